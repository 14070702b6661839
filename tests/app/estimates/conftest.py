"""What the command line makes of the simulated lift; once a session."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.app.cli.running import run
from tests.app.estimates.lifting import Lifting

PERSON = ["--height", 1.75, "--mass", 72, "--sex", "male"]


@pytest.fixture(scope="session")
def estimated(
    lifting: Lifting, tmp_path_factory: pytest.TempPathFactory
) -> tuple[dict[str, Any], Path]:
    """The summary that the command line writes, and the folder of the motion's results."""
    out = tmp_path_factory.mktemp("results")
    files = [f"static:{lifting.static}", lifting.motion, f"grf:{lifting.grf}"]
    assert run("estimate", *files, *PERSON, "--out", out, "--json") == 0
    folder = out / f"{lifting.motion.name}.estimate"
    return json.loads((folder / "summary.json").read_text()), folder
