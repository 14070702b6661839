"""Benchmarks of the estimator; run on purpose, never in the test run."""
