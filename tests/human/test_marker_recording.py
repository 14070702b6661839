"""Markers and plates as read: what the records refuse."""

import numpy as np
import pytest

from human.errors import RecordingError
from human.marker_recording import ForcePlate, PlateForces
from human.recording import ReadingReport


@pytest.mark.parametrize("times", [[0.0, 0.1, 0.1], [0.0, 0.2, 0.1], [0.0, np.nan, 0.1]])
def test_a_clock_that_stands_or_goes_back_is_refused(times: list[float]) -> None:
    plate = ForcePlate("1", np.zeros(3), 0.0)
    with pytest.raises(RecordingError, match=r"plates, sample [12]: expected times that increase"):
        PlateForces(
            np.array(times), (plate,), np.zeros((3, 1, 3)), np.zeros((3, 1, 3)), ReadingReport()
        )
