"""Joint moments of real people against other programs; run on purpose, never in the test run."""
