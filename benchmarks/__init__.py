"""Speed and accuracy against named peers; run on purpose, never by the tests."""
