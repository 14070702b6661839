from dataclasses import fields

import numpy as np
import pytest

from ergonomics import ArmAngles, PostureError, posture_angles
from human.names import SEGMENTS, mirrored

from .puppet import FORWARD, LEFT, UP, StickPoses, Sticks, pose, stack, turn

#: Rotation about +y carries an upright stick forward, and a hanging one backward.
_BODY = (
    "neck_flexion_deg neck_twist_deg neck_bend_deg trunk_flexion_deg trunk_inclination_deg "
    "trunk_twist_deg trunk_bend_deg"
).split()


def _measure(moves=None, **kwargs):
    return posture_angles(Sticks(), pose(moves, **kwargs))


def _close(got, expected, tolerance=1e-9):
    np.testing.assert_allclose(got, expected, atol=tolerance)


def _raise_forward(angle):
    return turn(LEFT, -angle)


def _raise_sideways(side, angle):
    return turn(FORWARD, -angle if side == "right" else angle)


def test_n_pose_is_zero_everywhere():
    angles = _measure()
    for name in _BODY:
        _close(getattr(angles, name), 0.0)
    for side in ("left", "right"):
        arm = angles.arms[side]
        for f in fields(ArmAngles):
            if f.name not in ("midline_crossing_m", "out_to_side_m"):
                _close(getattr(arm, f.name), 0.0)
        _close(arm.midline_crossing_m, -0.17)
        _close(arm.out_to_side_m, 0.0)
        _close(angles.knee_deg[side], 0.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [3, 20, 45, 89.9, 90, 90.1, 120, 170])
def test_arm_raised_forward(side, angle):
    arm = _measure({f"{side.capitalize()}UpperArm": _raise_forward(angle)}).arms[side]
    _close(arm.upper_arm_deg, angle)
    _close(arm.upper_arm_sagittal_deg, angle)
    _close(arm.abduction_deg, 0.0)
    if angle <= 135:
        _close(arm.rotation_deg, 0.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [20, 45, 89.9, 90, 90.1, 135, 179])
def test_arm_raised_sideways(side, angle):
    arm = _measure({f"{side.capitalize()}UpperArm": _raise_sideways(side, angle)}).arms[side]
    _close(arm.upper_arm_deg, angle)
    _close(arm.abduction_deg, 90 - abs(90 - angle))
    _close(np.sin(np.deg2rad(arm.upper_arm_sagittal_deg)), 0.0)
    if angle <= 135:
        _close(arm.rotation_deg, 0.0)


@pytest.mark.parametrize(("angle", "signed"), [(5, 5), (11, -11), (30, -30), (60, -60)])
def test_extension_is_negative_once_the_arm_leans_back(angle, signed):
    _close(_measure({"RightUpperArm": _raise_forward(-angle)}).arms["right"].upper_arm_deg, signed)


def test_a_sideways_raise_that_leans_back_a_little_is_no_extension():
    back = turn(UP, -15) @ _raise_sideways("right", 80)
    arm = _measure({"RightUpperArm": back}).arms["right"]
    _close(arm.upper_arm_deg, 80)
    assert arm.upper_arm_sagittal_deg < -45


@pytest.mark.parametrize("side", ["left", "right"])
def test_arm_across_the_chest_is_not_abducted(side):
    inward = 40 if side == "right" else -40
    arm = _measure({f"{side.capitalize()}UpperArm": turn(UP, inward) @ _raise_forward(90)}).arms[
        side
    ]
    _close(arm.upper_arm_deg, 90)
    _close(arm.abduction_deg, -40)


def test_upper_arm_is_measured_against_the_trunk():
    bent = {"T8": turn(LEFT, 50), "RightUpperArm": _raise_forward(30)}
    _close(_measure(bent).arms["right"].upper_arm_deg, 30)
    hanging = {"T8": turn(LEFT, 50), "RightUpperArm": turn(LEFT, -50)}
    _close(_measure(hanging).arms["right"].upper_arm_deg, 50)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [0, 5, 60, 100, 145])
