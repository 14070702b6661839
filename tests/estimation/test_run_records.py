import numpy as np
import pytest

from estimation import MeasurementError, ModelErrors, RunSettings, RunSettingsError


@pytest.mark.parametrize(
    ("setting", "error"),
    [
        ({"loaded_kg": 0.0}, RunSettingsError),
        ({"hand_force_sd_n": np.inf}, RunSettingsError),
        ({"tare_s": (2.0, 1.0)}, RunSettingsError),
    ],
)
def test_settings_that_make_no_sense_are_refused(setting, error):
    with pytest.raises(error, match=next(iter(setting))):
        RunSettings(**setting)
    with pytest.raises(MeasurementError, match="segment_mass"):
        ModelErrors(segment_mass=5.0)
