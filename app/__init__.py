"""The service: REST API, command line, storage and the built dashboard."""
