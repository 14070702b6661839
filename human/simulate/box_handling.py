"""Box handling: a person picks a box up, carries it on, and puts it down elsewhere."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from human.model import HumanModel
from human.motion import Motion, Provenance
from human.simulate.balance import balanced_pelvis, grid_of
from human.simulate.balanced_motion import on_grid, soles, standing_com
from human.simulate.body import BodyPaths, in_contact, refuse_beyond_limits, whole_body
from human.simulate.box_plan import DEFAULT_STATIONS, Station, plan_box_handling
from human.simulate.errors import SimulationError
from human.simulate.gait import Cadence, cadence_of
from human.simulate.ground import center_of_pressure, solve_dynamics
from human.simulate.legs import legs_of
from human.simulate.operators import Operator, coherent_noise
from human.simulate.paths import PosePath, PoseSamples
from human.simulate.reaching import chain_law, standing_configuration
from human.simulate.records import SimulatedMotion, Truth
from human.simulate.resolve import Resolved, follow
from human.simulate.walking import walking_angles

Array = NDArray[np.float64]

_HANDS = ("RightHandCOM", "LeftHandCOM")


def simulate_box_handling(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    *,
    stations: Sequence[Station] = DEFAULT_STATIONS,
    box_kg: float = 5.0,
    box_width_m: float = 0.36,
    hands: str = "both",
    cadence: Cadence | None = None,
    rate_hz: float = 60.0,
) -> SimulatedMotion:
    """Simulates a person who carries a box from each station to the next.

    The pelvis goes down by the operator's ``leg_share`` of what is lacking and leans by the rest,
    and keeps the balance; the feet step where the next stance is elsewhere. In the axes of the
    pelvis the hands are led exactly along their paths, and all joints between obey the operator's
    law.

    Args:
        model: the person's body.
        operator: the person.
        rng: source of all randomness.
        stations: two or more; the box is taken at each but the last, and left at each but the
            first.
        box_kg: mass of the box, taken as a point between the hands; each bears half, or the one
            all.
        box_width_m: distance of the hands on it.
        hands: ``both`` or ``right``.
        cadence: how they walk.
        rate_hz: samples per second.

    Returns:
        One recording. ``truth.segment_id`` numbers the phases (reach, lift, carry, lower, return)
        in order through all carries, -1 while the hands rest.

    Raises:
        SimulationError: a station that cannot be reached from its stance.
    """
    if len(stations) < 2 or not rate_hz > 0.0 or not box_kg >= 0.0:
        raise SimulationError(
            "expected two or more stations, a positive rate and a mass; got "
            f"{len(stations)}, {rate_hz} and {box_kg}"
        )
    if hands not in ("both", "right"):
        raise SimulationError(f"hands must be 'both' or 'right', got {hands!r}")
    tips = _HANDS if hands == "both" else _HANDS[:1]
    legs = legs_of(model)
    plan = plan_box_handling(
        model, operator, legs, stations, cadence or cadence_of(legs), box_width_m, tips
    )
    law = chain_law(model, operator, tips)
    noise = coherent_noise(
        rng,
        operator.null_noise[law.chain.dof],
        start_s=-1.0,
        end_s=plan.end_s + 1.0,
        memory_s=operator.noise_time_s,
    )
    hanging = walking_angles(model, operator, rng, plan.footfalls, plan.end_s)
    start = standing_configuration(model, operator, stations[0].stance)[7 + law.chain.dof]
    grid = grid_of(-0.5, plan.end_s + 0.5)
    provenance = Provenance("simulated: box handling", steps=(f"operator kind {operator.kind}",))

    def motion_of(pelvis: PosePath, t: Array, *, strict: bool) -> tuple[Motion, Resolved]:
        def seen(at: Array) -> list[PoseSamples]:
            frame = pelvis.sample(at)
            return [path.sample(at).seen_from(frame) for path in plan.hands]

        course = follow(law, seen, t, start, noise, within_limits=strict)
        paths = BodyPaths(pelvis, plan.footfalls.feet, plan.footfalls.contacts)
        led = law.chain.dof, course
        return whole_body(model, legs, paths, t, hanging, led, provenance), course

    def loads(t: Array) -> dict[str, Array]:
        return dict.fromkeys(tips, plan.load(t) * box_kg / len(tips))

    def pressure(pelvis: PosePath) -> Array:
        return on_grid(
            grid,
            lambda t: center_of_pressure(model, motion_of(pelvis, t, strict=False)[0], loads(t)),
        )

    com = standing_com(model, standing_configuration(model, operator)[7:], legs)
    pelvis = balanced_pelvis(legs, plan.footfalls, plan.bearing(grid), com, pressure)
    time_s = np.arange(int(np.floor(plan.end_s * rate_hz)) + 1, dtype=np.float64) / rate_hz
    motion, course = motion_of(pelvis, time_s, strict=True)
    refuse_beyond_limits(model, motion)
    contact = in_contact(plan.footfalls.contacts, time_s)
    truth = Truth(
        operator=operator,
        dof=law.chain.dof,
        noise=course.noise,
        hands={tip: path.sample(time_s) for tip, path in zip(tips, plan.hands, strict=True)},
        segment_id=plan.phase(time_s),
        load_kg=loads(time_s),
        contact_right=contact[0],
        contact_left=contact[1],
        dynamics=solve_dynamics(
            model,
            motion,
            loads(time_s),
            feet=soles(legs, plan.footfalls, time_s),
            contact=contact,
        ),
    )
    return SimulatedMotion(motion, truth)
