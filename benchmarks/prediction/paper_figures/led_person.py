"""One person led along known ways again and again, and what a trained model expects of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.prediction.paper_figures.experiments import REPETITIONS, WAYS, experiment, person
from human import HumanModel
from prediction import OperatorModel, Rollout, TrainingOptions, train_operator

Array = NDArray[np.float64]
METHOD = "mi-nsgp"


@dataclass(frozen=True, slots=True)
class LedPerson:
    """Predicted and real postures of every way.

    Attributes:
        model: The body.
        trained: The operator model, of EXP1's training takes.
        dof: Columns of a configuration that the chain's joints are.
        time_s: Of each way, ``(T,)``.
        start: Configuration each way begins in, ``(nq,)``: what the chain does not move stays.
        predicted: Roll-outs of each way, from the start.
        came: Chain postures of each time the person went it, ``(R, T, n)``.
    """

    model: HumanModel
    trained: OperatorModel
    dof: NDArray[np.int64]
    time_s: list[Array]
    start: Array
    predicted: list[Rollout]
    came: list[Array]

    def whole(self, way: int, q: Array) -> Array:
        """Returns whole configurations ``(..., nq)`` of chain postures ``(..., n)``."""
        out = np.broadcast_to(self.start, (*q.shape[:-1], len(self.start))).copy()
        out[..., self.dof] = q
        return out


def led_person(kind: str, seed: int, samples: int) -> LedPerson:
    """Trains on the first repetitions of EXP1 and predicts every way of the others."""
    who = person(kind, seed)
    data = experiment("EXP1", kind, seed)
    options = TrainingOptions(method=METHOD, tasks=("pose",), optimizer="gradient")
    trained = train_operator(who.chain, data.train, seed=seed, options=options)
    takes = [
        np.flatnonzero(data.test.trajectory_id == take)
        for take in dict.fromkeys(data.test.trajectory_id.tolist())
    ]
    assert len(takes) == WAYS * REPETITIONS // 2
    times, predicted, came = [], [], []
    for way in range(WAYS):
        repeated = takes[way::WAYS]
        q = np.stack([data.test.q[take] for take in repeated])
        time_s = data.test.time_s[repeated[0]]
        position, rotation, _ = who.chain.forward_and_jacobian(q[0])
        predicted.append(
            trained.rollout(
                position,
                rotation,
                time_s,
                q[0, 0],
                samples=samples,
                rng=np.random.default_rng([seed, way]),
            )
        )
        times.append(time_s)
        came.append(q)
    return LedPerson(
        who.model,
        trained,
        7 + who.chain.dof_indices,
        times,
        who.scene.q_start,
        predicted,
        came,
    )
