"""Markers on a simulated person: a named set placed on the model, and what cameras see of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.kinematics import forward_kinematics
from human.marker_recording import MarkerRecording
from human.markers.body import MarkerBody
from human.markers.marker_set import MarkerPlace, MarkerSet
from human.markers.recognise import known_marker_set
from human.model import HumanModel, Subject
from human.recording import ReadingReport
from human.simulate.errors import SimulationError
from human.simulate.sensor_noise import ALWAYS_THERE, PERFECT, Dropouts, SensorNoise, disturbed

Array = NDArray[np.float64]

#: Half a joint's breadth over stature, outer marker to inner marker.
_HALF_BREADTH = {"knee": 0.033, "ankle": 0.025, "elbow": 0.0215}
_WRIST_HALF = 0.015
#: The ankle's axis: turned outward from the knee's, rising inward.
_ANKLE_TURN, _ANKLE_TILT = np.deg2rad(15.0), np.deg2rad(7.3)
#: Depth of the chest from C7 to the breastbone over stature, and the dip of that line.
_CHEST_DEPTH = 0.075
_CHEST_DIP = np.deg2rad(26.0)
_PELVIS_DIP = np.deg2rad(12.0)
#: Depth of the pelvis over its width.
_PELVIS_DEPTH = 0.8
#: Turn between neighbours on a sphere that they cover evenly.
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
#: Distance of markers without a bony point from their segment's centre of mass, m.
_AROUND_M = 0.07


@dataclass(frozen=True, slots=True)
class MarkerNoise:
    """How cameras and skin err.

    Attributes:
        position: each marker's own [m]; its offset is a marker that was put on again elsewhere.
        dropouts: of each marker on its own.
    """

    position: SensorNoise = PERFECT
    dropouts: Dropouts = ALWAYS_THERE


def wear_markers(model: HumanModel, marker_set: MarkerSet | str) -> MarkerBody:
    """Puts a marker set on a model.

    Bony points sit where the published regressions, applied the other way round, have them on the
    model's joints; other markers are spread around their segments' centres of mass.

    Args:
        model: made by `human.generate_model` or `human.scale_model`.
        marker_set: the set, or the name of a known one.

    Raises:
        SimulationError: the model has no subject.
        MarkerSetError: no known set has that name.
    """
    if model.subject is None:
        raise SimulationError("expected a model of a known subject, got one without")
    worn = known_marker_set(marker_set) if isinstance(marker_set, str) else marker_set
    tracked = [place for place in worn.places if place.tracked]
    rest = forward_kinematics(model, model.neutral())
    carried: dict[str, int] = {}
    offsets = []
    for place in tracked:
        number = carried[place.segment] = carried.get(place.segment, -1) + 1
        home, at = _place(model, model.subject, place, number, worn)
        # The set may carry a point on a neighbour; in the T-pose all axes are parallel.
        offsets.append(at + rest.of(home)[1] - rest.of(place.segment)[1])
    segments = [place.segment for place in tracked]
    shown = {*segments, *(("L5", "L3", "T12") if "T8" in segments else ())}
    shown |= {"Neck"} if "Head" in segments else set()
    return MarkerBody(
        model=model,
        marker_names=tuple(place.name for place in tracked),
        segment=np.array([model.segment_index(name) for name in segments], dtype=np.intp),
        offset=np.array(offsets).reshape(-1, 3),
        sd_m=np.array([place.sd_m for place in tracked]),
        observed=tuple(name for name in model.segment_names if name in shown),
        notes=(f"Markers of the set {worn.name} put on the model.",),
    )


def simulate_markers(
    body: MarkerBody,
    time_s: ArrayLike,
    q: ArrayLike,
    rng: np.random.Generator,
    *,
    noise: MarkerNoise | None = None,
    source: str = "simulated.trc",
) -> MarkerRecording:
    """Records the markers of a moving person.

    Args:
        body: the person with the markers on.
        time_s: ``T`` [s].
        q: ``T x nq`` configurations.
        rng: source of all randomness.
        noise: how the markers err; not at all if not given.
        source: name of the file it pretends to be.
    """
    noise = noise or MarkerNoise()
    times = np.asarray(time_s, dtype=np.float64)
    poses = forward_kinematics(body.model, q)
    rotation, origin = poses.rotation[:, body.segment], poses.position[:, body.segment]
    true = origin + (rotation @ body.offset[..., None])[..., 0]
    position, valid = np.empty_like(true), np.ones(true.shape[:2], dtype=np.bool_)
    for k in range(len(body.marker_names)):
        position[:, k], _ = disturbed(true[:, k], noise.position, rng)
        valid[:, k] = _seen(times, noise.dropouts, rng)
    rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 100.0
    return MarkerRecording(
        source=source,
        format="trc",
        version="simulated",
        time_s=times,
        rate_hz=float(rate),
        marker_names=body.marker_names,
        position=np.where(valid[..., None], position, 0.0),
        valid=valid,
        events=(),
        plates=None,
        report=ReadingReport(),
        digest="",
    )


def _seen(times: Array, dropouts: Dropouts, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Returns the frames in which a marker is seen; unlike a sensor's, the first may be lost."""
    seen = np.ones(len(times), dtype=np.bool_)
    if dropouts.per_s > 0.0:
        now, end = float(times[0]) - dropouts.mean_s, float(times[-1])
        while (now := now + rng.exponential(1.0 / dropouts.per_s)) < end:
            back = now + rng.exponential(dropouts.mean_s)
            seen &= (times < now) | (times > back)
            now = back
    return seen


