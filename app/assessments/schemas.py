"""What a planner sends for an assessment, and what it gets back.

The request's shared part is validated as a whole; each candidate is validated alone (see
``candidates.py``), so that a bad one is an error in its slot.
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    WithJsonSchema,
    model_validator,
)

from app.assessments.poses import Pose, matrix_pose, quaternion_pose
from human.rotations import matrix_to_quaternion

#: A number, not a text or a truth value; sizes beyond these are of no person and no robot, and
#: would overflow once squared.
Metre = Annotated[float, Field(strict=True, ge=-1e4, le=1e4, allow_inf_nan=False)]
Newton = Annotated[float, Field(strict=True, ge=-1e4, le=1e4, allow_inf_nan=False)]
Radian = Annotated[float, Field(strict=True, allow_inf_nan=False)]
#: Wide enough for seconds since 1970.
Second = Annotated[float, Field(strict=True, ge=-1e10, le=1e10, allow_inf_nan=False)]
Part = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]
Vector3 = Annotated[list[Metre], Field(min_length=3, max_length=3)]
Force3 = Annotated[list[Newton], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[Part], Field(min_length=4, max_length=4)]

#: Roll-outs per candidate unless the request says otherwise.
DEFAULT_SAMPLES = 32


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class PoseParts(_Strict):
    """A pose as position and quaternion."""

    position_m: Vector3
    orientation_xyzw: Quaternion = [0.0, 0.0, 0.0, 1.0]

    @model_validator(mode="after")
    def _is_a_pose(self) -> "PoseParts":
        self.pose()
        return self

    def pose(self) -> Pose:
        """Returns the pose as rotation and position."""
        return quaternion_pose(self.position_m, self.orientation_xyzw)


def _parts_of_matrix(value: Any) -> Any:
    """Turns a 4x4 matrix into parts, and leaves anything else to be validated as parts."""
    if isinstance(value, dict | PoseParts):
        return value
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise ValueError("a 4x4 matrix of finite numbers, or {position_m, orientation_xyzw}")
    pose = matrix_pose(matrix)
    return {
        "position_m": pose.position.tolist(),
        "orientation_xyzw": matrix_to_quaternion(pose.rotation).tolist(),
    }


_MATRIX_SCHEMA = {
    "type": "array",
    "description": "Homogeneous transform, row by row.",
    "minItems": 4,
    "maxItems": 4,
    "items": {"type": "array", "minItems": 4, "maxItems": 4, "items": {"type": "number"}},
}
_POSE_SCHEMA = {"anyOf": [PoseParts.model_json_schema(), _MATRIX_SCHEMA]}

#: A pose: a 4x4 homogeneous matrix, or position and quaternion.
PoseInput = Annotated[PoseParts, BeforeValidator(_parts_of_matrix), WithJsonSchema(_POSE_SCHEMA)]


class Start(_Strict):
    """The person's posture when the motion begins."""

    #: Angles by joint name, in rad; joints left out stand as in neutral upright standing. None: not
    #: known; what the operator was demonstrated to take with the hand there stands for it.
    joint_position: dict[str, Radian] | None = {}
    T_world_pelvis: PoseInput


class Grasp(_Strict):
    """How the hand holds the tool, or both hands one object."""

    T_tool_hand: PoseInput | None = None
    #: Of both hands on one object.
    T_tool_right_hand: PoseInput | None = None
    T_tool_left_hand: PoseInput | None = None

    @model_validator(mode="after")
    def _one_or_both(self) -> "Grasp":
        given = (self.T_tool_hand, self.T_tool_right_hand, self.T_tool_left_hand)
        if [one is not None for one in given] not in ([True, False, False], [False, True, True]):
            raise ValueError("T_tool_hand, or T_tool_right_hand and T_tool_left_hand for both")
        return self

    def poses(self) -> tuple[Pose, ...]:
        """Returns the hand as the tool sees it, or both, the right one first."""
        given = (self.T_tool_hand, self.T_tool_right_hand, self.T_tool_left_hand)
        return tuple(one.pose() for one in given if one is not None)


