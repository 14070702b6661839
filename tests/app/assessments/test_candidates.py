"""A bad candidate is refused at its place; a good one leads the hand where the frames say."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.assessments.candidates import CandidateRejected, hand_path, parse_candidate
from app.assessments.poses import IDENTITY, Pose
from app.assessments.timing import prediction_grid, resample

UNIT = [0.0, 0.0, 0.0, 1.0]


def candidate(**changes: Any) -> dict[str, Any]:
    """Returns a good candidate with some columns replaced."""
    good = {
        "id": "a",
        "frame_id": "world",
        "time_s": [0.0, 0.1, 0.2],
        "position_m": [[0.4, 0.0, 1.0], [0.41, 0.0, 1.0], [0.42, 0.0, 1.0]],
        "orientation_xyzw": [UNIT] * 3,
    }
    return {**good, **changes}


@pytest.mark.parametrize(
    ("changes", "pointer", "words"),
    [
        ({"time_s": [0.0, float("nan"), 0.2]}, "/candidates/4/time_s/1", "finite"),
        ({"time_s": [0.0, 0.2, 0.1]}, "/candidates/4/time_s/2", "increase"),
        ({"time_s": [0.0, 0.1, 0.1]}, "/candidates/4/time_s/2", "increase"),
        ({"time_s": [0.0, 0.1]}, "/candidates/4/position_m", "length"),
        ({"time_s": [0.0]}, "/candidates/4/time_s", "at least 2"),
        (
            {"position_m": [[0, 0, 0], [0, 0], [0, 0, 0]]},
            "/candidates/4/position_m/1",
            "at least 3",
        ),
        ({"position_m": "far"}, "/candidates/4/position_m", "list"),
        (
            {"position_m": [[0, 0, 0], [0, 0, "0.5"], [0, 0, 0]]},
            "/candidates/4/position_m/1/2",
            "valid number",
        ),
        (
            {"position_m": [[0, 0, 0], [0, 0, 1e300], [0, 0, 0]]},
            "/candidates/4/position_m/1/2",
            "less than",
        ),
        ({"time_s": [0.0, 1e-9, 2e-9]}, "/candidates/4/time_s", "too short"),
        ({"time_s": [0.0, 0.1, 1e300]}, "/candidates/4/time_s/2", "less than"),
        ({"time_s": [False, True, 2.0]}, "/candidates/4/time_s/0", "valid number"),
        (
            {"orientation_xyzw": [UNIT, [0, 0, 0, 1.01], UNIT]},
            "/candidates/4/orientation_xyzw/1",
            "not unit",
        ),
        (
            {"orientation_xyzw": [UNIT, [0, 0, 0, 0], UNIT]},
            "/candidates/4/orientation_xyzw/1",
            "not unit",
        ),
        (
            {"orientation_xyzw": [UNIT, [1, 0, 0, 0], UNIT]},
            "/candidates/4/orientation_xyzw/1",
            "jumps",
        ),
        (
            {"position_m": [[0, 0, 0], [0, 0, 0.9], [0, 0, 0.9]]},
            "/candidates/4/position_m/1",
            "jumps",
        ),
        ({"colour": "red"}, "/candidates/4/colour", "not permitted"),
        ({"id": ""}, "/candidates/4/id", "at least 1"),
    ],
)
def test_a_malformed_candidate_is_refused_at_its_place(
    changes: dict[str, Any], pointer: str, words: str
) -> None:
    with pytest.raises(CandidateRejected) as caught:
        parse_candidate(candidate(**changes), 4)
    fault = caught.value.faults[0]
    assert fault.pointer == pointer
    assert words in fault.detail


@pytest.mark.parametrize("value", [None, 3, [], "a", {}])
def test_something_else_than_a_candidate_is_refused(value: Any) -> None:
    with pytest.raises(CandidateRejected):
        parse_candidate(value, 0)


def test_a_quaternion_that_is_nearly_unit_is_normalised() -> None:
    path = parse_candidate(candidate(orientation_xyzw=[[0, 0, 0, 1.0009]] * 3), 0)
    assert path.rotation is not None
    np.testing.assert_allclose(path.rotation, np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-15)


def pose(turn: list[float], position: list[float]) -> Pose:
    """Returns a pose from a rotation vector and a position."""
    return Pose(Rotation.from_rotvec(turn).as_matrix(), np.array(position))


def test_frames_and_grasp_compose_to_the_hand_in_the_world() -> None:
    table, grasp = pose([0, 0, 0.5], [1.0, 2.0, 0.7]), pose([0.2, 0, 0], [0.0, 0.1, 0.0])
    path = parse_candidate(candidate(frame_id="table"), 0)
    first = Pose(path.rotation[0], path.position[0])
    start = table @ first @ grasp
    hand = hand_path(path, {"world": IDENTITY, "table": table}, (grasp,), (start,))
    # By hand, as homogeneous matrices.
    expected = matrix(table) @ matrix(Pose(path.rotation[2], path.position[2])) @ matrix(grasp)
    np.testing.assert_allclose(matrix(hand.pose[2]), expected, atol=1e-14)
    from_start = hand_path(path, {"table": table}, None, (start,))
    np.testing.assert_allclose(from_start.pose.rotation, hand.pose.rotation, atol=1e-14)
    np.testing.assert_allclose(from_start.pose.position, hand.pose.position, atol=1e-14)


def test_both_hands_go_with_the_object_also_between_the_points_sent() -> None:
    grasps = pose([0.2, 0, 0], [0.0, -0.2, 0.05]), pose([-0.3, 0.4, 0], [0.02, 0.2, 0.0])
    turns = Rotation.from_rotvec([[0, 0, 0], [0, 0.3, 0.4], [0.1, 0.6, 0.9]]).as_quat().tolist()
    path = parse_candidate(candidate(time_s=[0.0, 0.7, 1.4], orientation_xyzw=turns), 0)
    first = Pose(path.rotation[0], path.position[0])
    starts = tuple(first @ grasp for grasp in grasps)
    for given in (grasps, None):
        both = hand_path(path, {"world": IDENTITY}, given, starts)
        hands = resample(both, prediction_grid(both.time_s)).hands()
        assert len(hands.position) > 3
        right = Pose(hands.rotation[:, 0], hands.position[:, 0])
        left = Pose(hands.rotation[:, 1], hands.position[:, 1])
        apart, expected = right.inverse() @ left, grasps[0].inverse() @ grasps[1]
        np.testing.assert_allclose(apart.position - expected.position, 0.0, atol=1e-12)
        np.testing.assert_allclose(apart.rotation - expected.rotation, 0.0, atol=1e-12)
        last = Pose(path.rotation[-1], path.position[-1]) @ grasps[1]
        np.testing.assert_allclose(left.position[-1], last.position, atol=1e-12)
    alone = parse_candidate(candidate(orientation_xyzw=None), 0)
    with pytest.raises(CandidateRejected, match="each hand"):
        hand_path(alone, {"world": IDENTITY}, grasps, starts)
    moved = starts[0], Pose(starts[1].rotation, starts[1].position + np.array([0.05, 0.0, 0.0]))
    with pytest.raises(CandidateRejected, match="does not meet"):
        hand_path(path, {"world": IDENTITY}, grasps, moved)


def matrix(value: Pose) -> np.ndarray:
    """Returns a pose as a homogeneous matrix."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = value.rotation, value.position
    return out


