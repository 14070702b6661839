"""Weighs the person of a recording while they stand unloaded on the plates."""

from dataclasses import replace

import numpy as np

from estimation.feet.foot_force_record import FootForces
from estimation.map_estimator import estimate
from estimation.run.run_records import RunInputError
from estimation.run.run_sensors import foot_frames, foot_sensors
from estimation.stance_calibration import StanceCalibration, calibrate_stance
from estimation.tree import real_tree
from human import HumanModel, Motion

#: Frames nearer in time than this say the same, by smoothing and sway, s.
APART_S = 0.25


def tare_stance(
    model: HumanModel, motion: Motion, feet: FootForces | None, tare_s: tuple[float, float]
) -> StanceCalibration:
    """Weighs the person on the plates while they stand still and bear nothing.

    The standard deviation is that of frames a quarter of a second apart: nearer ones say the same.

    Args:
        model: the person.
        motion: a stretch with all of the window.
        feet: the wrenches under the feet at its frames.
        tare_s: start and end, s, on the motion's clock.

    Raises:
        RunInputError: no frame of the window has both feet's forces.
        MeasurementError: the person does not stand still.
    """
    inside = (motion.time_s >= tare_s[0]) & (motion.time_s <= tare_s[1])
    known = foot_frames(feet, len(motion), model.total_mass_kg)
    # Where the model is far too heavy it looks as if something bore the person; a tare tells.
    rows = np.flatnonzero(inside & np.all(known.usable, axis=1))
    if feet is None or len(rows) < 2:
        raise RunInputError(
            f"tare from {tare_s[0]:g} to {tare_s[1]:g} s: expected frames in which plates bear "
            f"both feet, got {len(rows)}; choose another stretch, or run without a tare"
        )
    sensors = foot_sensors(feet.select(rows), known.usable[rows], motion.q[rows, :3])
    found = estimate(
        real_tree(model),
        motion.q[rows],
        motion.v[rows],
        motion.a[rows],
        sensors,
        method="deterministic",
    )
    weighed = calibrate_stance(found)
    lasted = float(motion.time_s[rows[-1]] - motion.time_s[rows[0]])
    alike = max(1.0, len(rows) / max(1.0, lasted / APART_S))
    return replace(weighed, sd_kg=weighed.sd_kg * float(np.sqrt(alike)))
