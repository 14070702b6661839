"""Operator models: files made by `ergocast train`, kept by content."""