def test_an_unknown_frame_a_far_start_and_a_turned_start_are_refused() -> None:
    path = parse_candidate(candidate(), 2)
    here = Pose(np.eye(3), path.position[0])
    with pytest.raises(CandidateRejected, match="frame 'world' is not given") as caught:
        hand_path(path, {"table": IDENTITY}, (IDENTITY,), (here,))
    assert caught.value.faults[0].pointer == "/candidates/2/frame_id"
    far = Pose(np.eye(3), path.position[0] + [0.03, 0, 0])
    with pytest.raises(CandidateRejected, match="does not meet") as caught:
        hand_path(path, {"world": IDENTITY}, (IDENTITY,), (far,))
    assert "0.030 m" in caught.value.faults[0].got
    turned = Pose(Rotation.from_euler("x", 6, degrees=True).as_matrix(), path.position[0])
    with pytest.raises(CandidateRejected, match="orientation in the start") as caught:
        hand_path(path, {"world": IDENTITY}, (IDENTITY,), (turned,))
    assert "6.0 deg" in caught.value.faults[0].got


@pytest.mark.parametrize("orientation", [None, [UNIT] * 3])
def test_a_tool_beyond_any_grasp_is_refused_where_the_grasp_comes_from_the_start(
    orientation: Any,
) -> None:
    path = parse_candidate(candidate(orientation_xyzw=orientation), 1)
    near = Pose(np.eye(3), path.position[0] + [0.0, 0.0, 0.99])
    hand_path(path, {"world": IDENTITY}, None, (near,))
    far = Pose(np.eye(3), path.position[0] + [0.0, 0.0, 1.01])
    with pytest.raises(CandidateRejected, match="do not meet") as caught:
        hand_path(path, {"world": IDENTITY}, None, (far,))
    assert caught.value.faults[0].pointer == "/candidates/1/position_m/0"
    assert caught.value.faults[0].got == "1.010 m away"


def test_a_position_path_keeps_the_offset_of_the_start_and_refuses_a_lever() -> None:
    path = parse_candidate(candidate(orientation_xyzw=None), 0)
    start = pose([0.3, 0.2, 0.1], [0.4, 0.05, 1.1])
    hand = hand_path(path, {"world": IDENTITY}, None, (start,))
    assert hand.position_only
    np.testing.assert_allclose(hand.pose.position[0], start.position)
    np.testing.assert_allclose(np.diff(hand.pose.position, axis=0), np.diff(path.position, axis=0))
    lever = Pose(np.eye(3), np.array([0.0, 0.0, 0.1]))
    with pytest.raises(CandidateRejected, match="cannot be told"):
        hand_path(path, {"world": IDENTITY}, (lever,), (start,))
