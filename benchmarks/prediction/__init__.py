"""Benchmarks of posture prediction; run on purpose, never in the test run."""
