"""Requests that can be answered and should not be believed: refused, or told in `assumed`."""

from typing import Any

import numpy as np
import pytest

from app.assessments.assess import assess
from app.assessments.schemas import AssessmentRequest
from app.models.operator import Operator
from app.problems import InvalidRequest
from tests.app.conftest import Scene


def assumed(scene: Scene, opened: Operator, **pelvis: Any) -> dict[str, str]:
    """Assesses one candidate with the pelvis elsewhere; returns what was assumed, by name."""
    asked = scene.request(opened.id, samples=4, candidates=scene.candidates()[:1])
    asked["start"]["T_world_pelvis"].update(pelvis)
    (answer,) = assess(AssessmentRequest.model_validate(asked), opened).result["candidates"]
    assert answer["problem"] is None, answer["problem"]
    return {one["what"]: one["value"] for one in answer["assumed"]}


def turned(degrees: float) -> list[float]:
    """Returns a pelvis pitched forward, xyzw."""
    half = np.deg2rad(degrees) / 2.0
    return [0.0, float(np.sin(half)), 0.0, float(np.cos(half))]


def test_a_quaternion_in_another_order_puts_nobody_on_their_head(
    scene: Scene, opened: Operator
) -> None:
    with pytest.raises(InvalidRequest) as refused:
        assumed(scene, opened, orientation_xyzw=[1.0, 0.0, 0.0, 0.0])
    (fault,) = refused.value.faults
    assert fault.pointer == "/start/T_world_pelvis/orientation_xyzw" and "180 deg" in fault.got


def test_a_pelvis_far_from_upright_is_told(scene: Scene, opened: Operator) -> None:
    assert "a pelvis far from upright" not in assumed(scene, opened, orientation_xyzw=turned(0.0))
    told = assumed(scene, opened, orientation_xyzw=turned(75.0))
    assert told["a pelvis far from upright"] == "75 deg, as sent"


def test_a_hand_that_is_not_at_the_tool_is_told(scene: Scene, opened: Operator) -> None:
    assert "a hand far from the tool" not in assumed(scene, opened)
    raised = scene.robot.q_start[:3] + np.array([0.0, 0.0, 0.5])
    told = assumed(scene, opened, position_m=raised.tolist())
    assert told["a hand far from the tool"].startswith("0.50 m")