class SigmaX(_Strict):
    """The robot's repeatability: one standard deviation."""

    position_m: float = Field(strict=True, default=0.0, ge=0.0, le=0.5, allow_inf_nan=False)
    orientation_rad: float = Field(strict=True, default=0.0, ge=0.0, le=1.0, allow_inf_nan=False)


_SIGMA_SCHEMA = {
    "anyOf": [{"type": "number", "minimum": 0, "maximum": 0.5}, SigmaX.model_json_schema()]
}
_GRASP_SCHEMA = {
    "anyOf": [
        {"const": "from_start"},
        {
            "type": "object",
            "properties": {"T_tool_hand": _POSE_SCHEMA},
            "required": ["T_tool_hand"],
        },
        {
            "type": "object",
            "description": "Both hands on one object.",
            "properties": {"T_tool_right_hand": _POSE_SCHEMA, "T_tool_left_hand": _POSE_SCHEMA},
            "required": ["T_tool_right_hand", "T_tool_left_hand"],
        },
    ]
}


def _sigma_parts(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"position_m": value}
    if isinstance(value, dict | SigmaX):
        return value
    raise ValueError("metres as a number, or {position_m, orientation_rad}")


def _explicit_grasp(value: Any) -> Any:
    if value is None or value == "from_start":
        return None
    if isinstance(value, dict | Grasp):
        return value
    raise ValueError(
        "'from_start', {T_tool_hand: a pose}, or {T_tool_right_hand, T_tool_left_hand: poses}"
    )


