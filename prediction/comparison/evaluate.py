"""Methods side by side on motion they have not seen."""

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.threads import single_threaded
from prediction.chain import Task, TaskChain
from prediction.demonstrations import Demonstrations
from prediction.errors import DemonstrationError
from prediction.laws.predictor import Predictor, Previous, Progress, ShouldStop
from prediction.operator_model import OperatorModel
from prediction.training.held_out import (
    HeldOutRun,
    Stretches,
    run_held_out,
    sampled_interval,
)
from prediction.training.train import train_operator
from prediction.training.training_options import TrainingOptions

Array = NDArray[np.float64]

#: Noise of the hand velocity densities are quoted at: m/s and rad/s per axis. A log density means
#: nothing without it.
SIGMA_LINEAR = 2e-3
SIGMA_ANGULAR = 5e-3
#: Horizons joint errors are quoted at, s.
HORIZONS_S = (0.25, 0.5, 1.0, 2.0)
#: A point this near a horizon stands for it, s.
HORIZON_TOLERANCE_S = 0.05
#: Share of the demonstrations, first in time, that a comparison trains on.
TRAINED_SHARE = 0.7


@dataclass(frozen=True, slots=True)
class MethodScore:
    """Held-out figures of one method.

    Attributes:
        method: Its name.
        log_likelihood: Mean log density of the joint velocity, nats, at the stated hand noise.
        null_log_likelihood: Its null-space term, nats: the part methods differ in.
        rmse_rad_s: One-step joint velocity error.
        hand_error_m_s: One-step hand velocity error, largest.
        coverage90_one_step: Share of joint velocities in the marginal 90 % interval.
        rollout_rmse_deg: Joint error of the central path, over all points of all stretches.
        rollout_rmse_deg_at: The same at horizons, by seconds.
        rollout_hand_mean_m: Mean hand error of the sampled roll-outs.
        rollout_hand_max_m: Largest.
        coverage90_rollout: Share of postures in the sampled 90 % band.
        band_width_deg: Mean width of that band.
        with_previous: The figures of one step where the measured step before is told (all above
            see the posture and the hand alone); None if the method has no memory.
    """

    method: str
    log_likelihood: float
    null_log_likelihood: float
    rmse_rad_s: float
    hand_error_m_s: float
    coverage90_one_step: float
    rollout_rmse_deg: float | None
    rollout_rmse_deg_at: Mapping[str, float]
    rollout_hand_mean_m: float | None
    rollout_hand_max_m: float | None
    coverage90_rollout: float | None
    band_width_deg: float | None
    with_previous: Mapping[str, float] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON values."""
        return asdict(self)


def hand_velocity_noise(demonstrations: Demonstrations) -> Array:
    """Returns Sigma_x, ``(m, m)``, that log densities are quoted at."""
    rows = demonstrations.jacobian.shape[1]
    linear = min(demonstrations.linear_rows, rows)
    return np.diag([SIGMA_LINEAR**2] * linear + [SIGMA_ANGULAR**2] * (rows - linear))


def score_method(
    model: OperatorModel,
    method: str,
    held_out: Demonstrations,
    rng: np.random.Generator,
    *,
    task: Task = "pose",
    chain: TaskChain | None = None,
    stretches: Stretches | None = None,
    samples: int = 100,
) -> MethodScore:
    """Scores one trained method on motion it has not seen.

    Args:
        model: The trained model.
        method: One of its methods.
        held_out: Recorded motion, all joints.
        rng: Randomness of the roll-outs.
        task: Pose or position.
        chain: The chain, for toys.
        stretches: Pieces to roll out on; of 2 s, half overlapping, if not given, and shorter runs
            of the recording whole.
        samples: Sampled postures a piece.

    Returns:
        Its figures. Density and one-step errors are those of the learned joints; densities are at
        the model's own Sigma_x if it has one, else at `hand_velocity_noise`.
    """
    follower = model.follower(method, task, chain)
    whole = held_out.for_task(task)
    learned = whole.reduced(model.reduction)
    predictor, memory = follower.predictor, model.fitted(method, task).memory
    sigma_x = hand_velocity_noise(learned)
    if model.sigma_x is not None:
        sigma_x = model.sigma_x[: len(sigma_x), : len(sigma_x)]
    one_step: dict[str, Any] = {**_one_step(predictor, learned, None, sigma_x)}
    if memory is not None:
        told = memory.within(predictor, learned)
        one_step["with_previous"] = _one_step(predictor, learned, told, sigma_x)
    pieces = Stretches.by_length(whole) if stretches is None else [stretches]
    runs = [run_held_out(follower, whole, one, samples, rng) for one in pieces if len(one.index)]
    return MethodScore(method, **one_step, **_closed_loop(runs, model.reduction.kept))


def _one_step(
    predictor: Predictor, held: Demonstrations, previous: Previous | None, sigma_x: Array
) -> dict[str, float]:
    q, xdot, J = held.q, held.xdot, held.jacobian
    density = predictor.log_prob(q, xdot, held.qdot, J, sigma_x, previous)
    prediction = predictor.predict(q, xdot, J, previous)
    deviation = np.sqrt(np.einsum("...ii->...i", prediction.covariance(sigma_x)))
    error = held.qdot - prediction.mean
    return {
        "log_likelihood": float(density.total.mean()),
        "null_log_likelihood": float(density.null_space.mean()),
        "rmse_rad_s": float(np.sqrt((error**2).mean())),
        "hand_error_m_s": float(np.abs(np.einsum("tmn,tn->tm", J, prediction.mean) - xdot).max()),
        "coverage90_one_step": float((np.abs(error) <= predictor.ninety * deviation).mean()),
    }


def _closed_loop(runs: Sequence[HeldOutRun], moving: NDArray[np.int64]) -> dict[str, Any]:
    """Returns the figures of roll-outs, all points of all pieces counted alike."""
    if not runs:
        return {
            "rollout_rmse_deg": None,
            "rollout_rmse_deg_at": {},
            "rollout_hand_mean_m": None,
            "rollout_hand_max_m": None,
            "coverage90_rollout": None,
            "band_width_deg": None,
        }
    at = {}
    for horizon in HORIZONS_S:
        columns = [(run, int(np.argmin(np.abs(run.elapsed_s[0] - horizon)))) for run in runs]
        there = [
            run.error[:, column]
            for run, column in columns
            if abs(run.elapsed_s[0, column] - horizon) < HORIZON_TOLERANCE_S
        ]
        if there:
            at[f"{horizon:g}"] = _rms_deg(there)
    inside, width = [], []
    for run in runs:
        low, high = sampled_interval(run.run.q[:, 1:], axis=1)
        moved = run.run.travelled > 1e-3
        inside.append(((run.truth >= low) & (run.truth <= high))[..., moving][moved])
        width.append((high - low)[..., moving][moved])
    covered, wide = np.concatenate(inside), np.concatenate(width)
    hand = np.concatenate([run.run.hand_error_m.ravel() for run in runs])
    return {
        "rollout_rmse_deg": _rms_deg([run.error[:, 1:] for run in runs]),
        "rollout_rmse_deg_at": at,
        "rollout_hand_mean_m": float(hand.mean()),
        "rollout_hand_max_m": float(hand.max()),
        # Nothing strays while the hand rests, so rest neither earns nor costs coverage.
        "coverage90_rollout": float(covered.mean()) if covered.size else None,
        "band_width_deg": float(np.degrees(wide.mean())) if wide.size else None,
    }


def _rms_deg(errors: Sequence[Array]) -> float:
    together = np.concatenate([error.ravel() for error in errors])
    return float(np.degrees(np.sqrt((together**2).mean())))


def split_in_time(
    demonstrations: Demonstrations, share: float = TRAINED_SHARE
) -> tuple[Demonstrations, Demonstrations]:
    """Splits demonstrations into the first part and the rest, in time order.

    Args:
        demonstrations: Samples.
        share: Share of the samples in the first part.

    Returns:
        What to train on and what to test on.

    Raises:
        DemonstrationError: One of the two would be empty.
    """
    cut = round(share * len(demonstrations))
    if not 0 < cut < len(demonstrations):
        raise DemonstrationError(
            f"demonstrations of {len(demonstrations)} samples are too short to hold a part out "
            f"({1.0 - share:.0%} of them): record at least some seconds of motion"
        )
    return demonstrations.take(slice(0, cut)), demonstrations.take(slice(cut, None))


@single_threaded
def compare_methods(
    chain: TaskChain,
    demonstrations: Demonstrations,
    *,
    seed: int,
    options: TrainingOptions | None = None,
    task: Task = "pose",
    samples: int = 100,
    kept: MutableMapping[str, bytes] | None = None,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> tuple[OperatorModel, Sequence[MethodScore]]:
    """Trains on the first part of the demonstrations and scores every method on the rest.

    Args:
        chain: The chain.
        demonstrations: All its joints, in time order.
        seed: Seed of everything.
        options: How to train; only ``task`` is trained.
        task: Pose or position.
        samples: Sampled postures a stretch.
        kept: See `train_operator`.
        progress: See `train_operator`.
        should_stop: See `train_operator`.

    Returns:
        The model of the first part, and one score per method, the chosen method first.

    Raises:
        DemonstrationError: Too few samples for a split.
        TrainingCancelledError: ``should_stop`` said so.
    """
    options = TrainingOptions() if options is None else options
    options = TrainingOptions(**{**asdict(options), "tasks": (task,)})
    train, test = split_in_time(demonstrations)
    model = train_operator(
        chain,
        train,
        seed=seed,
        options=options,
        kept=kept,
        progress=progress,
        should_stop=should_stop,
    )
    scores = [
        score_method(
            model,
            name,
            test,
            np.random.default_rng([seed, 99]),
            task=task,
            chain=chain,
            samples=samples,
        )
        for name in model.method_names
    ]
    return model, scores


def scores_to_dict(scores: Sequence[MethodScore]) -> dict[str, Any]:
    """Returns the comparison as JSON values for the model file and the command line."""
    return {
        "split": f"first {TRAINED_SHARE:.0%} in time for training, the rest held out",
        "sigma_x": {"linear_m_s": SIGMA_LINEAR, "angular_rad_s": SIGMA_ANGULAR},
        "scores": [score.to_dict() for score in scores],
    }