@pytest.mark.parametrize("raised", [0, 60, 120])
def test_elbow_whatever_the_shoulder_does(side, angle, raised):
    name = side.capitalize()
    moves = {f"{name}ForeArm": _raise_forward(angle), f"{name}UpperArm": _raise_forward(raised)}
    arm = _measure(moves).arms[side]
    _close(arm.elbow_deg, angle, 1e-6)
    _close(arm.pronation_deg, 0.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [-60, 30, 80])
@pytest.mark.parametrize("elbow", [0, 90, 130])
@pytest.mark.parametrize("carrier", ["ForeArm", "Hand", "both"])
def test_forearm_twist_wherever_the_recording_puts_it(side, angle, elbow, carrier):
    # Hanging, palms to the thighs: the right thumb turns inward about +z, the left about -z.
    name = side.capitalize()
    sign = 1 if side == "right" else -1
    share = {"ForeArm": (1, 0), "Hand": (0, 1), "both": (0.4, 0.6)}[carrier]
    # Wrist bent 30 towards the palm and 10 towards the thumb, about axes of the twisted forearm.
    palmward = turn(FORWARD, 30 * sign)
    thumbward = turn(LEFT, -10)
    hand = turn(UP, sign * share[1] * angle) @ palmward @ thumbward
    forearm = _raise_forward(elbow) @ turn(UP, sign * share[0] * angle)
    arm = _measure({f"{name}Hand": hand, f"{name}ForeArm": forearm}).arms[side]
    # The hand's swing is not a pure flexion, so a trace of its turn counts as twist.
    _close(arm.pronation_deg, angle, 3.0)
    _close(arm.wrist_flexion_deg, 30, 3.0)
    _close(arm.wrist_deviation_deg, 10, 3.0)
    _close(arm.elbow_deg, elbow, 1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [-70, -15, 15, 70])
