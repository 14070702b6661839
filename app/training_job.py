"""One training as asked for, by command or over HTTP: who, what from, how."""

import hashlib
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from app.generic import generic_operator_of
from app.models.operator import Operator
from app.problems import InvalidRequest
from app.takes import Take
from app.training import Trained, TrainingProgress, motions_of, train
from app.version import VERSION
from human import Subject
from prediction import Base, DemonstrationError, Hand, TrainingOptions, options_of

#: Share of the work spent on reading and fitting the recordings.
_READING = 0.05
_NOBODY = (
    "no demonstrations were given: the model moves as people in general do, its bands are as wide "
    "as people differ, and nothing is familiar to it"
)


@dataclass(frozen=True, slots=True)
class TrainingJob:
    """A training, resolved: nothing in it is left open.

    Attributes:
        takes: Recordings of one person; none for a model of how people in general move.
        subject: The person.
        hand: The hand that is led, or both.
        base: What of the body stays where it is.
        options: How.
        seed: Seed of everything.
        accept: Codes of findings to go on in spite of.
        add_to: A model of that person, whose demonstrations come first; or None.
    """

    takes: tuple[Take, ...]
    subject: Subject
    hand: Hand
    base: Base
    options: TrainingOptions
    seed: int
    accept: tuple[str, ...]
    add_to: Operator | None

    def about(self) -> dict[str, Any]:
        """Returns all that the outcome depends on, as JSON values."""
        recordings = {}
        for take in self.takes:
            for role, part in take.parts().items():
                with part.path.open("rb") as stream:
                    digest = hashlib.file_digest(stream, "sha256").hexdigest()
                name = part.name if role == "motion" else f"{role}:{part.name}"
                recordings[f"{name} ({digest[:8]})"] = digest
        return {
            "recordings": sorted(recordings),
            "person": asdict(self.subject),
            "hand": self.hand,
            "base": self.base,
            **self.options.to_dict(),
            "seed": self.seed,
            "accept": sorted(self.accept),
            "added to": None if self.add_to is None else self.add_to.id,
            "software": f"ergocast {VERSION}",
        }

    def run(
        self,
        kept: MutableMapping[str, bytes] | None = None,
        progress: TrainingProgress | None = None,
        should_stop: Callable[[], bool] | None = None,
    ) -> Trained:
        """Reads the recordings and trains.

        Args:
            kept: What is finished; see `train`.
            progress: Told how far it is.
            should_stop: Asked often.

        Raises:
            HumanError: A recording cannot be read or fitted.
            PredictionError: The motion cannot teach anything; see `train`.
            InvalidRequest: The recordings are of different people.
        """

        def tell(what: str, done: float, nats: float | None) -> None:
            if progress is not None:
                progress(what, _READING + (1.0 - _READING) * done, nats)

        if not self.takes:
            operator = generic_operator_of(self.subject, self.hand)
            return Trained(operator, (), str(operator.training["chosen_by"]), (_NOBODY,))
        if progress is not None:
            progress("reading the recordings", 0.0, None)
        add_to = None if self.add_to is None else self.add_to.content
        known = None if add_to is None else add_to.human_model
        recorded = motions_of(self.takes, self.subject, self.accept, known)
        return train(
            recorded,
            self.hand,
            self.base,
            seed=self.seed,
            options=self.options,
            add_to=add_to,
            kept=kept,
            progress=tell,
            should_stop=should_stop,
        )


def training_job(
    takes: Sequence[Take],
    *,
    height_m: float | None,
    mass_kg: float | None,
    sex: str | None,
    hand: Hand | None,
    base: Base | None,
    seed: int | None,
    accept: Sequence[str],
    options: Mapping[str, Any],
    add_to: Operator | None = None,
) -> TrainingJob:
    """Fills in what was not said: from the model that is added to, or the defaults.

    Args:
        takes: Recordings; without any, and without a model to add to, the model is generic.
        height_m: Stature, m.
        mass_kg: Body mass, kg.
        sex: ``female``, ``male`` or ``unknown``.
        hand: ``right``, ``left`` or ``both``.
        base: ``pelvis`` or ``feet``.
        seed: Seed of everything.
        accept: Codes of findings to go on in spite of.
        options: Fields of `TrainingOptions`; None where nothing was said.
        add_to: The model to add to.

    Raises:
        InvalidRequest: The person is not known, or another than the model's.
        DemonstrationError: Nothing can be added to that model.
        SubjectError: No person is like that.
        UnsupportedMethodError: An option is not known.
    """
    for take in takes:
        if take.grf is not None:
            raise InvalidRequest(f"grf:{take.grf.name}: training takes motion alone; leave it out.")
    given = {key: value for key, value in options.items() if value is not None}
    if add_to is None:
        if height_m is None or mass_kg is None:
            raise InvalidRequest(
                "Expected the person's height (m) and mass (kg), which scale the model."
            )
        if not takes and (given or base == "feet" or hand == "both"):
            what = sorted(given) or ["base or hand"]
            raise InvalidRequest(
                f"Without recordings there is nothing to choose ({', '.join(what)}): the model is "
                "of one hand led, the pelvis in place."
            )
        subject = Subject(height_m, mass_kg, sex or "unknown")  # type: ignore[arg-type]
        if hand == "both":
            # The position of an object alone does not place two hands.
            given["tasks"] = ("pose",)
        chosen = TrainingOptions(**given)
        return TrainingJob(
            tuple(takes),
            subject,
            hand or "right",
            base or "pelvis",
            chosen,
            seed or 0,
            tuple(accept),
            None,
        )
    content = add_to.content
    skeleton = content.skeleton
    assert skeleton is not None
    if content.samples is None:
        raise DemonstrationError(
            "the model is of a person without demonstrations: train on the recordings alone"
            if content.is_generic
            else "the model does not hold what it was trained on, so nothing can be added to it: "
            "train on all recordings together"
        )
    known = skeleton.subject
    for quantity, said, held in (
        ("height", height_m, known.height_m),
        ("mass", mass_kg, known.mass_kg),
        ("sex", sex, known.sex),
        ("hand", hand, skeleton.hand),
        ("base", base, skeleton.fixed),
    ):
        if said is not None and said != held:
            raise InvalidRequest(
                f"The model is of {quantity} {held}, got {said}: one model per person and chain. "
                "Leave it out to take the model's."
            )
    if not takes:
        raise InvalidRequest("Expected recordings to add to the model, got none.")
    chosen = TrainingOptions.from_dict({**options_of(content).to_dict(), **given})
    return TrainingJob(
        tuple(takes),
        known,
        skeleton.hand,
        skeleton.fixed,
        chosen,
        content.seed if seed is None else seed,
        tuple(accept),
        add_to,
    )
