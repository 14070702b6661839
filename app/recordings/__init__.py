"""Uploaded recordings, kept by content."""