def test_pure_wrist_movements(side, angle):
    name, sign = side.capitalize(), 1 if side == "right" else -1
    bent = _measure({f"{name}Hand": turn(FORWARD, sign * angle)}).arms[side]
    _close((bent.wrist_flexion_deg, bent.wrist_deviation_deg, bent.pronation_deg), (angle, 0, 0))
    tilted = _measure({f"{name}Hand": turn(LEFT, -angle)}).arms[side]
    _close((tilted.wrist_flexion_deg, tilted.wrist_deviation_deg), (0, angle))
    _close(tilted.pronation_deg, 0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("angle", [-40, 25, 70])
def test_upper_arm_turned_about_itself(side, angle):
    name, sign = side.capitalize(), 1 if side == "right" else -1
    turned = turn(UP, sign * angle)
    for raised in (0, 60, 100):
        arm = _measure({f"{name}UpperArm": _raise_forward(raised) @ turned}).arms[side]
        _close(arm.rotation_deg, angle)
    overhead = _measure({f"{name}UpperArm": _raise_forward(170) @ turned}).arms[side]
    _close(overhead.rotation_deg, 0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_shoulder_girdle(side):
    lifted = turn(FORWARD, -12 if side == "right" else 12)
    arm = _measure({f"{side.capitalize()}Shoulder": lifted}).arms[side]
    _close(arm.shoulder_raise_deg, 12)
    arm = _measure({f"{side.capitalize()}Shoulder": lifted.T}).arms[side]
    _close(arm.shoulder_raise_deg, -12)


def test_wrist_across_the_midline_and_out_to_the_side():
    bent = _raise_forward(90)
    across = _measure({"RightForeArm": turn(UP, 60) @ bent}).arms["right"]
    _close(across.midline_crossing_m, 0.25 * np.sin(np.deg2rad(60)) - 0.17)
    _close(across.out_to_side_m, -0.25 * np.sin(np.deg2rad(60)))
    outside = _measure({"LeftForeArm": turn(UP, 50) @ bent}).arms["left"]
    _close(outside.out_to_side_m, 0.25 * np.sin(np.deg2rad(50)))


@pytest.mark.parametrize("angle", [-30, 15, 60, 100])
def test_neck(angle):
    _close(_measure({"Head": turn(LEFT, angle)}).neck_flexion_deg, angle)
    shared = {"Head": turn(LEFT, 0.3 * angle), "Neck": turn(LEFT, 0.7 * angle)}
    _close(_measure(shared).neck_flexion_deg, angle)
    _close(_measure({"Head": turn(UP, angle)}).neck_twist_deg, angle)
    turned = _measure({"Head": turn(UP, angle), "T8": turn(LEFT, 40)})
    _close((turned.neck_twist_deg, turned.neck_flexion_deg), (angle, 0))
    _close(_measure({"Head": turn(FORWARD, -0.8 * angle)}).neck_bend_deg, 0.8 * angle)


@pytest.mark.parametrize("angle", [-25, 10, 60, 89, 90, 91, 120])
@pytest.mark.parametrize("segment", ["Pelvis", "L5", "T8"])
def test_trunk_leans_forward_whichever_joint_bends(angle, segment):
    angles = _measure({segment: turn(LEFT, angle)})
    _close(angles.trunk_flexion_deg, angle)
    _close(angles.trunk_inclination_deg, abs(angle), 1e-6)
    _close((angles.trunk_twist_deg, angles.trunk_bend_deg), (0, 0))


def test_trunk_twist_and_side_bend_are_against_the_pelvis():
    _close(_measure({"L3": turn(UP, 35)}).trunk_twist_deg, 35)
    bent = _measure({"L3": turn(FORWARD, -20)})
    _close((bent.trunk_bend_deg, bent.trunk_flexion_deg), (20, 0))
    _close(bent.trunk_inclination_deg, 20)
    leaning = _measure({"Pelvis": turn(FORWARD, -20)})
    _close((leaning.trunk_bend_deg, leaning.trunk_inclination_deg), (0, 20))
    after = _measure({"L3": turn(UP, 35), "Pelvis": turn(LEFT, 70)})
    _close((after.trunk_twist_deg, after.trunk_flexion_deg), (35, 70))


def test_lying_on_the_side_counts_as_fully_inclined():
    for side in (1, -1):
        angles = _measure({"Pelvis": turn(FORWARD, side * 90)})
        _close(np.abs(angles.trunk_flexion_deg), 90)
        _close(angles.trunk_inclination_deg, 90)


@pytest.mark.parametrize("side", ["left", "right"])
def test_knee(side):
    name = side.capitalize()
    moves = {f"{name}LowerLeg": turn(LEFT, 70), f"{name}UpperLeg": turn(LEFT, -50)}
    angles = _measure(moves)
    _close(angles.knee_deg[side], 70)
    _close(angles.knee_deg["left" if side == "right" else "right"], 0)


def _random_moves(rng):
    return {
        name: turn(rng.normal(size=3), rng.uniform(0, 50)) for name in SEGMENTS if "Toe" not in name
    }


def _all(angles):
    flat = {name: getattr(angles, name) for name in _BODY}
    for side in ("left", "right"):
        flat |= {f"{side}.{f.name}": getattr(angles.arms[side], f.name) for f in fields(ArmAngles)}
        flat[f"{side}.knee"] = angles.knee_deg[side]
    return flat


def test_heading_and_place_change_nothing():
    rng = np.random.default_rng(1)
    poses = stack([pose(_random_moves(rng)) for _ in range(40)])
    spin = turn(UP, 137.0)
    moved = StickPoses(spin @ poses.rotation, poses.position @ spin.T + np.array([5.0, -3.0, 1.0]))
    before, after = (_all(posture_angles(Sticks(), p)) for p in (poses, moved))
    for name, value in before.items():
        _close(after[name], value, 1e-7)


def test_mirrored_body_has_mirrored_angles():
    rng = np.random.default_rng(2)
    mirror = np.diag([1.0, -1.0, 1.0])
    poses = stack([pose(_random_moves(rng)) for _ in range(40)])
    swap = [SEGMENTS.index(mirrored(name)) for name in SEGMENTS]
    other = StickPoses(mirror @ poses.rotation[:, swap] @ mirror, poses.position[:, swap] @ mirror)
    before, after = (_all(posture_angles(Sticks(), p)) for p in (poses, other))
    odd = ("neck_twist_deg", "neck_bend_deg", "trunk_twist_deg", "trunk_bend_deg")
    for name, value in before.items():
        twin = name.replace("left.", "*").replace("right.", "left.").replace("*", "right.")
        _close(after[twin], -value if name in odd else value, 1e-7)


def test_elevation_is_the_angle_to_the_trunk_by_another_route():
    rng = np.random.default_rng(3)
    poses = stack([pose(_random_moves(rng)) for _ in range(200)])
    angles = posture_angles(Sticks(), poses)
    at = SEGMENTS.index
    for side in ("left", "right"):
        bone = (
            poses.position[:, at(f"{side.capitalize()}ForeArm")]
            - poses.position[:, at(f"{side.capitalize()}UpperArm")]
        )
        down = -poses.rotation[:, at("T8"), :, 2]
        cosine = (bone * down).sum(axis=1) / np.linalg.norm(bone, axis=1)
        _close(np.abs(angles.arms[side].upper_arm_deg), np.rad2deg(np.arccos(cosine)), 1e-6)


def test_own_n_pose_takes_out_how_segments_were_mounted():
    rng = np.random.default_rng(4)
    mounting = np.stack([turn(rng.normal(size=3), rng.uniform(0, 25)) for _ in SEGMENTS])
    mounting[0] = turn(LEFT, 17)
    spin = turn(UP, -70.0)
    truth = [pose(_random_moves(rng), root=spin) for _ in range(20)]
    seen = stack([StickPoses(p.rotation @ mounting, p.position) for p in truth])
    still = pose(root=turn(UP, 33.0))
    reference = stack([StickPoses(still.rotation @ mounting, still.position)] * 3)
    expected = _all(posture_angles(Sticks(), stack(truth)))
    got = _all(posture_angles(Sticks(), seen, neutral_reference=reference))
    for name, value in expected.items():
        _close(got[name], value, 1e-6)


def test_one_side_alone_and_long_batches_agree_with_the_whole():
    rng = np.random.default_rng(5)
    few = stack([pose(_random_moves(rng)) for _ in range(50)])
    long = StickPoses(
        np.tile(few.rotation, (50, 1, 1, 1)).reshape(50, 50, 23, 3, 3),
        np.tile(few.position, (50, 1, 1)).reshape(50, 50, 23, 3),
    )
    whole = posture_angles(Sticks(), few)
    alone = posture_angles(Sticks(), long, sides=("right",))
    assert set(alone.arms) == {"right"}
    assert alone.trunk_flexion_deg.shape == (50, 50)
    for f in fields(ArmAngles):
        _close(getattr(alone.arms["right"], f.name)[17], getattr(whole.arms["right"], f.name))


def _broken(**changes):
    still = pose()
    return StickPoses(**{"rotation": still.rotation, "position": still.position, **changes})


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (_broken(rotation=np.zeros((22, 3, 3))), r"poses.rotation: expected \(..., 23, 3, 3\)"),
        (_broken(position=np.zeros((2, 23, 3))), r"poses.position: expected \(23, 3\)"),
        (_broken(position=np.full((23, 3), np.nan)), r"poses.position at index \[0, 0\]"),
        (_broken(position=np.zeros((23, 3))), "has no length"),
        (StickPoses(np.zeros((0, 23, 3, 3)), np.zeros((0, 23, 3))), "at least one frame"),
    ],
)
def test_malformed_poses_are_refused(poses, message):
    with pytest.raises(PostureError, match=message):
        posture_angles(Sticks(), poses)


def test_unknown_unmeasured_segment_is_refused():
    with pytest.raises(PostureError, match="'Tail' is missing"):
        posture_angles(Sticks(), pose(), unmeasured=("Tail",))


def test_reference_that_moves_is_refused():
    moving = stack([pose({"Head": turn(UP, a)}) for a in (0, 120, 240)])
    with pytest.raises(PostureError, match="held still"):
        posture_angles(Sticks(), pose(), neutral_reference=moving)
