"""Contacts of a real person's feet, by their markers, held to the plates under them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter

from estimation import ROLLING_GAIT, ContactDetector, FootMotion

#: Heel, fifth metatarsal and toe markers of the right and of the left shoe.
MARKERS = (("r_calc", "r_5meta", "r_toe"), ("L_calc", "L_5meta", "L_toe"))
#: A foot that bears more than this, N, is down.
LOADED_N = 20.0


def markers(path: Path) -> tuple[np.ndarray, FootMotion]:
    """Times, and height, speed and acceleration of the shoe markers (y is up)."""
    lines = path.read_text().splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name.strip()]
    cells = [line.split("\t")[: 2 + 3 * len(names)] for line in lines[5:] if line.strip()]
    table = np.array([[float(cell or "nan") for cell in row] for row in cells])
    places = [[2 + 3 * names.index(name) for name in foot] for foot in MARKERS]
    at = np.array([[table[:, k : k + 3] for k in foot] for foot in places])
    step = float(np.mean(np.diff(table[:, 1])))
    speed, acceleration = (
        np.linalg.norm(savgol_filter(at, 7, 3, deriv=order, delta=step, axis=2), axis=-1)
        for order in (1, 2)
    )
    height = at[..., 1] - at[..., 1].min(axis=2, keepdims=True)
    return table[:, 1], FootMotion(*(np.moveaxis(x, 2, 0) for x in (height, speed, acceleration)))


def forces(path: Path, time_s: np.ndarray) -> np.ndarray:
    """Vertical force under the right and the left foot at some times."""
    lines = path.read_text().splitlines()
    start = [line.strip() for line in lines].index("endheader") + 1
    names = lines[start].split("\t")
    table = np.array([line.split("\t") for line in lines[start + 1 :] if line.strip()], dtype=float)
    columns = [names.index(f"ground_force_{plate}_vy") for plate in (1, 2)]
    return np.stack([np.interp(time_s, table[:, 0], table[:, k]) for k in columns], axis=-1)


@pytest.fixture(scope="module")
def folder(recordings_dir: Path) -> Path:
    return recordings_dir / "opencap_subject4"


@pytest.mark.parametrize("trial", ["squats1", "static1"])
def test_standing_and_squatting_feet_are_down_throughout(folder, trial):
    time_s, feet = markers(folder / f"{trial}.trc")
    force = forces(folder / f"{trial}_grf.mot", time_s)
    assert np.all(ContactDetector().classify(feet=feet).feet)
    assert np.all(ContactDetector(9.81 * 60.0).classify(vertical_n=force).feet)


@pytest.mark.parametrize("with_force", [False, True], ids=["markers alone", "with force"])
def test_walking_feet_are_down_when_the_plates_say_so(folder, with_force):
    time_s, feet = markers(folder / "walking1.trc")
    force = forces(folder / "walking1_grf.mot", time_s)
    # Until then the left foot pushes off beside its plate.
    known = time_s >= time_s[0] + 0.12
    loaded = force > LOADED_N
    if with_force:
        found = ContactDetector(9.81 * 60.0).classify(feet=feet, vertical_n=force)
    else:
        found = ContactDetector(thresholds=ROLLING_GAIT).classify(feet=feet)
    assert (found.feet == loaded)[known].mean() >= (0.99 if with_force else 0.97)
    for foot in range(2):
        true, seen = (np.diff(x[known, foot].astype(int)) for x in (loaded, found.feet))
        assert np.count_nonzero(true) == np.count_nonzero(seen)
        for at in np.flatnonzero(true):
            same = np.flatnonzero(seen == true[at])
            assert np.abs(time_s[known][same] - time_s[known][at]).min() <= 0.04
