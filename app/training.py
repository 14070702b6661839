"""From recordings to an operator model, with the held-out figures that go into its file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from app.fitting import body_in_motion
from app.problems import InvalidRequest
from app.takes import Take
from human import Chain, HumanModel, Motion, Subject
from prediction import (
    MethodScore,
    OperatorModel,
    TrainingOptions,
    compare_methods,
    demonstrations_from_motion,
    join,
    scores_to_dict,
    train_operator,
)

#: Told what is being done and the share done.
Progress = Callable[[str, float], None]
Hand = Literal["right", "left"]

#: Bones of recordings of one person may differ by this much between takes, m.
_SAME_BONES_M = 0.03
#: Share of the work spent on the held-out comparison.
_COMPARING = 0.35


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained operator and what was found on held-out motion.

    Attributes:
        operator: The model, trained on everything.
        scores: Each method on the last 30 %, trained on the first 70 %; the chosen one first.
        chosen_by: Why this method is the default.
        notes: What the fit of the recordings said.
    """

    operator: OperatorModel
    scores: tuple[MethodScore, ...]
    chosen_by: str
    notes: tuple[str, ...]


def motions_of(
    takes: Sequence[Take], subject: Subject, accept: Sequence[str] = ()
) -> tuple[HumanModel, list[Motion], list[str]]:
    """Reads recordings of one person and fits the model to them.

    Args:
        takes: Motions, each with what goes with it.
        subject: The person.
        accept: Codes of findings to go on in spite of.

    Returns:
        The model scaled to the first recording, a motion per recording, and notes.

    Raises:
        HumanError: A recording cannot be read or fitted.
        InvalidRequest: The recordings are of different people.
    """
    model: HumanModel | None = None
    motions, notes = [], []
    for take in takes:
        body = body_in_motion(take, subject, accept=accept)
        motion = body.whole()
        notes += [f"{body.source}: {note}" for note in body.notes]
        if model is None:
            model = body.model
        elif np.abs(model.offsets - body.model.offsets).max() > _SAME_BONES_M:
            raise InvalidRequest(
                f"{body.source} and {takes[0].motion.name} are recordings of different bodies: "
                f"their bones differ by more than {_SAME_BONES_M * 100:.0f} cm. "
                "Train one model per person."
            )
        motions.append(motion)
    assert model is not None
    return model, motions, notes


def train(
    model: HumanModel,
    motions: Sequence[Motion],
    hand: Hand,
    *,
    seed: int,
    options: TrainingOptions,
    progress: Progress | None = None,
    notes: Sequence[str] = (),
    rate_hz: float = 30.0,
) -> Trained:
    """Trains on motions of one model.

    Args:
        model: The person.
        motions: What they did.
        hand: The hand that is led.
        seed: Seed of everything.
        options: How to train.
        progress: Told what is being done and the share done.
        notes: Carried over.
        rate_hz: Demonstrations are thinned to at most this rate.

    Raises:
        PredictionError: The motions cannot teach anything.
    """
    chain = Chain(model, tip=f"{hand.capitalize()}HandCOM")
    demonstrations = join(
        [
            demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=rate_hz)
            for k, motion in enumerate(motions)
        ]
    )

    def report(start: float, share: float) -> Callable[[str, float, float], None]:
        def tell(what: str, done: float, _: float) -> None:
            if progress is not None:
                progress(what, start + share * done)

        return tell

    _, scores = compare_methods(
        chain, demonstrations, seed=seed, options=options, progress=report(0.0, _COMPARING)
    )
    operator = train_operator(
        chain,
        demonstrations,
        seed=seed,
        options=options,
        metrics=scores_to_dict(scores),
        progress=report(_COMPARING, 1.0 - _COMPARING),
    )
    chosen_by = str(operator.training["chosen_by"])
    metrics = {**operator.metrics, "chosen_by": chosen_by}
    ordered = sorted(scores, key=lambda score: score.method != operator.method)
    return Trained(replace(operator, metrics=metrics), tuple(ordered), chosen_by, tuple(notes))
