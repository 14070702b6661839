"""The MAP estimator against iDynTree's and Pinocchio's inverse dynamics.

Run ``python -m benchmarks.estimation.core``; ``pip install idyntree`` first for the peer, which
nothing else needs. Processor time, one thread; ratios of medians count, since the machine may be
shared. Agreement is checked with equal covariances on the papers' 67 links.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import pinocchio as pin

from benchmarks.estimation.agreement import agreement
from benchmarks.estimation.idyntree_peer import (
    ACCELEROMETER,
    JOINT_ACCELERATION,
    MOMENTUM,
    NET_WRENCH,
    Peer,
    PeerCovariances,
    PeerMissingError,
)
from benchmarks.estimation.live import RATE_HZ, fresh_process
from benchmarks.estimation.moving_scene import Scene, moving_scene, noisy
from benchmarks.figure import Figure, shown
from estimation import (
    APPLICATION,
    Accelerometer,
    Estimate,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    compile_kernel,
    estimate,
    hinge_tree,
    payload,
    real_tree,
)
from estimation.momentum import momentum_rate
from estimation.ncwe import external_wrenches
from estimation.tree_kinematics import base_acceleration, link_accelerations, tree_kinematics
from human import HumanModel, Subject, generate_model

FRAMES = 256
MANY = 10_000
ROUNDS = 5
PEER_FRAMES = 40
#: At rest 1 N of noise at each foot is sqrt(2) N of load; a hold tells more than a frame.
FLOOR = "0.14 at rest from the feet alone; holds: benchmarks.estimation.uncertainty"


def main() -> int:
    """Prints one line per figure; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    model = generate_model(Subject(1.76, 74.3, "male"))
    scene = moving_scene(model, FRAMES, np.random.default_rng(0))
    return shown(
        chain(
            speed(model, scene, options.rounds),
            accuracy(model, scene),
            agreement(model, scene),
        )
    )


def median_seconds(run: Callable[[], object], rounds: int) -> float:
    """Median processor seconds."""
    found = []
    for _ in range(rounds):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return statistics.median(found)


def run(tree: EstimationTree, scene: Scene, **more: object) -> Estimate:
    """Estimates a scene in one step."""
    return estimate(tree, scene.q, scene.v, scene.a, scene.sensors, **more)  # type: ignore[arg-type]


def speed(model: HumanModel, scene: Scene, rounds: int) -> Iterator[Figure]:
    """Times per frame, and ratios to the peers."""
    real, hinges = real_tree(model), hinge_tree(model)
    state = compile_kernel()
    many = moving_scene(model, MANY, np.random.default_rng(2))
    compiled = {
        "real links, mean and all sds": lambda: run(real, many),
        "real links, mean": lambda: run(real, many, spreads=False),
        "67 links and hands, mean and all sds": lambda: run(hinges, many),
        "67 links and hands, joint wrenches' prior": lambda: run(
            hinges, many, covariances=APPLICATION.covariances
        ),
    }
    by_numpy = {
        "real links, mean and all sds": lambda: run(real, scene, engine="numpy"),
        "67 links and hands, mean and all sds": lambda: run(hinges, scene, engine="numpy"),
    }
    yield Figure("compiled kernel", float(state.ready), least=1.0, beside=state.reason)
    rnea = rnea_microseconds(model, scene, rounds)
    times = {name: median_seconds(call, rounds) * 1e6 / MANY for name, call in compiled.items()}
    slow = {name: median_seconds(call, rounds) * 1e6 / FRAMES for name, call in by_numpy.items()}
    for name, value in times.items():
        yield Figure(name, value, "us/frame", beside=f"kernel, {MANY} frames, whole `estimate`")
    for name, value in slow.items():
        yield Figure(f"{name}, numpy", value, "us/frame", beside=f"batch {FRAMES}")
    yield Figure("pin.rnea in a loop", rnea, "us/frame", beside="the deterministic floor")
    own = times["real links, mean and all sds"]
    yield Figure("real links beside pin.rnea", own / rnea, "times", beside="aim 1; no sds there")
    yield from live()
    try:
        peer = idyntree(model, scene)
    except PeerMissingError as error:
        yield Figure("iDynTree", float("nan"), "us/frame", beside=str(error))
        return
    yield Figure("iDynTree MAP, means only, 67 links", peer.microseconds, "us/frame")
    for found, name, least in (
        (times, "real links, mean and all sds", 100.0),
        (times, "67 links and hands, mean and all sds", 40.0),
        (slow, "real links, mean and all sds", 5.0),
    ):
        ratio, how = peer.microseconds / found[name], "numpy" if found is slow else "kernel"
        label = f"{name}, {how}: times as fast"
        yield Figure(label, ratio, least=least)
    yield from step_one(model, scene, rounds)
    yield Figure(
        "torques with equal covariances, 67 links, differ",
        peer.torque_difference,
        "N m",
        most=1e-6,
    )
    yield Figure(
        "external wrenches, the same",
        peer.wrench_difference,
        "N, N m",
        most=1e-6,
    )
    yield from engines_agree(real, scene)


