"""A body in motion from markers: what training and scoring work on."""

import numpy as np
import pytest

from app.fitting import _stretches, body_in_motion
from app.takes import takes_of
from app.training import motions_of
from human import Motion, generate_model
from tests.app.estimates.lifting import PERSON, Lifting


def test_motions_to_train_on_come_from_markers(lifting: Lifting) -> None:
    takes = takes_of([f"static:{lifting.static}", str(lifting.motion)])
    recorded = motions_of(takes, PERSON)
    model, (motion,) = recorded.model, recorded.motions
    true = lifting.truth.motion
    elbow = model.dof_names.index("jRightElbow_rotz")
    error = motion.joint_angles[:, elbow] - true.joint_angles[:, elbow]
    assert np.max(np.abs(error)) < np.deg2rad(5.0)
    assert all(note.startswith("lift.trc: ") for note in recorded.notes)
    assert [source.name for source in recorded.sources] == ["lift.trc"]


def test_windows_are_the_whole(lifting: Lifting) -> None:
    (take,) = takes_of([str(lifting.motion)])
    whole = body_in_motion(take, PERSON).whole()
    parts = list(body_in_motion(take, PERSON, window_s=2.0).windows())
    assert len(parts) > 2
    np.testing.assert_allclose(np.concatenate([one.q for one in parts]), whole.q, atol=1e-8)
    np.testing.assert_allclose(np.concatenate([one.a for one in parts]), whole.a, atol=1e-5)


@pytest.mark.parametrize("start_s", [0.0, 0.3, 13.07, 41.943])
def test_every_frame_is_in_one_stretch_wherever_the_clock_starts(start_s: float) -> None:
    """The ends of stretches fall on frames, where rounding decides."""
    model = generate_model(PERSON)
    time_s = start_s + np.arange(3000) / 100.0
    still = np.zeros((len(time_s), model.nv))
    motion = Motion(
        model.dof_names, time_s, np.tile(model.neutral(), (len(time_s), 1)), still, still
    )
    for length_s in (0.1, 0.7, 6.0):
        parts = list(_stretches(motion, length_s))
        assert np.array_equal(np.concatenate([part.time_s for part in parts]), time_s)
        assert all(part.duration_s < length_s for part in parts)
