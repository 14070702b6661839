"""Both hands on one object, both feet on the floor: from a model to an answer over HTTP."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from starlette.testclient import TestClient

from app.assessments.balance import balance_assumed, overhang
from app.assessments.effort import HandLoad, arm_joints, joint_efforts, velocities
from app.assessments.footing import Footing
from app.models.operator import Operator, open_operator
from human import Subject, forward_kinematics, frame_poses, generate_model
from human.rotations import matrix_to_quaternion
from prediction import (
    TrainingOptions,
    demonstrations_from_motion,
    led_chain,
    save_model,
    train_operator,
)
from tests.prediction.whole_body import RATE_HZ, led, motion_of, object_way

BOX_KG = 6.0


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Somebody who was shown to carry a box about with both hands, on standing feet."""
    rng = np.random.default_rng(2)
    chain = led_chain(generate_model(Subject(1.70, 70.0)), "both", "feet")
    motion = motion_of(chain, led(chain, *object_way(rng, 5), rng))
    options = TrainingOptions(method="cov-ik", tasks=("pose",), blocks=2)
    trained = train_operator(
        chain, demonstrations_from_motion(chain, motion), seed=0, options=options
    )
    path = tmp_path_factory.mktemp("model") / "both.safetensors"
    save_model(path, trained)
    return path


@pytest.fixture(scope="module")
def person(file: Path) -> Operator:
    return open_operator(file)


def start_of(person: Operator) -> np.ndarray:
    """The person holding the box, as in the first demonstration."""
    rest = np.zeros((1, 3))
    q = led(person.chain, rest, rest, np.random.default_rng(0), sd=0.0)
    return np.array(motion_of(person.chain, np.repeat(q, 30, axis=0)).q[0])


