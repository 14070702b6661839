"""Worked cases: angles and boxes in, every published intermediate score out.

The scores are facts read off the published tables; each case has been scored alike by several
independent implementations.
"""

from typing import Any

Case = tuple[str, str, dict[str, Any], dict[str, int]]

_RULA_FIELDS = (
    "upper_arm lower_arm wrist wrist_twist posture_a muscle_a force_a score_c "
    "neck trunk legs posture_b muscle_b force_b score_d final action_level"
).split()
_REBA_FIELDS = (
    "neck trunk legs table_a load score_a upper_arm lower_arm wrist table_b coupling score_b "
    "score_c activity final action_level"
).split()


def _rula(name: str, scores: str, **sheet: Any) -> Case:
    numbers = map(int, scores.split())
    return "rula", name, sheet, dict(zip(_RULA_FIELDS, numbers, strict=True))


def _reba(name: str, scores: str, **sheet: Any) -> Case:
    numbers = map(int, scores.split())
    return "reba", name, sheet, dict(zip(_REBA_FIELDS, numbers, strict=True))


def _at(angle: float, **flags: Any) -> dict[str, Any]:
    return {"flexion_deg": angle, **flags}


_STANDING = {"supported_balanced": True}

CASES: tuple[Case, ...] = (
    _rula(
        "relaxed standing",
        "1 1 1 1 1 0 0 1 1 1 1 1 0 0 1 1 1",
        upper_arm=_at(10),
        lower_arm=_at(75),
        wrist=_at(0, twist="mid"),
        neck=_at(7),
        trunk=_at(0),
        legs=_STANDING,
    ),
    _rula(
        "arm flexed by 30",
        "2 1 1 1 2 0 0 2 1 1 1 1 0 0 1 2 1",
        upper_arm=_at(30),
        lower_arm=_at(80),
        wrist=_at(0, twist="mid"),
        neck=_at(0),
        trunk=_at(0),
        legs=_STANDING,
    ),
    _rula(
        "arm at shoulder height",
        "3 2 2 1 4 0 0 4 1 1 1 1 0 0 1 3 2",
        upper_arm=_at(85),
        lower_arm=_at(50),
        wrist=_at(10, twist="mid"),
        neck=_at(0),
        trunk=_at(0),
        legs=_STANDING,
    ),
    _rula(
        "neck 25, trunk 40",
        "1 1 1 1 1 0 0 1 3 3 1 4 0 0 4 3 2",
        upper_arm=_at(0),
        lower_arm=_at(80),
        wrist=_at(0, twist="mid"),
        neck=_at(25),
        trunk=_at(40),
        legs=_STANDING,
    ),
    _rula(
        "keyboard work",
        "2 1 3 1 3 1 0 4 2 1 1 2 0 0 2 3 2",
        upper_arm=_at(25),
        lower_arm=_at(95),
        wrist=_at(20, twist="mid"),
        neck=_at(15),
        trunk=_at(0, seated_supported=True),
        legs=_STANDING,
        muscle_use_a=1,
    ),
    _rula(
        "reaching up, shoulder raised",
        "5 2 4 2 7 0 0 7 1 1 1 1 0 0 1 5 3",
        upper_arm=_at(100, shoulder_raised=True),
        lower_arm=_at(30),
        wrist=_at(20, twist="end", deviated=True),
        neck=_at(0),
        trunk=_at(0),
        legs=_STANDING,
    ),
    _reba(
        "relaxed standing",
        "1 1 1 1 0 1 1 1 1 1 0 1 1 0 1 0",
        neck=_at(12),
        trunk=_at(0),
        legs={"bilateral": True, "knee_flexion_deg": 0},
        upper_arm=_at(10),
        lower_arm=_at(75),
        wrist=_at(0),
    ),
    _reba(
        "stooped lift of 12 kg",
        "1 4 1 3 2 5 3 2 1 4 1 5 6 0 6 2",
        neck=_at(10),
        trunk=_at(70),
        legs={"bilateral": True, "knee_flexion_deg": 20},
        upper_arm=_at(60),
        lower_arm=_at(30),
        wrist=_at(0),
        load={"kg": 12},
        coupling="fair",
    ),
    _reba(
        "squatting lift of 7 kg",
        "1 3 3 5 1 6 3 1 1 3 0 3 6 0 6 2",
        neck=_at(10),
        trunk=_at(30),
        legs={"bilateral": True, "knee_flexion_deg": 80},
        upper_arm=_at(50),
        lower_arm=_at(80),
        wrist=_at(0),
        load={"kg": 7},
    ),
    _reba(
        "twisted trunk",
        "1 4 1 3 0 3 2 1 1 1 0 1 2 0 2 1",
        neck=_at(0),
        trunk=_at(30, twisted=True),
        legs={"bilateral": True, "knee_flexion_deg": 0},
        upper_arm=_at(30),
        lower_arm=_at(80),
        wrist=_at(0),
    ),
    _reba(
        "on one leg",
        "1 2 2 3 0 3 1 1 1 1 0 1 2 0 2 1",
        neck=_at(0),
        trunk=_at(10),
        legs={"bilateral": False, "knee_flexion_deg": 0},
        upper_arm=_at(0),
        lower_arm=_at(80),
        wrist=_at(0),
    ),
    _reba(
        "repeated reach",
        "1 2 1 2 0 2 3 2 3 5 0 5 4 1 5 2",
        neck=_at(0),
        trunk=_at(15),
        legs={"bilateral": True, "knee_flexion_deg": 0},
        upper_arm=_at(70),
        lower_arm=_at(40),
        wrist=_at(20, deviated_or_twisted=True),
        activity={"repeated_over_4_per_min": True},
    ),
)
