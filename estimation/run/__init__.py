"""A whole recording, stretch by stretch."""
