"""Plates given to feet, and their clock found, on simulated walks; part of ``inputs``."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure
from estimation import FootForces, FootState, align, feet_from_plates
from human import HumanModel, Motion, motion_from_configurations
from human.marker_recording import PlateForces
from human.simulate import (
    Plate,
    SensorNoise,
    Stance,
    operator,
    simulate_plates,
    simulate_walking,
)

Array = NDArray[np.float64]

#: Plates are sampled so often, Hz; every so many samples is a frame of the motion.
RATE_HZ, EVERY = 1000.0, 10
#: White noise and zero of each channel, N and N m; sd of joint angles, rad.
NOISE = SensorNoise(sd=(1.0, 1.0, 2.0, 0.3, 0.3, 0.2), offset_sd=(3.0, 3.0, 6.0, 1.5, 1.5, 1.0))
ANGLE_SD = 5e-4
#: The plates' clock against the motion's, s.
OFFSETS_S = (-0.2, -0.037, 0.011, 0.2)


@dataclass(frozen=True, slots=True)
class Walk:
    """A walk over some plates: what is measured, and the truth at the motion's frames."""

    model: HumanModel
    exact: Motion
    derived: Motion
    plates: PlateForces
    truth: Array


def floor(name: str, x: float, y: float, size: tuple[float, float]) -> Plate:
    """A plate level with the floor, z up."""
    return Plate(name, np.array([x, y, 0.0]), np.eye(3), size, np.array([0.0, 0.0, -0.04]))


#: What is under the walk.
LAYOUTS = {
    "one belt a foot": (floor("1", 1.0, -0.35, (3.2, 0.69)), floor("2", 1.0, 0.35, (3.2, 0.69))),
    "two plates on the way": (floor("1", 0.55, 0.0, (0.6, 0.6)), floor("2", 1.15, 0.0, (0.6, 0.6))),
    "one plate under all": (floor("1", 1.0, 0.0, (3.2, 1.3)),),
}


def plate_figures(model: HumanModel) -> Iterator[Figure]:
    """Measures every layout on three people's walks."""
    for layout, plates in LAYOUTS.items():
        walks = [walk_over(model, plates, seed) for seed in range(3)]
        feet = [feet_from_plates(walk.model, walk.exact, walk.plates) for walk in walks]
        both = list(zip(walks, feet, strict=True))
        if layout != "one plate under all":
            given = np.mean([states_right(walk, foot) for walk, foot in both])
            yield Figure(
                f"loaded feet given their plate ({layout})", float(given), "share", least=0.98
            )
            error = np.sqrt(np.mean([squared_error(walk, foot) for walk, foot in both]))
            name = f"rms error of a foot's own force where known ({layout})"
            yield Figure(name, float(error), "N", most=5.0)
        known = np.mean([foot.known.mean() for foot in feet])
        yield Figure(f"frames with all ground forces known ({layout})", float(known), "share")
        yield from clock_figures(walks, layout)


def clock_figures(walks: list[Walk], layout: str) -> Iterator[Figure]:
    """Offsets found with differentiated, noisy joint angles."""
    errors, deviations, told = [], [], []
    for walk in walks:
        for offset in OFFSETS_S:
            late = replace(walk.plates, time_s=walk.plates.time_s - offset)
            clock = align(walk.model, walk.derived, late)
            told.append(clock.estimated_s is not None)
            if clock.estimated_s is not None and clock.sd_s is not None:
                errors.append(abs(clock.estimated_s - offset))
                deviations.append(abs(clock.estimated_s - offset) / clock.sd_s)
    yield Figure(f"clocks told ({layout})", float(np.mean(told)), "share", least=0.99)
    yield Figure(f"largest error of the clock ({layout})", 1e3 * max(errors), "ms", most=5.0)
    yield Figure(f"the same in standard deviations ({layout})", max(deviations), "sd", most=3.0)


def walk_over(model: HumanModel, plates: tuple[Plate, ...], seed: int) -> Walk:
    """Simulates a walk and what plates and a suit read of it."""
    rng = np.random.default_rng(seed)
    fast = simulate_walking(
        model,
        operator(("average", "stooper", "twister")[seed], rng, model),
        rng,
        route=(Stance(), Stance(x=2.0)),
        rate_hz=RATE_HZ,
    )
    exact = fast.motion.select(slice(None, None, EVERY))
    q = exact.q.copy()
    q[:, 7:] += rng.normal(scale=ANGLE_SD, size=q[:, 7:].shape)
    derived = motion_from_configurations(model.dof_names, exact.time_s, q)
    recorded = simulate_plates(fast, plates, rng, noise=NOISE)
    feet = fast.truth.dynamics.feet
    assert feet is not None
    return Walk(model, exact, derived, recorded.as_read(fast.motion.time_s), feet[:, ::EVERY])


def states_right(walk: Walk, feet: FootForces) -> float:
    """Share of frames at which a foot that bears 50 N or more has its force or is said to lack it.

    A foot's force is there where it is within a tenth of the weight of the truth.
    """
    right = []
    for foot, truth in zip((feet.right, feet.left), walk.truth, strict=True):
        loaded = truth[:, 2] > 50.0
        close = np.abs(foot.wrench - truth)[:, 2] < 0.1 * 9.81 * walk.model.total_mass_kg
        right.append(np.mean((close | (foot.state == FootState.UNMEASURED))[loaded]))
    return float(np.mean(right))


def squared_error(walk: Walk, feet: FootForces) -> float:
    """Mean square of the forces' errors where each foot's own is known."""
    errors = [
        (foot.wrench - truth)[foot.usable & (foot.state != FootState.SHARED), :3] ** 2
        for foot, truth in zip((feet.right, feet.left), walk.truth, strict=True)
    ]
    return float(np.mean(np.concatenate(errors)))
