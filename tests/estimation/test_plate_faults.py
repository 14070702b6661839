"""What plates do wrong, told from their samples alone."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.feet.plate_faults import saturated
from human.simulate import operator, simulate_still

from .plate_scene import floor_plate, plate_forces

RAILS = (floor_plate("1", 1.0, -0.35, (3.0, 0.69)), floor_plate("2", 1.0, 0.35, (3.0, 0.69)))


@pytest.mark.parametrize("limit_n", [300.0, 340.0])
def test_who_stands_quietly_on_a_plate_at_its_limit_is_not_weighed(person, limit_n):
    rng = np.random.default_rng(0)
    still = simulate_still(
        person, operator("average", rng, person), duration_s=2.0, rate_hz=100.0
    ).truth.dynamics.feet
    steps_on = np.clip(np.arange(400) / 100.0, 0.0, 1.0)[:, None, None]
    feet = steps_on * np.moveaxis(still, 0, 1)[np.minimum(np.arange(400), 199)]
    noisy = feet + rng.normal(size=feet.shape) * [1.0, 1.0, 2.0, 0.3, 0.3, 0.2]
    plates = plate_forces(np.arange(400) / 100.0, RAILS, noisy)
    force = plates.force.copy()
    force[:, 0, 2] = np.minimum(force[:, 0, 2], limit_n)
    limited = saturated(replace(plates, force=force))
    over = plates.force[:, 0, 2] > limit_n
    assert np.mean(over) > 0.1
    assert np.all(limited[over, 0])
    assert not np.any(limited[:, 1]) and not np.any(limited[:60])
    assert not np.any(saturated(plates))
    # Without noise a quiet stance stands still in all its channels.
    standing = plate_forces(plates.time_s[200:], RAILS, feet[200:])
    assert not np.any(saturated(standing))
