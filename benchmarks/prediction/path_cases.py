"""Hand paths and starts that are not what they seem, and what must become of each."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.prediction.input_world import Case, World, led, same
from human import Chain, Subject, generate_model
from human.rotations import rotation_vector_to_matrix
from prediction import HandNoise, OperatorModel, generic_operator

Array = NDArray[np.float64]


def _poses(world: World, q: Array) -> dict[str, Any]:
    position, rotation = world.hand(q)
    return {"target_position": position, "target_rotation": rotation}


def _overhead(world: World) -> str:
    """A way that this person can go and never went."""
    end = world.start.copy()
    names = list(world.chain.dof_names)
    for name, angle in (("jRightShoulder_rotx", -60.0), ("jRightElbow_rotz", 10.0)):
        end[names.index(name)] = np.radians(angle)
    q = world.start + np.linspace(0.0, 1.0, 61)[:, None] * (end - world.start)
    return led((0, 0, 0), count=61, duration_s=2.0, **_poses(world, q))(world)


def _coarse(world: World) -> str:
    """Five points a second, a decimetre apart: cut into steps that can be integrated."""
    step = np.array([0.05, 0.2, 0.15])
    fine = world.lead(step, count=51, duration_s=1.0)
    coarse = world.lead(step, count=6, duration_s=1.0)
    return same(fine.central[::10], coarse.central)


def _resting(world: World) -> str:
    return same(world.lead(np.zeros(3)).central, world.start)


def _outstretched(world: World) -> str:
    """Led towards the shoulder from an arm held straight out."""
    q0 = np.zeros(24)
    run = world.lead(np.array([0.0, 0.15, 0.0]), q0=q0)
    worst = 1e3 * float(run.hand_error_m.max())
    if not (np.isfinite(run.q).all() and worst < 1.0):
        raise AssertionError(f"the hand is {worst:.2f} mm off")
    return f"familiarity {run.familiarity.min():.2f}; hand within {worst:.2f} mm"


def _child(world: World) -> str:
    """The start of a smaller body, led where this one's hand was."""
    small = Chain(generate_model(Subject(1.45, 45.0)))
    place = small.forward(world.start)[0] - world.hand(world.start)[0]
    return led((0, 0.1, 0), target_position=lambda p: p + place)(world)


def _of_poses(model: OperatorModel) -> OperatorModel:
    """The same model as if nothing else had been trained."""
    poses = {(name, task): one for (name, task), one in model.methods.items() if task == "pose"}
    return replace(model, methods=poses)


def _generic(world: World) -> str:
    return led((0, 0.1, 0.1), model=generic_operator(world.chain))(world)


def _nan_at(row: int, value: float) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values = values.copy()
        values[row] = value
        return values

    return change


PATHS: Mapping[str, Case] = MappingProxyType(
    {
        "out of reach": Case("refused", "out of reach", led((1.5, 0, 0), duration_s=4.0)),
        "far from the demonstrations": Case("flagged", "familiarity 0.[012]", _overhead),
        "no demonstrations at all": Case("flagged", "familiarity 0.00", _generic),
        "five points a second": Case("right", "within", _coarse),
        "steps of a nanosecond": Case("refused", "jumps", led((0, 0.1, 0), duration_s=3e-8)),
        "a million seconds between points": Case(
            "refused", "lasts 1e\\+06 s", led((0, 0.1, 0), time_s=lambda t: t + 1e6 * (t > 0.5))
        ),
        "times that run back": Case(
            "refused", "does not increase at point 7", led((0, 0.1, 0), time_s=_nan_at(7, 0.0))
        ),
        "NaN": Case(
            "refused", "not finite at point 7", led((0, 0, 0), target_position=_nan_at(7, np.nan))
        ),
        "infinity": Case(
            "refused", "not finite at point 7", led((0, 0, 0), time_s=_nan_at(7, np.inf))
        ),
        "millimetres": Case(
            "refused",
            "jumps|start posture holds",
            led((0, 0.1, 0), target_position=lambda p: 1e3 * p),
        ),
        "a point far off": Case(
            "refused", "jumps by", led((0, 0, 0), target_position=_nan_at(15, 3.0))
        ),
        "one point": Case("refused", "at least two points", led((0, 0, 0), count=1)),
        "no points": Case("refused", "at least two points", led((0, 0, 0), count=0)),
        "two coordinates": Case(
            "refused", "shape", led((0, 0, 0), target_position=lambda p: p[:, :2])
        ),
        "a mirrored rotation": Case(
            "refused", "not a rotation", led((0, 0, 0), target_rotation=lambda r: -r)
        ),
        "an orientation in degrees": Case(
            "refused",
            "jumps|start posture",
            led((0, 0, 0), target_rotation=lambda r: r @ rotation_vector_to_matrix([0, 0, 90.0])),
        ),
        "a hand that stays": Case("right", "within", _resting),
        "an arm held straight out": Case("flagged", "familiarity 0.0.*hand within", _outstretched),
        "a start of another body": Case("refused", "start posture holds the hand", _child),
        "a start of the other hand": Case(
            "refused",
            "start posture holds the hand",
            led((0, 0, 0), target_position=lambda p: p * [1.0, -1.0, 1.0]),
        ),
        "a start in degrees": Case(
            "refused", "in rad", lambda w: led((0, 0.05, 0), q0=np.degrees(w.start))(w)
        ),
        "a start with NaN": Case(
            "refused", "finite", lambda w: led((0, 0.05, 0), q0=_nan_at(3, np.nan)(w.start))(w)
        ),
        "a start of too few joints": Case("refused", r"expected \(24,\)", lambda w: _few(w)),
        "fewer samples than none": Case("refused", "samples", led((0, 0.05, 0), samples=-1)),
        "a robot of negative repeatability": Case(
            "refused", "", lambda w: led((0, 0.05, 0), sigma_x=HandNoise(-0.001))(w)
        ),
        "a robot of unknown repeatability": Case(
            "refused", "", lambda w: led((0, 0.05, 0), sigma_x=float("nan"))(w)
        ),
        "a task that was not trained": Case(
            "refused",
            "position",
            lambda w: led((0, 0.05, 0), target_rotation=None, model=_of_poses(w.model))(w),
        ),
    }
)


def _few(world: World) -> str:
    position, rotation = world.hand(world.start)
    world.model.rollout(
        np.repeat(position[None], 5, axis=0),
        np.repeat(rotation[None], 5, axis=0),
        np.arange(5) / 10.0,
        world.start[:20],
        4,
        np.random.default_rng(0),
    )
    return ""
