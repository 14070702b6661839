"""Solves checked frames exactly, by the compiled kernel or by numpy; both give the same numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.covariances import ModelCovariances
from estimation.cross_covariance import wrench_covariance
from estimation.elimination import sweep_down, sweep_down_spreads, sweep_up
from estimation.errors import CovarianceError, MeasurementError
from estimation.estimate_inputs import of_frames
from estimation.kernel import Results, Solve, solve_frames, supports
from estimation.problem import Problem, assemble
from estimation.sensors import Measurement
from estimation.spatial import Array, IntArray
from estimation.tree import EstimationTree
from estimation.tree_kinematics import TreeKinematics, rows, tree_kinematics

#: Frames that numpy works on at once: a link's matrices then stay in the processor's cache.
CHUNK = 256


@dataclass(frozen=True, slots=True)
class Wanted:
    """What to solve for, and how.

    Attributes:
        tree: the links.
        covariances: of the model.
        sites: the links on which something unmeasured may push.
        spreads: whether standard deviations are wanted.
        kernel: the compiled kernel; None: numpy.
    """

    tree: EstimationTree
    covariances: ModelCovariances
    sites: tuple[str, ...]
    spreads: bool
    kernel: Solve | None

    @property
    def compiled(self) -> bool:
        """Whether the kernel does the work."""
        return self.kernel is not None and supports(self.covariances)


def solution(
    wanted: Wanted, q: Array, v: Array, measurements: Sequence[Measurement], numbers: IntArray
) -> Results:
    """Solves frames.

    Args:
        wanted: what to solve for.
        q: ``(frames, 7 + n_dof)``, checked.
        v: ``(frames, 6 + n_dof)``.
        measurements: all finite, on links of the tree.
        numbers: what messages call the frames.

    Returns:
        Results by their names in `Estimate`.

    Raises:
        MeasurementError: a value or covariance has the wrong shape; or numbers are too large.
        CovarianceError: a covariance is not one, or beyond double precision.
        MissingMeasurementError: nobody knows the joint accelerations.
    """
    if wanted.kernel is None or not supports(wanted.covariances):
        return _by_numpy(wanted, q, v, measurements, np.arange(len(q)), numbers)
    out, doubtful = solve_frames(
        wanted.kernel,
        wanted.tree,
        q,
        v,
        measurements,
        wanted.covariances,
        wanted.sites,
        spreads=wanted.spreads,
    )
    if len(doubtful):
        # Numpy takes more care with what is all but singular, and names what it refuses.
        again = _by_numpy(wanted, q, v, measurements, doubtful, numbers)
        for name, array in again.items():
            out[name][doubtful] = array
    return out


def _by_numpy(
    wanted: Wanted,
    q: Array,
    v: Array,
    measurements: Sequence[Measurement],
    chosen: IntArray,
    numbers: IntArray,
) -> Results:
    parts = []
    for part in rows(len(chosen), CHUNK):
        index = chosen[part]
        local = [of_frames(sensor, index, len(q)) for sensor in measurements]
        kinematics = tree_kinematics(wanted.tree, q[index], v[index])
        parts.append(numpy_solution(wanted, kinematics, local, numbers[index]))
    return gathered(parts)


def gathered(parts: Sequence[Results]) -> Results:
    """Joins results of successive frames."""
    if len(parts) == 1:
        return parts[0]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def numpy_solution(
    wanted: Wanted,
    kinematics: TreeKinematics,
    measurements: Sequence[Measurement],
    numbers: IntArray,
) -> Results:
    """Solves frames with numpy, all at once; as `solution`."""
    try:
        out = _solved(wanted, kinematics, measurements, len(numbers))
    except np.linalg.LinAlgError as error:
        raise CovarianceError(
            "covariances", f"expected some that double precision carries ({error})", float("nan")
        ) from error
    refuse_what_is_no_number(out, numbers)
    return out


def refuse_what_is_no_number(results: Mapping[str, Array], numbers: IntArray) -> None:
    """Refuses results beyond double precision.

    Raises:
        MeasurementError: with the frames.
    """
    bad = np.zeros(len(numbers), dtype=np.bool_)
    for array in results.values():
        bad |= ~np.isfinite(array.reshape(len(numbers), -1)).all(axis=1)
    if np.any(bad):
        raise MeasurementError(
            "estimate: expected states, readings and variances of a size that double precision "
            "carries through; they are too large or too small",
            numbers[bad].tolist(),
        )


def _solved(
    wanted: Wanted, kinematics: TreeKinematics, measurements: Sequence[Measurement], frames: int
) -> Results:
    problem = assemble(wanted.tree, kinematics, measurements, wanted.covariances, frames)
    gains, root = sweep_up(problem)
    means = sweep_down(problem, gains, root)
    out: Results = {
        "link_acceleration": means.a.swapaxes(0, 1),
        "external_wrench": means.fx.swapaxes(0, 1),
        "joint_wrench": means.fj[1:].swapaxes(0, 1),
        "joint_acceleration": means.s,
        "torque": means.tau,
        "link_rotation": kinematics.rotation.swapaxes(0, 1),
        "residual": root.residual,
        "residual_chi2": -np.einsum("fi,fij,fj->f", root.residual, root.B, root.residual),
    }
    if not wanted.spreads:
        return out
    spread = sweep_down_spreads(problem, gains, root)
    for name, block in (
        ("link_acceleration_sd", spread.Ca),
        ("external_wrench_sd", spread.Cfx),
        ("joint_wrench_sd", spread.Cfj[1:]),
    ):
        out[name] = np.sqrt(np.diagonal(block, axis1=-2, axis2=-1)).swapaxes(0, 1)
    out["joint_acceleration_sd"] = np.sqrt(spread.s)
    out["torque_sd"] = np.sqrt(spread.tau)
    out["joint_moment_covariance"] = spread.Cfj[1:, :, 3:, 3:].swapaxes(0, 1)
    links = [problem.tree.link_names.index(name) for name in wanted.sites]
    out["site_covariance"] = wrench_covariance(problem, gains, spread, links)
    out["site_prior"] = _site_prior(problem, links, frames)
    return out


def _site_prior(problem: Problem, links: Sequence[int], frames: int) -> Array:
    prior = np.zeros((frames, 6 * len(links), 6 * len(links)))
    for place, link in enumerate(links):
        part = slice(6 * place, 6 * place + 6)
        prior[:, part, part] = problem.Px[link]
    return prior
