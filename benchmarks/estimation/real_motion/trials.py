"""The trials that are compared: which files, which person, which kind of motion."""

import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.estimation.real_motion.dynamics_driver import dynamics_alone
from benchmarks.estimation.real_motion.opensim_reference import opensim_arrays, reference
from benchmarks.estimation.real_motion.reference import Estimated, Reference
from benchmarks.estimation.real_motion.user_driver import UserRun, user_path
from benchmarks.estimation.real_motion.vicon_reference import vicon_reference
from human import Subject
from human.readers import plate_forces, read_c3d, read_opensim_table, read_trc

#: Trials of `opencap_subject4` and what they are; sitting down has no bars: the chair is not
#: measured.
OPENCAP = {"squats1": "squats", "walking1": "gait", "STS1": "sitting down and standing up"}
#: The recordings do not state it; the neck's base is at 1.46 m, 0.86 of this.
_OPENCAP_HEIGHT_M = 1.70
#: As `ktk_walk`'s file states (PROCESSING).
_KTK = Subject(height_m=1.639, mass_kg=73.4)


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial with everything that was made of it.

    Attributes:
        kind: of motion, which decides the bars.
        theirs: the reference.
        ours: what each driver found.
        user: the user's run of driver B.
    """

    kind: str
    theirs: Reference
    ours: tuple[Estimated, ...]
    user: UserRun


def opencap_trials(data: Path, python: str | None) -> Iterator[Trial]:
    """Yields the trials with OpenSim's answer.

    Args:
        data: the folder of recordings.
        python: a Python that has OpenSim, needed once.

    Raises:
        RuntimeError: OpenSim is needed and not there.
    """
    folder = data / "opencap_subject4"
    standing = opensim_arrays(folder, "static1", python)
    static = read_trc(folder / "static1.trc")
    weighed = plate_forces(read_opensim_table(folder / "static1_grf.mot")).supported_mass_kg()
    assert weighed is not None
    subject = Subject(_OPENCAP_HEIGHT_M, weighed)
    for trial, kind in OPENCAP.items():
        arrays = opensim_arrays(folder, trial, python)
        plates = plate_forces(read_opensim_table(folder / f"{trial}_grf.mot"))
        user = user_path(static, read_trc(folder / f"{trial}.trc"), plates, subject)
        dynamics = dynamics_alone(arrays, standing, _OPENCAP_HEIGHT_M)
        yield Trial(kind, reference(arrays, trial), (dynamics, user.found), user)


def vicon_trial(data: Path) -> Trial:
    """Returns the gait trial with Vicon's answer; without a standing one it measures itself.

    Args:
        data: the folder of recordings.
    """
    with (
        tempfile.TemporaryDirectory() as folder,
        zipfile.ZipFile(data / "ktk_walk" / "walk.c3d.zip") as archive,
    ):
        path = Path(archive.extract("walk.c3d", folder))
        read = read_c3d(path)
        assert read.plates is not None
        user = user_path(read, read, read.plates, _KTK)
        return Trial("gait", vicon_reference(path), (user.found,), user)
