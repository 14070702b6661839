"""From recordings to an operator model, with the held-out figures that go into its file."""

from collections.abc import Callable, MutableMapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.fitting import body_in_motion
from app.problems import InvalidRequest
from app.takes import Take
from app.unseen import unseen_finding
from human import Chain, HumanModel, Motion, Subject
from prediction import (
    Base,
    DemonstrationError,
    Hand,
    KeptSamples,
    MethodScore,
    OperatorModel,
    TakeSource,
    TrainingOptions,
    compare_methods,
    demonstrations_from_motion,
    join,
    led_chain,
    motion_findings,
    scores_to_dict,
    train_operator,
    with_earlier,
)

#: Told what is being done and the share done.
Progress = Callable[[str, float], None]
#: Told what is being done, the share done, and the log likelihood a sample, nats, where there is.
TrainingProgress = Callable[[str, float, float | None], None]

#: Bones of recordings of one person may differ by this much between takes, m.
_SAME_BONES_M = 0.03
#: Share of the work spent on the held-out comparison.
_COMPARING = 0.35
#: Demonstrations are thinned to at most this rate.
_RATE_HZ = 30.0


@dataclass(frozen=True, slots=True)
class Recorded:
    """Recordings of one person, fitted.

    Attributes:
        model: The person, scaled to the first recording.
        motions: A motion per recording.
        sources: Name and digest of each recording.
        notes: What the fits said.
        unobserved: Segments whose pose is a placeholder, by recording; all were seen if empty.
    """

    model: HumanModel
    motions: tuple[Motion, ...]
    sources: tuple[TakeSource, ...]
    notes: tuple[str, ...]
    unobserved: tuple[frozenset[str], ...] = ()


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained operator and what was found on held-out motion.

    Attributes:
        operator: The model, trained on everything.
        scores: Each method on the last 30 %, trained on the first 70 %; the chosen one first.
        chosen_by: Why this method is the default.
        notes: What the fit of the recordings said, and the look at the demonstrations.
    """

    operator: OperatorModel
    scores: tuple[MethodScore, ...]
    chosen_by: str
    notes: tuple[str, ...]


def motions_of(
    takes: Sequence[Take],
    subject: Subject,
    accept: Sequence[str] = (),
    known: HumanModel | None = None,
) -> Recorded:
    """Reads recordings of one person and fits the model to them.

    Args:
        takes: Motions, each with what goes with it.
        subject: The person.
        accept: Codes of findings to go on in spite of.
        known: The person's body, where it is known already.

    Returns:
        The recordings, fitted; their model is ``known``, or scaled to the first one.

    Raises:
        HumanError: A recording cannot be read or fitted.
        InvalidRequest: The recordings are of different people.
    """
    model, first = known, "the model"
    motions, sources, notes, unobserved = [], [], [], []
    for take in takes:
        body = body_in_motion(take, subject, accept=accept)
        motion = body.whole()
        notes += [f"{body.source}: {note.removeprefix(f'{body.source}: ')}" for note in body.notes]
        if model is None:
            model, first = body.model, body.source
        elif np.abs(model.offsets - body.model.offsets).max() > _SAME_BONES_M:
            raise InvalidRequest(
                f"{body.source} and {first} are of different bodies: "
                f"their bones differ by more than {_SAME_BONES_M * 100:.0f} cm. "
                "Train one model per person."
            )
        motions.append(motion)
        sources.append(TakeSource(body.source, body.digest))
        unobserved.append(body.unobserved)
    assert model is not None
    return Recorded(model, tuple(motions), tuple(sources), tuple(notes), tuple(unobserved))


def train(
    recorded: Recorded,
    hand: Hand,
    base: Base = "pelvis",
    *,
    seed: int,
    options: TrainingOptions,
    add_to: OperatorModel | None = None,
    kept: MutableMapping[str, bytes] | None = None,
    progress: TrainingProgress | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Trained:
    """Trains on motions of one model.

    Args:
        recorded: The person and what they did.
        hand: The hand that is led, or both.
        base: What of the body stays where it is.
        seed: Seed of everything.
        options: How to train.
        add_to: A model of the same person and hand: what it was trained on comes first. The
            held-out comparison is made anew and from nothing, since the old weights know motion
            that is held out now; the training proper sets out from them.
        kept: What is finished; given again, the training goes on where it was broken off.
        progress: Told how far it is.
        should_stop: Asked often.

    Raises:
        PredictionError: The motions cannot teach anything, do not show the led hand, or are of
            another person than the model's, or in it already.
        TrainingCancelledError: ``should_stop`` said so.
    """
    chain = led_chain(recorded.model, hand, base)
    doubts = _doubts(recorded, chain, add_to)  # refuses what was not measured
    demonstrations = join(
        [
            demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=_RATE_HZ)
            for k, motion in enumerate(recorded.motions)
        ]
    )
    sources = recorded.sources
    if add_to is not None:
        demonstrations, sources = with_earlier(add_to, demonstrations, sources, chain)
    KeptSamples.of(demonstrations, sources)  # refuses a recording given twice before work is done

    def part(start: float, share: float, stage: str) -> Callable[[str, float, float], None]:
        def tell(what: str, done: float, nats: float) -> None:
            if progress is not None:
                known = nats if np.isfinite(nats) else None
                progress(f"{stage}, {what}", start + share * done, known)

        return tell

    _, scores = compare_methods(
        chain,
        demonstrations,
        seed=seed,
        options=options,
        kept=kept,
        progress=part(0.0, _COMPARING, "held-out comparison"),
        should_stop=should_stop,
    )
    operator = train_operator(
        chain,
        demonstrations,
        seed=seed,
        options=options,
        metrics=scores_to_dict(scores),
        takes=sources,
        sigma_x=None if add_to is None else add_to.sigma_x,
        start=add_to,
        kept=kept,
        progress=part(_COMPARING, 1.0 - _COMPARING, "training"),
        should_stop=should_stop,
    )
    chosen_by = str(operator.training["chosen_by"])
    findings = [*doubts, *operator.training["findings"]]
    operator = replace(
        operator,
        metrics={**operator.metrics, "chosen_by": chosen_by},
        training={**operator.training, "findings": findings},
    )
    ordered = sorted(scores, key=lambda score: score.method != operator.method)
    return Trained(operator, tuple(ordered), chosen_by, (*recorded.notes, *findings))


def _doubts(recorded: Recorded, chain: Chain, add_to: OperatorModel | None) -> list[str]:
    """Returns what makes recordings doubtful demonstrations, those added to among them."""
    found = []
    if add_to is not None and add_to.samples is not None:
        earlier = tuple(f"{take.name}: " for take in add_to.samples.takes)
        found = [one for one in add_to.training.get("findings", ()) if one.startswith(earlier)]
    for source, unobserved in zip(recorded.sources, recorded.unobserved, strict=False):
        try:
            unseen = unseen_finding(chain, unobserved)
        except DemonstrationError as error:
            raise DemonstrationError(f"{source.name}: {error}") from error
        found += [f"{source.name}: {unseen}"] if unseen else []
    for source, motion in zip(recorded.sources, recorded.motions, strict=True):
        found += [f"{source.name}: {finding}" for finding in motion_findings(chain, motion)]
    return found
