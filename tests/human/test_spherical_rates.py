import numpy as np
import pytest

from human.differentiate import LocalCubic, motion_from_configurations
from human.names import DOF_NAMES
from human.rotations import matrix_to_xyz, rotation_vector_to_matrix, xyz_to_matrix
from human.spherical_rates import spherical_rates

TIME = np.arange(120) / 100.0


def passing_the_pole(miss_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """A joint turning steadily past 90 degrees of its middle axis; angles, velocity in the child.

    Later the angles jump to the other triple of the same rotation.
    """
    turn = np.array([0.0, -2.0, 0.0])
    first = xyz_to_matrix([miss_rad, -0.4, 0.1])
    rotation = rotation_vector_to_matrix(turn * TIME[:, None]) @ first
    angles = matrix_to_xyz(rotation)
    other = np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=-1)
    angles[80:] = other[80:] - 2 * np.pi * np.round(other[80:] / (2 * np.pi))
    angles[:80] = np.unwrap(angles[:80], axis=0)
    return angles, first.T @ turn


def angular_velocity(angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """By differences of the rotation that the rates carry on."""
    step = 1e-6
    ahead, behind = xyz_to_matrix(angles + step * rates), xyz_to_matrix(angles - step * rates)
    turned = behind.swapaxes(-1, -2) @ ahead
    return np.stack([turned[..., 2, 1], turned[..., 0, 2], turned[..., 1, 0]], axis=-1) / (2 * step)


@pytest.mark.parametrize(("miss_deg", "error"), [(3.0, 0.1), (10.0, 0.01)])
def test_rates_make_the_velocity_of_the_limb_wherever_the_angles_jump(
    miss_deg: float, error: float
) -> None:
    angles, omega = passing_the_pole(np.deg2rad(miss_deg))
    cubic = LocalCubic(TIME, window_s=0.2)
    own = cubic.derivatives(angles)
    frames, rates, accelerations = spherical_rates(cubic, angles, own.first, own.second)
    assert 0 < len(frames) < len(TIME)
    ours = angular_velocity(angles[frames], rates)
    theirs = angular_velocity(angles, own.first)
    assert np.max(np.abs(theirs - omega)) > 10.0
    assert np.max(np.abs(ours - omega)) < error
    # The velocity is steady: carried on by rates and accelerations it stays what it is.
    step = 1e-5
    later = angular_velocity(
        angles[frames] + step * rates + 0.5 * step**2 * accelerations, rates + step * accelerations
    )
    assert np.max(np.abs(later - ours)) / step < 50.0 * error


def test_a_motion_takes_them_where_asked() -> None:
    angles, omega = passing_the_pole(np.deg2rad(5.0))
    q = np.zeros((len(TIME), 7 + len(DOF_NAMES)))
    q[:, 6] = 1.0
    q[:, 10:13] = angles
    made = [
        motion_from_configurations(DOF_NAMES, TIME, q, spherical=spherical)
        for spherical in ([], [np.arange(3, 6)])
    ]
    error = [np.max(np.abs(angular_velocity(angles, motion.v[:, 9:12]) - omega)) for motion in made]
    assert error[0] > 1.0
    assert error[1] < 0.02
