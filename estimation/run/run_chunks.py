"""Turns estimates into what a run gives out: named columns, loads of the hands, what is known."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from estimation.effort import joint_efforts, joint_load
from estimation.estimate_record import Estimate
from estimation.model_uncertainty import ModelSpread, in_world
from estimation.payload import LEAST_PULL, payload
from estimation.run.hands import states_by_hand
from estimation.run.payload_holds import HoldFrames
from estimation.run.run_records import QUANTILES, Balance, RunChunk, RunSettings
from estimation.run.run_sensors import FEET, HANDS
from estimation.spatial import GRAVITY_MS2, Array, BoolArray, IntArray, times, transposed

LOW_BACK = "jL5S1"


@dataclass(frozen=True, slots=True)
class Loads:
    """What the free hands bear.

    Attributes:
        settings: of the run.
        hands: whether the right and the left hand may bear something.
        mass_kg: ``(n,)`` by the inertial definition, which the hands' state goes by.
        sd_kg: ``(n,)`` as wide as the bands are, or None.
        known: ``(n,)`` whether the mass can be told at all.
        quantiles_kg: ``(n, 3)`` by the definition of the settings.
        force: ``(n, 3)`` N, world axes, all free hands together.
        noise_covariance: ``(n, 3, 3)`` N^2 without errors of the model, or None.
        pull: ``(n, 3)`` m/s^2, world axes, mean proper acceleration of the free hands.
        hand_kg: ``(n, 2)`` of each side.
        hand_sd_kg: ``(n, 2)``, or None.
        hand_known: ``(n, 2)``.
    """

    settings: RunSettings
    hands: tuple[bool, bool]
    mass_kg: Array
    sd_kg: Array | None
    known: BoolArray
    quantiles_kg: Array
    force: Array
    noise_covariance: Array | None
    pull: Array
    hand_kg: Array
    hand_sd_kg: Array | None
    hand_known: BoolArray

    def select(self, rows: IntArray) -> "Loads":
        """Returns some of the frames."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        settings, hands = values.pop("settings"), values.pop("hands")
        cut: dict[str, Any] = {
            name: None if value is None else value[rows] for name, value in values.items()
        }
        return Loads(settings=settings, hands=hands, **cut)


def loads_of(noise: Estimate, wide: Estimate, settings: RunSettings, balance: IntArray) -> Loads:
    """Reads the free hands' loads off an estimate.

    Args:
        noise: the estimate with bands that hold the sensors' noise alone.
        wide: the same with the bands that are given out.
        settings: of the run.
        balance: ``(n,)`` a `Balance` each.
    """
    n = len(noise.frames)
    hand_kg, hand_known = np.zeros((n, 2)), np.zeros((n, 2), dtype=np.bool_)
    if not noise.sites:
        nothing = np.zeros((n, 3))
        return Loads(
            settings=settings,
            hands=(False, False),
            mass_kg=np.zeros(n),
            sd_kg=None,
            known=np.zeros(n, dtype=np.bool_),
            quantiles_kg=nothing,
            force=nothing,
            noise_covariance=None,
            pull=nothing,
            hand_kg=hand_kg,
            hand_sd_kg=None if noise.torque_sd is None else np.zeros((n, 2)),
            hand_known=hand_known,
        )
    before, held = payload(noise), payload(wide)
    chosen = held if settings.definition == "inertial" else payload(wide, settings.definition)
    # Inverse dynamics estimates no load: it takes what nothing measured to bear nothing.
    told = (balance != Balance.UNKNOWN) & (noise.method != "deterministic")
    known = ~held.weightless & told
    if noise.bands == "uncertainty" and before.sd_kg is not None:
        known = ~held.weightless & (before.sd_kg * GRAVITY_MS2 <= settings.known_within_n)
    quantiles = chosen.quantiles_kg
    links = [noise.link(name) for name in noise.sites]
    turn = noise.link_rotation[:, links]
    pull = np.mean(times(turn, noise.link_acceleration[:, links, :3]), axis=1)
    hand_sd = None if wide.site_covariance is None else np.zeros((n, 2))
    for place, name in enumerate(noise.sites):
        side, link = HANDS.index(name), links[place]
        accel = noise.link_acceleration[:, link, :3]
        size = np.maximum(np.sum(accel**2, axis=1), LEAST_PULL**2)
        along = -accel / size[:, None]
        hand_kg[:, side] = np.sum(along * noise.external_wrench[:, link, :3], axis=1)
        part = slice(6 * place, 6 * place + 3)
        if wide.site_covariance is not None and noise.site_covariance is not None:
            assert hand_sd is not None
            sds = [
                np.sqrt(np.einsum("ni,nij,nj->n", along, whole[:, part, part], along))
                for whole in (noise.site_covariance, wide.site_covariance)
            ]
            hand_sd[:, side] = sds[1]
            hand_known[:, side] = sds[0] * GRAVITY_MS2 <= settings.known_within_n
    return Loads(
        settings=settings,
        hands=(HANDS[0] in noise.sites, HANDS[1] in noise.sites),
        mass_kg=held.mass_kg,
        sd_kg=held.sd_kg,
        known=known,
        quantiles_kg=np.repeat(chosen.mass_kg[:, None], 3, axis=1)
        if quantiles is None
        else quantiles,
        force=held.force_world,
        noise_covariance=before.force_covariance,
        pull=pull,
        hand_kg=hand_kg,
        hand_sd_kg=hand_sd,
        hand_known=hand_known & (known & held.split_observable)[:, None],
    )


