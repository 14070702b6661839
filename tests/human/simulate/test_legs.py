import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from human import Subject, generate_model
from human.simulate import SimulationError
from human.simulate.legs import legs_of
from human.simulate.paths import PoseSamples
from human.simulate.stance import Stance, standing_height


def _poses(position, rotation):
    position = np.atleast_2d(position)
    zero = np.zeros_like(position)
    return PoseSamples(position, np.broadcast_to(rotation, (len(position), 3, 3)), zero, zero)


@pytest.mark.parametrize("subject", [Subject(1.55, 50, "female"), Subject(1.95, 110, "male")])
@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
def test_feet_are_where_they_were_told_to_the_last_digits(subject, heading):
    model = generate_model(subject)
    legs, stance = legs_of(model), Stance(0.3, -0.2, heading)
    rng = np.random.default_rng(0)
    T = 30
    height = standing_height(legs) * rng.uniform(0.75, 0.95, T)
    sway = rng.normal(scale=0.03, size=(T, 2))
    position = np.column_stack((stance.origin[:2] + sway, height))
    angles = rng.normal(size=(T, 3)) * [0.2, 0.3, 0.1]
    rotation = stance.rotation @ Rotation.from_euler("zyx", angles).as_matrix()
    q = np.zeros((T, 73))
    q[:, :3], q[:, 3:7] = position, Rotation.from_matrix(rotation).as_quat()
    for leg in legs:
        foot = _poses(np.tile(stance.ankle(leg), (T, 1)), stance.rotation)
        found = leg.angles(_poses(position, rotation), foot)
        q[:, 7 + leg.dof] = found
        assert np.all(found[:, 4] > 0.0), "knees bend backwards only"
    data = model.pinocchio().createData()
    for row in q:
        pin.framesForwardKinematics(model.pinocchio(), data, row)
        for leg in legs:
            placed = data.oMf[model.pinocchio().getFrameId(f"{leg.side}Foot")]
            np.testing.assert_allclose(placed.translation, stance.ankle(leg), atol=1e-12)
            np.testing.assert_allclose(placed.rotation, stance.rotation, atol=1e-12)


def test_a_foot_out_of_reach_is_refused_with_numbers(person):
    leg = legs_of(person)[0]
    with pytest.raises(SimulationError, match=r"Right foot: sample 0 is 1\.\d+ m from the hip"):
        leg.angles(_poses([0, 0, 2.0], np.eye(3)), _poses([0, -0.1, 0.1], np.eye(3)))
