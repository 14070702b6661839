"""2021, Fig. 3: effort of shoulder, elbow and wrist in the ideal T-pose, 0 and 5 kg."""

import numpy as np

from benchmarks.estimation.papers.reports import Report, Table
from benchmarks.estimation.papers.scenes import TPOSE_KG, Scenes
from estimation import (
    Accelerometer,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    estimate,
    payload,
    real_tree,
)
from human import HumanModel, Wrench, from_urdf, inverse_dynamics

JOINTS = ("jRightShoulder", "jRightElbow", "jRightWrist")
FILE = "humanSubject03_66dof.urdf"
#: Of the published model of subject 3 (75.4 kg), by its own inverse dynamics, N m.
PUBLISHED = {0.0: (12.94, 3.46, 0.43), TPOSE_KG: (45.57, 20.76, 5.15)}


def experiment(scenes: Scenes) -> Report:
    """Computes the efforts of the published model if it is at hand, and of a generated person."""
    models = [("generated, 1.80 m, 75.4 kg", scenes.model, False)]
    notes = [f"for the published subject pass --urdf with the folder that holds {FILE}"]
    if scenes.urdf is not None:
        path = scenes.urdf / FILE
        if not path.is_file():
            raise SystemExit(f"--urdf {scenes.urdf}: expected {FILE} in it; it is not there")
        models.insert(0, ("IIT subject 3", from_urdf(path.read_text()), True))
        notes = []
    rows: list[tuple[object, ...]] = []
    for name, model, published in models:
        for load_kg, paper in PUBLISHED.items():
            static = tpose_efforts(model, load_kg)
            found, mass_kg = _estimated(model, load_kg)
            for joint, number, ideal, estimated in zip(JOINTS, paper, static, found, strict=True):
                off = max(abs(ideal - number), abs(estimated - number))
                good = off <= 0.01 if published else None
                rows.append((name, load_kg, joint, number, ideal, estimated, good))
                name = ""
            rows.append(("", load_kg, "payload, kg", load_kg, "", mass_kg, None))
    table = Table(
        "Effort in the ideal T-pose, N m; the load at RightHandCOM (reproduced to 0.01)",
        ("model", "load, kg", "joint", "published", "inverse dynamics", "estimated", ""),
        rows,
    )
    return Report("2021 Fig. 3: baseline efforts of the T-pose", (table,), {}, notes)


def tpose_efforts(model: HumanModel, load_kg: float) -> tuple[float, ...]:
    """Returns shoulder, elbow and wrist effort at rest in the ideal T-pose, N m."""
    load = Wrench("RightHandCOM", (0.0, 0.0, -9.81 * load_kg))
    torque = inverse_dynamics(model, model.neutral(), wrenches=[load])[6:]
    return _efforts(model, torque)


def _efforts(model: HumanModel, torque: np.ndarray) -> tuple[float, ...]:
    dofs = [[model.dof_names.index(f"{joint}_rot{axis}") for axis in "xyz"] for joint in JOINTS]
    return tuple(float(np.linalg.norm(torque[three])) for three in dofs)


def _estimated(model: HumanModel, load_kg: float) -> tuple[tuple[float, ...], float]:
    """Efforts and load from what a plate under the person reads, N m and kg."""
    q = model.neutral()[None]
    load = Wrench("RightHandCOM", (0.0, 0.0, -9.81 * load_kg))
    plate = inverse_dynamics(model, q, wrenches=[load])[:, :6]
    still = np.zeros((1, model.nv))
    known = 1e-6
    sensors: list[Measurement] = [
        ForceTorque("RightFoot", plate, known, fixed_to="world"),
        FreeWrench("RightHandCOM"),
        Accelerometer("Pelvis", np.array([[0.0, 0.0, 9.81]]), known),
        JointAcceleration(np.zeros((1, model.n_dof)), known),
    ]
    found = estimate(real_tree(model), q, still, still, sensors)
    return _efforts(model, found.torque[0]), float(payload(found).mass_kg[0])
