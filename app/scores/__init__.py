"""RULA and REBA of a recording over time."""
