"""The answer to an assessment: the same for the same question, and right about the body."""

import json
import re
from typing import Any

import numpy as np
import pytest

from app.assessments.assess import assess
from app.assessments.schemas import Assessment, AssessmentRequest
from app.files import dump_json
from app.models.operator import Operator
from app.problems import Cancelled, InvalidRequest
from human import forward_kinematics, frame_poses
from tests.app.conftest import Scene


def ask(scene: Scene, opened: Operator, **changes: Any) -> dict[str, Any]:
    request = AssessmentRequest.model_validate(scene.request(opened.id, **changes))
    result = assess(request, opened).result
    return json.loads(dump_json(result))


@pytest.fixture(scope="module")
def answer(scene: Scene, opened: Operator) -> dict[str, Any]:
    return ask(scene, opened)


def test_the_answer_has_the_shape_that_is_published(answer: dict[str, Any]) -> None:
    Assessment.model_validate({"id": "asm_0", "created": "", **answer})
    for one in answer["candidates"]:
        points = len(one["rula"]["time_s"])
        assert np.array(one["rula"]["pmf"]).shape == (points, 7)
        assert np.array(one["reba"]["pmf"]).shape == (points, 15)
        np.testing.assert_allclose(np.sum(one["rula"]["pmf"], axis=1), 1.0, atol=1e-5)
        expected = np.array(one["rula"]["pmf"]) @ np.arange(1, 8)
        np.testing.assert_allclose(one["rula"]["expected"], expected, atol=1e-5)
        assert set(one["effort_nm"]) >= {"jRightWrist", "jRightElbow", "jRightShoulder", "jL5S1"}
        for band in one["effort_nm"].values():
            assert (np.array(band["p05"]) <= np.array(band["p95"])).all()
        assert set(one["baseline"]) == {"cov-ik", "minimum-norm"}
        assert one["worst"]["time_s"] in one["rula"]["time_s"]


def test_the_same_question_gets_the_same_bytes(
    scene: Scene, opened: Operator, answer: dict[str, Any]
) -> None:
    assert dump_json(ask(scene, opened)) == dump_json(answer)
    other = ask(scene, opened, seed=4)
    assert other["candidates"][0]["rula"] != answer["candidates"][0]["rula"]


def test_a_candidates_numbers_do_not_depend_on_the_others(
    scene: Scene, opened: Operator, answer: dict[str, Any]
) -> None:
    turned = ask(scene, opened, candidates=scene.candidates()[::-1])
    assert [one["id"] for one in turned["candidates"]] == [
        one["id"] for one in answer["candidates"][::-1]
    ]
    alone = ask(scene, opened, candidates=scene.candidates()[1:2])
    own = ("cost", "rula", "reba", "back_angle_deg", "effort_nm", "worst", "moments", "baseline")
    for one in answer["candidates"]:
        twin = next(c for c in turned["candidates"] if c["id"] == one["id"])
        assert {**twin, "tied_with": set(twin["tied_with"])} == {
            **one,
            "tied_with": set(one["tied_with"]),
        }
    for name in own:
        assert alone["candidates"][0][name] == answer["candidates"][1][name]


def test_ranks_follow_costs_and_probabilities_sum_to_one(answer: dict[str, Any]) -> None:
    costs = [one["cost"]["total"] for one in answer["candidates"]]
    ranks = [one["rank"] for one in answer["candidates"]]
    assert [ranks[i] for i in np.argsort(costs)] == [1, 2, 3]
    assert sum(one["p_best"] for one in answer["candidates"]) == pytest.approx(1.0, abs=1e-5)
    for one in answer["candidates"]:
        parts = one["cost"]["parts"]
        total = sum(part["contribution"] for part in parts)
        assert total == pytest.approx(one["cost"]["total"], abs=1e-5)


def test_an_overhead_way_costs_more_than_a_straight_one(answer: dict[str, Any]) -> None:
    by_id = {one["id"]: one for one in answer["candidates"]}
    assert by_id["overhead"]["cost"]["total"] > by_id["direct"]["cost"]["total"]
    assert by_id["overhead"]["rank"] > by_id["direct"]["rank"]
    mean = {name: np.mean(one["rula"]["expected"]) for name, one in by_id.items()}
    assert mean["overhead"] > mean["direct"]


def test_a_heavier_payload_raises_every_effort_and_the_score(
    scene: Scene, opened: Operator, answer: dict[str, Any]
) -> None:
    heavy = ask(scene, opened, payload_kg=24.0)
    for light_one, heavy_one in zip(answer["candidates"], heavy["candidates"], strict=True):
        for joint in ("jRightElbow", "jRightShoulder", "jL5S1"):
            light_effort = np.mean(light_one["effort_nm"][joint]["p50"])
            assert np.mean(heavy_one["effort_nm"][joint]["p50"]) > light_effort + 2.0
        assert np.mean(heavy_one["rula"]["expected"]) > np.mean(light_one["rula"]["expected"])
        # The posture is predicted from the trajectory; the load does not change it.
        assert heavy_one["back_angle_deg"] == light_one["back_angle_deg"]


