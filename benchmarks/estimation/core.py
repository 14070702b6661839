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

import numpy as np
import pinocchio as pin

from benchmarks.estimation.idyntree_peer import (
    ACCELEROMETER,
    JOINT_ACCELERATION,
    MOMENTUM,
    NET_WRENCH,
    Peer,
    PeerCovariances,
    PeerMissingError,
)
from benchmarks.estimation.moving_scene import Scene, moving_scene, noisy
from estimation import (
    APPLICATION,
    Accelerometer,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
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
ROUNDS = 5
LIVE_FRAMES = 60
PEER_FRAMES = 40
#: At rest 1 N of noise at each foot is sqrt(2) N of load; a hold tells more than a frame.
FLOOR = "0.14 at rest from the feet alone; holds: benchmarks.estimation.uncertainty"


@dataclass(frozen=True, slots=True)
class Figure:
    """One line of the table: a number, what it must reach, and beside what."""

    name: str
    value: float
    unit: str
    good: bool | None
    beside: str


def main() -> int:
    """Prints one line per figure; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    model = generate_model(Subject(1.76, 74.3, "male"))
    scene = moving_scene(model, FRAMES, np.random.default_rng(0))
    failed = 0
    for figure in (*speed(model, scene, options.rounds), *accuracy(model, scene)):
        mark = {True: "pass", False: "FAIL", None: "    "}[figure.good]
        failed += figure.good is False
        print(f"{figure.name:58} {figure.value:11.4g} {figure.unit:9} {mark}  {figure.beside}")
    return 1 if failed else 0


def median_seconds(run: Callable[[], object], rounds: int) -> float:
    """Median processor seconds."""
    found = []
    for _ in range(rounds):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return statistics.median(found)


def run(tree: EstimationTree, scene: Scene, **more: object) -> object:
    """Estimates a scene in one step."""
    return estimate(tree, scene.q, scene.v, scene.a, scene.sensors, **more)  # type: ignore[arg-type]


def speed(model: HumanModel, scene: Scene, rounds: int) -> Iterator[Figure]:
    """Times per frame, and ratios to the peers."""
    scale = 1e6 / FRAMES
    real, hinges = real_tree(model), hinge_tree(model)
    ours = {
        "real links, mean and all sds": lambda: run(real, scene),
        "real links, mean": lambda: run(real, scene, spreads=False),
        "67 links and hands, mean and all sds": lambda: run(hinges, scene),
        "two steps": lambda: run(real, scene, method="two_step"),
    }
    times = {name: median_seconds(call, rounds) * scale for name, call in ours.items()}
    rnea = rnea_microseconds(model, scene, rounds)
    for name, value in times.items():
        yield Figure(f"{name}, numpy, batch {FRAMES}", value, "us/frame", None, "")
    yield Figure("pin.rnea in a loop", rnea, "us/frame", None, "the deterministic floor")
    yield from live(real, scene)
    try:
        peer = idyntree(model, scene)
    except PeerMissingError as error:
        yield Figure("iDynTree", float("nan"), "us/frame", None, str(error))
        return
    yield Figure("iDynTree MAP, means only, 67 links", peer.microseconds, "us/frame", None, "")
    for name, least in (
        ("real links, mean and all sds", 5.0),
        ("67 links and hands, mean and all sds", 1.0),
    ):
        ratio = peer.microseconds / times[name]
        yield Figure(f"{name}: times as fast", ratio, "", ratio >= least, f"at least {least:g}")
    yield from step_one(model, scene, rounds)
    yield Figure(
        "torques with equal covariances, 67 links, differ",
        peer.torque_difference,
        "N m",
        peer.torque_difference <= 1e-6,
        "at most 1e-6",
    )
    yield Figure(
        "external wrenches, the same",
        peer.wrench_difference,
        "N, N m",
        peer.wrench_difference <= 1e-6,
        "at most 1e-6",
    )


def live(tree: EstimationTree, scene: Scene) -> Iterator[Figure]:
    """One frame at a time, with standard deviations."""
    found = []
    for frame in range(LIVE_FRAMES):
        one = [frame]
        sensors = [cut(sensor, frame) for sensor in scene.sensors]
        q, v, a = scene.q[one], scene.v[one], scene.a[one]
        start = time.process_time()
        estimate(tree, q, v, a, sensors)
        found.append(1e3 * (time.process_time() - start))
    found.sort()
    yield Figure("one frame at a time, numpy, median", statistics.median(found), "ms", None, "")
    yield Figure("one frame at a time, numpy, p99", found[-1 - len(found) // 100], "ms", None, "")


def cut(sensor: Measurement, frame: int) -> Measurement:
    """One frame of a measurement."""
    if isinstance(sensor, FreeWrench):
        return sensor
    return replace(sensor, value=np.asarray(sensor.value)[[frame]])


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
    yield Figure("wrenches from balance, 67 links", mine, "us/frame", None, "")
    yield Figure("wrenches from balance, real links", mine_real, "us/frame", None, "")
    yield Figure("the same, iDynTree, 67 links", theirs, "us/frame", None, "")
    yield Figure("67 links: times as fast", theirs / mine, "", None, "")
    ratio = theirs / mine_real
    yield Figure("real links: times as fast", ratio, "", ratio >= 300.0, "at least 300")
    yield Figure(
        "wrenches from balance, 67 links, differ", apart, "N, N m", apart <= 1e-6, "at most 1e-6"
    )


def accuracy(model: HumanModel, scene: Scene) -> Iterator[Figure]:
    """Errors, bands and payload on a moving person with the noise stated."""
    tree = real_tree(model)
    found = estimate(tree, scene.q, scene.v, scene.a, noisy(scene, np.random.default_rng(1), tree))
    error = found.torque - scene.torque
    assert found.torque_sd is not None
    rms = float(np.sqrt(np.mean(error**2)))
    yield Figure("torque RMSE, noise stated", rms, "N m", rms <= 0.35, "at most 0.35")
    cover = float(np.mean(np.abs(error) < 1.96 * found.torque_sd))
    yield Figure("95 % intervals of torques cover", cover, "", 0.92 <= cover <= 0.97, ".92 to .97")
    held = payload(found)
    off = held.mass_kg - scene.load_kg
    yield Figure("payload, error of the mean", abs(float(np.mean(off))), "kg", None, "of 5 kg")
    spread = float(np.std(off))
    yield Figure("payload of a frame, standard deviation", spread, "kg", None, FLOOR)


if __name__ == "__main__":
    raise SystemExit(main())
