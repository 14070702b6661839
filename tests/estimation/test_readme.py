"""The package's README works as pasted, and says what comes out."""

import re
from pathlib import Path

import numpy as np
import pytest

from human.simulate import operator, simulate_still

from .run_scene import feet_of

README = Path(__file__).parents[2] / "estimation" / "README.md"


def test_the_examples_find_the_box_and_weigh_the_person():
    code, live, recording = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    names: dict = {}
    exec(code, names)
    assert names["held"].mass_kg[0] == pytest.approx(5.0, abs=0.02)
    assert names["held"].sd_kg[0] < 0.8
    assert names["stress"].quantiles_nm.shape == (100, 22, 3)
    assert names["found"].assumed == (
        "joint accelerations: derived from the motion, sd 0.5 rad/s^2",
    )
    exec(live, names)
    # Without an accelerometer the pelvis is known less well, but the motion is the same.
    assert names["now"].torque[0] == pytest.approx(names["found"].torque[0], abs=0.2)
    assert set(names["live"].measurements) == {"plate"}
    person = operator("average", np.random.default_rng(0), names["model"])
    still = simulate_still(names["model"], person, duration_s=2.5, rate_hz=20.0)
    names["stretches"] = [(still.motion, feet_of(still))]
    exec(recording, names)
    assert names["summary"].body_mass_kg == pytest.approx(74.3, abs=0.01)
    assert names["summary"].holds[0].mass().mass_kg == pytest.approx(0.0, abs=0.01)
    assert names["summary"].bands == "noise_and_model"


def test_every_module_is_in_the_table():
    named = set(re.findall(r"`(\w+)`", README.read_text()))
    modules = {path.stem for path in README.parent.glob("*.py")} - {"__init__"}
    assert modules - named <= {"errors", "spatial"}
