"""A first posture from markers, segment by segment from the pelvis outwards."""

import numpy as np
from numpy.typing import NDArray

from human.kinematics import forward_kinematics
from human.markers.ik_priors import reference_angles
from human.model import BASE_NQ, Array, HumanModel, IntArray
from human.rotations import (
    matrix_to_quaternion,
    matrix_to_rotation_vector,
    matrix_to_xyz,
    rotation_vector_to_matrix,
    xyz_to_matrix,
)

Flags = NDArray[np.bool_]

#: Pull of a segment's turn to the reference posture, m^2: decides only what its markers leave open.
_LEANING = 1e-4
#: Root mean square width (m) of a segment's markers across their line, for them to turn it alone.
_LEAST_WIDTH_M = 0.01


def start_poses(
    model: HumanModel, segment: IntArray, offset: Array, marker: Array, seen: Array
) -> Array:
    """Returns configurations ``(B, nq)`` roughly at the markers, each frame for itself.

    A segment with three or more markers off one line is turned onto them; with fewer it is turned
    about its joint, leaning to the reference posture. Segments between, that carry none, share the
    turn that is left equally.

    Args:
        model: the person.
        segment: ``(markers,)`` index of each marker's segment.
        offset: ``(markers, 3)`` m, in segment axes.
        marker: ``(B, markers, 3)`` m, world.
        seen: ``(B, markers)`` 1 where it is seen, else 0.

    Source: Kabsch 1976 (the turn of one point set onto another); the rest derived here.
    """
    count = len(marker)
    q = np.tile(model.neutral(), (count, 1))
    q[:, BASE_NQ:] = reference_angles(model)
    rotation = np.empty((len(model.segment_names), count, 3, 3))
    origin = np.empty((len(model.segment_names), count, 3))
    mine = np.flatnonzero(segment == 0)
    rotation[0], open_base = _turn_onto(offset[mine], marker[:, mine], seen[:, mine])
    if np.any(open_base):
        everything = _reference_points(model, segment, offset)
        whole, _ = _turn_onto(everything, marker[open_base], seen[open_base])
        rotation[0, open_base] = whole
        at = marker[open_base] - (whole[:, None] @ everything[..., None])[..., 0]
        origin[0, open_base] = _mean(at, seen[open_base])
    placed = marker[:, mine] - (rotation[0][:, None] @ offset[mine][..., None])[..., 0]
    origin[0, ~open_base] = _mean(placed, seen[:, mine])[~open_base]
    q[:, :3], q[:, 3:7] = origin[0], matrix_to_quaternion(rotation[0])
    turned_already = {0, *segment.tolist()}
    for index in range(1, len(model.segment_names)):
        bare = _bare_above(model, index, turned_already) if index in segment else []
        turned_already.update(bare)
        chain = [*bare, index]
        mine = np.flatnonzero(segment == index)
        if bare:
            turned, unsure = _turn_onto(offset[mine], marker[:, mine], seen[:, mine])
            above = rotation[model.parents[chain[0]]]
            share = matrix_to_rotation_vector(above.swapaxes(1, 2) @ turned) / len(chain)
            share[unsure] = 0.0
            for link in chain:
                _set_joint(model, link, rotation_vector_to_matrix(share), q, rotation, origin)
            continue
        parent = model.parents[index]
        dofs = BASE_NQ + model.joint_dofs(index - 1)
        resting = np.zeros((count, 3))
        resting[:, model.dof_axes[dofs - BASE_NQ]] = q[:, dofs]
        relative = xyz_to_matrix(resting)
        if len(mine):
            leaning = rotation[parent] @ relative
            centre = origin[parent] + rotation[parent] @ model.offsets[index - 1]
            arm = (marker[:, mine] - centre[:, None]) * seen[:, mine, None]
            turned, unsure = _turn_onto(offset[mine], marker[:, mine], seen[:, mine])
            about = _nearest_rotation(
                np.einsum("bmi,mj->bij", arm, offset[mine]) + _LEANING * leaning
            )
            turned[unsure] = about[unsure]
            relative = rotation[parent].swapaxes(1, 2) @ turned
        _set_joint(model, index, relative, q, rotation, origin)
    return q


