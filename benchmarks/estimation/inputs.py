"""What stands before the estimator, on simulated people.

Contacts, base velocity, sensor places, plates given to feet, clocks.

Run with::

    python -m benchmarks.estimation.inputs

Prints each figure beside its bar and exits with 1 when one misses it. Real feet are held to real
plates by ``tests/recordings/test_contacts.py`` and ``test_foot_forces.py``.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.estimation.plates import plate_figures
from benchmarks.figure import Figure, shown
from estimation import (
    Contact,
    ContactDetector,
    Contacts,
    FootMotion,
    IllConditionedError,
    LinkMotion,
    base_velocity,
    classify_by_force,
    contacts_of_motion,
    place_imu,
    sole_motion,
)
from human import HumanModel, Subject, generate_model, motion_from_configurations
from human.rotations import quaternion_to_matrix
from human.simulate import (
    ImuMount,
    ImuNoise,
    SensorNoise,
    SimulatedMotion,
    Stance,
    imu_mounts,
    operator,
    simulate_imus,
    simulate_walking,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Standing added before and after each walk, as in the 2019 paper's task T4 [s].
STILL_S = 2.0
#: sd of one axis of the suit's velocity, its acceleration, height of the soles, force, joint rate.
VELOCITY_SD, ACCELERATION_SD, HEIGHT_SD, FORCE_SD, RATE_SD = 0.02, 0.1, 0.003, 1.0, 0.02
#: sd of joint angles where movement is differentiated from them [rad].
ANGLE_SD = 5e-4
#: A foot that bears more than this is loaded [N].
LOADED_N = 10.0
FRAMES_BAR, SWITCH_BAR_MS = 0.98, 60.0


@dataclass(frozen=True, slots=True)
class Steps:
    """A walk between two rests: times, truth and noisy measurements."""

    time_s: Array
    rest: Mask
    loaded: Mask
    vertical_n: Array
    feet: FootMotion
    weight_n: float


def figures() -> Iterator[Figure]:
    """Measures everything."""
    model = generate_model(Subject(1.75, 70.0, "male"))
    for seed, (kind, rate_hz) in enumerate(
        (("average", 50.0), ("stooper", 100.0), ("twister", 240.0))
    ):
        rng = np.random.default_rng(seed)
        walk = simulate_walking(
            model, operator(kind, rng, model), rng, route=(Stance(), Stance(x=3.0)), rate_hz=rate_hz
        )
        yield from contact_figures(with_rests(model, walk, rng), f"{kind}, {rate_hz:g} Hz")
        yield from position_figures(model, walk, rng, f"{kind}, {rate_hz:g} Hz")
        yield from base_figures(model, walk, rng, f"{kind}, {rate_hz:g} Hz")
    yield from placement_figures(model)
    yield from plate_figures(model)


def contact_figures(steps: Steps, who: str) -> Iterator[Figure]:
    """Frames at which both feet are told right, and the slowest switch."""
    slow = FootMotion(steps.feet.height_m, steps.feet.speed_m_s)
    cases: tuple[tuple[str, Contacts, Mask, bool], ...] = (
        ("movement", ContactDetector().classify(feet=steps.feet), steps.rest, True),
        (
            "movement and force",
            ContactDetector(steps.weight_n).classify(feet=steps.feet, vertical_n=steps.vertical_n),
            steps.rest,
            True,
        ),
        (
            "force, of loaded feet",
            ContactDetector(steps.weight_n).classify(vertical_n=steps.vertical_n),
            steps.loaded,
            True,
        ),
        (
            "offline by force, of loaded feet",
            classify_by_force(steps.vertical_n),
            steps.loaded,
            True,
        ),
        ("offline as printed, of loaded feet", as_printed(steps.vertical_n), steps.loaded, False),
        (
            "movement without accelerations",
            ContactDetector().classify(feet=slow),
            steps.rest,
            False,
        ),
    )
    for name, found, truth, held_to_bar in cases:
        share = float(np.all(found.feet == truth, axis=-1).mean())
        yield Figure(
            f"frames right by {name} ({who})", share, "share", FRAMES_BAR if held_to_bar else None
        )
        if held_to_bar:
            delay = slowest_switch(found, truth, steps.time_s)
            yield Figure(f"slowest switch by {name} ({who})", delay, "ms", most=SWITCH_BAR_MS)


def position_figures(
    model: HumanModel, walk: SimulatedMotion, rng: np.random.Generator, who: str
) -> Iterator[Figure]:
    """Where there are noisy positions and nothing else: offline, and live for comparison."""
    extra, count = round(STILL_S / float(walk.motion.time_s[1])), len(walk.motion)
    index = np.r_[np.zeros(extra, int), np.arange(count), np.full(extra, count - 1)]
    time_s = np.arange(len(index)) * float(walk.motion.time_s[1])
    q = walk.motion.q[index].copy()
    q[:, 7:] += rng.normal(scale=ANGLE_SD, size=q[:, 7:].shape)
    derived = motion_from_configurations(model.dof_names, time_s, q)
    rest = np.stack([walk.truth.contact_right, walk.truth.contact_left], axis=-1)[index]
    found = Contacts(contacts_of_motion(model, derived).feet)
    share = float(np.all(found.feet == rest, axis=-1).mean())
    yield Figure(
        f"frames right by positions alone, offline ({who})", share, "share", least=FRAMES_BAR
    )
    delay = slowest_switch(found, rest, np.asarray(time_s, dtype=np.float64))
    yield Figure(
        f"slowest switch by positions alone, offline ({who})", delay, "ms", most=SWITCH_BAR_MS
    )
    live = ContactDetector().classify(feet=sole_motion(model, derived.q, derived.v, derived.a))
    share = float(np.all(live.feet == rest, axis=-1).mean())
    yield Figure(f"frames right by positions alone, live ({who})", share, "share")


def base_figures(
    model: HumanModel, walk: SimulatedMotion, rng: np.random.Generator, who: str
) -> Iterator[Figure]:
    """Base velocity by the standing feet, with exact and with noisy joint rates."""
    motion, truth = walk.motion, walk.truth
    feet = [
        Contact("RightFoot", active=truth.contact_right),
        Contact("LeftFoot", active=truth.contact_left),
    ]
    exact = base_velocity(model, motion.q, motion.joint_rates, feet).twist_body
    yield Figure(
        f"largest base error, exact rates ({who})",
        float(np.abs(exact - motion.v[:, :6]).max()),
        "m/s",
        most=1e-5,
    )
    rates = motion.joint_rates + rng.normal(scale=RATE_SD, size=motion.joint_rates.shape)
    noisy = base_velocity(model, motion.q, rates, feet).twist_body[:, :3]
    error = float(np.sqrt(np.mean((noisy - motion.v[:, :3]) ** 2)))
    yield Figure(f"rms base error, joint rates {RATE_SD} rad/s ({who})", error, "m/s")


def placement_figures(model: HumanModel) -> Iterator[Figure]:
    """Places of sensors strapped on anyhow, from one walk, with noise and bias."""
    rng = np.random.default_rng(9)
    walk = simulate_walking(model, operator("average", rng, model), rng, rate_hz=100.0)
    segments = ("RightUpperArm", "RightForeArm", "RightUpperLeg", "RightLowerLeg", "RightFoot")
    mounts = imu_mounts(model, rng, segments)
    origins = [ImuMount(mount.segment, np.zeros(3), np.eye(3)) for mount in mounts]
    exact = simulate_imus(model, walk.motion, origins, rng)
    noise = ImuNoise(accelerometer=SensorNoise(sd=0.033, offset_sd=0.02))
    refused = []
    for mount, origin, reading in zip(
        mounts, exact, simulate_imus(model, walk.motion, mounts, rng, noise=noise), strict=True
    ):
        R = quaternion_to_matrix(origin.orientation_xyzw)
        omega = np.einsum("tij,tj->ti", R, origin.angular_velocity)
        acceleration = np.einsum("tij,tj->ti", R, origin.acceleration) - [0.0, 0.0, 9.81]
        alpha = np.gradient(omega, walk.motion.time_s, axis=0, edge_order=2)
        link = LinkMotion(R, omega, alpha, acceleration)
        attitude = quaternion_to_matrix(reading.orientation_xyzw)
        try:
            found = place_imu(
                link,
                reading.acceleration,
                attitude,
                estimate_bias=True,
                least_excitation_per_s2=0.1,
            )
        except IllConditionedError:
            refused.append(mount.segment)
            continue
        error = 1e3 * float(np.abs(found.position - mount.position).max())
        name = f"place of the {mount.segment} sensor, condition {found.condition_number:.3g}"
        yield Figure(name, error, "mm", most=20.0)
    # On a straight way a foot turns about one axis alone: its sensor must not be placed.
    right = float(refused == ["RightFoot"])
    yield Figure(f"refused as not determined: {', '.join(refused)}", right, "share", least=1.0)


def with_rests(model: HumanModel, walk: SimulatedMotion, rng: np.random.Generator) -> Steps:
    """Adds the rests and the noise."""
    motion, truth = walk.motion, walk.truth
    step = float(motion.time_s[1])
    extra, count = round(STILL_S / step), len(motion)
    index = np.r_[np.zeros(extra, int), np.arange(count), np.full(extra, count - 1)]
    soles = sole_motion(model, motion.q, motion.v, motion.a)
    feet = truth.dynamics.feet
    assert feet is not None
    force = feet[..., 2].T[index]

    def noisy(norm: object, sd: float) -> Array:
        vector = rng.normal(scale=sd, size=(len(index), 2, 2, 3))
        vector[..., 0] += np.asarray(norm)[index]
        return np.asarray(np.linalg.norm(vector, axis=-1))

    height = np.asarray(soles.height_m)[index]
    return Steps(
        time_s=np.asarray(np.arange(len(index)) * step, dtype=np.float64),
        rest=np.stack([truth.contact_right, truth.contact_left], axis=-1)[index],
        loaded=force > LOADED_N,
        vertical_n=force + rng.normal(scale=FORCE_SD, size=force.shape),
        feet=FootMotion(
            height + rng.normal(scale=HEIGHT_SD, size=height.shape),
            noisy(soles.speed_m_s, VELOCITY_SD),
            noisy(soles.acceleration_m_s2, ACCELERATION_SD),
        ),
        weight_n=9.81 * model.total_mass_kg,
    )


def as_printed(force: Array) -> Contacts:
    """The paper's Algorithm 1 to the letter."""
    difference = force[:, 0] - force[:, 1]
    double = np.abs(difference) <= force.sum(axis=1).mean()
    return Contacts(np.stack([double | (difference > 0.0), double | (difference <= 0.0)], axis=-1))


def slowest_switch(found: Contacts, truth: Mask, time_s: Array) -> float:
    """Longest time from a true switch to the nearest one found, ms."""
    worst = 0.0
    for foot in range(2):
        true, seen = (np.diff(x[:, foot].astype(int)) for x in (truth, found.feet))
        for at in np.flatnonzero(true):
            same = np.flatnonzero(seen == true[at])
            near = np.abs(time_s[same] - time_s[at]).min() if len(same) else np.inf
            worst = max(worst, float(near))
    return 1e3 * worst


def main() -> int:
    """Prints the figures; returns 1 if one fails."""
    return shown(figures())


if __name__ == "__main__":
    sys.exit(main())