def _place(
    model: HumanModel, subject: Subject, place: MarkerPlace, number: int, worn: MarkerSet
) -> tuple[str, Array]:
    """Returns a segment and where a marker sits in its axes ``(3,)`` in the T-pose."""
    if place.role is None:
        return place.segment, _around(model, place.segment, number)
    side, _, point = place.role.partition("_")
    if side not in ("right", "left"):
        side, point = "", place.role
    return _bony_point(model, subject, side.capitalize(), point, worn)


def _bony_point(
    model: HumanModel, subject: Subject, side: str, point: str, worn: MarkerSet
) -> tuple[str, Array]:
    """Returns the segment that a bony point belongs to and its place there ``(3,)``."""
    out = -1.0 if side == "Right" else 1.0
    height = subject.height_m
    joint, _, way = point.partition("_")
    if joint in _HALF_BREADTH and way in ("lateral", "medial", "center"):
        sign = {"lateral": 1.0, "medial": -1.0, "center": 0.0}[way]
        half = sign * _HALF_BREADTH[joint] * height
        upper = {"knee": "UpperLeg", "ankle": "LowerLeg", "elbow": "UpperArm"}[joint]
        across = {
            "knee": _vector(0.0, out, 0.0),
            "ankle": _vector(-np.sin(_ANKLE_TURN), out * np.cos(_ANKLE_TURN), 0.0)
            * np.cos(_ANKLE_TILT)
            - _vector(0.0, 0.0, np.sin(_ANKLE_TILT)),
            "elbow": _vector(0.0, 0.0, 1.0),
        }[joint]
        return f"{side}{upper}", _offset(model, f"j{side}{joint.capitalize()}") + half * across
    if joint == "wrist":
        sign = {"radial": 1.0, "ulnar": -1.0, "center": 0.0}[way]
        across = _vector(sign * _WRIST_HALF * height, 0.0, 0.0)
        return f"{side}ForeArm", _offset(model, f"j{side}Wrist") + across
    if joint == "hand":
        # A set with one marker on the hand has it in the middle.
        apart = 0.0 if f"{side.lower()}_hand_fifth" not in worn.roles() else 0.025
        knuckle = model.frames[f"{side}HandCOM"].position
        return f"{side}Hand", knuckle + _vector(apart if way == "second" else -apart, 0.0, 0.0)
    if joint in ("heel", "toe"):
        return f"{side}Foot", _foot_point(model, side, point, out)
    if joint == "head":
        across = 0.0 if way == "top" else out * 0.07
        ahead = {"front": 0.09, "back": -0.09}.get(way, 0.0)
        return "Head", _vector(ahead, across, 0.2 if way == "top" else 0.12)
    if point in ("asis", "psis", "sacrum", "hip_center"):
        return "Pelvis", _pelvis_point(model, out, point, worn.pelvis_dip_deg)
    return "T8", _chest_point(model, subject, side, out, point)


