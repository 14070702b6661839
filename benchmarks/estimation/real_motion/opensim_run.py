"""OpenSim's inverse kinematics and inverse dynamics of one trial; run by a Python that has OpenSim.

    python opensim_run.py FOLDER TRIAL OUT.npz

OpenSim is no dependency of Ergocast, so this file is run by path in an environment of its own
(`pip install opensim`) and imports nothing of ours. Joint angles and plate forces pass the same
low-pass filter. Everything it leaves is in OpenSim's ground axes (x forward, y up, z right).
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import opensim as osim

CUTOFF_HZ = 6.0
#: Plate of the file and the body that it presses on.
PLATES = (("1", "calcn_r"), ("2", "calcn_l"))
#: Our name, OpenSim's joint and the coordinate whose generalised force is kept for the check.
JOINTS = (
    ("hip_r", "hip_flexion_r"), ("walker_knee_r", "knee_angle_r"), ("ankle_r", "ankle_angle_r"),
    ("hip_l", "hip_flexion_l"), ("walker_knee_l", "knee_angle_l"), ("ankle_l", "ankle_angle_l"),
    ("back", "lumbar_extension"),
)  # fmt: skip


def inverse_kinematics(model: Any, trc: Path, folder: Path) -> Path:
    """Fits the model's markers, all weighted alike."""
    tool = osim.InverseKinematicsTool()
    tool.setModel(model)
    tool.setMarkerDataFileName(str(trc))
    out = folder / "ik.mot"
    tool.setOutputMotionFileName(str(out))
    tool.setResultsDir(str(folder))
    tool.set_report_errors(False)
    # Without this the tool stops after two seconds.
    last = osim.MarkerData(str(trc)).getLastFrameTime()
    tool.setStartTime(0.0)
    tool.setEndTime(last)
    tasks = osim.IKTaskSet()
    for marker in model.getMarkerSet():
        task = osim.IKMarkerTask()
        task.setName(marker.getName())
        task.setWeight(1.0)
        task.setApply(True)
        tasks.cloneAndAppend(task)
    tool.upd_IKTaskSet().assign(tasks)
    tool.run()
    return out


def filtered(table: Any) -> Any:
    """Low-pass filters every column, forwards and back; the padding is cut off again."""
    time = table.getIndependentColumn()
    first, last = time[0], time[-1]
    osim.TableUtilities.filterLowpass(table, CUTOFF_HZ, True)
    table.trim(first - 1e-6, last + 1e-6)
    return table


def columns_of(table: Any, labels: list[str]) -> Any:
    """Returns some columns of a table, ``(rows, columns)``."""
    return np.stack([table.getDependentColumn(label).to_numpy() for label in labels], axis=1)


def plate_table(path: Path, folder: Path) -> Path:
    """Writes the plates with force and moment filtered, the moment about the ground's origin."""
    table = osim.TimeSeriesTable(str(path))
    time = np.array(table.getIndependentColumn())
    out = osim.TimeSeriesTable()
    columns: dict[str, Any] = {}
    for plate, _ in PLATES:
        names = {kind: [f"ground_force_{plate}_{kind}{a}" for a in "xyz"] for kind in "vpm"}
        get = {kind: columns_of(table, labels) for kind, labels in names.items()}
        for kind in "pm":
            get[kind] = np.nan_to_num(get[kind])
        moment = get["m"] + np.cross(get["p"], get["v"])
        for k, axis in enumerate("xyz"):
            columns[f"plate{plate}_v{axis}"] = get["v"][:, k]
            columns[f"plate{plate}_m{axis}"] = moment[:, k]
    values = np.stack(list(columns.values()), axis=1)
    out.setColumnLabels(list(columns))
    for row, t in zip(values, time, strict=True):
        out.appendRow(float(t), osim.RowVector(row))
    filtered(out)
    for plate, _ in PLATES:
        for axis in "xyz":
            out.appendColumn(f"plate{plate}_p{axis}", osim.Vector(out.getNumRows(), 0.0))
    out.addTableMetaDataString("inDegrees", "no")
    written = folder / "plates.sto"
    osim.STOFileAdapter.write(out, str(written))
    return written


def external_loads(plates: Path, folder: Path) -> Path:
    """Says which plate presses on which foot."""
    loads = osim.ExternalLoads()
    loads.setDataFileName(str(plates))
    for plate, body in PLATES:
        force = osim.ExternalForce()
        force.setName(f"plate{plate}")
        force.set_applied_to_body(body)
        force.set_force_expressed_in_body("ground")
        force.set_point_expressed_in_body("ground")
        force.set_force_identifier(f"plate{plate}_v")
        force.set_point_identifier(f"plate{plate}_p")
        force.set_torque_identifier(f"plate{plate}_m")
        loads.cloneAndAppend(force)
    written = folder / "loads.xml"
    loads.printToXML(str(written))
    return written


