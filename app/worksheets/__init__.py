"""RULA and REBA worksheets filled in by people."""
