"""The person of an assessment: the model standing at the start, and what was taken for granted."""

from dataclasses import dataclass

import numpy as np

from app.assessments.footing import Footing
from app.assessments.poses import IDENTITY, Array, Pose
from app.assessments.schemas import AssessmentRequest, Assumption
from app.models.operator import Operator
from app.problems import Fault, InvalidRequest, pointer, shorten
from human import HumanModel, forward_kinematics, frame_poses
from human.rotations import matrix_to_quaternion

#: How far a given start angle may be outside the joint's tabulated range.
LIMIT_SLACK_RAD = np.deg2rad(15.0)

#: Upright standing: T-pose but for the arms, which hang.
_HANGING_RAD = {"jRightShoulder_rotx": np.deg2rad(85.0), "jLeftShoulder_rotx": -np.deg2rad(85.0)}


@dataclass(frozen=True, slots=True)
class Standing:
    """The person when the motion begins.

    Attributes:
        q: ``(nq,)`` configuration.
        footing: What stays in place.
        hands: ``T_world_hand`` of the led hand, or of both; None if the start is not known.
        frames: ``T_world_frame`` by frame id, ``world`` among them.
        grasps: ``T_tool_hand`` of each, or None: from the start.
        taken: What was taken for granted, for every candidate.
    """

    q: Array
    footing: Footing
    hands: tuple[Pose, ...] | None
    frames: dict[str, Pose]
    grasps: tuple[Pose, ...] | None
    taken: tuple["Taken", ...]


@dataclass(frozen=True, slots=True)
class Taken:
    """Something taken for granted of the body.

    Attributes:
        assumption: What, in words.
        parts: Parts of RULA that may be another way; what they could score is the range it opens.
    """

    assumption: Assumption
    parts: frozenset[str] = frozenset()


#: Further from upright than this a pelvis is not that of a person at work, degrees; and from here
#: on it is worth a word.
MAX_TILT_DEG, BOWED_DEG = 110.0, 60.0
#: Parts that follow from the joints that a model predicts, and from those that it does not.
_LED_PARTS = frozenset({"trunk", "upper_arm", "lower_arm", "wrist", "wrist_twist"})
_OTHER_PARTS = frozenset({"neck", "legs"})
_GRASP_PARTS = frozenset({"wrist", "wrist_twist"})


def stand(request: AssessmentRequest, operator: Operator) -> Standing:
    """Puts the operator's model where the request says.

    Raises:
        InvalidRequest: The hand is not the model's, a joint is unknown or far outside its range.
    """
    if request.hand != operator.hand:
        led = "both hands" if operator.hand == "both" else f"the {operator.hand} hand"
        raise InvalidRequest(
            f"The model predicts {led}.",
            [Fault("/hand", repr(operator.hand), repr(request.hand), f"trained for {led}")],
        )
    model = operator.model
    q, missing = _start_configuration(request, model)
    pelvis = request.start.T_world_pelvis.pose()
    _check_upright(pelvis)
    q[:3], q[3:7] = pelvis.position, matrix_to_quaternion(pelvis.rotation)
    poses = forward_kinematics(model, q)
    hands = None
    if request.start.joint_position is None:
        _check_guessable(request, operator)
    else:
        hands = tuple(Pose(*frame_poses(model, poses, tip)) for tip in operator.tips)
    frames = {name: pose.pose() for name, pose in request.frames.items()}
    if "world" in frames:
        raise InvalidRequest(
            "The world needs no pose.",
            [Fault("/frames/world", "another name", "world", "the world is where it is")],
        )
    grasps = None if request.grasp is None else request.grasp.poses()
    if grasps is not None and len(grasps) != len(operator.tips):
        wanted = (
            "T_tool_hand" if len(operator.tips) == 1 else "T_tool_right_hand and T_tool_left_hand"
        )
        raise InvalidRequest(
            "The grasp is not one of the led hands.",
            [Fault("/grasp", wanted, f"{len(grasps)} poses", f"hand is {request.hand!r}")],
        )
    return Standing(
        q,
        Footing.of(model, q, operator.chain.base),
        hands,
        {"world": IDENTITY, **frames},
        grasps,
        tuple(_assumptions(request, operator, missing)),
    )


def _check_guessable(request: AssessmentRequest, operator: Operator) -> None:
    """Refuses a start that is not known where nothing tells what it may be.

    Raises:
        InvalidRequest: The grasp is to be taken from the start, or the model cannot guess it.
    """
    if request.grasp is None:
        raise InvalidRequest(
            "Neither the start posture nor the grasp is known.",
            [
                Fault(
                    "/grasp",
                    "T_tool_hand",
                    "from_start",
                    "with start.joint_position null there is no start to take the grasp from",
                )
            ],
        )
    if operator.base == "feet" or operator.content.samples is None:
        why = (
            "feet that stand somewhere have to be given"
            if operator.base == "feet"
            else "this model holds no demonstrations to guess it from"
        )
        raise InvalidRequest(
            "The start posture cannot be guessed.",
            [Fault("/start/joint_position", "angles by joint name", "null", why)],
        )


def _tilt_deg(pelvis: Pose) -> float:
    """Returns the angle between the pelvis's long axis and the vertical."""
    return float(np.degrees(np.arccos(np.clip(pelvis.rotation[2, 2], -1.0, 1.0))))


def _check_upright(pelvis: Pose) -> None:
    """Refuses a person on their head, which is what a quaternion in another order makes of them."""
    tilt = _tilt_deg(pelvis)
    if tilt > MAX_TILT_DEG:
        raise InvalidRequest(
            "The person stands on their head.",
            [
                Fault(
                    "/start/T_world_pelvis/orientation_xyzw",
                    f"a pelvis at most {MAX_TILT_DEG:g} deg from upright",
                    f"{tilt:.0f} deg",
                    "the world's z points up, and quaternions are x, y, z, w",
                )
            ],
        )


