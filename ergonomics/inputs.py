"""From measured angles and the task to what RULA and REBA ask for."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .angles import ArmAngles, PostureAngles, Side
from .errors import PostureError
from .evidence import Evidence
from .method_data import method_data
from .reba_arrays import RebaInputs, score_reba_interval
from .rula_arrays import RulaInputs, score_rula_interval
from .rules import DEFAULT_RULES, ScoringRules
from .task import Assumption, SecondaryThresholds, TaskContext

UpperArm = Literal["elevation", "sagittal"]
DEFAULT_THRESHOLDS = SecondaryThresholds()

#: Segments whose pose a part is read from; ``*`` stands for the side.
_SEGMENTS_OF_PART = {
    "upper_arm": ("T8", "*Shoulder", "*UpperArm", "*ForeArm"),
    "lower_arm": ("T8", "*UpperArm", "*ForeArm", "*Hand"),
    "wrist": ("*ForeArm", "*Hand"),
    "wrist_twist": ("*UpperArm", "*ForeArm", "*Hand"),
    "neck": ("T8", "Head"),
    "trunk": ("Pelvis", "T8"),
}
_LEG_SEGMENTS = tuple(f"{s}{part}" for s in ("Left", "Right") for part in ("UpperLeg", "LowerLeg"))


def rula_inputs(
    angles: PostureAngles,
    *,
    side: Side,
    task: TaskContext | None = None,
    thresholds: SecondaryThresholds = DEFAULT_THRESHOLDS,
    rules: ScoringRules = DEFAULT_RULES,
    upper_arm: UpperArm = "elevation",
) -> RulaInputs:
    """Returns the RULA inputs of one side.

    Args:
        angles: Measured angles ``(...)``.
        side: The arm to score.
        task: Load, support, time; what is None there is assumed and named by
            ``task.assumptions()``.
        thresholds: Where angles tick boxes.
        rules: The profile decides the points of a load.
        upper_arm: ``elevation`` scores a raise in any direction, ``sagittal`` only its forward
            part, so that a sideways raise of 90 degrees counts 2 instead of 4 points.

    Raises:
        PostureError: If the side was not measured.
    """
    task = task or TaskContext()
    arm = _arm(angles, side)
    evidence = _arm_evidence(arm, thresholds) | _body_evidence(angles, thresholds)
    twist = Evidence("forearm twisted", np.abs(arm.pronation_deg), thresholds.forearm_twist_end_deg)
    boxes: dict[str, tuple[Evidence, ...]] = {
        "upper_arm.shoulder_raised": (evidence["raised"],),
        "upper_arm.abducted": (evidence["abducted"],),
        "lower_arm.across_midline_or_out_to_side": (evidence["across"], evidence["outside"]),
        "wrist.deviated": (evidence["deviated"],),
        "wrist.twist": (twist,),
        "neck.twisted": (evidence["neck_twisted"],),
        "neck.side_bent": (evidence["neck_bent"],),
        "trunk.twisted": (evidence["trunk_twisted"],),
        "trunk.side_bent": (evidence["trunk_bent"],),
    }
    muscle = int(bool(task.static) or bool(task.repeated))
    unmeasured = _unmeasured(angles, side, ("wrist_twist",))
    if task.legs is None and not angles.unmeasured.isdisjoint(_LEG_SEGMENTS):
        unmeasured |= {"legs"}
    notes: dict[str, str] = {}
    force = {}
    for half, load in (("a", task.hand_load_kg), ("b", task.body_load_kg)):
        force[half] = _force_points(load, task, rules)
        notes |= _load_note(f"force_{half}", force[half], load, task)
    return RulaInputs(
        upper_arm_deg=_upper_arm(arm, upper_arm),
        lower_arm_deg=arm.elbow_deg,
        wrist_deg=arm.wrist_flexion_deg,
        neck_deg=angles.neck_flexion_deg,
        trunk_deg=angles.trunk_flexion_deg,
        shoulder_raised=_ticked(boxes["upper_arm.shoulder_raised"]),
        abducted=_ticked(boxes["upper_arm.abducted"]),
        supported=bool(task.arm_supported),
        across_midline_or_out_to_side=_ticked(boxes["lower_arm.across_midline_or_out_to_side"]),
        wrist_deviated=_ticked(boxes["wrist.deviated"]),
        wrist_twist_end=_ticked(boxes["wrist.twist"]),
        neck_twisted=_ticked(boxes["neck.twisted"]),
        neck_side_bent=_ticked(boxes["neck.side_bent"]),
        trunk_twisted=_ticked(boxes["trunk.twisted"]),
        trunk_side_bent=_ticked(boxes["trunk.side_bent"]),
        seated_supported=task.seated_supported,
        legs_supported=task.legs != "one",
        muscle_a=muscle,
        muscle_b=muscle,
        force_a=force["a"],
        force_b=force["b"],
        unmeasured=unmeasured,
        evidence=boxes,
        notes=notes,
    )


def reba_inputs(
    angles: PostureAngles,
    *,
    side: Side,
    task: TaskContext | None = None,
    thresholds: SecondaryThresholds = DEFAULT_THRESHOLDS,
    upper_arm: UpperArm = "elevation",
) -> RebaInputs:
    """Returns the REBA inputs of one side; the knee is the worse of the two.

    Args:
        angles: Measured angles ``(...)``.
        side: The arm to score.
        task: Load, grip, support, time; what is None there is assumed and named by
            ``task.assumptions()``.
        thresholds: Where angles tick boxes.
        upper_arm: As for ``rula_inputs``.

    Raises:
        PostureError: If the side was not measured.
    """
    task = task or TaskContext()
    arm = _arm(angles, side)
    evidence = _arm_evidence(arm, thresholds) | _body_evidence(angles, thresholds)
    turned = Evidence("upper arm rotated", np.abs(arm.rotation_deg), thresholds.rotated_deg)
    twist = Evidence("forearm twisted", np.abs(arm.pronation_deg), thresholds.forearm_twist_end_deg)
    boxes: dict[str, tuple[Evidence, ...]] = {
        "upper_arm.shoulder_raised": (evidence["raised"],),
        "upper_arm.abducted_or_rotated": (evidence["abducted"], turned),
        "wrist.deviated_or_twisted": (evidence["deviated"], twist),
        "neck.twisted": (evidence["neck_twisted"],),
        "neck.side_bent": (evidence["neck_bent"],),
        "trunk.twisted": (evidence["trunk_twisted"],),
        "trunk.side_bent": (evidence["trunk_bent"],),
    }
    data = method_data("reba").other
    small, large = data["load"]["limits_kg"]
    kg = task.body_load_kg
    load = (kg >= small).astype(np.uint8) + (kg > large)
    if task.force_mode == "shock":
        load = load + np.uint8(data["load"]["shock"])
    unmeasured = _unmeasured(angles, side, ())
    if not angles.unmeasured.isdisjoint(_LEG_SEGMENTS) and task.legs != "sitting":
        unmeasured |= {"legs"}
    return RebaInputs(
        neck_deg=angles.neck_flexion_deg,
        trunk_deg=angles.trunk_flexion_deg,
        knee_deg=np.maximum(angles.knee_deg["left"], angles.knee_deg["right"]),
        upper_arm_deg=_upper_arm(arm, upper_arm),
        lower_arm_deg=arm.elbow_deg,
        wrist_deg=arm.wrist_flexion_deg,
        neck_twisted=_ticked(boxes["neck.twisted"]),
        neck_side_bent=_ticked(boxes["neck.side_bent"]),
        trunk_twisted=_ticked(boxes["trunk.twisted"]),
        trunk_side_bent=_ticked(boxes["trunk.side_bent"]),
        bilateral=task.legs != "one",
        sitting=task.legs == "sitting",
        shoulder_raised=_ticked(boxes["upper_arm.shoulder_raised"]),
        abducted_or_rotated=_ticked(boxes["upper_arm.abducted_or_rotated"]),
        supported_or_gravity_assisted=bool(task.arm_supported),
        wrist_deviated_or_twisted=_ticked(boxes["wrist.deviated_or_twisted"]),
        static_over_1min=bool(task.static),
        repeated_over_4_per_min=bool(task.repeated),
        rapid_large_change_or_unstable=bool(task.rapid_change),
        load=load,
        coupling=int(data["coupling"][task.coupling or "good"]),
        unmeasured=unmeasured,
        evidence=boxes,
        notes=_load_note("load", load, kg, task),
    )


def with_effects(
    assumptions: Iterable[Assumption],
    rula: RulaInputs | None = None,
    reba: RebaInputs | None = None,
    rules: ScoringRules = DEFAULT_RULES,
) -> tuple[Assumption, ...]:
    """Works out the range that each assumption opens in the mean score.

    Args:
        assumptions: From ``TaskContext.assumptions``.
        rula: RULA inputs with the assumptions in force.
        reba: REBA inputs with the assumptions in force.
        rules: The conventions to apply.

    Returns:
        The same assumptions with ``effect`` filled in.
    """
    known: dict[tuple[object, ...], list[float]] = {}

    def means(inputs: RulaInputs | RebaInputs, changes: Mapping[str, int | bool]) -> list[float]:
        # Several assumptions turn the same field over, and all are held against the same base.
        key = (type(inputs), *sorted(changes.items()))
        if key not in known:
            changed = replace(inputs, **changes)  # type: ignore[arg-type]
            ends = (
                score_rula_interval(changed, rules)
                if isinstance(changed, RulaInputs)
                else score_reba_interval(changed, rules)
            )
            known[key] = [float(ends.low.final.mean()), float(ends.high.final.mean())]
        return known[key]

    def effect(one: Assumption) -> str:
        words = []
        if rula is not None and one.rula:
            words.append(_span("RULA", means(rula, {}) + means(rula, one.rula)))
        if reba is not None and one.reba:
            words.append(_span("REBA", means(reba, {}) + means(reba, one.reba)))
        return "; ".join(words) or "none on these scores"

    return tuple(replace(one, effect=effect(one)) for one in assumptions)


def _span(method: str, means: list[float]) -> str:
    return f"{method} mean {min(means):.1f} to {max(means):.1f}"


def _arm(angles: PostureAngles, side: Side) -> ArmAngles:
    if side not in angles.arms:
        raise PostureError(
            "side", f"expected one of {sorted(angles.arms)}, got {side!r}: measure that side first"
        )
    return angles.arms[side]


def _upper_arm(arm: ArmAngles, convention: UpperArm) -> NDArray[np.float64]:
    return arm.upper_arm_deg if convention == "elevation" else arm.upper_arm_sagittal_deg


def _arm_evidence(arm: ArmAngles, at: SecondaryThresholds) -> dict[str, Evidence]:
    return {
        "raised": Evidence("shoulder raised", arm.shoulder_raise_deg, at.shoulder_raised_deg),
        "abducted": Evidence("upper arm abducted", arm.abduction_deg, at.abducted_deg),
        "across": Evidence(
            "lower arm across the midline by", arm.midline_crossing_m, at.across_midline_m, "m"
        ),
        "outside": Evidence(
            "lower arm out to the side by", arm.out_to_side_m, at.out_to_side_m, "m"
        ),
        "deviated": Evidence(
            "wrist deviated", np.abs(arm.wrist_deviation_deg), at.wrist_deviated_deg
        ),
    }


def _body_evidence(angles: PostureAngles, at: SecondaryThresholds) -> dict[str, Evidence]:
    return {
        name: Evidence(words, np.abs(value), limit)
        for name, words, value, limit in (
            ("neck_twisted", "neck twisted", angles.neck_twist_deg, at.neck_twisted_deg),
            ("neck_bent", "neck side-bent", angles.neck_bend_deg, at.neck_side_bent_deg),
            ("trunk_twisted", "trunk twisted", angles.trunk_twist_deg, at.trunk_twisted_deg),
            ("trunk_bent", "trunk side-bent", angles.trunk_bend_deg, at.trunk_side_bent_deg),
        )
    }


def _ticked(evidence: tuple[Evidence, ...]) -> NDArray[np.bool_]:
    ticked = evidence[0].exceeded()
    for another in evidence[1:]:
        ticked = ticked | another.exceeded()
    return ticked


def _unmeasured(angles: PostureAngles, side: Side, extra: tuple[str, ...]) -> frozenset[str]:
    parts = {"upper_arm", "lower_arm", "wrist", "neck", "trunk", *extra}
    missing = angles.unmeasured
    return frozenset(
        part
        for part in parts
        if any(s.replace("*", side.capitalize()) in missing for s in _SEGMENTS_OF_PART[part])
    )


def _force_points(
    kg: NDArray[np.float64], task: TaskContext, rules: ScoringRules
) -> NDArray[np.uint8]:
    data = method_data("rula").other["force"]
    small, large = data["limits_kg"]
    scores = np.asarray(data[rules.profile][task.force_mode], dtype=np.uint8)
    points: NDArray[np.uint8] = scores[(kg >= small).astype(np.intp) + (kg > large)]
    return points


def _load_note(
    name: str, points: NDArray[np.uint8], kg: NDArray[np.float64], task: TaskContext
) -> dict[str, str]:
    if task.load_kg is None and task.total_load_kg is None:
        return {name: f"{int(points)}: load not known, none assumed"}
    if kg.ndim:
        return {}
    return {name: f"{int(points)}: {round(float(kg), 2):g} kg, {task.force_mode}"}