def engines_agree(tree: EstimationTree, scene: Scene) -> Iterator[Figure]:
    """The kernel's numbers beside numpy's, where no free force costs them digits."""
    sensors = [FreeWrench(s.link, 1.0) if isinstance(s, FreeWrench) else s for s in scene.sensors]
    cut = replace(scene, sensors=sensors)
    kernel, plain = run(tree, cut, engine="kernel"), run(tree, cut, engine="numpy")
    assert kernel.torque_sd is not None
    assert plain.torque_sd is not None
    off = float(np.abs(kernel.torque - plain.torque).max())
    yield Figure("kernel and numpy: torques differ", off, "N m", most=1e-9)
    off = float(np.abs(kernel.torque_sd / plain.torque_sd - 1.0).max())
    yield Figure("kernel and numpy: their sds differ", off, "relative", most=1e-8)


def live() -> Iterator[Figure]:
    """One frame at a time, with standard deviations, in a fresh process."""
    found = fresh_process("kernel")
    first, clock = found["first"], f"by the clock {found['first by the clock']:.2f}"
    yield Figure("first estimate of a fresh process", first, "s", most=3.0, beside=clock)
    for name, most in (("median", 0.5), ("p99", 1e3 / RATE_HZ / 2.0)):
        clock = f"by the clock {found[f'{name} by the clock']:.3f}"
        yield Figure(f"live at {RATE_HZ:g} Hz, {name}", found[name], "ms", most=most, beside=clock)
    late = found["late"]
    yield Figure("live, frames later than the next", late, "share", beside="shared machine")
    bare = fresh_process("numpy")
    yield Figure("live, numpy, median", bare["median"], "ms", beside="where nothing is compiled")


def rnea_microseconds(model: HumanModel, scene: Scene, rounds: int) -> float:
    """Pinocchio's inverse dynamics, frame by frame."""
    peer = model.pinocchio()
    data = peer.createData()

    def loop() -> None:
        for frame in range(FRAMES):
            pin.rnea(peer, data, scene.q[frame], scene.v[frame], scene.a[frame])

    return median_seconds(loop, rounds) * 1e6 / FRAMES


@dataclass(frozen=True, slots=True)
class PeerFigures:
    """What iDynTree takes, and how far it is from us."""

    microseconds: float
    torque_difference: float
    wrench_difference: float


def idyntree(model: HumanModel, scene: Scene) -> PeerFigures:
    """Solves the papers' problem with both; the load stays in the hand's own link."""
    table = APPLICATION
    free = np.array([1e2] * 3 + [1e-2] * 3)
    variances = {name: np.full(6, table.feet) for name in ("RightFoot", "LeftFoot")}
    variances["RightHand"] = free
    accelerometers = [sensor for sensor in scene.sensors if isinstance(sensor, Accelerometer)]
    peer = Peer(
        model,
        accelerometers,
        PeerCovariances(
            table.prior,
            table.model,
            table.accelerometer,
            table.joint_acceleration,
            variances,
            table.untouched,
        ),
    )
    tree = hinge_tree(model, frames=())
    sensors: list[Measurement] = [FreeWrench("RightHand", 10.0, 0.1)]
    readings: list[tuple[str, str, np.ndarray]] = []
    for sensor in scene.sensors:
        if isinstance(sensor, Accelerometer):
            sensors.append(replace(sensor, covariance=table.accelerometer))
            readings.append((ACCELEROMETER, f"imu_{sensor.link}", np.asarray(sensor.value)))
        elif isinstance(sensor, ForceTorque):
            sensors.append(replace(sensor, covariance=table.feet))
            readings.append((NET_WRENCH, sensor.link, np.asarray(sensor.value)))
        elif isinstance(sensor, JointAcceleration):
            sensors.append(replace(sensor, covariance=table.joint_acceleration))
            value = np.asarray(sensor.value)
            for dof, name in enumerate(model.dof_names):
                readings.append((JOINT_ACCELERATION, name, value[:, dof]))
    ours = estimate(tree, scene.q, scene.v, scene.a, sensors, covariances=table.covariances)
    dofs = [model.dof_names.index(name) for name in peer.dofs]
    taken, torque_off, wrench_off = [], 0.0, 0.0
    for frame in range(PEER_FRAMES):
        y = peer.measurement({(kind, name): value[frame] for kind, name, value in readings})
        s, ds = scene.q[frame, 7:][dofs], scene.v[frame, 6:][dofs]
        peer.load(s, ds, scene.v[frame, 3:6], y)
        start = time.process_time()
        peer.solve()
        taken.append(time.process_time() - start)
        torques, wrenches = peer.result()
        for name, torque in torques.items():
            mine = ours.torque[frame, model.dof_names.index(name)]
            torque_off = max(torque_off, abs(torque - float(mine)))
        for link in model.segment_names:
            apart = wrenches[link] - ours.external_wrench[frame, ours.link(link)]
            wrench_off = max(wrench_off, float(np.abs(apart).max()))
    return PeerFigures(1e6 * statistics.median(taken), torque_off, wrench_off)


