"""Whether a person whose feet stay where they are could stand as predicted."""

import numpy as np
from scipy.spatial import ConvexHull

from app.assessments.poses import Array
from app.assessments.schemas import Assumption
from human import HumanModel, forward_kinematics
from human.dynamics import GRAVITY
from human.shapes import Box

_SOLES = ("RightFoot", "RightToe", "LeftFoot", "LeftToe")
#: The centre of pressure may leave the soles by as much as bodies and models differ, m.
SLACK_M = 0.02


def overhang(
    model: HumanModel, q: Array, place: Array, mass_kg: float, force_n: Array
) -> Array | None:
    """Returns how far the centre of pressure is outside the soles, ``(T,)`` m, negative inside.

    At rest: what weight, load and hand force ask of the floor, without what acceleration adds.

    Args:
        model: The person.
        q: ``(T, nq)`` configurations; the feet are where they are in the first.
        place: Where load and force act, ``(T, 3)`` m, world.
        mass_kg: What the person bears.
        force_n: ``(3,)`` further force on the hands, N, world.

    Returns:
        None for a model whose feet have no shape.

    Derived here: the floor's force acts where it leaves no horizontal moment, so at
    ``x = (sum x_i f_zi - sum (z_i - z_0) f_xi) / sum f_zi`` over all other forces, y likewise.
    """
    poses = forward_kinematics(model, q)
    corners = _corners(model, poses.rotation[0], poses.position[0])
    if corners is None:
        return None
    weights = np.append(model.masses, mass_kg)[:, None] * np.asarray(GRAVITY)
    centres = poses.position + (poses.rotation @ model.centers_of_mass[:, :, None])[..., 0]
    points = np.concatenate([centres, place[:, None], place[:, None]], axis=1)
    forces = np.concatenate([weights, np.asarray(force_n)[None]])
    height = points[..., 2:] - corners[:, 2].min()
    moment = points[..., :2] * forces[:, 2:] - height * forces[:, :2]
    pressure = moment.sum(axis=1) / forces[:, 2].sum()
    sides = ConvexHull(corners[:, :2]).equations
    return np.asarray((pressure @ sides[:, :2].T + sides[:, 2]).max(axis=1))


def _corners(model: HumanModel, rotation: Array, position: Array) -> Array | None:
    """Returns the corners of the soles, ``(n, 3)`` m, world."""
    out = []
    for name in _SOLES:
        shape = model.shapes.get(name)
        if not isinstance(shape, Box):
            return None
        index = model.segment_index(name)
        ends = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
        local = np.array(shape.center) + ends * np.array(shape.size)
        out.append(position[index] + local @ rotation[index].T)
    return np.concatenate(out)


def balance_assumed(outside: Array, time_s: Array) -> Assumption:
    """Says whether standing feet can hold the person."""
    worst = int(np.argmax(outside))
    if outside[worst] <= SLACK_M:
        value = "kept: the centre of pressure stays over the soles"
        return Assumption(
            what="balance", value=value, range="at rest, without inertia", effect="none"
        )
    first = int(np.argmax(outside > SLACK_M))
    return Assumption(
        what="balance",
        value=f"lost from {time_s[first]:.2f} s on: the centre of pressure would be up to "
        f"{outside[worst]:.2f} m outside the soles ({time_s[worst]:.2f} s)",
        range="a person would step, lean otherwise or hold on to the robot",
        effect="the predicted postures are not ones that this person could stand in",
    )
