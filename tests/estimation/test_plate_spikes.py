from dataclasses import replace

import numpy as np
import pytest

from estimation.feet.foot_forces import feet_from_plates
from human import HumanModel
from human.simulate import SensorNoise

from .plate_scene import PlateScene, floor_plate, walking_scene

#: One plate for each foot, all along the way: what a split-belt treadmill has.
RAILS = (floor_plate("1", 1.0, -0.35, (3.0, 0.69)), floor_plate("2", 1.0, 0.35, (3.0, 0.69)))
NOISE = SensorNoise(sd=[1.0, 1.0, 2.0, 0.3, 0.3, 0.2])


@pytest.fixture(scope="module")
def scene(person: HumanModel) -> PlateScene:
    return walking_scene(person)


@pytest.fixture
def rails(scene):
    return scene.plates(RAILS, np.random.default_rng(3), NOISE)


def feet_of(scene, plates):
    return feet_from_plates(scene.model, scene.motion, plates, window_s=0.0)


def error_n(scene, feet):
    """Largest error of the forces where they are said to be known, and how often they are."""
    both = [
        (np.abs(foot.wrench - truth)[foot.usable, :3].max(), foot.usable.mean())
        for foot, truth in zip((feet.right, feet.left), scene.truth, strict=True)
    ]
    return max(error for error, _ in both), min(share for _, share in both)


def test_what_people_do_is_no_spike(scene, rails):
    assert not feet_of(scene, rails).findings


@pytest.mark.parametrize(("size_n", "channel"), [(2e3, "force"), (1e8, "force"), (3e3, "moment")])
def test_a_glitch_of_one_sample_is_left_out_and_said(scene, rails, size_n, channel):
    spoilt = {channel: getattr(rails, channel).copy()}
    stance = feet_of(scene, rails).stances[2]
    k = int(np.searchsorted(rails.time_s, 0.5 * (stance.start_s + stance.end_s)))
    spoilt[channel][k, int(stance.plate) - 1, 1] += size_n
    feet = feet_of(scene, replace(rails, **spoilt))
    worst, known = error_n(scene, feet)
    assert worst < 12.0
    assert known == 1.0
    assert any(f"plate {stance.plate}" in text and "no person" in text for text in feet.findings)


def test_what_no_person_causes_for_long_is_not_known(scene, rails):
    force = rails.force.copy()
    part = (rails.time_s > 2.0) & (rails.time_s < 2.1)
    force[part, 0, 2] = 1e5
    feet = feet_of(scene, replace(rails, force=force))
    assert error_n(scene, feet)[0] < 12.0
    now = (scene.motion.time_s > 2.0) & (scene.motion.time_s < 2.1)
    assert not np.any(feet.known[now])
