import numpy as np
import pytest

from ergonomics import PostureError, back_angle, back_dose, posture_angles

from .puppet import FORWARD, LEFT, UP, StickPoses, Sticks, pose, stack, turn


def _bend(*angles, **others):
    segments = ("L5", "L3", "T12", "T8")
    moves = {s: turn(LEFT, a) for s, a in zip(segments, angles, strict=True)} | others
    return back_angle(Sticks(), pose(moves))


def test_bends_add_up_without_sign_and_with_it():
    bent = _bend(10, 20, -5, 15)
    np.testing.assert_allclose(bent.by_joint_deg, [10, 20, -5, 15])
    np.testing.assert_allclose(bent.chain_sum_deg, 50)
    np.testing.assert_allclose(bent.signed_sum_deg, 40)


def test_hip_hinge_is_seen_by_the_inclination_alone():
    hinged = pose({"Pelvis": turn(LEFT, 70)})
    np.testing.assert_allclose(back_angle(Sticks(), hinged).chain_sum_deg, 0, atol=1e-9)
    np.testing.assert_allclose(posture_angles(Sticks(), hinged).trunk_inclination_deg, 70)


def test_twist_does_not_leak_and_heading_does_not_matter():
    twisted = back_angle(Sticks(), pose({"L3": turn(UP, 40)}, root=turn(UP, 111)))
    np.testing.assert_allclose(twisted.chain_sum_deg, 0, atol=1e-9)
    sideways = back_angle(Sticks(), pose({"T8": turn(FORWARD, 25)}))
    np.testing.assert_allclose(sideways.chain_sum_deg, 0, atol=1e-9)


def test_signed_sum_is_the_bend_of_the_trunk_against_the_pelvis():
    rng = np.random.default_rng(0)
    for _ in range(5):
        angles = rng.uniform(-20, 30, 4)
        moves = {s: turn(LEFT, a) for s, a in zip(("L5", "L3", "T12", "T8"), angles, strict=True)}
        got = back_angle(Sticks(), pose(moves)).signed_sum_deg
        np.testing.assert_allclose(got, posture_angles(Sticks(), pose(moves)).trunk_flexion_deg)


def test_batches_keep_their_shape():
    poses = stack([pose({"T8": turn(LEFT, a)}) for a in range(6)])
    folded = StickPoses(poses.rotation.reshape(2, 3, 23, 3, 3), poses.position.reshape(2, 3, 23, 3))
    assert back_angle(Sticks(), folded).by_joint_deg.shape == (2, 3, 4)


def test_dose_of_a_ramp_over_uneven_frames():
    time = np.array([0.0, 0.1, 0.15, 1.0, 1.7, 2.0])
    dose = back_dose(-40.0 * time, time)
    assert dose.dose_deg_s == pytest.approx(0.5 * 80.0 * 2.0)
    assert dose.mean_deg == pytest.approx(40.0)
    assert sum(dose.zone_share) == pytest.approx(1.0)


def test_dropped_frames_do_not_shorten_a_bend():
    time = np.arange(0.0, 10.01, 0.1)
    angle = np.where((time > 3) & (time < 7), 70.0, 5.0)
    keep = ~((time > 4) & (time < 6))
    whole, gappy = back_dose(angle, time), back_dose(angle[keep], time[keep])
    assert gappy.dose_deg_s == pytest.approx(whole.dose_deg_s)
    assert gappy.zone_share == pytest.approx(whole.zone_share)
    assert whole.zone_share[2] == pytest.approx(0.4, abs=0.02)
    assert whole.percentiles_deg == (5.0, 5.0, 70.0)


def test_malformed_poses_are_refused():
    still = pose()
    with pytest.raises(PostureError, match="expected"):
        back_angle(Sticks(), StickPoses(still.rotation[:5], still.position))
    with pytest.raises(PostureError, match="finite"):
        back_angle(Sticks(), StickPoses(still.rotation * np.nan, still.position))
