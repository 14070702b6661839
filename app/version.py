"""The version of Ergocast, as its answers and files name it."""

from importlib.metadata import PackageNotFoundError, version

try:
    VERSION = version("ergocast")
except PackageNotFoundError:  # run from a tree that was never installed
    VERSION = "0.0.0"
