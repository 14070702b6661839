"""Reaching: a person stands and is led by one hand, out and back, or along a robot's trajectory."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from human.model import HumanModel
from human.motion import Provenance
from human.simulate.body import BodyPaths, in_contact, whole_body
from human.simulate.errors import SimulationError
from human.simulate.ground import solve_dynamics
from human.simulate.legs import legs_of
from human.simulate.operators import Operator, coherent_noise
from human.simulate.paths import MinimumJerkPath, PosePath, PoseSamples, minimum_jerk_path
from human.simulate.records import SimulatedMotion, Truth
from human.simulate.resolve import Law, LimbChain, Resolved, TipPaths, follow
from human.simulate.stance import Stance, sole_center

Array = NDArray[np.float64]

#: Targets are redrawn this often before giving up.
_TRIES = 40
#: Longest movement, for which noise is kept ready [s].
_LONGEST_S = 10.0


def hand_frame(hand: str) -> str:
    """Returns the frame name of the ``right`` or ``left`` hand.

    Raises:
        SimulationError: another word.
    """
    if hand not in ("right", "left"):
        raise SimulationError(f"hand must be 'right' or 'left', got {hand!r}")
    return f"{hand.capitalize()}HandCOM"


def standing_configuration(
    model: HumanModel, operator: Operator, stance: Stance | None = None
) -> Array:
    """Returns how an operator stands at ease: comfortable, both feet on the floor.

    Args:
        model: the person's body.
        operator: the person.
        stance: where; at the world origin looking along x if not given.

    Returns:
        Configuration, ``7 + n_dof``.
    """
    stance = stance or Stance()
    legs = legs_of(model)
    pelvis = _still(stance.pelvis(legs), stance.rotation).sample([0.0])
    q = model.neutral()
    q[:3] = pelvis.position[0]
    q[3:7] = Rotation.from_matrix(pelvis.rotation[0]).as_quat()
    q[7:] = operator.comfort.neutral
    for leg in legs:
        toes = [model.dof_names.index(f"j{leg.side}BallFoot_rot{axis}") for axis in "xyz"]
        q[7 + np.array(toes)] = 0.0
        foot = _still(stance.ankle(leg), stance.rotation).sample([0.0])
        q[7 + leg.dof] = leg.angles(pelvis, foot)[0]
    return q


def simulate_reaching(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    *,
    movements: int = 20,
    targets: Sequence[tuple[Array, Array]] | None = None,
    hand: str = "right",
    hold_orientation: bool = False,
    rate_hz: float = 60.0,
) -> SimulatedMotion:
    """Simulates a person who is led by the hand to targets and back, with minimum jerk.

    The pelvis and the other arm rest, so that the law of the hand's chain (24 degrees of freedom)
    is exactly the operator's.

    Args:
        model: the person's body.
        operator: the person.
        rng: source of all randomness.
        movements: number of out-and-back movements, if targets are to be drawn.
        targets: hand poses to be led to, position ``3`` [m] and rotation ``3 x 3``, world.
        hand: which one is led.
        hold_orientation: whether drawn targets keep the orientation of the hand.
        rate_hz: samples per second.

    Returns:
        One recording; ``truth.segment_id`` counts the movements, with pauses between them.

    Raises:
        SimulationError: a target cannot be reached within the joint limits.
    """
    if not (rate_hz > 0.0 and movements > 0):
        raise SimulationError(
            f"rate_hz and movements must be positive, got {rate_hz} and {movements}"
        )
    frame = hand_frame(hand)
    q_start = standing_configuration(model, operator)
    law = chain_law(model, operator, (frame,))
    pelvis = _pelvis_of(q_start)
    home = _hand_in_world(law, q_start, pelvis)
    count = movements if targets is None else len(targets)
    noise = coherent_noise(
        rng,
        operator.null_noise[law.chain.dof],
        start_s=0.0,
        end_s=count * _LONGEST_S,
        memory_s=operator.noise_time_s,
    )
    step = 1.0 / rate_hz
    pause = max(1, round(operator.reaction_s / step))
    posture, tick = q_start[7 + law.chain.dof], 0
    pieces: list[Resolved] = []
    hand_pieces: list[PoseSamples] = []
    ids: list[NDArray[np.int64]] = []
    for movement in range(count):
        for attempt in range(_TRIES):
            if targets is None:
                target = _drawn_target(law, operator, home, pelvis, rng, hold_orientation)
            else:
                target = targets[movement]
            leg_ticks = _ticks(home, target, operator.pace_m_s * rng.uniform(0.7, 1.4), step)
            path = _out_and_back(home, target, (tick + pause) * step, leg_ticks * step, rng)
            ticks = np.arange(tick, tick + pause + 2 * leg_ticks + 1)
            time_s = ticks.astype(np.float64) * step
            try:
                piece = follow(law, _seen(path, pelvis), time_s, posture, noise)
            except SimulationError:
                if targets is not None or attempt == _TRIES - 1:
                    raise
                continue
            break
        last = movement == count - 1
        kept = slice(None, None if last else -1)
        pieces.append(piece[kept])
        hand_pieces.append(path.sample(time_s[kept]))
        ids.append(np.where(ticks[kept] >= tick + pause, movement, -1))
        posture, tick = piece.q[-1], int(ticks[-1])
    time_s = np.arange(tick + 1, dtype=np.float64) * step
    return _recorded(
        model,
        operator,
        law,
        q_start,
        time_s,
        Resolved.joined(pieces),
        PoseSamples.joined(hand_pieces),
        np.concatenate(ids),
        None,
    )


def simulate_following(
    model: HumanModel,
    operator: Operator,
    path: PosePath,
    rng: np.random.Generator,
    *,
    hand: str = "right",
    q_start: Array | None = None,
    load_kg: float = 0.0,
    rate_hz: float = 60.0,
) -> SimulatedMotion:
    """Simulates what a person does while a robot leads one hand along a path.

    Args:
        model: the person's body.
        operator: the person.
        path: hand poses, world axes.
        rng: source of all randomness.
        hand: which one is led.
        q_start: whole-body configuration to start from; standing at ease if not given. The hand
            must be at the start of the path to within what one small step corrects.
        load_kg: mass the hand bears.
        rate_hz: samples per second.

    Raises:
        SimulationError: the path cannot be reached, or leads a joint beyond its limit.
    """
    frame = hand_frame(hand)
    q = standing_configuration(model, operator) if q_start is None else np.array(q_start)
    law = chain_law(model, operator, (frame,))
    noise = coherent_noise(
        rng,
        operator.null_noise[law.chain.dof],
        start_s=path.start_s,
        end_s=path.end_s,
        memory_s=operator.noise_time_s,
    )
    steps = max(2, int(np.ceil((path.end_s - path.start_s) * rate_hz)))
    time_s = path.start_s + np.arange(steps + 1) / rate_hz
    course = follow(law, _seen(path, _pelvis_of(q)), time_s, q[7 + law.chain.dof], noise)
    ids = np.zeros(time_s.size, dtype=np.int64)
    loads = {frame: np.full(time_s.size, load_kg)} if load_kg else None
    return _recorded(model, operator, law, q, time_s, course, path.sample(time_s), ids, loads)


def chain_law(model: HumanModel, operator: Operator, tips: tuple[str, ...]) -> Law:
    """Returns the law of an operator for the joints between the pelvis and some frames."""
    chain = LimbChain(model, tips)
    return Law(chain, operator.mobility[chain.dof], operator.comfort.of(chain.dof))


def _recorded(
    model: HumanModel,
    operator: Operator,
    law: Law,
    q_start: Array,
    time_s: Array,
    course: Resolved,
    hand: PoseSamples,
    segment_id: NDArray[np.int64],
    loads: dict[str, Array] | None,
) -> SimulatedMotion:
    """Returns the whole-body record of who stands still but for the led chain."""
    legs = legs_of(model)
    data = model.pinocchio().createData()
    pin.framesForwardKinematics(model.pinocchio(), data, q_start)
    ankles = [data.oMf[model.pinocchio().getFrameId(f"{leg.side}Foot")].copy() for leg in legs]
    feet = [_still(M.translation, M.rotation) for M in ankles]
    always = np.array([[-np.inf, np.inf]])
    paths = BodyPaths(_pelvis_of(q_start), (feet[0], feet[1]), (always, always))
    rest = q_start[7:]
    motion = whole_body(
        model,
        legs,
        paths,
        time_s,
        lambda t: np.tile(rest, (t.size, 1)),
        (law.chain.dof, course),
        Provenance("simulated: led by the hand", steps=(f"operator kind {operator.kind}",)),
    )
    soles = [
        sole_center(leg, M.translation, M.rotation) for leg, M in zip(legs, ankles, strict=True)
    ]
    T = time_s.size
    contact = in_contact(paths.contacts, time_s)
    return SimulatedMotion(
        motion,
        Truth(
            operator=operator,
            dof=law.chain.dof,
            noise=course.noise,
            hands={law.chain.tips[0]: hand},
            segment_id=segment_id,
            load_kg=loads or {},
            contact_right=contact[0],
            contact_left=contact[1],
            dynamics=solve_dynamics(
                model,
                motion,
                loads or {},
                feet=(np.tile(soles[0], (T, 1)), np.tile(soles[1], (T, 1))),
                contact=contact,
            ),
        ),
    )


def _still(position: Array, rotation: Array) -> MinimumJerkPath:
    return minimum_jerk_path([0.0, 1.0], np.tile(position, (2, 1)), rotation)


def _pelvis_of(q: Array) -> MinimumJerkPath:
    return _still(q[:3], Rotation.from_quat(q[3:7]).as_matrix())


def _seen(path: PosePath, pelvis: PosePath) -> TipPaths:
    return lambda t: [path.sample(t).seen_from(pelvis.sample(t))]


def _hand_in_world(law: Law, q: Array, pelvis: PosePath) -> tuple[Array, Array]:
    position, rotation, _ = law.chain.pose_and_jacobian(q[7 + law.chain.dof])
    zero = np.zeros((1, 3))
    hand = PoseSamples(position, rotation, zero, zero).carried_by(pelvis.sample([0.0]))
    return hand.position[0], hand.rotation[0]


def _drawn_target(
    law: Law,
    operator: Operator,
    home: tuple[Array, Array],
    pelvis: PosePath,
    rng: np.random.Generator,
    hold_orientation: bool,
) -> tuple[Array, Array]:
    """Draws a posture about the comfortable one and returns where it has the hand.

    Drawn by the mobilities, so that what moves easily moves far; between 15 and 55 cm from home.
    """
    comfort = law.comfort
    for _ in range(1000):
        spread = 0.35 * np.sqrt(law.mobility) * rng.standard_normal(law.mobility.size)
        q = np.clip(comfort.neutral + spread, comfort.lower + 0.2, comfort.upper - 0.2)
        full = np.zeros(7 + operator.mobility.size)
        full[7 + law.chain.dof] = q
        position, rotation = _hand_in_world(law, full, pelvis)
        if 0.15 < np.linalg.norm(position - home[0]) < 0.55:
            return position, home[1] if hold_orientation else rotation
    raise SimulationError("no target between 15 and 55 cm from the hand found; check the limits")


def _ticks(
    home: tuple[Array, Array], target: tuple[Array, Array], pace_m_s: float, step: float
) -> int:
    """Returns how many samples one way takes; turning counts a quarter of a metre per radian."""
    turn = float(np.linalg.norm(pin.log3(home[1].T @ target[1])))
    way = float(np.linalg.norm(target[0] - home[0])) + 0.25 * turn
    return int(np.clip(np.ceil(way / pace_m_s / step), 1.0 / step, 0.4 * _LONGEST_S / step))


def _out_and_back(
    home: tuple[Array, Array],
    target: tuple[Array, Array],
    start_s: float,
    way_s: float,
    rng: np.random.Generator,
) -> MinimumJerkPath:
    bow = rng.normal(scale=0.03, size=(2, 3))
    return minimum_jerk_path(
        start_s + way_s * np.arange(3),
        [home[0], target[0], home[0]],
        np.array([home[1], target[1], home[1]]),
        bow,
    )
