"""Batched kinematics and dynamics against Pinocchio called in a Python loop.

Run ``python -m benchmarks.kinematics``.

Each peer is timed in turn with ours, several rounds, processor time, one thread; the ratio of the
medians is what counts, since the machine may be shared. Agreement is checked on the same postures.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from human import (
    Chain,
    HumanModel,
    Subject,
    forward_kinematics,
    generate_model,
    inverse_dynamics,
    joint_loads,
)

ROUNDS = 9
ATOL = 1e-12


@dataclass(frozen=True, slots=True)
class Case:
    """One comparison: ours and the peer over the same postures, and the largest difference."""

    name: str
    postures: int
    ours: Callable[[], object]
    peer_name: str
    peer: Callable[[], object]
    difference: float
    least_ratio: float


def main() -> int:
    """Prints one line per comparison; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    model = generate_model(Subject(1.76, 74.3, "male"))
    rng = np.random.default_rng(0)
    failed = 0
    columns = f"{'postures':>8} {'ours us':>8} {'peer us':>8} {'ratio':>6} {'difference':>11}"
    print(f"{'what':38} {columns}")
    for case in (*kinematic_cases(model, rng), *dynamic_cases(model, rng)):
        ours, peer = timings(case, options.rounds)
        ratio, scale = peer / ours, 1e6 / case.postures
        good = case.difference <= ATOL and ratio >= case.least_ratio
        failed += not good
        print(
            f"{case.name:38} {case.postures:8d} {ours * scale:8.2f} {peer * scale:8.2f} "
            f"{ratio:6.2f} {case.difference:11.1e}  {'pass' if good else 'FAIL'} "
            f"(against {case.peer_name}; at least {case.least_ratio:g} times as fast, {ATOL:g})"
        )
    return 1 if failed else 0


def timings(case: Case, rounds: int) -> tuple[float, float]:
    """Median processor seconds of ours and of the peer, taken in turn."""
    ours, peer = [], []
    for _ in range(rounds):
        for run, found in ((case.ours, ours), (case.peer, peer)):
            start = time.process_time()
            run()
            found.append(time.process_time() - start)
    return statistics.median(ours), statistics.median(peer)


def configurations(model: HumanModel, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random base poses and joint angles."""
    q = rng.normal(size=(count, model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[:, 7:] = rng.uniform(-3.0, 3.0, (count, model.n_dof))
    return q


def kinematic_cases(model: HumanModel, rng: np.random.Generator) -> list[Case]:
    """Forward kinematics of the whole body; pose and Jacobian of the right hand's chain."""
    count = 1000
    peer = model.pinocchio()
    data = peer.createData()
    q = configurations(model, rng, count)
    segments = [peer.getFrameId(name) for name in model.segment_names]
    hand = peer.getFrameId("RightHandCOM")
    chain = Chain(model)
    fixed = np.tile(model.neutral(), (count, 1))
    fixed[:, 7:] = q[:, 7:]
    angles = q[:, 7 + chain.dof_indices]
    rows = np.ascontiguousarray(angles.T)
    columns = 6 + chain.dof_indices

    def body_loop() -> np.ndarray:
        out = np.empty((count, len(segments), 3))
        for row in range(count):
            pin.framesForwardKinematics(peer, data, q[row])
            for place, index in enumerate(segments):
                out[row, place] = data.oMf[index].translation
        return out

    def hand_loop() -> np.ndarray:
        out = np.empty((count, 6, chain.n))
        for row in range(count):
            jacobian = pin.computeFrameJacobian(
                peer, data, fixed[row], hand, pin.LOCAL_WORLD_ALIGNED
            )
            out[row] = jacobian[:, columns]
        return out

    def bare_loop() -> None:
        for row in range(count):
            pin.framesForwardKinematics(peer, data, q[row])

    body = np.max(np.abs(forward_kinematics(model, q).position - body_loop()))
    jacobian = np.max(np.abs(chain.jacobian(angles) - hand_loop()))
    last = np.max(np.abs(np.moveaxis(chain.sweep(rows)[2], -1, 0) - hand_loop()))
    return [
        Case(
            "whole body, positions read out",
            count,
            lambda: forward_kinematics(model, q),
            "a loop that reads them",
            body_loop,
            float(body),
            5.0,
        ),
        Case(
            "whole body",
            count,
            lambda: forward_kinematics(model, q),
            "the bare loop",
            bare_loop,
            float(body),
            1.2,
        ),
        Case(
            "right hand: pose and Jacobian",
            count,
            lambda: chain.forward_and_jacobian(angles),
            "a loop",
            hand_loop,
            float(jacobian),
            3.0,
        ),
        Case(
            "right hand, batch last",
            count,
            lambda: chain.sweep(rows),
            "a loop",
            hand_loop,
            float(last),
            3.0,
        ),
    ]


def dynamic_cases(model: HumanModel, rng: np.random.Generator) -> list[Case]:
    """Inverse dynamics: moving, standing still, and the upper body alone."""
    count = 4096
    peer = model.pinocchio()
    data = peer.createData()
    q = configurations(model, rng, count)
    v, a = rng.normal(size=(2, count, model.nv))
    still = np.zeros(model.nv)
    pool = pin.ModelPool(peer, 1)
    arrays = [np.asfortranarray(array.T) for array in (q, v, a)]
    joints = ("jL5S1", "jRightShoulder", "jRightElbow", "jRightWrist")

    def loop() -> np.ndarray:
        out = np.empty((count, model.nv))
        for row in range(count):
            out[row] = pin.rnea(peer, data, q[row], v[row], a[row])
        return out

    def still_loop() -> np.ndarray:
        out = np.empty((count, model.nv))
        for row in range(count):
            out[row] = pin.rnea(peer, data, q[row], still, still)
        return out

    expected = loop()
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    moving = np.max(np.abs(inverse_dynamics(model, q, v, a) - expected) / scale)
    expected = still_loop()
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    standing = np.max(np.abs(inverse_dynamics(model, q) - expected) / scale)
    upper = joint_loads(model, q, joints=joints)
    dofs = [6 + model.dof_names.index(name) for name in upper.dof_names]
    some = np.max(np.abs(upper.torque - expected[:, dofs]) / scale)
    return [
        Case(
            "inverse dynamics",
            count,
            lambda: inverse_dynamics(model, q, v, a),
            "pin.rnea in a loop",
            loop,
            float(moving),
            1.0,
        ),
        Case(
            "inverse dynamics",
            count,
            lambda: inverse_dynamics(model, q, v, a),
            "pin.rneaInParallel, one thread",
            lambda: pin.rneaInParallel(1, pool, *arrays),
            float(moving),
            1.0,
        ),
        Case(
            "standing still",
            count,
            lambda: inverse_dynamics(model, q),
            "pin.rnea in a loop",
            still_loop,
            float(standing),
            1.5,
        ),
        Case(
            "standing still, hand to L5S1",
            count,
            lambda: joint_loads(model, q, joints=joints),
            "pin.rnea in a loop",
            still_loop,
            float(some),
            1.5,
        ),
    ]


if __name__ == "__main__":
    raise SystemExit(main())
