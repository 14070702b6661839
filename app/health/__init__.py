"""Whether the service runs and can work."""