def inverse_dynamics(model: Any, motion: Path, loads: Path, folder: Path, span: Any) -> Any:
    """Returns the table of generalised forces."""
    tool = osim.InverseDynamicsTool()
    tool.setModel(model)
    tool.setCoordinatesFileName(str(motion))
    tool.setExternalLoadsFileName(str(loads))
    tool.setStartTime(float(span[0]))
    tool.setEndTime(float(span[1]))
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("id.sto")
    excluded = osim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.run()
    return osim.TimeSeriesTable(str(folder / "id.sto"))


def numpy_of(vector: Any) -> Any:
    """A Vec3 as an array."""
    return np.array([vector.get(k) for k in range(3)])


def bodies_over_time(model: Any, motion: Path) -> dict[str, Any]:
    """Returns where each body and joint is at each time, with masses and inertias."""
    state = model.initSystem()
    table = osim.TimeSeriesTable(str(motion))
    labels = list(table.getColumnLabels())
    time = np.array(table.getIndependentColumn())
    values = columns_of(table, labels)
    coordinates = [model.getCoordinateSet().get(n) for n in labels]
    rotation = [c.getMotionType() == 1 for c in coordinates]
    degrees = table.getTableMetaDataAsString("inDegrees") == "yes"
    bodies = [model.getBodySet().get(k) for k in range(model.getBodySet().getSize())]
    joints = [model.getJointSet().get(name) for name, _ in JOINTS]
    turn = np.empty((len(time), len(bodies), 3, 3))
    place = np.empty((len(time), len(bodies), 3))
    center = np.empty((len(time), len(joints), 3))
    for row in range(len(time)):
        for k, coordinate in enumerate(coordinates):
            value = values[row, k] * (np.pi / 180.0 if degrees and rotation[k] else 1.0)
            coordinate.setValue(state, float(value), False)
        model.realizePosition(state)
        for k, body in enumerate(bodies):
            transform = body.getTransformInGround(state)
            place[row, k] = numpy_of(transform.p())
            matrix = transform.R()
            turn[row, k] = [[matrix.get(i, j) for j in range(3)] for i in range(3)]
        for k, joint in enumerate(joints):
            center[row, k] = numpy_of(joint.getChildFrame().getPositionInGround(state))
    inertia = []
    for body in bodies:
        moments, products = body.getInertia().getMoments(), body.getInertia().getProducts()
        xy, xz, yz = numpy_of(products)
        off = np.array([[0, xy, xz], [xy, 0, yz], [xz, yz, 0]])
        inertia.append(np.diag(numpy_of(moments)) + off)
    parents = {}
    for k in range(model.getJointSet().getSize()):
        joint = model.getJointSet().get(k)
        child, parent = joint.getChildFrame(), joint.getParentFrame()
        parents[child.findBaseFrame().getName()] = parent.findBaseFrame().getName()
    names = [body.getName() for body in bodies]
    return {
        "time": time, "body_names": names, "turn": turn, "place": place,
        "parent": [names.index(parents[n]) if parents[n] in names else -1 for n in names],
        "mass": [body.getMass() for body in bodies],
        "com": [numpy_of(body.getMassCenter()) for body in bodies], "inertia": inertia,
        "joint_names": [name for name, _ in JOINTS], "center": center,
        "child": [names.index(j.getChildFrame().findBaseFrame().getName()) for j in joints],
    }  # fmt: skip


def main(data: Path, trial: str, out: Path) -> None:
    """Runs one trial and writes an npz file."""
    model = osim.Model(str(data / "optimized_scale_and_markers.osim"))
    model.initSystem()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        raw = inverse_kinematics(model, data / f"{trial}.trc", folder)
        table = osim.TimeSeriesTable(str(raw))
        filtered(table)
        motion = folder / "filtered.sto"
        osim.STOFileAdapter.write(table, str(motion))
        plates = plate_table(data / f"{trial}_grf.mot", folder)
        result = bodies_over_time(model, motion)
        loads = external_loads(plates, folder)
        time = result["time"]
        forces = inverse_dynamics(model, motion, loads, folder, (time[0], time[-1]))
        labels = list(forces.getColumnLabels())
        result["id_time"] = np.array(forces.getIndependentColumn())
        for _, coordinate in JOINTS:
            label = next(n for n in labels if n == f"{coordinate}_moment")
            result[f"id_{coordinate}"] = forces.getDependentColumn(label).to_numpy()
        pressed = osim.TimeSeriesTable(str(plates))
        result["plate_time"] = np.array(pressed.getIndependentColumn())
        result["plate_wrench"] = np.stack(
            [
                columns_of(pressed, [f"plate{p}_{k}{a}" for k in "vm" for a in "xyz"])
                for p, _ in PLATES
            ],
            axis=1,
        )
    np.savez(out, **{name: np.asarray(value) for name, value in result.items()})


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
