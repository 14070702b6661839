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
from estimation.errors import KernelMissingError, MissingMeasurementError, UnknownLinkError
from estimation.estimate_inputs import (
    Missing,
    completed,
    force_sensors,
    free_links,
    of_frames,
    usable_frames,
)
from estimation.estimate_record import Estimate, Method, from_results
from estimation.exact_solution import (
    CHUNK,
    Wanted,
    gathered,
    numpy_solution,
    refuse_what_is_no_number,
    solution,
)
from estimation.kernel import Results, Solve, kernel_state, loaded_kernel
from estimation.momentum import momentum_rate, newton_euler
from estimation.ncwe import external_wrenches
from estimation.problem import net_wrenches
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
)
from estimation.spatial import Array, IntArray, times
from estimation.tree import EstimationTree
from estimation.tree_kinematics import (
    base_acceleration,
    check_state,
    link_accelerations,
    rows,
    tree_kinematics,
)


@dataclass(frozen=True, slots=True)
class _Run:
    """Everything that holds for the whole run."""

    wanted: Wanted
    preset: TwoStepCovariances
    diagonal_at: str


@dataclass(frozen=True, slots=True)
class _Part:
    """Frames that are worked on at once."""

    q: Array
    v: Array
    a: Array | None
    measurements: Sequence[Measurement]
    numbers: IntArray


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
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
    engine: Literal["auto", "kernel", "numpy"] = "auto",
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
        engine: ``kernel``, compiled for this processor by `compile_kernel`; ``numpy``, the same
            numbers some 30 times as slowly; ``auto``: the kernel if there is one. None of them
            ever waits for a compiler.

    Returns:
        Means and standard deviations of the frames estimated.

    Raises:
        MeasurementError: shapes do not fit, or numbers are not finite or too large.
        UnknownLinkError: a sensor is on a link that the tree has not.
        MissingMeasurementError: an acceleration is neither measured nor given.
        KernelMissingError: the kernel is asked for and has not been compiled.
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
    believed = preset.covariances if method == "two_step" else model
    kernel = None if method == "deterministic" else chosen_kernel(engine)
    wanted = Wanted(tree, believed, free_links(measurements), spreads, kernel)
    run = _Run(wanted, preset, diagonal_at)
    solve = _SOLVERS[method]
    size = len(chosen) if method == "one_step" else CHUNK
    parts = []
    for part in rows(len(chosen), size):
        parts.append(solve(run, _part(chosen[part], state, velocity, acceleration, given)))
    found = gathered(parts)
    bands: Literal["uncertainty", "tuning", "none"] = "none"
    if "torque_sd" in found:
        bands = "uncertainty" if method == "one_step" else "tuning"
    return from_results(
        found,
        tree=tree,
        method=method,
        frames=chosen,
        left_out=left_out,
        sites=wanted.sites,
        bands=bands,
        assumed=tuple(assumed),
        engine="kernel" if wanted.compiled else "numpy",
    )


def chosen_kernel(engine: str) -> Solve | None:
    """Returns the compiled kernel, if it is wanted and there.

    Raises:
        KernelMissingError: it is asked for and has not been compiled.
    """
    kernel = None if engine == "numpy" else loaded_kernel()
    if engine == "kernel" and kernel is None:
        raise KernelMissingError(f"engine 'kernel': {kernel_state().reason}")
    return kernel


def _part(
    index: IntArray, q: Array, v: Array, a: Array | None, measurements: Sequence[Measurement]
) -> _Part:
    """Cuts a run to some of its frames; all of them are not copied."""
    if len(index) == len(q):
        return _Part(q, v, a, measurements, index)
    local = [of_frames(sensor, index, len(q)) for sensor in measurements]
    return _Part(q[index], v[index], None if a is None else a[index], local, index)


def _one_step(run: _Run, part: _Part) -> Results:
    return solution(run.wanted, part.q, part.v, part.measurements, part.numbers)


def _deterministic(run: _Run, part: _Part) -> Results:
    """Inverse dynamics; what nothing measured is taken to bear nothing."""
    v, a, measurements = part.v, part.a, part.measurements
    assert a is not None
    tree = run.wanted.tree
    kinematics = tree_kinematics(tree, part.q, v)
    base = base_acceleration(kinematics, v, a)
    accelerations = link_accelerations(tree, kinematics, base, a[:, 6:])
    _, wrenches = net_wrenches(tree, kinematics, measurements, run.wanted.covariances, len(v))
    joints, residual = newton_euler(tree, kinematics, accelerations, wrenches)
    torque = np.empty((len(v), tree.n_dof))
    for link, dofs in enumerate(tree.dofs):
        torque[:, dofs] = times(kinematics.H[link].swapaxes(-1, -2), joints[link])
    out = {
        "link_acceleration": accelerations.swapaxes(0, 1),
        "external_wrench": wrenches.swapaxes(0, 1),
        "joint_wrench": joints[1:].swapaxes(0, 1),
        "joint_acceleration": a[:, 6:],
        "torque": torque,
        "link_rotation": kinematics.rotation.swapaxes(0, 1),
        "residual": residual,
    }
    refuse_what_is_no_number(out, part.numbers)
    return out


def _two_step(run: _Run, part: _Part) -> Results:
    """External wrenches from the balance of momentum, then everything with those as measured."""
    v, a, measurements = part.v, part.a, part.measurements
    assert a is not None
    tree, preset, frames = run.wanted.tree, run.preset, len(v)
    kinematics = tree_kinematics(tree, part.q, v)
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
        variance = preset.second_hands if name in run.wanted.sites else variance
        second.append(ForceTorque(name, wrenches[link], variance))
    if run.wanted.compiled:
        return solution(run.wanted, part.q, v, second, part.numbers)
    return numpy_solution(run.wanted, kinematics, second, part.numbers)


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


_Solver = Callable[[_Run, _Part], Results]
_SOLVERS: dict[Method, _Solver] = {
    "one_step": _one_step,
    "two_step": _two_step,
    "deterministic": _deterministic,
}
