"""1000 sampled postures x 100 steps, 24 joints: time, hand error, and what compression costs.

Run ``python -m benchmarks.prediction.rollout_speed [--full]``.

The person is simulated, led 21 ways at 25 Hz (2025 samples), and then a way it was not trained on.
The peer is the same process kept on every sample, its mean and variance for the same postures once
a step, alone: no kinematics, no hand. Processor time of one thread, least of several turns taken in
alternation, so that a busy machine slows both. ``--full`` takes more turns.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from benchmarks.figure import Figure, shown
from human import Chain, Subject, generate_model
from human.simulate import operator, robot_trajectories, simulate_following
from prediction import (
    METHODS,
    Demonstrations,
    Follower,
    HandPath,
    MiNsGp,
    Rollout,
    TrainingOptions,
    demonstrations_from_motion,
    join,
    train_operator,
)
from prediction.following.hand_path import orientation_error
from prediction.following.precision import Precision
from prediction.following.propagation import propagate
from prediction.laws.compression import exact_posterior
from prediction.laws.process import Process
from prediction.search.weight_search import NullSpaceTargets
from prediction.training.held_out import Stretches, recorded_paths

Array = NDArray[np.float64]
SAMPLES, STEPS = 1000, 100
WAYS, UNSEEN, TRAINED, RATE_HZ = 24, 3, 2025, 25.0
#: Steps the peer is timed on; what it takes does not change from one to the next.
PEER_STEPS = 4
COMPARED = ("mi-nsgp", "cc-gp", "locov-ik", "cov-ik")


@dataclass(frozen=True, slots=True)
class Scene:
    """A trained person and the way they are led.

    Attributes:
        demonstrations: What they were trained on, learned joints.
        unseen: Ways they were not trained on, all joints.
        followers: By method; the process of ``mi-nsgp`` is conditioned on every sample.
        path: The way, 25 Hz.
        q0: Posture it starts from.
        residual: What ``mi-nsgp``'s process was conditioned on, ``(N, k)``.
    """

    demonstrations: Demonstrations
    unseen: Demonstrations
    followers: dict[str, Follower]
    path: HandPath
    q0: Array
    residual: Array

    def roll_out(self, method: str, precision: Precision = "double", **how: object) -> Rollout:
        """Rolls out, always the same people."""
        rng = np.random.default_rng(0)
        follower = self.followers[method]
        return follower.rollout(self.path, self.q0, SAMPLES, rng, precision=precision, **how)  # type: ignore[arg-type]


def scene() -> Scene:
    """Simulates and trains."""
    model = generate_model(Subject(1.75, 72.0))
    chain, rng = Chain(model), np.random.default_rng(0)
    person = operator("average", rng, model)
    ways = robot_trajectories(model, person, rng, count=WAYS)
    takes = []
    for number, way in enumerate(ways.trajectories):
        motion = simulate_following(
            model, person, way.path(), rng, q_start=ways.q_start, rate_hz=RATE_HZ
        ).motion
        takes.append(
            demonstrations_from_motion(chain, motion, trajectory_id=number, rate_hz=RATE_HZ)
        )
    trained, led = join(takes[:-UNSEEN]).take(slice(0, TRAINED)), takes[-1]
    options = TrainingOptions(method="mi-nsgp", tasks=("pose",), optimizer="gradient", blocks=2)
    person_model = train_operator(chain, trained, seed=0, options=options)
    learned = trained.reduced(person_model.reduction)
    follower = person_model.follower("mi-nsgp")
    fitted = follower.predictor
    assert isinstance(fitted, MiNsGp)
    law = fitted.law
    y = NullSpaceTargets(learned, law.basis, law.correlation).one(law.log_weights)
    process = Process.conditioned(
        law.scaling, law.theta, learned.q, learned.xdot, y, constant_mean=law.constant_mean
    )
    followers = {"mi-nsgp": replace(follower, predictor=replace(fitted, process=process))}
    for name in COMPARED[1:]:
        predictor = METHODS[name].fit(learned, np.random.default_rng(0))
        followers[name] = replace(follower, predictor=predictor)
    path = HandPath.recorded(chain, led.q, led.time_s, "pose")
    unseen = join(takes[-UNSEEN:])
    return Scene(learned, unseen, followers, path, led.q[0], y - process.prior_mean)


def least(rounds: int, *works: Callable[[], object]) -> list[float]:
    """Returns the least processor time of each, s, of several rounds in which they take turns."""
    times = np.full((rounds, len(works)), np.inf)
    for turn in range(rounds):
        for index, work in enumerate(works):
            start = time.process_time()
            work()
            times[turn, index] = time.process_time() - start
    return [float(t) for t in times.min(axis=0)]


def speed(led: Scene, rounds: int) -> Iterator[Figure]:
    """Times the roll-outs beside the exact process, and says what compression loses."""
    fitted = led.followers["mi-nsgp"].predictor
    assert isinstance(fitted, MiNsGp)
    law, process, data = fitted.law, fitted.process, led.demonstrations
    inputs = law.scaling.inputs(data.q, data.xdot, law.theta[:-1])
    noise = float(np.exp(law.theta[-1]))
    exact = exact_posterior(inputs, led.residual, noise)
    # The postures of the roll-out itself, half way, with the hand as fast as it is led there.
    run, middle = led.roll_out("mi-nsgp"), STEPS // 2
    kept = led.followers["mi-nsgp"].reduction.kept
    q = run.q[:, middle][:, kept]
    moved, turned = led.path.position, led.path.rotation
    assert turned is not None
    step = led.path.time_s[middle + 1] - led.path.time_s[middle]
    twist = np.concatenate(
        [
            moved[middle + 1] - moved[middle],
            orientation_error(turned[middle + 1], turned[middle]),
        ]
    )
    at = law.scaling.inputs(q, np.broadcast_to(twist / step, (SAMPLES, 6)), law.theta[:-1])

    def peer() -> None:
        for _ in range(PEER_STEPS):
            exact.mean(at)
            exact.variance(at)

    works: list[Callable[[], object]] = [
        peer,
        lambda: led.roll_out("mi-nsgp"),
        lambda: led.roll_out("mi-nsgp", "single"),
        lambda: led.roll_out("mi-nsgp", noise="white"),
    ]
    some, double, single, white = least(rounds, *works)
    whole = some * STEPS / PEER_STEPS
    beside = f"exact process on {len(inputs)} samples, {whole:.1f} s for its mean and variance"
    name = f"{SAMPLES} roll-outs x {STEPS} steps, 24 joints, MI-NsGP"
    yield Figure(f"{name}, double precision: times as fast", whole / double, "x", 15, None, beside)
    yield Figure(f"{name}, single precision: times as fast", whole / single, "x", 15, None, beside)
    yield Figure(f"{name}, white noise: times as fast", whole / white, "x", None, None, beside)
    yield Figure(f"{name}, double precision", double, "s", None, None, "about 1.0 s alone")
    yield Figure(f"{name}, single precision", single, "s", None, None, "about 0.6 s alone")
    deviation = np.sqrt(
        np.outer(exact.variance(at) + noise, np.diagonal(process.output_covariance))
    )
    lost = (process.posterior.mean(at) - exact.mean(at)) / deviation
    centres = f"{len(process.posterior.centres)} centres of {len(inputs)}"
    yield Figure(
        "compression: mean off, rms", float(np.sqrt((lost**2).mean())), "sd", None, 0.1, centres
    )
    off = (process.posterior.variance(at) + noise) / (exact.variance(at) + noise) - 1.0
    yield Figure(
        "compression: variance off, rms",
        100 * float(np.sqrt((off**2).mean())),
        "%",
        None,
        5,
        centres,
    )
    apart = led.roll_out("mi-nsgp", "single").q - run.q
    spread = np.degrees(run.q.std(axis=0).mean())
    yield Figure(
        "single precision: postures off, rms",
        float(np.degrees(np.sqrt((apart**2).mean()))),
        "deg",
        None,
        0.05 * spread,
        f"samples spread by {spread:.2f} deg",
    )
    for method in COMPARED[1:]:
        slow, fast = least(
            rounds, partial(led.roll_out, method), partial(led.roll_out, method, "single")
        )
        yield Figure(
            f"the same by {method}: times as fast",
            whole / slow,
            "x",
            beside=f"{slow:.2f} s; single precision x{whole / fast:.1f}, {fast:.2f} s",
        )


def hand(led: Scene) -> Iterator[Figure]:
    """Measures where the hand is, with and without the correction."""
    for method, follower in led.followers.items():
        run = propagate(follower, [led.path], led.q0[None], SAMPLES, np.random.default_rng(0))
        yield Figure(
            f"hand in closed loop at {RATE_HZ:g} Hz, {method}: mean error",
            1e3 * float(run.hand_error_m[0, 1:, 1:].mean()),
            "mm",
            None,
            0.2,
            f"{1e3 * run.uncorrected_m[0, 1:, 1:].mean():.2f} mm before the correction of each "
            f"step; largest {1e3 * run.hand_error_m.max():.4f} mm",
        )


def starts(led: Scene) -> Iterator[Figure]:
    """Measures what is known of a start that is not given, on ways never shown, cut in seconds."""
    follower = led.followers["mi-nsgp"]
    stretches = Stretches.of(led.unseen, 1.0, at_most=24)
    paths = recorded_paths(follower.chain, led.unseen, stretches, "pose")
    truth = led.unseen.q[stretches.index]
    guessed = follower.rollouts(paths, None, 64, np.random.default_rng(1))
    inside, widths, errors = [], [], []
    for outcome, recorded in zip(guessed, truth, strict=True):
        if isinstance(outcome, Rollout):
            low, high = np.quantile(outcome.q, [0.05, 0.95], axis=0, method="weibull")
            inside.append((low <= recorded) & (recorded <= high))
            widths.append(high - low)
            errors.append(outcome.central - recorded)
    yield Figure(
        "start not given: 90 % band holds, from start to one second",
        float(np.mean(inside)),
        "",
        0.87,
        0.96,
        f"{len(inside)} of {len(paths)} starts; width {np.degrees(np.mean(widths)):.1f} deg, error "
        f"{np.degrees(np.sqrt(np.mean(np.square(errors)))):.2f} deg",
    )


def rates(led: Scene) -> Iterator[Figure]:
    """Measures how far samples are apart where the same way is sent at other rates."""
    follower, path = led.followers["mi-nsgp"], led.path
    spans = Slerp(path.time_s, Rotation.from_matrix(path.rotation))
    tenths = {}
    for rate in (20, 50, 100):
        time_s = np.arange(round((path.time_s[-1] - path.time_s[0]) * rate) + 1) / rate
        time_s = path.time_s[0] + time_s[time_s <= path.time_s[-1] - path.time_s[0]]
        position = CubicSpline(path.time_s, path.position)(time_s)
        sampled = HandPath.checked(time_s, position, spans(time_s).as_matrix())
        run = follower.rollout(sampled, led.q0, 64, np.random.default_rng(1))
        tenths[rate] = run.q[:, :: rate // 10]
    spread = float(tenths[100].std(axis=0)[1:].mean())
    for rate in (20, 50):
        points = min(tenths[rate].shape[1], tenths[100].shape[1])
        apart = tenths[rate][:, :points] - tenths[100][:, :points]
        yield Figure(
            f"the same way at {rate} and 100 Hz: postures of a sample apart, rms",
            float(np.sqrt((apart**2).mean())) / spread,
            "spreads",
            None,
            0.25,
            "numbers drawn point by point: 1.4",
        )


def figures(full: bool = False) -> Iterator[Figure]:
    """Measures all figures of roll-outs."""
    led = scene()
    yield from speed(led, 5 if full else 2)
    yield from hand(led)
    yield from rates(led)
    yield from starts(led)


def main() -> int:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--full", action="store_true", help="more turns of each timing")
    return shown(figures(parser.parse_args().full))


if __name__ == "__main__":
    sys.exit(main())
