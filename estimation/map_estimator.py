"""Estimates accelerations, external wrenches, joint wrenches and torques from all there is.

Three methods. ``one_step``, the default, solves the whole problem at once, with every covariance
the sensors' noise; its bands are uncertainties. ``two_step`` is the 2021 paper's, for comparison.
``deterministic`` is inverse dynamics, the check.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from estimation.covariances import APPLICATION, ModelCovariances, TwoStepCovariances
from estimation.cross_covariance import wrench_covariance
from estimation.elimination import sweep_down, sweep_down_spreads, sweep_up
from estimation.estimate_record import Estimate, Method
from estimation.map_errors import MissingMeasurementError, UnknownLinkError
from estimation.momentum import momentum_rate, newton_euler
from estimation.ncwe import external_wrenches
from estimation.problem import Problem, assemble, net_wrenches
from estimation.run_inputs import (
    Missing,
    completed,
    force_sensors,
    free_links,
    of_frames,
    usable_frames,
)
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
)
from estimation.spatial import Array, times
from estimation.tree import EstimationTree
from estimation.tree_kinematics import (
    TreeKinematics,
    base_acceleration,
    check_state,
    link_accelerations,
    rows,
    tree_kinematics,
)

#: Frames worked on at once: a link's matrices then stay in the processor's cache.
CHUNK = 256
_Part = dict[str, Array]


@dataclass(frozen=True, slots=True)
class _Run:
    """Everything that holds for the whole run."""

    tree: EstimationTree
    covariances: ModelCovariances
    preset: TwoStepCovariances
    diagonal_at: str
    sites: tuple[str, ...]
    spreads: bool


def estimate(
    tree: EstimationTree,
    q: ArrayLike,
    v: ArrayLike | None,
    a: ArrayLike | None = None,
    measurements: Sequence[Measurement] = (),
    *,
    method: Method = "one_step",
    covariances: ModelCovariances | None = None,
    preset: TwoStepCovariances = APPLICATION,
    diagonal_at: str = "com",
    missing: Missing = "refuse",
    spreads: bool = True,
) -> Estimate:
    """Estimates a run; a live frame is a run of one.

    Args:
        tree: the links, from `real_tree` or `hinge_tree`.
        q: ``(frames, 7 + n_dof)`` base position (m), base quaternion xyzw, joint angles (rad).
        v: ``(frames, 6 + n_dof)`` base twist in body axes, joint rates; None stands for rest. The
            base's linear velocity does not matter to ``one_step``.
        a: ``(frames, 6 + n_dof)`` accelerations of the motion. ``one_step`` takes them only for
            what no sensor measures; the other methods need them.
        measurements: what was measured, and where something unmeasured may push.
        method: ``one_step``, ``two_step`` or ``deterministic``.
        covariances: of the model; for ``one_step`` alone.
        preset: the covariances of ``two_step``, which stand in for the sensors'.
        diagonal_at: where the preset's momentum covariance is diagonal: ``com`` or ``base``.
        missing: ``refuse`` frames with numbers that are not finite, or ``leave_out`` and name them.
        spreads: whether to compute standard deviations; half the time.

    Returns:
        Means and standard deviations of the frames estimated.

    Raises:
        SensorError: shapes do not fit, or numbers are not finite.
        UnknownLinkError: a sensor is on a link that the tree has not.
        MissingMeasurementError: an acceleration is neither measured nor given.
        CovarianceError: a covariance is not one, or beyond double precision.

    Source: Latella et al. 2019, eq. 11-25 and appendix A; Tirupachuri et al. 2021, eq. 1-25.
    """
    state, velocity, acceleration = check_state(tree, q, v, a)
    for sensor in measurements:
        if not isinstance(sensor, JointAcceleration) and sensor.link not in tree.link_names:
            raise UnknownLinkError(sensor.link, tree.link_names)
    chosen, left_out = usable_frames(measurements, len(state), missing)
    if method != "one_step" and acceleration is None:
        raise MissingMeasurementError(
            f"method {method!r}: expected the motion's accelerations `a`, got None"
        )
    model = covariances or ModelCovariances()
    assumed: list[str] = []
    given: Sequence[Measurement] = measurements
    if method != "deterministic":
        believed = model if method == "one_step" else _as_derived(preset)
        given, assumed = completed(tree, state, velocity, acceleration, measurements, believed)
    run = _Run(tree, model, preset, diagonal_at, free_links(measurements), spreads)
    solve = _SOLVERS[method]
    parts = []
    for part in rows(len(chosen), CHUNK):
        index = chosen[part]
        local = [of_frames(sensor, index, len(state)) for sensor in given]
        kinematics = tree_kinematics(tree, state[index], velocity[index])
        here = None if acceleration is None else acceleration[index]
        out = solve(run, kinematics, velocity[index], here, local)
        out["link_rotation"] = kinematics.rotation.swapaxes(0, 1)
        parts.append(out)
    gathered = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    bands: Literal["uncertainty", "tuning", "none"] = "none"
    if "torque_sd" in gathered:
        bands = "uncertainty" if method == "one_step" else "tuning"
    return Estimate(
        tree=tree,
        method=method,
        frames=chosen,
        left_out=left_out,
        link_acceleration=gathered["link_acceleration"],
        external_wrench=gathered["external_wrench"],
        joint_wrench=gathered["joint_wrench"],
        joint_acceleration=gathered["joint_acceleration"],
        torque=gathered["torque"],
        link_acceleration_sd=gathered.get("link_acceleration_sd"),
        external_wrench_sd=gathered.get("external_wrench_sd"),
        joint_wrench_sd=gathered.get("joint_wrench_sd"),
        joint_acceleration_sd=gathered.get("joint_acceleration_sd"),
        torque_sd=gathered.get("torque_sd"),
        joint_moment_covariance=gathered.get("joint_moment_covariance"),
        sites=run.sites,
        site_covariance=gathered.get("site_covariance"),
        site_prior=gathered.get("site_prior"),
        link_rotation=gathered["link_rotation"],
        residual=gathered["residual"],
        residual_chi2=gathered.get("residual_chi2"),
        bands=bands,
        assumed=tuple(assumed),
    )


def _one_step(
    run: _Run,
    kinematics: TreeKinematics,
    v: Array,
    a: Array | None,
    measurements: Sequence[Measurement],
) -> _Part:
    problem = assemble(run.tree, kinematics, measurements, run.covariances, len(v))
    return _solved(problem, run)


def _solved(problem: Problem, run: _Run) -> _Part:
    """Solves an assembled problem and puts frames first."""
    gains, root = sweep_up(problem)
    means = sweep_down(problem, gains, root)
    out: _Part = {
        "link_acceleration": means.a.swapaxes(0, 1),
        "external_wrench": means.fx.swapaxes(0, 1),
        "joint_wrench": means.fj[1:].swapaxes(0, 1),
        "joint_acceleration": means.s,
        "torque": means.tau,
        "residual": root.residual,
        "residual_chi2": -np.einsum("fi,fij,fj->f", root.residual, root.B, root.residual),
    }
    if not run.spreads:
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
    links = [problem.tree.link_names.index(name) for name in run.sites]
    out["site_covariance"] = wrench_covariance(problem, gains, spread, links)
    prior = np.zeros_like(out["site_covariance"])
    for place, link in enumerate(links):
        part = slice(6 * place, 6 * place + 6)
        prior[:, part, part] = problem.Px[link]
    out["site_prior"] = prior
    return out


def _deterministic(
    run: _Run,
    kinematics: TreeKinematics,
    v: Array,
    a: Array | None,
    measurements: Sequence[Measurement],
) -> _Part:
    """Inverse dynamics; what nothing measured is taken to bear nothing."""
    assert a is not None
    tree = run.tree
    base = base_acceleration(kinematics, v, a)
    accelerations = link_accelerations(tree, kinematics, base, a[:, 6:])
    _, wrenches = net_wrenches(tree, kinematics, measurements, run.covariances, len(v))
    joints, residual = newton_euler(tree, kinematics, accelerations, wrenches)
    torque = np.empty((len(v), tree.n_dof))
    for link, dofs in enumerate(tree.dofs):
        torque[:, dofs] = times(kinematics.H[link].swapaxes(-1, -2), joints[link])
    return {
        "link_acceleration": accelerations.swapaxes(0, 1),
        "external_wrench": wrenches.swapaxes(0, 1),
        "joint_wrench": joints[1:].swapaxes(0, 1),
        "joint_acceleration": a[:, 6:],
        "torque": torque,
        "residual": residual,
    }


def _two_step(
    run: _Run,
    kinematics: TreeKinematics,
    v: Array,
    a: Array | None,
    measurements: Sequence[Measurement],
) -> _Part:
    """External wrenches from the balance of momentum, then everything with those as measured."""
    assert a is not None
    tree, preset, frames = run.tree, run.preset, len(v)
    model = preset.covariances
    first = [_for_first_step(sensor, preset) for sensor in measurements]
    Px, fbar = net_wrenches(tree, kinematics, first, model, frames)
    for name in force_sensors(measurements):
        # The preset states the covariance of a foot's net wrench, whatever its sensors.
        Px[tree.link_names.index(name)] = preset.feet * np.eye(6)[None]
    wrenches = fbar
    if preset.first_step:
        base = base_acceleration(kinematics, v, a)
        accelerations = link_accelerations(tree, kinematics, base, a[:, 6:])
        rate = momentum_rate(tree, kinematics, accelerations)
        wrenches, _ = external_wrenches(
            tree,
            kinematics,
            Px,
            fbar,
            rate,
            preset.momentum,
            diagonal_at=run.diagonal_at,
            spreads=False,
        )
    second: list[Measurement] = []
    for sensor in measurements:
        if isinstance(sensor, Accelerometer | AngularAcceleration):
            second.append(replace(sensor, covariance=preset.accelerometer))
        elif isinstance(sensor, JointAcceleration):
            second.append(replace(sensor, covariance=preset.joint_acceleration))
    feet = force_sensors(measurements)
    for link, name in enumerate(tree.link_names):
        variance = preset.second_feet if name in feet else preset.untouched
        variance = preset.second_hands if name in run.sites else variance
        second.append(ForceTorque(name, wrenches[link], variance))
    return _solved(assemble(tree, kinematics, second, model, frames), run)


def _as_derived(preset: TwoStepCovariances) -> ModelCovariances:
    """The preset's covariances as those of accelerations derived from the motion."""
    linear, joint = preset.accelerometer**0.5, preset.joint_acceleration**0.5
    return ModelCovariances(
        derived_acceleration_sd=linear, derived_angular_sd=linear, derived_joint_sd=joint
    )


def _for_first_step(sensor: Measurement, preset: TwoStepCovariances) -> Measurement:
    if isinstance(sensor, FreeWrench):
        force, moment = preset.hand_force**0.5, preset.hand_moment**0.5
        return replace(sensor, force_sd=force, moment_sd=moment)
    return sensor


_Solver = Callable[
    [_Run, TreeKinematics, Array, Array | None, Sequence[Measurement]], dict[str, Array]
]
_SOLVERS: dict[Method, _Solver] = {
    "one_step": _one_step,
    "two_step": _two_step,
    "deterministic": _deterministic,
}