@dataclass(frozen=True, slots=True)
class StepOne:
    """The 2021 paper's first step, assembled on one tree."""

    tree: EstimationTree
    rate: np.ndarray
    solve: Callable[[], np.ndarray]


def our_step_one(tree: EstimationTree, scene: Scene, noise: dict[str, float]) -> StepOne:
    """Assembles external wrenches and the rate of change of momentum."""
    table = APPLICATION
    Px, fbar = [], np.zeros((tree.n_links, FRAMES, 6))
    for link, name in enumerate(tree.link_names):
        variance = noise.get(name, table.untouched)
        # The prior about zero, too, as in the paper.
        Px.append(np.eye(6)[None] / (1.0 / variance + 1.0 / table.prior))
        for sensor in scene.sensors:
            if isinstance(sensor, ForceTorque) and sensor.link == name:
                fbar[link] = np.asarray(sensor.value) / (1.0 + variance / table.prior)
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    base = base_acceleration(kinematics, scene.v, scene.a)
    accelerations = link_accelerations(tree, kinematics, base, scene.a[:, 6:])
    rate = momentum_rate(tree, kinematics, accelerations)

    def solve() -> np.ndarray:
        return external_wrenches(
            tree, kinematics, Px, fbar, rate, table.momentum, diagonal_at="base", spreads=False
        )[0]

    return StepOne(tree, rate, solve)


def step_one(model: HumanModel, scene: Scene, rounds: int) -> Iterator[Figure]:
    """The first step with both; the load in the hand's own link."""
    table = APPLICATION
    noise = {"RightFoot": table.feet, "LeftFoot": table.feet, "RightHand": table.hand_force}
    ours = our_step_one(hinge_tree(model, frames=()), scene, noise)
    real = our_step_one(real_tree(model), scene, noise)
    mine = median_seconds(ours.solve, rounds) * 1e6 / FRAMES
    mine_real = median_seconds(real.solve, rounds) * 1e6 / FRAMES
    variances = {name: np.full(6, value) for name, value in noise.items()}
    peer = Peer(
        model,
        [],
        PeerCovariances(
            table.prior, table.model, 1.0, 1.0, variances, table.untouched, table.momentum
        ),
        balance_only=True,
    )
    dofs = [model.dof_names.index(name) for name in peer.dofs]
    tree, rate = ours.tree, ours.rate
    wrenches, taken, apart = ours.solve(), [], 0.0
    momentum = next((kind, name) for kind, name, _ in peer.order if kind == MOMENTUM)
    for frame in range(PEER_FRAMES // 4):
        readings: dict[tuple[str, str], np.ndarray] = {momentum: rate[frame]}
        for sensor in scene.sensors:
            if isinstance(sensor, ForceTorque):
                readings[NET_WRENCH, sensor.link] = np.asarray(sensor.value)[frame]
        s, ds = scene.q[frame, 7:][dofs], scene.v[frame, 6:][dofs]
        peer.load(s, ds, scene.v[frame, 3:6], peer.measurement(readings))
        start = time.process_time()
        peer.solve()
        taken.append(time.process_time() - start)
        found = peer.result()[1]
        for name in model.segment_names:
            off = found[name] - wrenches[tree.link_names.index(name), frame]
            apart = max(apart, float(np.abs(off).max()))
    theirs = 1e6 * statistics.median(taken)
    yield Figure("wrenches from balance, 67 links", mine, "us/frame")
    yield Figure("wrenches from balance, real links", mine_real, "us/frame")
    yield Figure("the same, iDynTree, 67 links", theirs, "us/frame")
    yield Figure("67 links: times as fast", theirs / mine)
    ratio = theirs / mine_real
    yield Figure("real links: times as fast", ratio, least=300.0)
    yield Figure("wrenches from balance, 67 links, differ", apart, "N, N m", most=1e-6)


def accuracy(model: HumanModel, scene: Scene) -> Iterator[Figure]:
    """Errors, bands and payload on a moving person with the noise stated."""
    tree = real_tree(model)
    found = estimate(tree, scene.q, scene.v, scene.a, noisy(scene, np.random.default_rng(1), tree))
    error = found.torque - scene.torque
    assert found.torque_sd is not None
    rms = float(np.sqrt(np.mean(error**2)))
    yield Figure("torque RMSE, noise stated", rms, "N m", most=0.35)
    cover = float(np.mean(np.abs(error) < 1.96 * found.torque_sd))
    yield Figure("95 % intervals of torques cover", cover, "", 0.92, 0.97)
    held = payload(found)
    off = held.mass_kg - scene.load_kg
    yield Figure("payload, error of the mean", abs(float(np.mean(off))), "kg", beside="of 5 kg")
    spread = float(np.std(off))
    yield Figure("payload of a frame, standard deviation", spread, "kg", beside=FLOOR)


if __name__ == "__main__":
    raise SystemExit(main())
