"""Both hands on one object, and feet that stand, on simulated people who handle a box.

``python -m benchmarks.prediction.chains [--full]``: one person, Cov-IK; ``--full``: five kinds of
people, the method of `auto`. They lift, carry and put down with both hands, all joints between
pelvis and hands by their own law, and go down by legs and back as their kind does; the legs follow
no law of the predictors. The first 70 % of half a minute trains, the rest is rolled out on.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure, shown
from human import Chain, Motion, Subject, generate_model
from human.simulate import (
    OPERATOR_KINDS,
    SimulationError,
    Station,
    operator,
    simulate_box_handling,
)
from prediction import (
    Base,
    Demonstrations,
    Hand,
    HandNoise,
    HandPath,
    OperatorModel,
    Stretches,
    TrainingOptions,
    demonstrations_from_motion,
    led_chain,
    score_method,
    split_in_time,
    train_operator,
)

Array = NDArray[np.float64]

CHAINS: tuple[tuple[Hand, Base], ...] = (("both", "pelvis"), ("right", "feet"), ("both", "feet"))
RATE_HZ = 30.0
#: What tips that are led or held may stray, m.
BAR_M = 2e-4
#: A robot that errs: its error must move both hands as one, and no foot.
ROBOT = HandNoise(0.002, 0.01)


def box_handling(kind: str, seed: int) -> Motion:
    """Simulates a person who moves a box about on one spot."""
    rng = np.random.default_rng(seed)
    model = generate_model(Subject(1.75, 72.0))
    person = operator(kind, rng, model)
    for _ in range(50):
        places = rng.uniform([0.34, -0.15, 0.45], [0.46, 0.15, 1.25], (6, 3))
        stations = [Station((float(x), float(y), float(z))) for x, y, z in places]
        try:
            simulated = simulate_box_handling(
                model, person, rng, stations=stations, rate_hz=RATE_HZ
            )
        except SimulationError:  # a place that this person does not reach so
            continue
        return simulated.motion
    raise SimulationError(f"no way for a {kind} to move a box was found")


@dataclass(frozen=True, slots=True)
class Led:
    """Sampled roll-outs along what was recorded, led by a robot that errs.

    Attributes:
        tips: Error of the tip that is furthest off, ``(N,)`` m.
        feet: How far held tips are from where they stood, ``(N,)`` m; empty if none is held.
        hands: How far one hand is, as seen by the other, from where the path has it, ``(N,)`` m.
    """

    tips: Array
    feet: Array
    hands: Array

    @classmethod
    def of(cls, model: OperatorModel, held_out: Demonstrations) -> Self:
        """Rolls out along every stretch, 20 samples each."""
        follower, chain = model.follower(), model.chain
        tips, feet, hands = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
        for index in Stretches.of(held_out).index:
            q = held_out.q[index]
            path = HandPath.recorded(chain, q, held_out.time_s[index], "pose")
            rng = np.random.default_rng(0)
            rollout = follower.rollout(path, q[0], 20, rng, hand_noise=ROBOT)
            tips.append(rollout.hand_error_m.ravel())
            position, rotation = _tips(chain, rollout.q)
            still, _ = _tips(chain, q[0])
            held = chain.held_tips
            moved = position[..., :held, :] - still[:held]
            feet.append(np.linalg.norm(moved, axis=-1).ravel())
            if len(chain.led) == 2:
                off = _between(position, rotation) - _between(*_tips(chain, q))
                hands.append(np.linalg.norm(off, axis=-1).ravel())
        return cls(*(np.concatenate(parts) for parts in (tips, feet, hands)))


def _tips(chain: Chain, q: Array) -> tuple[Array, Array]:
    position, rotation = chain.forward(q)
    return position.reshape(*q.shape[:-1], -1, 3), rotation.reshape(*q.shape[:-1], -1, 3, 3)


def _between(position: Array, rotation: Array) -> Array:
    """Returns the place of the last tip as the one before it sees it, ``(..., 3)``."""
    back = np.swapaxes(rotation[..., -2, :, :], -1, -2)
    apart = position[..., -1, :] - position[..., -2, :]
    return np.asarray((back @ apart[..., None])[..., 0])


def figures(full: bool = False) -> Iterator[Figure]:
    """Measures every chain."""
    kinds = OPERATOR_KINDS if full else OPERATOR_KINDS[:1]
    motions = {kind: box_handling(kind, seed) for seed, kind in enumerate(kinds)}
    options = TrainingOptions(method="auto" if full else "cov-ik", tasks=("pose",))
    body = generate_model(Subject(1.75, 72.0))
    for hand, base in CHAINS:
        chain = led_chain(body, hand, base)
        name = f"{hand} hand{'s' if hand == 'both' else ''}, {base} fixed ({chain.n} joints)"
        led: list[Led] = []
        ratios, cover = [], []
        for motion in motions.values():
            seen = demonstrations_from_motion(chain, motion, rate_hz=RATE_HZ)
            train, test = split_in_time(seen, 0.7)
            model = train_operator(chain, train, seed=0, options=options)
            rng = np.random.default_rng(0)
            own, least = (
                score_method(model, method, test, rng, samples=30)
                for method in (model.method, "minimum-norm")
            )
            assert own.rollout_rmse_deg is not None and least.rollout_rmse_deg is not None
            led.append(Led.of(model, test))
            ratios.append(own.rollout_rmse_deg / least.rollout_rmse_deg)
            cover.append(own.coverage90_rollout or 0.0)
            yield Figure(
                f"{name}: joint error over 2 s",
                own.rollout_rmse_deg,
                "deg",
                beside=f"{model.method}; minimum-norm {least.rollout_rmse_deg:.2f}",
            )
        ratio = float(np.exp(np.mean(np.log(ratios))))
        yield Figure(f"{name}: joint error on minimum-norm's", ratio, most=1.0)
        yield Figure(f"{name}: 90 % band holds", float(np.mean(cover)))
        mean = float(np.concatenate([one.tips for one in led]).mean())
        yield Figure(f"{name}: worst tip, mean error", 1e3 * mean, "mm", most=1e3 * BAR_M)
        if chain.held_tips:
            most = float(np.concatenate([one.feet for one in led]).max())
            yield Figure(f"{name}: foot moves, at most", 1e3 * most, "mm", most=1e3 * BAR_M)
        if hand == "both":
            apart = np.concatenate([one.hands for one in led])
            yield Figure(
                f"{name}: one hand seen from the other, mean error",
                1e3 * float(apart.mean()),
                "mm",
                most=1e3 * BAR_M,
                beside=f"at most {1e3 * float(apart.max()):.2f} mm",
            )


def main() -> int:
    """Prints all figures; returns 1 if a bar is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full", action="store_true", help="five kinds of people, auto")
    return shown(figures(parser.parse_args().full))


if __name__ == "__main__":
    sys.exit(main())
