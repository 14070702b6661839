"""Where the real recordings are; this ring is collected only when that is known."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings_dir() -> Path:
    """The folder that ``ERGOCAST_RECORDINGS`` names."""
    folder = os.environ.get("ERGOCAST_RECORDINGS")
    if not folder:
        pytest.fail("set ERGOCAST_RECORDINGS to the folder of recordings to run this test")
    return Path(folder)
