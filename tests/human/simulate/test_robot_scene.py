import numpy as np
import pinocchio as pin
import pytest

from human import Subject, generate_model
from human.simulate import SimulationError, operator, robot_trajectories, simulate_following


@pytest.mark.parametrize(
    ("subject", "kind", "hand"),
    [
        (Subject(1.75, 70.0, "male"), "average", "right"),
        (Subject(1.52, 48.0, "female"), "stooper", "left"),
    ],
)
def test_every_candidate_can_be_followed_from_the_start_posture(subject, kind, hand):
    model = generate_model(subject)
    one = operator(kind, np.random.default_rng(0), model)
    scene = robot_trajectories(model, one, np.random.default_rng(1), count=9, hand=hand)
    data = model.pinocchio().createData()
    pin.framesForwardKinematics(model.pinocchio(), data, scene.q_start)
    grip = data.oMf[model.pinocchio().getFrameId(f"{hand.capitalize()}HandCOM")]
    assert len({t.id for t in scene.trajectories}) == 9
    for candidate in scene.trajectories:
        first = candidate.path().sample([0.0])
        np.testing.assert_allclose(first.position[0], grip.translation, atol=1e-9)
        np.testing.assert_allclose(first.rotation[0], grip.rotation, atol=1e-9)
        np.testing.assert_allclose(
            candidate.position_m[-1], scene.trajectories[0].position_m[-1], atol=1e-9
        )
        led = simulate_following(
            model,
            one,
            candidate.path(),
            np.random.default_rng(2),
            hand=hand,
            q_start=scene.q_start,
            rate_hz=15,
        )
        np.testing.assert_allclose(led.motion.q[0], scene.q_start, atol=1e-9)


def test_candidates_differ_as_they_say(person, average):
    scene = robot_trajectories(person, average, np.random.default_rng(0), count=8)
    height = {t.id: t.position_m[:, 2].max() for t in scene.trajectories}
    depth = {t.id: t.position_m[:, 2].min() for t in scene.trajectories}
    reach = {t.id: t.position_m[:, 0].max() for t in scene.trajectories}
    back = {t.id: t.position_m[:, 0].min() for t in scene.trajectories}
    assert max(height, key=height.__getitem__) == "overhead"
    assert min(depth, key=depth.__getitem__) == "low-front"
    assert max(reach, key=reach.__getitem__) == "far"
    assert min(back, key=back.__getitem__) == "twist"


def test_impossible_settings_are_refused(person, average):
    with pytest.raises(SimulationError, match="count >= 1"):
        robot_trajectories(person, average, np.random.default_rng(0), count=0)
