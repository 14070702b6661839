"""The package's README works as pasted, and says what comes out."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "estimation" / "README.md"


def test_the_example_finds_the_box():
    (code,) = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    names: dict = {}
    exec(code, names)
    assert names["held"].mass_kg[0] == pytest.approx(5.0, abs=0.02)
    assert names["held"].sd_kg[0] < 0.8
    assert names["stress"].quantiles_nm.shape == (100, 22, 3)
    assert names["found"].assumed == (
        "joint accelerations: derived from the motion, sd 0.5 rad/s^2",
    )


def test_every_module_is_in_the_table():
    named = set(re.findall(r"`(\w+)`", README.read_text()))
    modules = {path.stem for path in README.parent.glob("*.py")} - {"__init__"}
    assert modules - named <= {"errors", "spatial"}
