"""What a recording says about forces, as measurements of the estimator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.feet.foot_force_record import SIDES, FootForce, FootForces, FootState
from estimation.run.run_records import Balance, RunSettings
from estimation.sensors import ACCEPTED_VARIANCE, ForceTorque, FreeWrench, Measurement
from estimation.spatial import GRAVITY_MS2, Array, BoolArray, IntArray, cross
from estimation.tree import EstimationTree

FEET = ("RightFoot", "LeftFoot")
HANDS = ("RightHandCOM", "LeftHandCOM")
#: A foot that stands where nothing measures bears 0 with these standard deviations, N and N m.
UNMEASURED_SD = 2000.0
#: Where the plates bear less than the person by this share of weight, something else bears them.
PROPPED_SHARE = 0.1
#: Where errors of the model are stated, the pelvis takes up the moment by which they make body and
#: plates disagree: so many metres of the body's weight. Else the hands would, as a load.
PELVIS_LEVER_M = 0.02
#: How hard a segment that nothing saw may turn about the last joint that was seen, rad/s^2.
UNSEEN_TURNING = 5.0
#: How far beside the hand's centre an unnoticed load may push, m.
EMPTY_LEVER_M = 0.1
#: How hard two hands that hold a thing between them may press on it sideways, as a share of what
#: they bear: palms that hold it by friction alone press with half of it where friction is 1.
SIDEWAYS_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class FootFrames:
    """What the feet's sensors are made of, at some frames.

    Attributes:
        propped: ``(n,)`` whether something else than the plates bears a part of the person.
        usable: ``(n, 2)`` whether each foot's wrench is known.
        balance: ``(n,)`` a `Balance` each.
        mended: ``(n, 2)`` whether a wrench that was called known is not a finite one with a
            covariance that double precision carries.
    """

    propped: BoolArray
    usable: BoolArray
    balance: IntArray
    mended: BoolArray


def foot_frames(
    feet: FootForces | None, frames: int, body_kg: float, tare_kg: float = 0.0
) -> FootFrames:
    """Returns which frames' foot forces can be used, by state and by their numbers.

    Args:
        feet: at these frames, or None.
        frames: how many.
        body_kg: the person's mass.
        tare_kg: how much that is above the mass which the foot forces were made with.
    """
    if feet is None:
        nothing = np.zeros((frames, 2), dtype=np.bool_)
        unknown = np.full(frames, int(Balance.UNKNOWN))
        return FootFrames(nothing[:, 0], nothing, unknown, nothing)
    pair = (feet.right, feet.left)
    stated = np.stack([foot.usable for foot in pair], axis=1)
    sound = np.stack([_sound(foot) for foot in pair], axis=1)
    usable = stated & sound
    shared = np.any(
        np.stack([foot.state == FootState.SHARED for foot in pair], axis=1) & usable, axis=1
    )
    balance = np.where(shared, int(Balance.SPLIT_UNKNOWN), int(Balance.KNOWN))
    whole = np.all(usable, axis=1)
    propped = np.zeros(frames, dtype=np.bool_)
    if feet.missing_n is not None:
        missing_kg = feet.missing_n / GRAVITY_MS2 + tare_kg
        propped = whole & (missing_kg > PROPPED_SHARE * body_kg)
    balance = np.where(whole & ~propped, balance, int(Balance.UNKNOWN))
    return FootFrames(propped, usable, balance, stated & ~sound)


def _sound(foot: FootForce) -> BoolArray:
    low, high = ACCEPTED_VARIANCE
    return np.asarray(
        np.isfinite(foot.wrench).all(axis=1)
        & np.isfinite(foot.point).all(axis=1)
        & (foot.variance >= low).all(axis=1)
        & (foot.variance <= high).all(axis=1)
    )


def foot_sensors(feet: FootForces | None, usable: BoolArray, pelvis: Array) -> list[ForceTorque]:
    """Makes a force sensor for each foot, wide open where its wrench is not known.

    Args:
        feet: at these frames.
        usable: ``(n, 2)`` from `foot_frames`.
        pelvis: ``(n, 3)`` m, where a wrench that is not known is told about.
    """
    out = []
    for side, name in enumerate(FEET):
        known = usable[:, side]
        value = np.zeros((len(pelvis), 6))
        variance = np.full((len(pelvis), 6), UNMEASURED_SD**2)
        point = pelvis.copy()
        if feet is not None:
            foot = (feet.right, feet.left)[side]
            point[known], variance[known] = foot.point[known], foot.variance[known]
            value[known] = foot.wrench[known]
            value[known, 3:] -= cross(point[known], value[known, :3])
        blocks = variance[:, :, None] * np.eye(6)
        out.append(ForceTorque(name, value, blocks, point, fixed_to="world"))
    return out


def free_hands(settings: RunSettings, has_feet: bool) -> tuple[str, ...]:
    """Returns the sides whose hand may bear something."""
    if settings.free_hands == "auto":
        return SIDES if has_feet else ()
    named = {"both": SIDES, "none": ()}
    return named.get(settings.free_hands, (settings.free_hands,))


def body_sensors(
    tree: EstimationTree,
    settings: RunSettings,
    hands: Sequence[str],
    propped: BoolArray,
    unseen: Mapping[str, BoolArray],
) -> list[Measurement]:
    """Says what may push on the body but the ground: loads, a seat, and what is not seen.

    Args:
        tree: the links.
        settings: of the run.
        hands: sides whose hand is free to bear.
        propped: ``(n,)`` frames in which something may push on the pelvis as hard as it likes.
        unseen: segments to the frames ``(n,)`` on which nothing measured their posture.
    """
    out: list[Measurement] = [
        FreeWrench(HANDS[SIDES.index(side)], settings.hand_force_sd_n, settings.hand_moment_sd_nm)
        for side in hands
    ]
    if settings.method != "one_step":
        return out
    stated = settings.covariances
    untouched = np.repeat([stated.untouched_force_sd, stated.untouched_moment_sd], 3)
    slack: dict[str, Array] = {}
    pelvis = tree.link_names[0]
    if settings.model_errors is not None:
        moment = PELVIS_LEVER_M * tree.mass_kg * GRAVITY_MS2
        slack[pelvis] = np.array([*untouched[:3], moment, moment, moment])
    for link, sd in unseen_wrenches(tree, tuple(unseen)).items():
        where = unseen[link]
        here = sd if np.all(where) else np.where(where[:, None], sd, untouched)
        slack[link] = np.hypot(slack.get(link, 0.0), here)
    if np.any(propped):
        rest = slack.get(pelvis, untouched)
        slack[pelvis] = np.where(propped[:, None], UNMEASURED_SD, rest)
    for link, sd in slack.items():
        variance = sd**2 if sd.ndim == 1 else (sd**2)[:, :, None] * np.eye(6)
        out.append(ForceTorque(link, np.zeros((len(propped), 6)), variance))
    return out


def empty_hands(
    settings: RunSettings, mass_kg: Array, sd_kg: Array | None, pull: Array
) -> list[Measurement]:
    """Says that hands in which no load was found bear nothing but what may have gone unnoticed.

    Args:
        settings: of the run.
        mass_kg: ``(n,)`` kg, what the hands together seem to bear.
        sd_kg: ``(n,)`` kg, as wide as the bands are, or None.
        pull: ``(n, 2, 3)`` unit, line along which a load pulls, axes of the right and left hand.

    Derived here: a load of which the balance says ``m +- s`` has the mean square ``m^2 + s^2``, and
    either hand may bear all of it.
    """
    least = 0.5 * settings.loaded_kg
    spread = 0.0 if sd_kg is None else sd_kg
    most = np.maximum(mass_kg**2 + np.square(spread), least**2)
    variance = np.zeros((len(mass_kg), 2, 6, 6))
    along = pull[..., :, None] * pull[..., None, :]
    variance[..., :3, :3] = least**2 * np.eye(3) + (most - least**2)[:, None, None, None] * along
    variance[..., 3:, 3:] = EMPTY_LEVER_M**2 * most[:, None, None, None] * np.eye(3)
    variance *= GRAVITY_MS2**2
    nothing = np.zeros((len(mass_kg), 6))
    return [ForceTorque(hand, nothing, variance[:, side]) for side, hand in enumerate(HANDS)]


def both_hands_load(settings: RunSettings, force: Array, sd_kg: Array | None) -> list[Measurement]:
    """Says how two hands may share a load of which their sum was found.

    Args:
        settings: of the run.
        force: ``(n, 2, 3)`` N, what the load does to both hands together, axes of the right and of
            the left hand.
        sd_kg: ``(n,)`` kg, of the load, as wide as the bands are, or None.

    Derived here: a hand bears anything between nothing and all, evenly: half, give or take
    ``1 / sqrt(12)`` of it along the load. Stated of each hand is twice that variance, because the
    balance, which knows the sum of both, halves it. Sideways a hand may press as hard as
    `SIDEWAYS_SHARE` says, as hands do that hold a thing between them.
    """
    size = np.linalg.norm(force, axis=-1)
    along = force[..., :, None] * force[..., None, :] / np.maximum(size**2, 1e-12)[..., None, None]
    unsure = 0.0 if sd_kg is None else (GRAVITY_MS2 * sd_kg[:, None]) ** 2
    sideways = (SIDEWAYS_SHARE * size) ** 2
    lengthways = size**2 / 6.0 + unsure - sideways
    variance = np.zeros((*force.shape[:-1], 6, 6))
    variance[..., :3, :3] = (
        sideways[..., None, None] * np.eye(3) + lengthways[..., None, None] * along
    )
    variance[..., 3:, 3:] = settings.hand_moment_sd_nm**2 * np.eye(3)
    value = np.concatenate([0.5 * force, np.zeros_like(force)], axis=-1)
    return [ForceTorque(hand, value[:, k], variance[:, k]) for k, hand in enumerate(HANDS)]


def unseen_wrenches(tree: EstimationTree, unobserved: Sequence[str]) -> dict[str, Array]:
    """Returns by how much weight and inertia of segments that nothing saw may be wrong.

    Args:
        tree: the links.
        unobserved: the segments.

    Returns:
        Link to ``(6,)`` standard deviations, N and N m.

    Derived here: a segment at a reference posture weighs what it weighs, but hangs somewhere within
    its reach ``r`` of the last joint that was seen, and moves in a way that nobody measured.
    """
    out = {}
    for name in unobserved:
        link = tree.link_names.index(name)
        mass = float(tree.inertias[link, 0, 0])
        if mass <= 0.0:
            continue
        lower = tree.inertias[link, 3:, :3] / mass
        reach = float(np.linalg.norm([lower[2, 1], lower[0, 2], lower[1, 0]]))
        above = link
        while above > 0 and tree.link_names[tree.parents[above]] in unobserved:
            reach += float(np.linalg.norm(tree.offsets[above]))
            above = tree.parents[above]
        swing = UNSEEN_TURNING * reach
        force, moment = mass * swing, mass * float(np.hypot(GRAVITY_MS2, swing)) * reach
        out[name] = np.array([force] * 3 + [moment] * 3)
    return out