def test_wrist_effort_at_rest_is_the_lever_of_the_load(scene: Scene, opened: Operator) -> None:
    """A hand that is held still: effort over that of the empty hand is force times lever."""
    model, q = scene.model, scene.robot.q_start
    poses = forward_kinematics(model, q)
    _, hand = frame_poses(model, poses, "RightHandCOM")
    still = {
        "id": "still",
        "time_s": [0.0, 0.05, 0.1, 0.15, 0.2],
        "position_m": [hand.tolist()] * 5,
    }
    options: dict[str, Any] = {"candidates": [still], "sigma_x": 0.0, "samples": 2}
    light = ask(scene, opened, payload_kg=0.0, **options)["candidates"][0]
    loaded = ask(scene, opened, payload_kg=10.0, payload_share=0.7, **options)["candidates"][0]
    _, elbow = poses.of("RightForeArm")
    lever = np.linalg.norm((hand - elbow)[:2])
    gained = (
        loaded["effort_nm"]["jRightElbow"]["p50"][0] - light["effort_nm"]["jRightElbow"]["p50"][0]
    )
    # Both moments point the same way here: forearm and load hang from the same side.
    assert gained == pytest.approx(7.0 * 9.81 * lever, rel=0.05)


def test_a_hand_force_upwards_relieves_the_arm(scene: Scene, opened: Operator) -> None:
    loaded = ask(scene, opened, payload_kg=4.0, payload_share=1.0)
    lifted = ask(scene, opened, payload_kg=4.0, payload_share=1.0, hand_force_n=[0, 0, 39.24])
    for before, after in zip(loaded["candidates"], lifted["candidates"], strict=True):
        for joint in ("jRightElbow", "jL5S1"):
            assert np.mean(after["effort_nm"][joint]["p50"]) < np.mean(
                before["effort_nm"][joint]["p50"]
            )


def test_leg_efforts_come_only_with_the_foot_split(
    scene: Scene, opened: Operator, answer: dict[str, Any]
) -> None:
    one = answer["candidates"][0]
    assert not [name for name in one["effort_nm"] if "Knee" in name or "Hip" in name]
    assert any(entry["what"] == "support by each foot" for entry in one["assumed"])
    right = ask(
        scene,
        opened,
        candidates=scene.candidates()[:1],
        foot_split={"left": 0.0, "right": 1.0},
    )["candidates"][0]
    assert not any(entry["what"] == "support by each foot" for entry in right["assumed"])
    # A leg that bears nothing hangs: its ankle bears the foot alone.
    hanging = np.mean(right["effort_nm"]["jLeftAnkle"]["p50"])
    assert hanging < 3.0
    assert np.mean(right["effort_nm"]["jRightHip"]["p50"]) > 10 * hanging


def test_bad_candidates_are_errors_in_their_slots(
    scene: Scene, opened: Operator, answer: dict[str, Any]
) -> None:
    good = scene.candidates()
    far = {**good[0], "id": "far"}
    far["position_m"] = (
        np.array(good[0]["position_m"]) + np.linspace(0, 1, 15)[:, None] * [2.5, 0, 0]
    ).tolist()
    bad: list[Any] = [
        {**good[0], "id": "nan", "time_s": [float("nan"), *good[0]["time_s"][1:]]},
        {**good[0], "id": "moon", "frame_id": "moon"},
        far,
        {"no": "candidate"},
    ]
    mixed = ask(scene, opened, candidates=[bad[0], good[0], bad[1], good[1], *bad[2:], good[2]])
    slots = mixed["candidates"]
    assert [slot["id"] for slot in slots] == [
        "nan", "direct", "moon", good[1]["id"], "far", "candidate-5", good[2]["id"],
    ]  # fmt: skip
    for index in (0, 2, 4, 5):
        problem = slots[index]["problem"]
        assert problem["type"] == "/problems/candidate-rejected"
        assert problem["errors"][0]["pointer"].startswith(f"/candidates/{index}")
        assert slots[index]["rank"] is None
    assert "out of reach" in slots[4]["problem"]["errors"][0]["got"]
    for index, before in ((1, 0), (3, 1), (6, 2)):
        assert slots[index]["cost"] == answer["candidates"][before]["cost"]
        assert slots[index]["rank"] == answer["candidates"][before]["rank"]


