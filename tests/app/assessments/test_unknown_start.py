"""An assessment whose start posture nobody measured."""

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from human import forward_kinematics, frame_poses
from human.rotations import matrix_to_quaternion
from tests.app.conftest import Scene


def _unmeasured(scene: Scene, model_id: str, **changes: Any) -> dict[str, Any]:
    """A request whose candidates are ways of the hand itself, from a start that is not given."""
    pose = forward_kinematics(scene.model, scene.robot.q_start)
    rotation, position = frame_poses(scene.model, pose, "RightHandCOM")
    tool = scene.robot.trajectories[0]
    first = np.asarray(tool.position_m)[0]
    way = position + np.asarray(tool.position_m) - first
    turned = matrix_to_quaternion(rotation).tolist()
    candidate = {
        "id": "way",
        "time_s": tool.time_s.tolist(),
        "position_m": way.tolist(),
        "orientation_xyzw": [turned] * len(way),
    }
    hand = {"T_tool_hand": {"position_m": [0.0, 0.0, 0.0]}}
    request = scene.request(model_id, candidates=[candidate], grasp=hand, samples=24)
    request["start"]["joint_position"] = None
    return {**request, **changes}


@pytest.mark.parametrize("oriented", [True, False])
def test_an_unknown_start_is_guessed_widens_the_bands_and_is_said(
    api: TestClient, scene: Scene, model_id: str, oriented: bool
) -> None:
    """The same way from the measured start has narrower efforts; the guess stands in `assumed`."""
    unknown = _unmeasured(scene, model_id)
    if not oriented:
        del unknown["candidates"][0]["orientation_xyzw"]
    known = {**unknown, "start": scene.request(model_id)["start"]}
    widths, whats = [], []
    for request in (known, unknown):
        answer = api.post("/v1/assessments", json=request)
        assert answer.status_code in (200, 201), answer.text
        result = answer.json()["candidates"][0]
        assert result["problem"] is None, result["problem"]
        band = result["effort_nm"]
        first = [value["p95"][0] - value["p05"][0] for value in band.values()]
        widths.append(float(np.mean(first)))
        whats.append([one["what"] for one in result["assumed"]])
    assert widths[1] > 1.5 * widths[0]
    assert "start posture" in whats[1] and "start posture" not in whats[0]


def test_an_unknown_start_needs_the_grasp(api: TestClient, scene: Scene, model_id: str) -> None:
    """Without a start there is nothing to take a grasp from."""
    answer = api.post("/v1/assessments", json=_unmeasured(scene, model_id, grasp="from_start"))
    assert answer.status_code == 422
    assert "/grasp" in answer.text and "T_tool_hand" in answer.text
