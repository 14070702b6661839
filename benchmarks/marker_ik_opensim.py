"""OpenSim's inverse kinematics of one trial, timed; run by a Python that has OpenSim.

    python marker_ik_opensim.py FOLDER TRIAL

Run by path from `benchmarks.marker_ik`; imports nothing of ours. Prints one line of JSON: frames,
processor seconds, root mean square of the markers' residuals.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import opensim as osim


def main() -> None:
    """Fits the scaled model to the trial."""
    folder, trial = Path(sys.argv[1]), sys.argv[2]
    trc = folder / f"{trial}.trc"
    model = osim.Model(str(folder / "optimized_scale_and_markers.osim"))
    data = osim.MarkerData(str(trc))
    seen = {data.getMarkerNames().get(k) for k in range(data.getMarkerNames().size())}
    with tempfile.TemporaryDirectory() as scratch:
        tool = osim.InverseKinematicsTool()
        tool.setModel(model)
        tool.setMarkerDataFileName(str(trc))
        tool.setOutputMotionFileName(str(Path(scratch) / "ik.mot"))
        tool.setResultsDir(scratch)
        tool.set_report_errors(True)
        tool.setStartTime(0.0)
        tool.setEndTime(data.getLastFrameTime())
        tasks = osim.IKTaskSet()
        for marker in model.getMarkerSet():
            task = osim.IKMarkerTask()
            task.setName(marker.getName())
            task.setWeight(1.0)
            task.setApply(marker.getName() in seen)
            tasks.cloneAndAppend(task)
        tool.upd_IKTaskSet().assign(tasks)
        start = time.process_time()
        tool.run()
        seconds = time.process_time() - start
        (errors,) = Path(scratch).glob("*marker_errors.sto")
        rms = osim.TimeSeriesTable(str(errors)).getDependentColumn("marker_error_RMS").to_numpy()
    print(
        json.dumps(
            {
                "frames": len(rms),
                "seconds": seconds,
                "rms_m": float(np.sqrt(np.mean(rms**2))),
            }
        )
    )


if __name__ == "__main__":
    main()
