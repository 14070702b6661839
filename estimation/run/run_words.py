"""Says in words what a run assumes, and where body and plates disagree."""

from collections.abc import Sequence

from estimation.run.run_records import PayloadHold, RunSettings
from estimation.run.run_sensors import SIDEWAYS_SHARE
from estimation.stance_calibration import StanceCalibration

#: Body mass and plates may differ by so much of the body before it is a finding.
MASS_GAP_SHARE = 0.03


def settings_in_words(
    settings: RunSettings,
    hands: Sequence[str],
    tare: StanceCalibration | None,
    model_kg: float,
) -> list[str]:
    """Returns what a run assumes.

    Args:
        settings: of the run.
        hands: sides whose hand is free to bear.
        tare: what the unloaded stance said, or None.
        model_kg: the model's mass before the tare.
    """
    out = []
    if tare is not None:
        out.append(
            f"body mass: set from the model's {model_kg:.2f} kg to the {tare.mass_kg:.2f} kg with "
            f"which the plates balance, +- {tare.sd_kg:.2f} kg; all parts alike"
        )
    elif hands:
        out.append(
            f"body mass: the model's {model_kg:.2f} kg; a kilogram too much there is one too "
            "little in the hands; give an unloaded stance to be sure"
        )
    if hands:
        out.append(
            f"{' and '.join(hands)} hand: may bear 0 +- {settings.hand_force_sd_n:g} N and "
            f"0 +- {settings.hand_moment_sd_nm:g} N m about the hand's centre"
        )
        if len(hands) > 1:
            out.append(
                "a load found in both hands: each bears half of it, give or take any split between "
                f"nothing and all, and may press sideways with {100 * SIDEWAYS_SHARE:g} % of it"
            )
    else:
        out.append("hands: bear nothing")
    errors = settings.model_errors
    if errors is not None and settings.method == "one_step":
        out.append(
            f"bands hold errors (standard deviations) of {100 * errors.segment_mass:g} % of each "
            f"segment's mass, {100 * errors.segment_length:g} % of its length, "
            f"{errors.joint_angle_deg:g} deg of each joint angle and "
            f"{1000 * errors.plate_offset_m:g} mm of each foot's point of force, the same through "
            "the run; each foot "
            + ("was seen on its plate" if errors.feet_seen else "may be beside its plate's force")
        )
    if settings.unobserved:
        out.append(
            f"{', '.join(settings.unobserved)}: not seen, at a reference posture; their joints are "
            "not known, and their weight is uncertain to all above"
        )
    return out


def hold_in_words(hold: PayloadHold) -> str:
    """Returns what to look for where hands would have to pull upwards, or nothing."""
    most = hold.mass().quantiles_kg
    if most is None or most[2] >= 0.0:
        return ""
    return (
        f"from {hold.start_s:.2f} to {hold.end_s:.2f} s the hands would bear "
        f"{hold.mass().mass_kg:.1f} kg, less than nothing: something else bears the person, body "
        "mass is too high, or the motion is too quick for its derived accelerations"
    )


def mass_in_words(gap_kg: float, body_kg: float) -> str:
    """Returns what to look for where the plates bear more or less than the body, or nothing."""
    if abs(gap_kg) <= MASS_GAP_SHARE * body_kg:
        return ""
    more = "more" if gap_kg > 0.0 else "less"
    return (
        f"the plates bear {abs(gap_kg):.1f} kg {more} than the body of {body_kg:.1f} kg: check the "
        "person's mass, the plates' units, and that nothing else bears or loads the person"
    )