def _foot_point(model: HumanModel, side: str, point: str, out: float) -> Array:
    ball = _offset(model, f"j{side}BallFoot")
    if point == "heel":
        return _vector(-0.35 * ball[0], 0.0, ball[2])
    across = {"toe_first": -0.035, "toe_second": 0.0, "toe_fifth": 0.035}[point]
    return ball + _vector(0.0, out * across, 0.02)


def _pelvis_point(model: HumanModel, out: float, point: str, dip_deg: float) -> Array:
    """Turns Harrington's regression round: a pelvis whose hips are the model's."""
    right, left = _offset(model, "jRightHip"), _offset(model, "jLeftHip")
    if point == "hip_center":
        return left if out > 0.0 else right
    width = (0.5 * (left[1] - right[1]) - 0.0073) / 0.33
    depth = _PELVIS_DEPTH * width
    front = _about_y(_PELVIS_DIP) @ _vector(0.24 * depth + 0.0099, 0.0, 0.30 * width + 0.0109)
    back = front + _about_y(np.deg2rad(dip_deg)) @ _vector(-depth, 0.0, 0.0)
    if point == "sacrum":
        return np.asarray(back)
    if point == "asis":
        return np.asarray(front + _vector(0.0, out * 0.5 * width, 0.0))
    return np.asarray(back + _vector(0.0, out * 0.2 * width, 0.0))


def _chest_point(model: HumanModel, subject: Subject, side: str, out: float, point: str) -> Array:
    """Turns Reed's regressions round: a chest whose neck and shoulder joints are the model's."""
    ratios = {"female": (0.53, 14.0), "male": (0.55, 8.0), "unknown": (0.54, 11.0)}
    ratio, above = ratios[subject.sex]
    depth = _CHEST_DEPTH * subject.height_m

    def along(angle_deg: float) -> Array:
        return _about_y(_CHEST_DIP - np.deg2rad(angle_deg)) @ _vector(1.0, 0.0, 0.0)

    c7 = _offset(model, "jT1C7") - ratio * depth * along(above)
    notch = c7 + depth * along(0.0)
    if point == "c7":
        return c7
    if point == "jugular_notch":
        return notch
    if point == "sternal":
        return notch + _vector(0.0, out * 0.02, 0.0)
    below = 0.5 * (c7 + notch) - _vector(0.0, 0.0, 0.11 * subject.height_m)
    if point in ("t8", "xiphoid"):
        return below + _vector(-0.06 if point == "t8" else 0.06, 0.0, 0.0) * subject.height_m
    shoulder = _offset(model, f"j{side}C7Shoulder") + _offset(model, f"j{side}Shoulder")
    if point == "shoulder_center":
        return shoulder
    if point == "acromion":
        return shoulder - 0.42 * depth * along(-67.0)
    raise SimulationError(f"no place is known for the bony point {point!r}")


def _around(model: HumanModel, segment: str, number: int) -> Array:
    """Returns the ``number``-th place around a segment's centre of mass, evenly spread."""
    z = 1.0 - 2.0 * ((0.37 + 0.618 * number) % 1.0)
    flat = np.sqrt(1.0 - z * z)
    way = np.array([flat * np.cos(_GOLDEN * number), flat * np.sin(_GOLDEN * number), z])
    center = model.centers_of_mass[model.segment_index(segment)]
    return np.asarray(center + _AROUND_M * way)


def _offset(model: HumanModel, joint: str) -> Array:
    return np.asarray(model.offsets[model.joint_names.index(joint)])


def _vector(x: float, y: float, z: float) -> Array:
    return np.array([x, y, z])


def _about_y(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
