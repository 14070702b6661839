"""A recording's skeleton and segment orientations filled up to the 23 segments of the model."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from human.generate import generate_model
from human.model import HumanModel, Subject
from human.names import JOINT_OF_SEGMENT, PARENT_SEGMENT, SEGMENTS
from human.recording import Recording
from human.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)

Array = NDArray[np.float64]

#: A joint closer than this to its parent's is not one of its own: some skeletons put dummies there.
_LEAST_OFFSET_M = 5e-3
#: Of a missing segment between two of these, the bend is shared; elsewhere it moves with its
#: parent.
_SHARING = frozenset({"L5", "L3", "T12", "T8", "Neck", "Head"})


def joint_offsets(recording: Recording, subject: Subject) -> dict[str, Array]:
    """Returns the offset of every joint of the model, m, from the recording's skeleton.

    Where the recording lacks a segment, the distance between its neighbours is shared out in the
    proportion of the generated model.
    """
    default = dict(_offsets_by_segment(generate_model(subject)))
    known = {
        name: offset
        for name, offset in recording.joint_offset.items()
        if float(np.linalg.norm(offset)) >= _LEAST_OFFSET_M
    }
    # A dummy's zero offset is left out; what hangs on it is measured from the next joint above it.
    reach = dict(default)
    for child in SEGMENTS[1:]:
        if child not in known:
            continue
        chain = [child]
        total = known[child].copy()
        while (parent := PARENT_SEGMENT[chain[-1]]) != "Pelvis" and parent not in known:
            chain.append(parent)
        if child in _SHARING:
            shares = np.array([np.linalg.norm(default[name]) for name in chain])
            shares /= shares.sum()
            reach.update({name: total * share for name, share in zip(chain, shares, strict=True)})
        else:
            above = sum((default[name] for name in chain[1:]), start=np.zeros(3))
            reach[child] = total - above
    return {JOINT_OF_SEGMENT[name]: offset for name, offset in reach.items()}


def _offsets_by_segment(model: HumanModel) -> Mapping[str, Array]:
    return {name: model.offsets[k] for k, name in enumerate(model.segment_names[1:])}


def all_orientations(recording: Recording) -> tuple[Array, tuple[str, ...]]:
    """Returns ``(frames, 23, 4)`` orientations and the names of the segments that were filled in.

    A missing spine or neck segment takes its share of the turn between its neighbours; any other
    moves with its parent.
    """
    have = {
        name: recording.orientation_xyzw[:, k] for k, name in enumerate(recording.segment_names)
    }
    out = dict(have)
    for name in SEGMENTS[1:]:
        if name in out:
            continue
        parent = PARENT_SEGMENT[name]
        below = _next_present(name, have)
        if name in _SHARING and below is not None:
            steps = _steps_between(name, below)
            turn = quaternion_to_rotation_vector(
                quaternion_multiply(quaternion_conjugate(out[parent]), have[below])
            )
            out[name] = quaternion_multiply(
                out[parent], rotation_vector_to_quaternion(turn / (steps + 1))
            )
        else:
            out[name] = out[parent]
    filled = tuple(name for name in SEGMENTS if name not in have)
    return np.stack([out[name] for name in SEGMENTS], axis=1), filled


def _next_present(name: str, have: Mapping[str, Array]) -> str | None:
    """The nearest present segment further along the spine."""
    spine = ("L5", "L3", "T12", "T8", "Neck", "Head")
    if name not in spine:
        return None
    return next((s for s in spine[spine.index(name) + 1 :] if s in have), None)


def _steps_between(name: str, below: str) -> int:
    """Number of joints from a segment down to one further along the spine."""
    steps = 0
    while below != name:
        below = PARENT_SEGMENT[below]
        steps += 1
    return steps
