"""Checks one candidate: what it must be before anything is predicted from it."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import ValidationError

from app.assessments.poses import (
    IDENTITY,
    UNIT_TOLERANCE,
    Array,
    Pose,
    rotation_angle,
    rotation_of_quaternion,
)
from app.assessments.schemas import Candidate
from app.problems import Fault, Problem, faults_of_validation, pointer, shorten

#: Faster than this between two points, the trajectory is taken to jump.
MAX_SPEED_M_S = 5.0
MAX_TURN_RAD_S = 4 * np.pi
#: Shorter than this, a trajectory is no motion, and whatever speed its rounding has is none either.
MIN_DURATION_S = 0.02
#: Longest prediction, in steps, and in steps times samples: some 2 GB while it is scored.
MAX_STEPS = 2000
MAX_POSTURES = 400_000
#: How far the hand may be from the trajectory's first point when the motion begins.
START_DISTANCE_M = 0.02
START_ANGLE_RAD = np.deg2rad(5.0)
#: How far from the tool's first point a hand may be that is taken to hold it as it stands.
MAX_GRASP_M = 1.0


class CandidateRejected(Problem):
    """One candidate cannot be assessed; it stands in its slot, the others are unaffected."""

    status: ClassVar[int] = 422
    slug: ClassVar[str] = "candidate-rejected"
    title: ClassVar[str] = "The candidate cannot be assessed"


@dataclass(frozen=True, slots=True)
class ToolPath:
    """A candidate that is well formed: the tool's way in its own frame.

    Attributes:
        id: The client's name for it.
        index: Its place in the request.
        frame_id: The frame its poses are in.
        time_s: ``(T,)`` strictly increasing, s.
        position: ``(T, 3)`` m.
        rotation: ``(T, 3, 3)``, or None where the task is the position alone.
    """

    id: str
    index: int
    frame_id: str
    time_s: Array
    position: Array
    rotation: Array | None


@dataclass(frozen=True, slots=True)
class HandPath:
    """The imposed way of the hand, or of the object between both, in the world.

    Attributes:
        time_s: ``(T,)`` s.
        pose: ``T_world_hand``, ``(T, ...)``; for a position task the rotation is the start's. With
            both hands, of the object.
        position_only: Whether the rotation is free.
        grasps: Hands as ``pose`` sees them: the identity alone, or those of both.
        held_m: How far from the tool's point the furthest hand was taken to hold it; 0 if the grasp
            was given.
    """

    time_s: Array
    pose: Pose
    position_only: bool
    grasps: tuple[Pose, ...]
    held_m: float = 0.0

    def hands(self) -> Pose:
        """Returns ``T_world_hand`` of each hand, ``(T, hands, ...)``."""
        held = [self.pose @ grasp for grasp in self.grasps]
        return Pose(
            np.stack([one.rotation for one in held], axis=1),
            np.stack([one.position for one in held], axis=1),
        )

    def middle(self) -> Array:
        """Returns where the hand is, or the middle between both, ``(T, 3)`` m."""
        return np.asarray(self.hands().position.mean(axis=1))


def slot_id(value: Any, index: int) -> str:
    """Returns the id under which a slot is answered, also where the candidate has none."""
    identifier = value.get("id") if isinstance(value, dict) else None
    return identifier if isinstance(identifier, str) and identifier else f"candidate-{index}"


def _reject(index: int, fault: Fault) -> CandidateRejected:
    return CandidateRejected(f"Candidate {index}: {fault.detail}", [fault])


def _place(index: int, *parts: str | int) -> str:
    return pointer("candidates", index, *parts)


def parse_candidate(value: Any, index: int) -> ToolPath:
    """Returns a candidate as arrays.

    Raises:
        CandidateRejected: A value is missing, not finite, of the wrong shape; times do not
            increase; a quaternion is not unit; the path jumps.
    """
    try:
        parsed = Candidate.model_validate(value)
    except ValidationError as error:
        faults = faults_of_validation(error.errors()[:10], ("candidates", index))
        raise CandidateRejected(
            f"Candidate {index} is malformed at {faults[0].pointer}: {faults[0].detail}.", faults
        ) from error
    time_s = np.array(parsed.time_s)
    position = np.array(parsed.position_m)
    count = len(time_s)
    columns = {"position_m": parsed.position_m, "orientation_xyzw": parsed.orientation_xyzw}
    for name, column in columns.items():
        if column is not None and len(column) != count:
            raise _reject(
                index,
                Fault(
                    _place(index, name),
                    f"{count} rows, one per time",
                    f"{len(column)} rows",
                    f"{name} and time_s differ in length.",
                ),
            )
    step = np.diff(time_s)
    if (step <= 0).any():
        late = int(np.argmax(step <= 0)) + 1
        raise _reject(
            index,
            Fault(
                _place(index, "time_s", late),
                f"a time after {time_s[late - 1]:g} s",
                f"{time_s[late]:g} s",
                "times must increase strictly.",
            ),
        )
    if time_s[-1] - time_s[0] < MIN_DURATION_S:
        raise _reject(
            index,
            Fault(
                _place(index, "time_s"),
                f"at least {MIN_DURATION_S:g} s from first to last",
                f"{time_s[-1] - time_s[0]:g} s",
                "the trajectory is too short to be a motion; times are in seconds.",
            ),
        )
    rotation = None
    if parsed.orientation_xyzw is not None:
        quaternions = np.array(parsed.orientation_xyzw)
        off = np.abs(np.linalg.norm(quaternions, axis=1) - 1.0)
        if (off > UNIT_TOLERANCE).any():
            row = int(np.argmax(off > UNIT_TOLERANCE))
            raise _reject(
                index,
                Fault(
                    _place(index, "orientation_xyzw", row),
                    "a quaternion of norm 1 within 0.001",
                    f"norm {np.linalg.norm(quaternions[row]):.6g}",
                    "the quaternion is not unit.",
                ),
            )
        rotation = rotation_of_quaternion(quaternions)
    path = ToolPath(parsed.id, index, parsed.frame_id, time_s, position, rotation)
    _check_continuous(path)
    return path


def check_size(index: int, steps: int, samples: int) -> None:
    """Refuses a candidate whose prediction would not fit in memory.

    Raises:
        CandidateRejected: It is too long, or too long for so many samples.
    """
    if steps > MAX_STEPS or steps * samples > MAX_POSTURES:
        raise _reject(
            index,
            Fault(
                _place(index, "time_s"),
                f"at most {MAX_STEPS} steps, and {MAX_POSTURES} steps times samples",
                f"{steps} steps, {steps * samples} steps times samples",
                "the trajectory is too long; split it, or ask for fewer samples.",
            ),
        )


def _check_continuous(path: ToolPath) -> None:
    step = np.diff(path.time_s)
    speed = np.linalg.norm(np.diff(path.position, axis=0), axis=1) / step
    if speed.max() > MAX_SPEED_M_S:
        row = int(np.argmax(speed)) + 1
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "position_m", row),
                f"at most {MAX_SPEED_M_S:g} m/s from the point before",
                f"{speed[row - 1]:.3g} m/s",
                f"the path jumps at {path.time_s[row]:g} s.",
            ),
        )
    if path.rotation is not None:
        turn = rotation_angle(path.rotation[1:], path.rotation[:-1]) / step
        if turn.max() > MAX_TURN_RAD_S:
            row = int(np.argmax(turn)) + 1
            raise _reject(
                path.index,
                Fault(
                    _place(path.index, "orientation_xyzw", row),
                    f"at most {MAX_TURN_RAD_S:.3g} rad/s from the point before",
                    f"{turn[row - 1]:.3g} rad/s",
                    f"the orientation jumps at {path.time_s[row]:g} s.",
                ),
            )


def hand_path(
    path: ToolPath,
    frames: dict[str, Pose],
    grasps: tuple[Pose, ...] | None,
    start_hands: tuple[Pose, ...] | None,
) -> HandPath:
    """Returns where the hand must go in the world, and checks that it begins where it is.

    Args:
        path: The tool's way.
        frames: ``T_world_frame`` by frame id.
        grasps: ``T_tool_hand`` of the led hand, or of both; None takes them from the start.
        start_hands: ``T_world_hand`` in the start posture; None if that is not known, and the
            grasps are.

    Raises:
        CandidateRejected: The frame is not known, the grasp needs an orientation that is not
            given, or the hand does not start at the trajectory's first point.
    """
    frame = frames.get(path.frame_id)
    if frame is None:
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "frame_id"),
                "one of " + ", ".join(sorted(frames)),
                shorten(path.frame_id),
                f"the frame {path.frame_id!r} is not given in `frames`.",
            ),
        )
    held = grasps if start_hands is None else start_hands
    assert held is not None
    if path.rotation is None:
        if len(held) > 1:
            raise _reject(
                path.index,
                Fault(
                    _place(path.index, "orientation_xyzw"),
                    "orientations, since both hands hold the object",
                    "none",
                    "where each hand is cannot be told from the object's position alone.",
                ),
            )
        start = None if start_hands is None else start_hands[0]
        return _position_path(path, frame, None if grasps is None else grasps[0], start)
    tool = frame @ Pose(path.rotation, path.position)
    first = tool[0]
    held_m = 0.0
    if grasps is None:
        assert start_hands is not None
        held_m = max(_check_held(path, first.position, start) for start in start_hands)
        grasps = tuple(first.inverse() @ start for start in start_hands)
    for grasp, start in zip(grasps, start_hands or (), strict=start_hands is not None):
        _check_start(path, first @ grasp, start)
    if len(grasps) == 1:
        return HandPath(path.time_s, tool @ grasps[0], False, (IDENTITY,), held_m)
    return HandPath(path.time_s, tool, False, grasps, held_m)


def _position_path(
    path: ToolPath, frame: Pose, grasp: Pose | None, start_hand: Pose | None
) -> HandPath:
    tool = (frame.rotation @ path.position[..., None])[..., 0] + frame.position
    if grasp is not None and np.linalg.norm(grasp.position) > 1e-9:
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "orientation_xyzw"),
                "orientations, since T_tool_hand has an offset",
                "none",
                "where the hand is cannot be told from the tool's position alone.",
            ),
        )
    if start_hand is None:
        # Which way the hand points is then not known; the task does not ask.
        start_hand = Pose(IDENTITY.rotation, tool[0])
    held_m = _check_held(path, tool[0], start_hand) if grasp is None else 0.0
    offset = start_hand.position - tool[0] if grasp is None else np.zeros(3)
    position = tool + offset
    rotation = np.broadcast_to(start_hand.rotation, (len(position), 3, 3))
    hand = Pose(rotation, position)
    _check_start(path, hand[0], start_hand)
    return HandPath(path.time_s, hand, True, (IDENTITY,), held_m)


def _check_held(path: ToolPath, first: Array, start: Pose) -> float:
    """Returns how far the hand is from the tool's point that it is taken to hold, m."""
    distance = float(np.linalg.norm(first - start.position))
    if distance > MAX_GRASP_M:
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "position_m", 0),
                f"within {MAX_GRASP_M:g} m of the hand's start at {_words(start.position)}",
                f"{distance:.3f} m away",
                "the hand cannot hold a tool so far away; start posture and trajectory do not "
                "meet, or are in different frames.",
            ),
        )
    return distance


def _words(position: Array) -> str:
    return ", ".join(f"{x:.3f}" for x in position)


def _check_start(path: ToolPath, first: Pose, start: Pose) -> None:
    distance = float(np.linalg.norm(first.position - start.position))
    angle = float(rotation_angle(first.rotation, start.rotation))
    if distance > START_DISTANCE_M:
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "position_m", 0),
                f"within {START_DISTANCE_M:g} m of the hand's start at {_words(start.position)}",
                f"{distance:.3f} m away",
                "the start posture does not meet the trajectory's first point.",
            ),
        )
    if angle > START_ANGLE_RAD:
        raise _reject(
            path.index,
            Fault(
                _place(path.index, "orientation_xyzw", 0),
                f"within {np.rad2deg(START_ANGLE_RAD):g} deg of the hand's orientation",
                f"{np.rad2deg(angle):.1f} deg off",
                "the hand's orientation in the start posture does not meet the trajectory.",
            ),
        )
