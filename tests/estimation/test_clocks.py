from dataclasses import replace

import numpy as np
import pytest

from estimation import ClockOffset, MeasurementError, align
from human import HumanModel, Motion, generate_model, motion_from_configurations
from human.model import Subject
from human.simulate import SensorNoise, solve_dynamics

from .plate_scene import floor_plate, plate_forces, walking_scene

RAILS = (floor_plate("1", 1.0, -0.35, (3.0, 0.69)), floor_plate("2", 1.0, 0.35, (3.0, 0.69)))
TILES = (floor_plate("a", 0.55, 0.0, (0.6, 0.6)), floor_plate("b", 1.16, 0.0, (0.6, 0.6)))
NOISE = SensorNoise(sd=[1.0, 1.0, 2.0, 0.3, 0.3, 0.2], offset_sd=[3.0, 3.0, 5.0, 1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def walk_and_plates(person):
    """Joint angles with noise, differentiated, and noisy plates."""
    scene = walking_scene(person, seed=1)
    rng = np.random.default_rng(2)
    q = scene.motion.q.copy()
    q[:, 7:] += rng.normal(scale=5e-4, size=q[:, 7:].shape)
    motion = motion_from_configurations(person.dof_names, scene.motion.time_s, q)
    return motion, {"rails": scene.plates(RAILS, rng, NOISE), "tiles": scene.plates(TILES, rng)}


def bobbing(model: HumanModel, height_m, rate_hz: float = 200.0):
    """A person whose pelvis moves up and down, and one plate under it all; ``height_m(t)``."""
    time = np.arange(0.0, 5.0, 1.0 / rate_hz)
    q = np.tile(model.neutral(), (len(time), 1))
    q[:, 2] += height_m(time)
    fast = motion_from_configurations(model.dof_names, time, q, window_s=0.04)
    ground = solve_dynamics(model, fast, {}).ground
    noise = np.random.default_rng(5).normal(scale=[1, 1, 2, 0.3, 0.3, 0.2], size=ground.shape)
    plates = plate_forces(time, RAILS[:1], (ground + noise)[:, None])
    slow = motion_from_configurations(model.dof_names, time[::2], q[::2])
    return slow, plates


def found(model, motion: Motion, plates, **options) -> ClockOffset:
    return align(model, motion, plates, **options)


@pytest.mark.parametrize("offset_s", [0.2, -0.2, 0.031])
@pytest.mark.parametrize("which", ["rails", "tiles"])
def test_a_known_offset_is_found_in_a_walk(person, walk_and_plates, which, offset_s):
    """On the tiles only two steps are measured: the rest is left out by itself."""
    motion, plates = walk_and_plates
    late = replace(plates[which], time_s=plates[which].time_s - offset_s)
    clock = found(person, motion, late)
    assert clock.offset_s == pytest.approx(offset_s, abs=0.004)
    assert abs(clock.offset_s - offset_s) < 2.0 * clock.sd_s < 0.02
    assert "added to the plates' times" in clock.words


def test_zero_is_left_at_zero(person, walk_and_plates):
    motion, plates = walk_and_plates
    clock = found(person, motion, plates["rails"])
    assert clock.offset_s == 0.0
    assert clock.estimated_s is not None
    assert "too near zero" in clock.words


def test_a_squat_tells_with_a_load_and_a_wrong_body_mass(person):
    motion, plates = bobbing(person, lambda t: -0.15 * np.exp(-(((t - 2.5) / 0.6) ** 2)))
    late = replace(plates, time_s=plates.time_s - 0.12)
    assert found(person, motion, late).offset_s == pytest.approx(0.12, abs=0.005)
    lighter = generate_model(Subject(1.75, 65.0, "male"))
    assert found(lighter, motion, late).offset_s == pytest.approx(0.12, abs=0.005)


def test_quiet_standing_cannot_tell(person):
    motion, plates = bobbing(person, lambda t: 1e-4 * np.sin(t))
    clock = found(person, motion, replace(plates, time_s=plates.time_s + 0.2))
    assert (clock.offset_s, clock.estimated_s, clock.sd_s) == (0.0, None, None)
    assert "cannot be told" in clock.words


def test_a_rhythm_faster_than_the_search_is_ambiguous(person):
    motion, plates = bobbing(person, lambda t: 0.01 * np.sin(2.0 * np.pi * t / 0.4))
    clock = found(person, motion, plates)
    assert clock.estimated_s is None
    assert "fit almost alike" in clock.words
    assert found(person, motion, plates, most_s=0.15).estimated_s == pytest.approx(0.0, abs=0.004)


def test_an_offset_beyond_the_search_is_not_made_up(person, walk_and_plates):
    motion, plates = walk_and_plates
    clock = found(person, motion, replace(plates["rails"], time_s=plates["rails"].time_s + 0.4),
                  most_s=0.1)  # fmt: skip
    assert clock.offset_s == 0.0
    assert clock.estimated_s is None


def test_what_cannot_be_searched_is_refused(person, walk_and_plates):
    motion, plates = walk_and_plates
    with pytest.raises(MeasurementError, match="positive most_s"):
        found(person, motion, plates["rails"], most_s=0.0)