class FootSplit(_Strict):
    """Share of the body's support that each foot bears."""

    left: float = Field(strict=True, ge=0.0, le=1.0, allow_inf_nan=False)
    right: float = Field(strict=True, ge=0.0, le=1.0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _whole(self) -> "FootSplit":
        if abs(self.left + self.right - 1.0) > 1e-6:
            raise ValueError(f"shares that sum to 1 (they sum to {self.left + self.right:g})")
        return self


class Candidate(_Strict):
    """One trajectory of the tool (or of the hand, with an identity grasp), column by column.

    Held with both hands, the tool is the object between them, and orientations are needed.

    Without ``orientation_xyzw`` the task is the position alone.
    """

    id: str = Field(min_length=1, max_length=200)
    frame_id: str = "world"
    time_s: list[Second] = Field(min_length=2, max_length=20_000)
    position_m: list[Vector3] = Field(min_length=2, max_length=20_000)
    orientation_xyzw: list[Quaternion] | None = None


_Slot = Annotated[Any, WithJsonSchema(Candidate.model_json_schema())]


class AssessmentRequest(_Strict):
    """N candidate trajectories for one person."""

    model_id: str
    name: str | None = Field(default=None, max_length=200)
    #: The led hand; ``both`` hold one object, whose poses the candidates are.
    hand: Literal["right", "left", "both"] = "right"
    start: Start
    #: Poses of the frames that candidates name, in the world; ``world`` is always known.
    frames: dict[str, PoseInput] = {}
    #: ``from_start``: whatever the start posture and the trajectory's first point say.
    grasp: Annotated[
        Grasp | None, BeforeValidator(_explicit_grasp), WithJsonSchema(_GRASP_SCHEMA)
    ] = None
    #: None: not known. No load is then assumed, and that is said.
    payload_kg: float | None = Field(
        strict=True, default=None, ge=0.0, le=200.0, allow_inf_nan=False
    )
    #: What the person bears of the payload; the robot bears the rest.
    payload_share: float = Field(strict=True, default=1.0, ge=0.0, le=1.0, allow_inf_nan=False)
    #: Further force of the robot on the person's hand, world axes, N; of both hands together.
    hand_force_n: Force3 = [0.0, 0.0, 0.0]
    foot_split: FootSplit | None = None
    #: The robot's repeatability, m; or ``{position_m, orientation_rad}``.
    sigma_x: Annotated[SigmaX, BeforeValidator(_sigma_parts), WithJsonSchema(_SIGMA_SCHEMA)] = (
        SigmaX(position_m=0.001)
    )
    samples: int = Field(strict=True, default=DEFAULT_SAMPLES, ge=2, le=2000)
    seed: int = Field(strict=True, default=0, ge=0, le=2**32 - 1)
    #: Each one is checked alone; a bad one is a ``problem`` in its slot of the answer.
    candidates: Annotated[list[_Slot], Field(min_length=1, max_length=5000)]
    include_posture: bool = False

    def points(self) -> int:
        """Returns how many trajectory points were sent, as far as that can be told."""
        times = (c.get("time_s") for c in self.candidates if isinstance(c, dict))
        return sum(len(t) for t in times if isinstance(t, list))

    def hand_force(self) -> np.ndarray:
        """Returns the force on the hand, ``(3,)`` in N, world axes."""
        return np.array(self.hand_force_n, dtype=float)


class CostPart(BaseModel):
    """One part of the cost of a candidate."""

    name: str
    value: float
    unit: str
    weight: float
    #: What the part adds to the total.
    contribution: float
    aggregation: str
    direction: str


class Cost(BaseModel):
    """The cost by which candidates are ranked: less is better."""

    total: float
    parts: list[CostPart]


class ScoreCourse(BaseModel):
    """Distribution of a score over time: one row per instant."""

    time_s: list[float]
    pmf: list[list[float]]
    expected: list[float]
    p05: list[float]
    p95: list[float]


class RulaCourse(ScoreCourse):
    """RULA, 1 to 7 (columns of ``pmf``)."""

    p_ge_5: list[float]


class Band(BaseModel):
    """Median and 90 % band of a quantity over time."""

    p05: list[float]
    p50: list[float]
    p95: list[float]


class TimedBand(Band):
    """A band with its times."""

    time_s: list[float]


class Moment(BaseModel):
    """An instant worth looking at, and why."""

    time_s: float
    side: str
    body_part: str
    reason: str
    score: float


class Worst(BaseModel):
    """The worst instant of a candidate."""

    time_s: float
    side: str
    body_part: str
    reason: str
    rula: float
    #: Median effort of the joint that works hardest then, against its reference.
    effort_nm: float
    effort_joint: str


class Assumption(BaseModel):
    """Something that was taken for granted, and what that may change."""

    what: str
    value: Any
    range: Any
    effect: str


class OutOfDistribution(BaseModel):
    """Whether the model was asked about postures it has not seen."""

    flag: bool
    familiarity_min: float | None
    time_s: float | None


class Baseline(BaseModel):
    """What another method predicts for the same candidate, without spread."""

    rula_expected_mean: float
    cost_total: float


class CandidateResult(BaseModel):
    """The answer to one candidate; ``problem`` says why there is none."""

    id: str
    rank: int | None
    p_best: float | None
    tied_with: list[str]
    cost: Cost | None
    rula: RulaCourse | None
    reba: ScoreCourse | None
    back_angle_deg: TimedBand | None
    effort_nm: dict[str, Band] | None
    worst: Worst | None
    moments: list[Moment]
    assumed: list[Assumption]
    out_of_distribution: OutOfDistribution | None
    baseline: dict[str, Baseline | None] | None
    problem: dict[str, Any] | None
    posture: dict[str, Any] | None = None


class Assessment(BaseModel):
    """Candidates in the order sent, ranked by cost."""

    id: str
    name: str | None
    model_id: str
    created: str
    seed: int
    samples: int
    methods: list[str]
    cost_definition: dict[str, Any]
    candidates: list[CandidateResult]


class AssessmentItem(BaseModel):
    """One line of the list of assessments."""

    id: str
    created: str
    model_id: str
    n_candidates: int
    name: str | None


class Assessments(BaseModel):
    """A list of assessments, newest first."""

    items: list[AssessmentItem]


class Posture(BaseModel):
    """The predicted body over time, for playing it back."""

    time_s: list[float]
    joint_names: list[str]
    joint_position: list[list[float]]
    samples: list[list[list[float]]]
    base: dict[str, list[list[float]]]
    #: The pelvis of each of the ``samples``; it moves where the feet stand.
    samples_base: list[dict[str, list[list[float]]]] = []
    effort_p50_nm: dict[str, list[float]]
    effort_scale_nm: dict[str, float]
    target: dict[str, list[list[float]]]
