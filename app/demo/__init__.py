"""A demonstration made by our own simulator: one person, their model, what a robot might do."""

from app.demo.files import write_demo
from app.demo.load import load_demo

__all__ = ["load_demo", "write_demo"]