def test_assumptions_are_named_with_the_range_they_open(answer: dict[str, Any]) -> None:
    assumed = {entry["what"]: entry for entry in answer["candidates"][0]["assumed"]}
    assert {
        "pelvis",
        "joints that the model does not predict",
        "grasp",
        "support by each foot",
        "what the legs stand on",
        "postures held longer than a minute",
    } <= set(assumed)
    for entry in assumed.values():
        assert entry["effect"] and entry["range"] and entry["value"]
    assert "RULA mean" in assumed["what the legs stand on"]["effect"]
    # What is assumed of the body opens the range of the parts it decides.
    spans = {}
    for what in ("pelvis", "joints that the model does not predict", "grasp"):
        found = re.search(r"RULA mean ([\d.]+) to ([\d.]+); REBA", assumed[what]["effect"])
        assert found, assumed[what]
        spans[what] = float(found[1]), float(found[2])
        assert 1.0 <= spans[what][0] < spans[what][1] <= 7.0
    reached = np.mean(answer["candidates"][0]["rula"]["expected"])
    low, high = spans["pelvis"]
    assert low - 0.5 <= reached <= high + 0.5
    assert high - low > spans["grasp"][1] - spans["grasp"][0]


def test_a_payload_that_was_not_given_is_named_with_what_it_may_change(
    scene: Scene, opened: Operator
) -> None:
    unsaid = {k: v for k, v in scene.request("m").items() if k != "payload_kg"}
    unsaid["candidates"] = scene.candidates()[:1]

    def named(request: dict[str, Any]) -> dict[str, Any]:
        one = assess(AssessmentRequest(**request), opened).result["candidates"][0]
        return {taken["what"]: taken for taken in one["assumed"]}

    load = named(unsaid)["load in the hand"]
    assert load["value"] == "none"
    low, high = (float(x) for x in load["effect"].split(";")[0].split("mean ")[1].split(" to "))
    assert high >= low + 1.0
    assert "payload" in named({**unsaid, "hand_force_n": [0.0, 0.0, -20.0]})
    assert not {"load in the hand", "payload"} & set(named({**unsaid, "payload_kg": 0.0}))


def test_coarse_times_are_resampled_and_said(scene: Scene, opened: Operator) -> None:
    sparse = scene.candidates()[0]
    keep = [0, 4, 9, 14]
    coarse = {
        "id": "coarse",
        "frame_id": "world",
        "time_s": [sparse["time_s"][i] for i in keep],
        "position_m": [sparse["position_m"][i] for i in keep],
        "orientation_xyzw": [sparse["orientation_xyzw"][i] for i in keep],
    }
    one = ask(scene, opened, candidates=[coarse])["candidates"][0]
    assert one["problem"] is None
    assert len(one["rula"]["time_s"]) > 4
    assert any(entry["what"] == "time steps" for entry in one["assumed"])


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"hand": "left"}, "/hand"),
        ({"start": {"T_world_pelvis": {"position_m": [0, 0, 1]}, "joint_position": {"jNo": 0.0}}},
         "/start/joint_position/jNo"),
        ({"start": {"T_world_pelvis": {"position_m": [0, 0, 1]},
                    "joint_position": {"jRightElbow_rotz": 90.0}}},
         "/start/joint_position/jRightElbow_rotz"),
        ({"frames": {"world": {"position_m": [0, 0, 0]}}}, "/frames/world"),
    ],
)  # fmt: skip
def test_a_shared_part_that_does_not_fit_is_refused(
    scene: Scene, opened: Operator, changes: dict[str, Any], pointer: str
) -> None:
    request = AssessmentRequest.model_validate(scene.request(opened.id, **changes))
    with pytest.raises(InvalidRequest) as caught:
        assess(request, opened)
    assert caught.value.faults[0].pointer == pointer


def test_two_candidates_of_one_id_are_refused(scene: Scene, opened: Operator) -> None:
    twice = [scene.candidates()[0]] * 2
    with pytest.raises(InvalidRequest, match="same id") as caught:
        ask(scene, opened, candidates=twice)
    assert caught.value.faults[0].pointer == "/candidates/1/id"


def test_parts_that_fit_in_memory_change_nothing(
    scene: Scene, opened: Operator, answer: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.assessments.assess.POSTURES_AT_ONCE", 1)
    assert ask(scene, opened) == answer


def test_a_cancel_is_noticed_between_parts(
    scene: Scene, opened: Operator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.assessments.assess.POSTURES_AT_ONCE", 1)
    told: list[tuple[int, int]] = []

    def stop(done: int, total: int) -> None:
        told.append((done, total))
        if done == 2:
            raise Cancelled("enough")

    request = AssessmentRequest.model_validate(scene.request(opened.id))
    with pytest.raises(Cancelled):
        assess(request, opened, stop)
    assert told == [(1, 3), (2, 3)]


@pytest.mark.parametrize("duration_s", [3600.0, 2e9])
def test_a_trajectory_too_long_to_hold_is_refused_in_its_slot(
    scene: Scene, opened: Operator, duration_s: float
) -> None:
    hand = scene.candidates()[0]["position_m"][0]
    hour = {"id": "hour", "time_s": [0.0, duration_s], "position_m": [hand, hand]}
    slots = ask(scene, opened, candidates=[hour, scene.candidates()[1]])["candidates"]
    assert slots[0]["problem"]["errors"][0]["pointer"] == "/candidates/0/time_s"
    assert "too long" in slots[0]["problem"]["detail"]
    assert slots[1]["problem"] is None