def hands_of(person: Operator, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    poses = forward_kinematics(person.model, q)
    return [frame_poses(person.model, poses, tip) for tip in person.tips]


def request_of(person: Operator, model_id: str, **changes: Any) -> dict[str, Any]:
    q = start_of(person)
    (_, right), (_, left) = hands_of(person, q)
    share = np.linspace(0.0, 1.0, 21)[:, None]
    turn = 0.15 * share
    spin = np.concatenate([0 * turn, 0 * turn, np.sin(turn), np.cos(turn)], axis=1)
    ways = {"down": (0.10, 0.0, -0.18), "up": (0.10, 0.05, 0.12)}
    return {
        "model_id": model_id,
        "hand": "both",
        "start": {
            "T_world_pelvis": {
                "position_m": q[:3].tolist(),
                "orientation_xyzw": q[3:7].tolist(),
            },
            "joint_position": dict(zip(person.model.dof_names, q[7:].tolist(), strict=True)),
        },
        "payload_kg": BOX_KG,
        "samples": 6,
        "sigma_x": 0.0,
        "candidates": [
            {
                "id": name,
                "time_s": (1.4 * share[:, 0]).tolist(),
                "position_m": ((right + left) / 2 + share * np.array(way)).tolist(),
                "orientation_xyzw": spin.tolist(),
            }
            for name, way in ways.items()
        ],
        **changes,
    }


@pytest.fixture
def model_id(api: TestClient, file: Path) -> str:
    sent = api.post(
        "/v1/models",
        content=file.read_bytes(),
        headers={"Content-Type": "application/vnd.ergocast.model"},
    )
    assert sent.status_code == 201, sent.text
    assert (sent.json()["hand"], sent.json()["base"]) == ("both", "feet")
    return str(sent.json()["id"])


def test_hands_stay_on_the_box_and_feet_on_the_floor(
    api: TestClient, person: Operator, model_id: str
) -> None:
    answer = api.post("/v1/assessments", json=request_of(person, model_id))
    assert answer.status_code == 200, answer.text
    body = answer.json()
    assert {c["rank"] for c in body["candidates"]} == {1, 2}
    sent = {c["id"]: c for c in request_of(person, model_id)["candidates"]}
    at_start, q0 = forward_kinematics(person.model, start_of(person)), start_of(person)
    for one in body["candidates"]:
        assert set(arm_joints("both")) <= set(one["effort_nm"])
        assumed = {entry["what"] for entry in one["assumed"]}
        assert {
            "feet",
            "share of the load by hand",
            "balance",
        } <= assumed and "pelvis" not in assumed
        url = f"/v1/assessments/{body['id']}/candidates/{one['id']}/posture"
        posture = api.get(url).json()
        for angles, base in [
            (posture["joint_position"], posture["base"]),
            *zip(posture["samples"], posture["samples_base"], strict=True),
        ]:
            q = np.concatenate([base["position_m"], base["orientation_xyzw"], angles], axis=1)
            q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
            assert np.ptp(q[:, 2]) > 0.005  # the pelvis does move
            poses = forward_kinematics(person.model, q)
            for foot in ("RightFoot", "LeftFoot"):
                moved = poses.of(foot)[1] - at_start.of(foot)[1]
                assert np.abs(moved).max() < 4e-4
            (R_right, right), (_, left) = hands_of(person, q)
            way = np.array(sent[one["id"]]["position_m"])
            (R_first, first), (_, other) = hands_of(person, q0)
            apart = (np.swapaxes(R_right, 1, 2) @ (left - right)[..., None])[..., 0]
            assert np.abs(apart - R_first.T @ (other - first)).max() < 4e-4
            np.testing.assert_allclose((right + left) / 2, way, atol=5e-4)


def test_requests_that_do_not_fit_two_hands_are_refused(
    api: TestClient, person: Operator, model_id: str
) -> None:
    one_hand = api.post("/v1/assessments", json=request_of(person, model_id, hand="right"))
    assert one_hand.status_code == 422 and "both hands" in one_hand.text
    pose = {"position_m": [0.0, 0.2, 0.0], "orientation_xyzw": [0.0, 0.0, 0.0, 1.0]}
    for grasp in ({"T_tool_hand": pose}, {"T_tool_left_hand": pose}):
        refused = api.post("/v1/assessments", json=request_of(person, model_id, grasp=grasp))
        assert refused.status_code == 422 and "T_tool_right_hand" in refused.text
    request = request_of(person, model_id)
    for candidate in request["candidates"]:
        del candidate["orientation_xyzw"]
    answer = api.post("/v1/assessments", json=request).json()
    assert all("each hand" in c["problem"]["detail"] for c in answer["candidates"])
    request = request_of(person, model_id)
    far = np.array(request["candidates"][0]["position_m"])
    far[:, 0] += np.linspace(0.0, 2.0, len(far))
    request["candidates"][0]["position_m"] = far.tolist()
    answer = api.post("/v1/assessments", json=request).json()
    problem = answer["candidates"][0]["problem"]
    assert problem is not None and "feet where they are" in str(problem)
    assert answer["candidates"][1]["problem"] is None


def test_a_grasp_given_is_the_grasp_taken_from_the_start(
    api: TestClient, person: Operator, model_id: str
) -> None:
    request = request_of(person, model_id)
    first = np.array(request["candidates"][0]["position_m"][0])
    names = ("T_tool_right_hand", "T_tool_left_hand")
    grasp = {
        name: {
            "position_m": (position - first).tolist(),
            "orientation_xyzw": matrix_to_quaternion(rotation).tolist(),
        }
        for name, (rotation, position) in zip(
            names, hands_of(person, start_of(person)), strict=True
        )
    }
    given = api.post("/v1/assessments", json={**request, "grasp": grasp}).json()
    taken = api.post("/v1/assessments", json=request).json()
    for one, other in zip(given["candidates"], taken["candidates"], strict=True):
        assert one["cost"]["total"] == pytest.approx(other["cost"]["total"], abs=1e-4)


def test_feet_that_stand_neither_move_nor_accelerate(person: Operator) -> None:
    """Twist and acceleration of the pelvis are those that leave the feet at rest."""
    rng, model, chain = np.random.default_rng(3), person.model, person.chain
    motion = motion_of(chain, led(chain, *object_way(rng, 1), rng, sd=0.0))
    footing = Footing.of(model, motion.q[0], chain.base)
    time_s = motion.time_s
    q, v, a = velocities(model, motion.q[None].copy(), time_s, chain.dof_indices, footing=footing)
    position = forward_kinematics(model, q[0]).of("Pelvis")
    inner = slice(10, -10)
    rate = np.gradient(position[1], time_s, axis=0)
    seen = (position[0] @ v[0, :, :3, None])[..., 0]
    np.testing.assert_allclose(seen[inner], rate[inner], atol=5e-3)
    change = np.gradient(v[0, :, :6], time_s, axis=0)
    assert np.abs(a[0, inner, :6] - change[inner]).max() < 0.1 * np.abs(change).max()
    peer = model.pinocchio()
    data = peer.createData()

    for k in range(10, len(time_s) - 10, 7):
        pin.forwardKinematics(peer, data, q[0, k], v[0, k], a[0, k])
        for foot in ("RightFoot", "LeftFoot"):
            frame = peer.getFrameId(foot)
            pin.updateFramePlacements(peer, data)
            moving = pin.getFrameVelocity(peer, data, frame, pin.LOCAL)
            assert np.linalg.norm(moving.linear) < 5e-3
            hurried = pin.getFrameClassicalAcceleration(peer, data, frame, pin.LOCAL)
            assert np.linalg.norm(hurried.linear) < 0.1


def test_the_centre_of_pressure_is_that_of_statics(person: Operator) -> None:
    """Ahead of straight toes it is outside by what Pinocchio's centre of mass and a lever say."""
    model, q0 = person.model, start_of(person)
    q = np.tile(q0, (3, 1))
    q[:, 0] += [0.0, 0.4, 0.4]
    still = forward_kinematics(model, q0)
    toe, foot = still.of("RightToe"), still.of("RightFoot")
    shape = model.shapes["RightToe"]
    front = toe[1][0] + shape.center[0] + shape.size[0] / 2
    sole = foot[1][2] + model.shapes["RightFoot"].center[2] - model.shapes["RightFoot"].size[2] / 2
    hand, force, mass = np.array([0.5, 0.0, 1.1]), np.array([30.0, 0.0, 0.0]), 10.0
    outside = overhang(model, q, np.tile(hand, (3, 1)), mass, force)
    assert outside is not None and outside[0] < 0.0
    peer = model.pinocchio()
    com = pin.centerOfMass(peer, peer.createData(), q[1])
    down = 9.81 * (model.total_mass_kg + mass)
    lever = 9.81 * (model.total_mass_kg * com[0] + mass * hand[0]) + 30.0 * (hand[2] - sole)
    assert outside[1] == pytest.approx(lever / down - front, abs=1e-3)
    assert balance_assumed(outside, np.arange(3.0)).value.startswith("lost from 1.00 s")
    assert balance_assumed(outside[:1], np.arange(1.0)).effect == "none"


def test_each_hand_bears_half(person: Operator) -> None:
    """A load held by both is two loads of half the mass, one in each hand."""
    q = np.tile(start_of(person), (1, round(RATE_HZ), 1))
    time_s = np.arange(q.shape[1]) / RATE_HZ
    place = np.zeros((len(time_s), 3))

    def efforts(tips: tuple[str, ...], mass: float) -> dict[str, np.ndarray]:
        load = HandLoad(tips, mass, np.zeros(3))
        found = joint_efforts(
            person.model, q, time_s, place, "both", load, person.chain.dof_indices, None
        )
        return dict(zip(found.joint_names, np.moveaxis(found.moment_norm, -1, 0), strict=True))

    both, none = efforts(person.tips, BOX_KG), efforts(person.tips, 0.0)
    right = efforts(person.tips[:1], BOX_KG / 2)
    np.testing.assert_allclose(both["jRightElbow"], right["jRightElbow"], atol=1e-9)
    np.testing.assert_allclose(right["jLeftElbow"], none["jLeftElbow"], atol=1e-9)
    np.testing.assert_allclose(both["jLeftElbow"], both["jRightElbow"], rtol=1e-6)
    assert (both["jRightElbow"] > none["jRightElbow"]).all()
