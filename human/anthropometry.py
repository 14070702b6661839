"""Published body proportions: lengths, masses and centres of mass of the 23 segments.

The tables are ``human/data/anthropometry.json``; each entry there names its source. This module
turns them into metres and kilograms for one person, and says how the trunk, which the tables cut in
three, is divided over the model's five trunk segments and two shoulder girdles.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from human.model import Subject

#: Trunk segments from the hips up, each from its own joint to the next one's.
TRUNK = ("Pelvis", "L5", "L3", "T12", "T8")


@cache
def anthropometry_table() -> dict[str, Any]:
    """Returns the published tables as read from the data file; do not change them."""
    table: dict[str, Any] = json.loads(
        files("human").joinpath("data/anthropometry.json").read_text("utf-8")
    )
    return table


@dataclass(frozen=True, slots=True)
class BodyPlan:
    """One person's lengths and masses, right side standing for both.

    Attributes:
        length_m: named lengths and heights in metres; see `body_plan`.
        mass_kg: mass of each segment by name, both sides, summing to the person's mass but for
            rounding.
        com_fraction: centre of mass of the limb segments, as a fraction of their length from the
            proximal joint.
    """

    length_m: Mapping[str, float]
    mass_kg: Mapping[str, float]
    com_fraction: Mapping[str, float]


def body_plan(subject: Subject) -> BodyPlan:
    """Scales the published tables to one person.

    Lengths are proportional to stature, masses to body mass; for sex ``unknown`` the result is the
    mean of the two sexes'.

    Source: de Leva 1996 table 4 (masses, centres of mass, arm lengths, height of C7); Winter 2009
    figure 4.1, after Drillis and Contini 1966 (legs, shoulder height, foot); Dumas and Wojtusch
    2018 (hip and lumbar joint centres); Gray 1918 (proportions of the column).
    """
    sexes = ("female", "male") if subject.sex == "unknown" else (subject.sex,)
    plans = [_plan_of_sex(subject, sex) for sex in sexes]

    def mean(key: str) -> dict[str, float]:
        tables = [getattr(plan, key) for plan in plans]
        return {name: sum(table[name] for table in tables) / len(tables) for name in tables[0]}

    return BodyPlan(mean("length_m"), mean("mass_kg"), mean("com_fraction"))


def _plan_of_sex(subject: Subject, sex: str) -> BodyPlan:
    table = anthropometry_table()
    deleva = table["deleva"][sex]
    length = _lengths(subject.height_m, sex)
    percent = deleva["mass_percent"]
    # The published percentages sum to 99.99 for women: shared out in proportion.
    total = sum(percent[n] for n in ("head_neck", "upper_trunk", "middle_trunk", "lower_trunk"))
    total += 2.0 * sum(
        percent[n] for n in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    )
    part = {name: subject.mass_kg * value / total for name, value in percent.items()}

    split = table["split"]
    girdle = split["each_girdle_of_upper_trunk"] * part["upper_trunk"]
    mass = _trunk_masses(length, part)
    mass["T8"] -= 2.0 * girdle
    mass["Neck"] = split["neck_of_head_neck"] * part["head_neck"]
    mass["Head"] = part["head_neck"] - mass["Neck"]
    toe = _toe_share() * part["foot"]
    for side in ("Right", "Left"):
        mass[f"{side}Shoulder"] = girdle
        mass[f"{side}UpperArm"] = part["upper_arm"]
        mass[f"{side}ForeArm"] = part["forearm"]
        mass[f"{side}Hand"] = part["hand"]
        mass[f"{side}UpperLeg"] = part["thigh"]
        mass[f"{side}LowerLeg"] = part["shank"]
        mass[f"{side}Foot"] = part["foot"] - toe
        mass[f"{side}Toe"] = toe

    com = dict(deleva["com_fraction"])
    knuckle = com.pop("hand_to_knuckle")
    com["hand"] = knuckle * deleva["length_m"]["wrist_to_knuckle"] / deleva["length_m"]["hand"]
    return BodyPlan(length, mass, com)


def _lengths(height_m: float, sex: str) -> dict[str, float]:
    """Returns lengths and heights above the sole (``*_height``), metres."""
    table = anthropometry_table()
    out = {name: row["value"] * height_m for name, row in table["stature_fraction"].items()}
    deleva = table["deleva"][sex]
    scale = height_m / deleva["stature_m"]
    for name in ("upper_arm", "forearm", "hand", "wrist_to_knuckle"):
        out[name] = deleva["length_m"][name] * scale
    pelvis = table["pelvis"][sex]
    pelvis_width = pelvis["width_m"] * height_m / pelvis["stature_m"]
    out["hip_half_breadth"] = pelvis["hip_lateral"] * pelvis_width

    out["hip_height"] = out["foot_height"] + out["shank"] + out["thigh"]
    low = out["hip_height"] + pelvis["hip_below_lumbar"] * pelvis_width
    high = height_m - deleva["length_m"]["vertex_to_cervicale"] * scale
    column = table["column"]
    lumbar, thoracic = column["lumbar_cm"], column["thoracic_cm"]
    levels = {
        "jL5S1": 0.0,
        # Two lumbar levels up; the top of the lumbar column; four thoracic levels above that.
        "jL4L3": 2.0 / column["lumbar_levels"] * lumbar,
        "jL1T12": lumbar,
        "jT9T8": lumbar + 4.0 / column["thoracic_levels"] * thoracic,
        "jT1C7": lumbar + thoracic,
    }
    for joint, along in levels.items():
        out[f"{joint}_height"] = low + (high - low) * along / (lumbar + thoracic)
    out["jC1Head_height"] = high + out["neck"]
    out["stature"] = height_m
    # Tops of de Leva's lower and middle trunk: the navel and the lower end of the breastbone.
    out["navel_height"] = out["hip_height"] + deleva["length_m"]["omphalion_to_mid_hip"] * scale
    out["xiphion_height"] = out["navel_height"] + deleva["length_m"]["xiphion_to_omphalion"] * scale
    return out


def _trunk_masses(length: Mapping[str, float], part: Mapping[str, float]) -> dict[str, float]:
    """Cuts de Leva's three trunk parts at the heights of the model's joints.

    Derived here: each published part is spread evenly over its own height (the upper one up to C7,
    where the head and neck begin), and each model segment takes what lies between its joint and the
    next.
    """
    cuts = [
        length["hip_height"],
        *(length[f"{j}_height"] for j in ("jL5S1", "jL4L3", "jL1T12", "jT9T8")),
    ]
    cuts.append(length["jT1C7_height"])
    parts = (
        (length["hip_height"], length["navel_height"], part["lower_trunk"]),
        (length["navel_height"], length["xiphion_height"], part["middle_trunk"]),
        (length["xiphion_height"], length["jT1C7_height"], part["upper_trunk"]),
    )
    mass = {}
    for segment, bottom, top in zip(TRUNK, cuts[:-1], cuts[1:], strict=True):
        mass[segment] = sum(
            max(0.0, min(top, high) - max(bottom, low)) / (high - low) * kg
            for low, high, kg in parts
        )
    return mass


def _toe_share() -> float:
    """Share of the foot's mass before the ball, by the volume of two blocks of equal breadth."""
    foot = anthropometry_table()["foot"]
    behind = foot["ball_from_heel"]
    before = (1.0 - behind) * foot["toe_height_ratio"]
    return float(before / (behind + before))
