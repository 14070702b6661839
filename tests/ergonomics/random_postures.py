"""Random inputs for both scorers, with many angles exactly on an edge."""

import numpy as np
from numpy.typing import NDArray

from ergonomics import RebaInputs, RulaInputs

_EDGES = np.array([-20, -15, -10, -5, 0, 5, 10, 15, 20, 30, 45, 60, 90, 100], dtype=float)


def angles(rng: np.random.Generator, n: int, low: float, high: float) -> NDArray[np.float64]:
    """Returns ``(n,)`` angles, two in five of them on an edge that some scale uses."""
    free = rng.uniform(low, high, n)
    return np.where(rng.random(n) < 0.4, rng.choice(_EDGES, n), free)


def _flags(rng: np.random.Generator, n: int, names: str) -> dict[str, NDArray[np.bool_]]:
    return {name: rng.random(n) < 0.2 for name in names.split()}


def _points(rng: np.random.Generator, n: int, high: int) -> NDArray[np.int64]:
    return np.where(rng.random(n) < 0.6, 0, rng.integers(0, high + 1, n))


def random_rula(rng: np.random.Generator, n: int) -> RulaInputs:
    return RulaInputs(
        upper_arm_deg=angles(rng, n, -60, 170),
        lower_arm_deg=angles(rng, n, 0, 145),
        wrist_deg=angles(rng, n, -70, 70),
        neck_deg=angles(rng, n, -40, 50),
        trunk_deg=angles(rng, n, -30, 90),
        muscle_a=_points(rng, n, 1),
        muscle_b=_points(rng, n, 1),
        force_a=_points(rng, n, 3),
        force_b=_points(rng, n, 3),
        **_flags(
            rng,
            n,
            "shoulder_raised abducted supported across_midline_or_out_to_side wrist_deviated "
            "wrist_twist_end neck_twisted neck_side_bent trunk_twisted trunk_side_bent "
            "seated_supported",
        ),
        legs_supported=rng.random(n) < 0.7,
    )


def random_reba(rng: np.random.Generator, n: int) -> RebaInputs:
    return RebaInputs(
        neck_deg=angles(rng, n, -40, 50),
        trunk_deg=angles(rng, n, -30, 90),
        knee_deg=angles(rng, n, -5, 130),
        upper_arm_deg=angles(rng, n, -60, 170),
        lower_arm_deg=angles(rng, n, 0, 145),
        wrist_deg=angles(rng, n, -70, 70),
        load=_points(rng, n, 3),
        coupling=_points(rng, n, 3),
        **_flags(
            rng,
            n,
            "neck_twisted neck_side_bent trunk_twisted trunk_side_bent sitting "
            "shoulder_raised abducted_or_rotated supported_or_gravity_assisted "
            "wrist_deviated_or_twisted static_over_1min repeated_over_4_per_min "
            "rapid_large_change_or_unstable",
        ),
        bilateral=rng.random(n) < 0.7,
    )