def hold_frames(
    noise: Estimate, spread: ModelSpread | None, time_s: Array, state: IntArray, loads: Loads
) -> HoldFrames:
    """Gathers what holds are weighed from.

    Args:
        noise: the estimate with bands that hold the sensors' noise alone.
        spread: what drawn models change, or None.
        time_s: ``(n,)`` s.
        state: ``(n,)`` a `HandState` each, of all free hands together.
        loads: of the same frames.
    """
    links = [noise.link(name) for name in noise.sites]
    parts = times(noise.link_rotation[:, links], noise.external_wrench[:, links, :3])
    deviation = np.zeros((0, len(time_s), 3))
    if spread is not None:
        together = np.sum(spread.external_wrench[:, :, links, :3], axis=2)
        deviation = spread.at(together, time_s)
    assert loads.noise_covariance is not None
    sides = [HANDS.index(name) for name in noise.sites]
    return HoldFrames(
        time_s=time_s,
        state=state,
        force=loads.force,
        covariance=loads.noise_covariance,
        pull=loads.pull,
        deviation=deviation,
        parts=parts,
        parts_known=np.all(loads.hand_known[:, sides], axis=1),
    )


def chunk_of(
    wide: Estimate,
    time_s: Array,
    frames: IntArray,
    balance: IntArray,
    joints: BoolArray,
    loads: Loads,
    state: IntArray,
    chance: Array,
) -> RunChunk:
    """Makes a chunk.

    Args:
        wide: the estimate with the bands to give out.
        time_s: ``(n,)`` s.
        frames: ``(n,)`` their numbers.
        balance: ``(n,)``.
        joints: ``(n, m)`` whether the moment of each joint that turns is known.
        loads: of the free hands.
        state: ``(n,)`` of all free hands together.
        chance: ``(n,)`` of a load.
    """
    tree = wide.tree
    efforts = joint_efforts(wide, QUANTILES)
    turning = [link for link in range(1, tree.n_links) if len(tree.dofs[link])]
    torque_known = np.zeros((len(time_s), tree.n_dof), dtype=np.bool_)
    for column, link in enumerate(turning):
        torque_known[:, tree.dofs[link]] = joints[:, column, None]
    back = joint_load(wide, LOW_BACK)
    feet, feet_sd = _ends(wide, FEET)
    hands, hands_sd = _ends(wide, HANDS)
    if hands_sd is not None:
        _exact_hands(wide, hands_sd)
    world = in_world(wide.residual, wide.link_rotation[:, 0])
    quantiles = efforts.quantiles_nm
    return RunChunk(
        time_s=time_s,
        frames=frames,
        torque_nm=wide.torque,
        torque_sd_nm=wide.torque_sd,
        torque_known=torque_known,
        effort_nm=np.repeat(efforts.effort_nm[..., None], 3, axis=-1)
        if quantiles is None
        else quantiles,
        effort_known=joints,
        low_back_force_n=back.force,
        low_back_force_sd_n=back.force_sd,
        low_back_moment_nm=back.moment,
        low_back_moment_sd_nm=back.moment_sd,
        low_back_known=joints[:, efforts.joint_names.index(LOW_BACK)],
        foot_wrench=feet,
        foot_wrench_sd=feet_sd,
        hand_wrench=hands,
        hand_wrench_sd=hands_sd,
        payload_kg=loads.quantiles_kg,
        payload_known=loads.known,
        hand_kg=loads.hand_kg,
        hand_kg_sd=loads.hand_sd_kg,
        hand_kg_known=loads.hand_known,
        hand_state=states_by_hand(
            state, loads.hands, loads.hand_kg, loads.hand_known, loads.settings.loaded_kg
        ),
        hands_state=state,
        loaded_probability=chance,
        balance=balance,
        residual_n=world[:, :3],
        residual_nm=world[:, 3:],
    )


def _ends(wide: Estimate, names: tuple[str, ...]) -> tuple[Array, Array | None]:
    """Returns ``(n, 2, 6)`` wrenches in world axes, and standard deviations as if uncorrelated."""
    links = [wide.link(name) for name in names]
    rotation = wide.link_rotation[:, links]
    wrench = in_world(wide.external_wrench[:, links], rotation)
    if wide.external_wrench_sd is None:
        return wrench, None
    variance = in_world(wide.external_wrench_sd[:, links] ** 2, rotation**2)
    return wrench, np.sqrt(variance)


def _exact_hands(wide: Estimate, sd: Array) -> None:
    """Puts in the standard deviations of free hands, whose whole covariance is known."""
    if wide.site_covariance is None:
        return
    for place, name in enumerate(wide.sites):
        turn = wide.link_rotation[:, wide.link(name)]
        for part in (0, 3):
            block = slice(6 * place + part, 6 * place + part + 3)
            world = turn @ wide.site_covariance[:, block, block] @ transposed(turn)
            sd[:, HANDS.index(name), part : part + 3] = np.sqrt(
                np.diagonal(world, axis1=-2, axis2=-1)
            )