def _set_joint(
    model: HumanModel, index: int, relative: Array, q: Array, rotation: Array, origin: Array
) -> None:
    """Writes a joint's angles and the pose that follows to ``q``, ``rotation``, ``origin``."""
    parent, dofs = model.parents[index], model.joint_dofs(index - 1)
    origin[index] = origin[parent] + rotation[parent] @ model.offsets[index - 1]
    axes = model.dof_axes[dofs]
    if len(dofs) == 0:
        rotation[index] = rotation[parent]
        return
    lower, upper = np.full(3, -np.pi), np.full(3, np.pi)
    lower[axes], upper[axes] = model.lower[dofs], model.upper[dofs]
    angles = np.zeros((len(q), 3))
    angles[:, axes] = within_reach(matrix_to_xyz(relative), lower, upper)[:, axes]
    q[:, BASE_NQ + dofs] = angles[:, axes]
    rotation[index] = rotation[parent] @ xyz_to_matrix(angles)


def other_branch(angles: Array) -> Array:
    """Returns the second triple of x-y-z angles ``(..., 3)`` of the same rotation."""
    a, b, c = np.moveaxis(angles, -1, 0)
    return np.stack([a + np.pi, np.pi - b, c + np.pi], axis=-1)


def whole_turns_off(angles: Array, centre: Array) -> Array:
    """Returns angles within half a turn of a centre."""
    return np.asarray(angles - 2.0 * np.pi * np.round((angles - centre) / (2.0 * np.pi)))


def middle(lower: Array, upper: Array) -> Array:
    """Returns the middle of ranges (rad), zero of those without an end."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    return np.where(bounded, 0.5 * (np.where(bounded, lower, 0.0) + upper), 0.0)


def within_reach(angles: Array, lower: Array, upper: Array) -> Array:
    """Returns the triple ``(B, 3)`` of the two that lies least outside limits, then is smaller."""
    both = np.stack([angles, other_branch(angles)])
    both = whole_turns_off(both, middle(lower, upper))
    outside = np.sum(np.abs(both - np.clip(both, lower, upper)), axis=-1)
    size = outside + 1e-3 * np.sum(both**2, axis=-1)
    return np.asarray(np.where((size[0] <= size[1])[:, None], both[0], both[1]))


def inside(angles: Array, lower: Array, upper: Array, slack: float = 1e-3) -> Flags:
    """Returns which triples ``(..., 3)`` lie within limits, or this little outside (rad)."""
    return np.asarray(np.all((angles >= lower - slack) & (angles <= upper + slack), axis=-1))


def _bare_above(model: HumanModel, index: int, turned: set[int]) -> list[int]:
    """Segments without markers between this one and the nearest above that has been turned.

    Only along the trunk and neck: a clavicle stays where it is and leaves the turn to the arm.
    """
    out: list[int] = []
    above = model.parents[index]
    while above not in turned and not model.segment_names[above].endswith("Shoulder"):
        out.append(above)
        above = model.parents[above]
    return out[::-1]


def _turn_onto(offset: Array, marker: Array, seen: Array) -> tuple[Array, Flags]:
    """Rotation ``(B, 3, 3)`` of points onto markers, and where they do not determine one."""
    count = len(marker)
    total = np.maximum(seen.sum(axis=1), 1.0)
    if offset.shape[0] < 3:
        return np.tile(np.eye(3), (count, 1, 1)), np.ones(count, dtype=np.bool_)
    own = (offset[None] - (seen @ offset / total[:, None])[:, None]) * seen[..., None]
    there = (marker - _mean(marker, seen)[:, None]) * seen[..., None]
    # Width across the line through the points: the middle singular value of their scatter.
    width = np.sqrt(np.abs(np.linalg.eigvalsh(own.swapaxes(1, 2) @ own)[:, 1]) / total)
    unsure = (seen.sum(axis=1) < 3) | (width < _LEAST_WIDTH_M)
    return _nearest_rotation(there.swapaxes(1, 2) @ own), unsure


def _nearest_rotation(matrix: Array) -> Array:
    """Rotations ``(B, 3, 3)`` that maximise the trace of ``R^T M``."""
    u, _, vt = np.linalg.svd(matrix)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return np.asarray(u @ vt)


def _mean(points: Array, seen: Array) -> Array:
    total = np.maximum(seen.sum(axis=1), 1.0)
    return np.asarray((seen[:, None] @ points)[:, 0] / total[:, None])


def _reference_points(model: HumanModel, segment: IntArray, offset: Array) -> Array:
    """Markers ``(markers, 3)`` of the reference posture, in the pelvis's axes."""
    q = model.neutral()
    q[BASE_NQ:] = reference_angles(model)
    poses = forward_kinematics(model, q)
    return np.asarray(
        poses.position[segment] + (poses.rotation[segment] @ offset[..., None])[..., 0]
    )
