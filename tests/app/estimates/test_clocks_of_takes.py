"""The clocks of plates and motion over a recording that is worked on in windows."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.estimates.feet import FeetOfTake
from app.estimates.schemas import EstimateOptions
from human import generate_model, motion_from_configurations
from human.marker_recording import ForcePlate, PlateForces
from human.recording import ReadingReport
from human.simulate import solve_dynamics
from tests.app.estimates.lifting import PERSON

#: A window each.
SECONDS = 5.0


@pytest.fixture(scope="module")
def squats() -> Any:
    """Two squats, one in each of two windows, over one plate."""
    model = generate_model(PERSON)
    time = np.arange(0.0, 2.0 * SECONDS, 0.01)
    q = np.tile(model.neutral(), (len(time), 1))
    q[:, 2] -= sum(0.15 * np.exp(-(((time - t) / 0.6) ** 2)) for t in (2.5, 7.5))
    motion = motion_from_configurations(model.dof_names, time, q)
    ground = solve_dynamics(model, motion, {}).ground
    ground += np.random.default_rng(0).normal(scale=[1, 1, 2, 0.3, 0.3, 0.2], size=ground.shape)
    plates = PlateForces(
        time,
        (ForcePlate("1", np.zeros(3), 0.0),),
        ground[:, None, :3],
        ground[:, None, 3:],
        ReadingReport(),
    )
    return model, motion, plates


def said_of(squats: Any, warp: Any, **options: Any) -> list[str]:
    model, motion, plates = squats
    halves = [motion.slice(0.0, SECONDS), motion.slice(SECONDS)]
    take = SimpleNamespace(
        model=model,
        plates=replace(plates, time_s=warp(plates.time_s)),
        plates_from="forces.mot",
        source="motion.trc",
        windows=lambda: iter(halves),
    )
    asked = EstimateOptions(height_m=1.75, mass_kg=72.0, **options)
    feet = FeetOfTake(take, asked)  # type: ignore[arg-type]
    assert len(list(feet.windows())) == 2
    return [text for text in feet.findings if "clock" in text]


def test_clocks_that_drift_apart_are_named(squats: Any) -> None:
    (said,) = said_of(squats, lambda time_s: 1.02 * time_s)
    assert "plates' clock from 5.0 to 10.0 s: -0.1" in said


@pytest.mark.parametrize("offset_s", [0.0, 0.2])
def test_clocks_that_keep_their_distance_are_not(squats: Any, offset_s: float) -> None:
    assert not said_of(squats, lambda time_s: time_s - offset_s)


def test_an_offset_that_was_given_is_not_doubted(squats: Any) -> None:
    assert not said_of(squats, lambda time_s: 1.02 * time_s, clock_offset_s=0.0)
