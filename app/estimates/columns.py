"""What each column of an estimate's time series holds: names with SI units, values from a chunk."""

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from estimation import Balance, FootForces, FootState, HandState, RunChunk
from human import Motion

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Values of a column, and where they are known; None where they are everywhere.
Column = tuple[NDArray[np.generic], Mask | None]

AXES = "xyz"
SIDES = ("right", "left")
QUANTILES = ("p05", "p50", "p95")
#: Flags of a motion's frames that make what follows from them doubtful.
_DOUBTFUL = ("bridged", "unseen", "gap", "weak_derivative")
#: A foot's force that nothing measured is told where the balance leaves so little open, N.
_TOLD_N = 30.0

#: For the file's metadata: what a reader of the columns has to know.
CONVENTIONS = """SI units in the names: s, m, rad, N, N m (nm), kg; *_sd_* is a standard deviation.
An empty cell cannot be told from what was measured; it is not zero.
doubtful: the motion was carried over a gap there, or differentiated across one.
World axes: z up, x forward, y left. Wrenches act on the person, about the origin of the foot or
hand they are named after. *_torque_nm: generalized force of a degree of freedom.
*_effort_*: norm of a joint's moment, quantiles. l5s1_*: pelvis on trunk, axes of the segment above.
payload_*: what all free hands bear together. residual_*: what motion and measured wrenches leave
over, about the pelvis."""


def columns_of(
    chunk: RunChunk,
    motion: Motion,
    feet: FootForces | None,
    dof_names: Sequence[str],
    joint_names: Sequence[str],
) -> dict[str, Column]:
    """Returns the columns of a chunk by name, in the file's order.

    Args:
        chunk: Estimated frames.
        motion: Holds those frames among its own.
        feet: The wrenches under the feet at the motion's frames, or None.
        dof_names: Of the torques' columns.
        joint_names: Of the efforts' columns.
    """
    return dict(_columns(chunk, motion, feet, dof_names, joint_names))


def _columns(
    chunk: RunChunk,
    motion: Motion,
    feet: FootForces | None,
    dof_names: Sequence[str],
    joint_names: Sequence[str],
) -> Iterator[tuple[str, Column]]:
    at = np.searchsorted(motion.time_s, chunk.time_s)
    yield "time_s", (chunk.time_s, None)
    yield "doubtful", (_doubtful(motion)[at], None)
    yield "balance", (_names(chunk.balance, Balance), None)
    for k, side in enumerate(SIDES):
        yield f"{side}_hand_state", (_names(chunk.hand_state[:, k], HandState), None)
    yield "hands_state", (_names(chunk.hands_state, HandState), None)
    for k, quantile in enumerate(QUANTILES):
        yield f"payload_{quantile}_kg", (chunk.payload_kg[:, k], chunk.payload_known)
    yield "loaded_probability", (chunk.loaded_probability, chunk.payload_known)
    for k, side in enumerate(SIDES):
        known = chunk.hand_kg_known[:, k]
        yield f"{side}_hand_payload_kg", (chunk.hand_kg[:, k], known)
        if chunk.hand_kg_sd is not None:
            yield f"{side}_hand_payload_sd_kg", (chunk.hand_kg_sd[:, k], known)
    for k, joint in enumerate(joint_names):
        for j, quantile in enumerate(QUANTILES):
            name = f"{joint}_effort_{quantile}_nm"
            yield name, (chunk.effort_nm[:, k, j], chunk.effort_known[:, k])
    low_back = chunk.low_back_known
    yield from _vector("l5s1_force", "n", chunk.low_back_force_n, low_back)
    yield from _vector("l5s1_force_sd", "n", chunk.low_back_force_sd_n, low_back)
    yield from _vector("l5s1_moment", "nm", chunk.low_back_moment_nm, low_back)
    yield from _vector("l5s1_moment_sd", "nm", chunk.low_back_moment_sd_nm, low_back)
    for part, wrench, sd in (
        ("foot", chunk.foot_wrench, chunk.foot_wrench_sd),
        ("hand", chunk.hand_wrench, chunk.hand_wrench_sd),
    ):
        for k, side in enumerate(SIDES):
            told = chunk.hand_kg_known[:, k]
            if part == "foot":
                told = _foot_told(chunk, feet, k, at)
            yield from _vector(f"{side}_{part}_force", "n", wrench[:, k, :3], told)
            yield from _vector(f"{side}_{part}_moment", "nm", wrench[:, k, 3:], told)
            if sd is not None:
                yield from _vector(f"{side}_{part}_force_sd", "n", sd[:, k, :3], told)
                yield from _vector(f"{side}_{part}_moment_sd", "nm", sd[:, k, 3:], told)
    yield from _vector("residual_force", "n", chunk.residual_n, None)
    yield from _vector("residual_moment", "nm", chunk.residual_nm, None)
    for k, dof in enumerate(dof_names):
        yield f"{dof}_torque_nm", (chunk.torque_nm[:, k], chunk.torque_known[:, k])
        if chunk.torque_sd_nm is not None:
            yield f"{dof}_torque_sd_nm", (chunk.torque_sd_nm[:, k], chunk.torque_known[:, k])
    yield from _vector("pelvis_position", "m", motion.q[at, :3], None)
    for k, axis in enumerate("xyzw"):
        yield f"pelvis_orientation_{axis}", (motion.q[at, 3 + k], None)
    for k, dof in enumerate(motion.model_dof_names):
        yield f"{dof}_angle_rad", (motion.q[at, 7 + k], None)


def _doubtful(motion: Motion) -> Mask:
    """Returns the frames in which the motion was carried over a gap, or differentiated across."""
    out = np.zeros(len(motion), dtype=np.bool_)
    for name in _DOUBTFUL:
        out |= motion.flags.get(name, False)
    return out


def _foot_told(chunk: RunChunk, feet: FootForces | None, side: int, at: NDArray[np.intp]) -> Mask:
    """Returns where a foot's wrench was measured, or follows from the balance all the same."""
    if feet is None:
        return np.zeros(len(chunk), dtype=np.bool_)
    state = (feet.right, feet.left)[side].state[at]
    told = np.isin(state, (FootState.OFF_GROUND, FootState.MEASURED))
    if chunk.foot_wrench_sd is not None:
        close = np.linalg.norm(chunk.foot_wrench_sd[:, side, :3], axis=-1) <= _TOLD_N
        told |= close & np.isin(state, (FootState.UNMEASURED, FootState.SATURATED))
    return told


def _vector(
    name: str, unit: str, values: Array | None, known: Mask | None
) -> Iterator[tuple[str, Column]]:
    if values is not None:
        for k, axis in enumerate(AXES):
            yield f"{name}_{axis}_{unit}", (values[:, k], known)


def _names(codes: NDArray[np.intp], kind: type[IntEnum]) -> NDArray[np.str_]:
    words = np.array([kind(k).name.lower() for k in range(len(kind))])
    return np.asarray(words[codes], dtype=np.str_)


def units_of(names: Sequence[str]) -> Mapping[str, str]:
    """Returns the unit that each column's name states; empty where it has none."""
    known = {"nm": "N m", "n": "N", "kg": "kg", "s": "s", "m": "m", "rad": "rad"}
    return {name: known.get(name.rsplit("_", 1)[-1], "") for name in names}
