"""The estimator against the same problem written down whole, against itself, and turned around.

Part of ``python -m benchmarks.estimation.core``. The dense solution is the tests': a stack of
whitened rows, solved by QR, and the inverse of its normal matrix.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.estimation.moving_scene import Scene
from benchmarks.figure import Figure
from estimation import (
    APPLICATION,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    Measurement,
    ModelCovariances,
    estimate,
    hinge_tree,
    real_tree,
)
from estimation.problem import assemble
from estimation.tree_kinematics import tree_kinematics
from human import HumanModel
from human.rotations import quaternion_multiply, quaternion_to_matrix, rotation_vector_to_quaternion
from tests.estimation.dense_reference import solve

#: A dense solution takes a tenth of a second.
DENSE_FRAMES = range(0, 256, 16)
PAPER = {"Accelerometer": 1.1e-3, "JointAcceleration": 6.66e-6, "ForceTorque": 1e-6}


def agreement(model: HumanModel, scene: Scene) -> Iterator[Figure]:
    """Largest differences from what must come out the same."""
    tree = real_tree(model)
    hands = [FreeWrench("RightHandCOM"), FreeWrench("LeftHandCOM")]
    sensors = [s for s in scene.sensors if not isinstance(s, FreeWrench)] + hands
    yield from dense(tree, scene, sensors)
    yield Figure("real links and 67, carried over: torques", trees(model, scene), "N m", most=1e-5)
    yield Figure("whole scene turned about z: torques", turned(tree, scene), "N m", most=1e-9)


def dense(tree: EstimationTree, scene: Scene, sensors: list[Measurement]) -> Iterator[Figure]:
    """Both hands free, default covariances."""
    found = estimate(tree, scene.q, scene.v, scene.a, sensors)
    problem = assemble(
        tree, tree_kinematics(tree, scene.q, scene.v), sensors, ModelCovariances(), len(scene.q)
    )
    assert found.torque_sd is not None
    assert found.external_wrench_sd is not None
    assert found.site_covariance is not None
    sites = [tree.link_names.index(name) for name in found.sites]
    off = dict.fromkeys(("d", "torque", "sd", "cross"), 0.0)
    for frame in DENSE_FRAMES:
        whole = solve(problem, frame)

        def differ(kind: str, apart: np.ndarray) -> None:
            off[kind] = max(off[kind], float(np.abs(apart).max()))

        for link in range(tree.n_links):
            for kind, value in (
                ("a", found.link_acceleration[frame, link]),
                ("fx", found.external_wrench[frame, link]),
            ):
                differ("d", value - whole.mean[whole.where[kind, link]])
            part = whole.where["fx", link]
            true = np.sqrt(np.diagonal(whole.covariance[part, part]))
            differ("sd", found.external_wrench_sd[frame, link] / true - 1.0)
        for link in range(1, tree.n_links):
            part, dofs = whole.where["fj", link], tree.dofs[link]
            differ("d", found.joint_wrench[frame, link - 1] - whole.mean[part])
            H = problem.kinematics.H[link][frame]
            if len(dofs):
                differ("torque", found.torque[frame, dofs] - H.T @ whole.mean[part])
                true = np.sqrt(np.diagonal(H.T @ whole.covariance[part, part] @ H))
                differ("sd", found.torque_sd[frame, dofs] / true - 1.0)
        index = np.concatenate([np.r_[whole.where["fx", link]] for link in sites])
        true = whole.covariance[np.ix_(index, index)]
        scale = np.sqrt(np.diagonal(true))
        differ("cross", (found.site_covariance[frame] - true) / np.outer(scale, scale))
    yield Figure("dense QR: every unknown", off["d"], "SI", most=1e-6)
    yield Figure("dense QR: torques", off["torque"], "N m", most=1e-6)
    yield Figure("dense inverse: standard deviations", off["sd"], "relative", most=1e-6)
    yield Figure("dense inverse: covariance of the hands", off["cross"], "relative", most=1e-6)


def trees(model: HumanModel, scene: Scene) -> float:
    """The papers' covariances on both trees, the load measured."""
    sensors: list[Measurement] = [
        replace(s, covariance=PAPER[type(s).__name__])
        for s in scene.sensors
        if not isinstance(s, FreeWrench)
    ]
    tree = real_tree(model)
    held = estimate(tree, scene.q, scene.v, scene.a, scene.sensors)
    wrench = held.external_wrench[:, held.link("RightHandCOM")]
    sensors.append(ForceTorque("RightHandCOM", wrench, 1e-6))
    model_covariances = APPLICATION.covariances
    papers = estimate(
        hinge_tree(model), scene.q, scene.v, scene.a, sensors, covariances=model_covariances
    )
    carried = replace(model_covariances, joint_wrench_prior=float("inf"), carried_from_hinges=True)
    real = estimate(tree, scene.q, scene.v, scene.a, sensors, covariances=carried)
    return float(np.abs(real.torque - papers.torque).max())


def turned(tree: EstimationTree, scene: Scene) -> float:
    """Person and plates walked around the vertical axis by 2.2 rad."""
    turn = rotation_vector_to_quaternion(np.array([0.0, 0.0, 2.2]))
    R, q = quaternion_to_matrix(turn), scene.q.copy()
    q[:, :3] = q[:, :3] @ R.T
    q[:, 3:7] = quaternion_multiply(turn, q[:, 3:7])
    kinematics = tree_kinematics(tree, scene.q, scene.v)

    def on_plates(axes: np.ndarray) -> list[Measurement]:
        out: list[Measurement] = []
        for sensor in scene.sensors:
            if isinstance(sensor, ForceTorque):
                link = tree.link_names.index(sensor.link)
                world, value = kinematics.rotation[link], np.asarray(sensor.value)
                force = np.einsum("fij,fj->fi", world, value[:, :3])
                moment = np.einsum("fij,fj->fi", world, value[:, 3:])
                moment = moment + np.cross(kinematics.position[link], force)
                both = np.concatenate([force, moment], axis=1)
                sensor = replace(sensor, value=both, rotation=axes, fixed_to="world")
            out.append(sensor)
        return out

    before = estimate(tree, scene.q, scene.v, scene.a, on_plates(np.eye(3)))
    after = estimate(tree, q, scene.v, scene.a, on_plates(R))
    return float(np.abs(after.torque - before.torque).max())
