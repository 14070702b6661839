import json

import numpy as np
import pytest

from ergonomics import (
    PostureError,
    RebaInputs,
    RulaInputs,
    explain_rula,
    frame_inputs,
    posture_angles,
    rula_inputs,
    score_rula,
    score_rula_interval,
    score_rula_with,
    worst_moments,
)

from .puppet import FORWARD, LEFT, Sticks, pose, stack, turn

_TIME = np.arange(6.0)


def _rested(**changes):
    angles = {"upper_arm_deg": 10.0, "lower_arm_deg": 80.0, "wrist_deg": 0.0, "neck_deg": 5.0}
    return RulaInputs(**{**angles, "trunk_deg": np.zeros(6), **changes})


@pytest.mark.parametrize(
    ("changes", "frame", "body_part", "words"),
    [
        ({"trunk_deg": [0, 0, 0, 65, 0, 0]}, 3, "trunk", "flexion 65°"),
        ({"upper_arm_deg": [0, 95, 0, 0, 0, 0]}, 1, "right upper arm", "flexion 95°"),
        ({"neck_deg": [0, 0, 0, 0, -20, 0]}, 4, "neck", "flexion -20°"),
        ({"force_a": [0, 0, 3, 0, 0, 0], "force_b": [0, 0, 3, 0, 0, 0]}, 2, "load", "3:"),
    ],
)
def test_worst_moment_names_time_part_and_reason(changes, frame, body_part, words):
    inputs = _rested(**{name: np.array(value) for name, value in changes.items()})
    (worst,) = worst_moments(inputs, 2.0 * _TIME, side="right")
    assert (worst.index, worst.time_s) == (frame, 2.0 * frame)
    assert worst.body_part == body_part
    assert words in worst.reason
    assert worst.score == score_rula(inputs).final[frame]
    assert worst.points >= 0.5
    assert json.loads(json.dumps(worst.to_dict()))["body_part"] == body_part


def test_neither_trunk_nor_neck_gets_off_in_a_deep_stoop():
    inputs = _rested(
        upper_arm_deg=50.0,
        trunk_deg=np.array([0, 0, 80.0, 0, 0, 0]),
        neck_deg=np.array([0, 0, -30.0, 0, 0, 0]),
        trunk_twisted=True,
        force_a=1,
        force_b=1,
    )
    worse = score_rula(inputs).final[2]
    for part in ("trunk", "neck"):
        assert score_rula_with(inputs, {part: 1}).final[2] == worse, "one alone changes nothing"
    assert score_rula_with(inputs, {"upper_arm": 1}).final[2] < worse
    (worst,) = worst_moments(inputs, _TIME, side="left")
    assert (worst.index, worst.body_part) == (2, "trunk")


def test_measured_boxes_are_told_with_their_numbers():
    still, lifted = {}, {"LeftUpperArm": turn(LEFT, -60) @ turn(FORWARD, 35)}
    angles = posture_angles(Sticks(), stack([pose(m) for m in (still, lifted, still)]))
    (worst,) = worst_moments(rula_inputs(angles, side="left"), [0.0, 0.5, 1.0], side="left")
    assert worst.index == 1
    assert worst.body_part == "left upper arm"
    assert "upper arm abducted" in worst.reason and "> 20°" in worst.reason


def test_samples_are_weighed_and_the_median_one_is_told():
    trunk = np.zeros((5, 6))
    trunk[:, 2] = 30.0
    trunk[0, 4] = 70.0
    inputs = _rested(trunk_deg=trunk)
    (worst,) = worst_moments(inputs, _TIME, side="right")
    assert worst.index == 2, "one bad sample in five does not outweigh five middling ones"
    assert worst.expected == pytest.approx(score_rula(inputs).final[:, 2].mean())
    assert "flexion 30°" in worst.reason


def test_several_moments_keep_their_distance_and_order():
    trunk = np.array([0, 65, 64, 0, 0, 30.0])
    moments = worst_moments(_rested(trunk_deg=trunk), _TIME, side="right", count=3, apart_s=2.0)
    assert [m.index for m in moments] == [1, 5, 3]
    assert [m.expected for m in moments] == sorted((m.expected for m in moments), reverse=True)


def test_nothing_stands_out_of_a_body_at_rest():
    (worst,) = worst_moments(_rested(), _TIME, side="right")
    assert (worst.score, worst.body_part, worst.points) == (1, "none", 0.0)


def test_reba_moments_speak_of_reba():
    inputs = RebaInputs(0.0, np.array([0, 70.0, 0, 0, 0, 0]), 0.0, 0.0, 80.0, 0.0)
    (worst,) = worst_moments(inputs, _TIME, side="left")
    assert worst.reason.startswith(f"REBA {worst.score} ")
    assert worst.body_part == "trunk"


def test_one_frame_of_a_batch_keeps_scores_and_words():
    angles = posture_angles(
        Sticks(), stack([pose({"RightUpperArm": turn(FORWARD, -a)}) for a in (10, 40, 70)])
    )
    inputs = rula_inputs(angles, side="right")
    one = frame_inputs(inputs, 2)
    assert one.shape == (1,)
    assert explain_rula(one, (0,)) == explain_rula(inputs, (2,))


def test_what_does_not_fit_is_refused():
    with pytest.raises(PostureError, match="samples, 5"):
        worst_moments(_rested(), _TIME[:5], side="right")


def test_unmeasured_parts_count_in_full_and_take_no_blame():
    trunk = np.array([0, 0, 0, 30.0, 0, 0])
    hidden = frozenset({"wrist", "force_a"})
    for inputs in (
        _rested(trunk_deg=trunk, unmeasured=hidden),
        RebaInputs(0.0, trunk, 0.0, 0.0, 80.0, 0.0, unmeasured=frozenset({"wrist", "coupling"})),
    ):
        (worst,) = worst_moments(inputs, _TIME, side="right")
        assert (worst.index, worst.body_part) == (3, "trunk")
        assert "not measured, could be 1 to" in worst.reasons["wrist"]
    inputs = _rested(trunk_deg=trunk, unmeasured=hidden)
    bounds = score_rula_interval(inputs)
    for frame in range(6):
        one = explain_rula(inputs, (frame,))
        assert one.final == bounds.high.final[frame]
        assert (one.wrist, one.force_a) == (4, 3)