def _start_configuration(request: AssessmentRequest, model: HumanModel) -> tuple[Array, list[str]]:
    q = model.neutral()
    angles = q[7:]
    given = request.start.joint_position or {}
    for name, value in _HANGING_RAD.items():
        angles[model.dof_names.index(name)] = value
    faults = []
    for name, value in given.items():
        place = pointer("start", "joint_position", name)
        if name not in model.dof_names:
            faults.append(
                Fault(place, "a joint such as jRightShoulder_rotx", shorten(name), "unknown joint")
            )
            continue
        k = model.dof_names.index(name)
        low, high = model.lower[k] - LIMIT_SLACK_RAD, model.upper[k] + LIMIT_SLACK_RAD
        if not low <= value <= high:
            detail = "no joint turns so far; angles are in rad"
            faults.append(Fault(place, f"{low:.3f} to {high:.3f} rad", f"{value:g}", detail))
            continue
        angles[k] = value
    if faults:
        raise InvalidRequest("The start posture is not one of this person.", faults)
    return q, [name for name in model.dof_names if name not in given]


def _assumptions(request: AssessmentRequest, operator: Operator, missing: list[str]) -> list[Taken]:
    n_dof = len(operator.model.dof_names)
    predicted = operator.chain.dof_names
    others = n_dof - len(predicted)
    standing = operator.base == "feet"
    where = "stay where they are" if standing else "stays where it is"
    unled = [
        *([] if standing else ["legs"]),
        "head",
        *([] if operator.hand == "both" else ["other arm"]),
    ]
    side = "" if operator.hand == "both" else ", and the score of the other side"
    found = [
        Taken(
            Assumption(
                what=operator.base,
                value=f"{where} at the start",
                range="people step when a reach is far"
                if standing
                else "people step and lean when a reach is far",
                effect="trunk, arm and legs",
            ),
            _LED_PARTS | {"legs"},
        ),
        Taken(
            Assumption(
                what="joints that the model does not predict",
                value=f"{others} joint angles ({', '.join(unled)}) stay at the start posture",
                range="free",
                effect=("neck" if standing else "neck and legs") + side,
            ),
            _OTHER_PARTS - {"legs"} if standing else _OTHER_PARTS,
        ),
    ]
    if operator.hand == "both":
        found.append(
            Taken(
                Assumption(
                    what="share of the load by hand",
                    value="each hand bears half; the load's weight acts in the middle between them",
                    range="0 to 1 for each hand",
                    effect="the efforts of either arm; points for the load",
                )
            )
        )
    found += _demonstrated(operator)
    tilt = _tilt_deg(request.start.T_world_pelvis.pose())
    if tilt > BOWED_DEG:
        found.append(
            Taken(
                Assumption(
                    what="a pelvis far from upright",
                    value=f"{tilt:.0f} deg, as sent",
                    range="people stand or bow; RULA and REBA know no lying",
                    effect="trunk and legs: check that the quaternion is x, y, z, w",
                ),
                _LED_PARTS | {"legs"},
            )
        )
    if request.start.joint_position is None:
        found.append(
            Taken(
                Assumption(
                    what="start posture",
                    value="not given: between pelvis and hand it is drawn from what was "
                    "demonstrated with the hand nearby, so bands are wider; the other joints stand "
                    "as in upright standing",
                    range="free",
                    effect="the whole posture",
                ),
                _LED_PARTS | _OTHER_PARTS,
            )
        )
    elif missing:
        led = [name for name in missing if name in predicted]
        found.append(
            Taken(
                Assumption(
                    what="start angles that were not given",
                    value=f"{len(missing)} of {n_dof} joint angles stand as in upright standing "
                    f"({len(led)} of them between pelvis and hand)",
                    range="free",
                    effect="the prediction starts from there" if led else "neck and legs",
                ),
                _LED_PARTS | _OTHER_PARTS if led else _OTHER_PARTS,
            )
        )
    if request.grasp is None:
        found.append(
            Taken(
                Assumption(
                    what="grasp",
                    value="as the start posture and the first point say; it does not slip",
                    range="free",
                    effect="the wrist",
                ),
                _GRASP_PARTS,
            )
        )
    if request.payload_kg is None and any(request.hand_force_n):
        found.append(
            Taken(
                Assumption(
                    what="payload",
                    value="none beside hand_force_n",
                    range="0 to more than 10 kg",
                    effect="points for the load, and every effort; efforts not worked out",
                ),
                frozenset({"force_a", "force_b"}),
            )
        )
    if request.foot_split is None:
        found.append(
            Taken(
                Assumption(
                    what="support by each foot",
                    value="not given, so leg efforts are left out",
                    range="0 to 1 for each foot",
                    effect="none on the scores",
                )
            )
        )
    return found


def _demonstrated(operator: Operator) -> list[Taken]:
    """Returns what the demonstrations did not show."""
    content = operator.content
    if content.is_generic:
        value = "none: this person was not seen; W and bands are those of other people"
        change = "every posture between pelvis and hand"
    elif content.training.get("findings"):
        value = "; ".join(content.training["findings"])
        change = "the prediction, where it goes beyond what was shown"
    else:
        return []
    assumption = Assumption(
        what="demonstrations", value=value, range="people differ by tens of degrees", effect=change
    )
    return [Taken(assumption, _LED_PARTS)]
