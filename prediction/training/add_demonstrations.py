"""More demonstrations of a person who has a model already."""

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from human import Chain
from prediction.chain import TaskChain
from prediction.demonstrations import Demonstrations, join
from prediction.errors import DemonstrationError
from prediction.laws.predictor import Progress, ShouldStop
from prediction.operator_model import OperatorModel, Skeleton
from prediction.training.kept_samples import TakeSource
from prediction.training.train import train_operator
from prediction.training.training_options import TrainingOptions

#: Bones of one person may differ by this much between recordings, m.
SAME_BONES_M = 0.03


def add_demonstrations(
    model: OperatorModel,
    demonstrations: Demonstrations,
    *,
    seed: int | None = None,
    options: TrainingOptions | None = None,
    chain: TaskChain | None = None,
    takes: Sequence[TakeSource] = (),
    metrics: Mapping[str, Any] | None = None,
    kept: MutableMapping[str, bytes] | None = None,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> OperatorModel:
    """Trains on what a model was trained on and more, setting out from its weights and kernel.

    The model is that of a training on everything at once, up to where the search ends.

    Args:
        model: The model.
        demonstrations: What to add, all joints of the same chain.
        seed: The model's if not given.
        options: The model's if not given.
        chain: The chain the new demonstrations are of; the model's if not given, which is right
            where they were made with it.
        takes: Where each new take came from, in their order.
        metrics: See `train_operator`; figures of the old model are not kept, they were of less.
        kept: See `train_operator`.
        progress: See `train_operator`.
        should_stop: See `train_operator`.

    Returns:
        A new model.

    Raises:
        DemonstrationError: They are of another person, hand or chain, are in the model already, or
            the model does not hold its demonstrations.
        TrainingCancelledError: ``should_stop`` said so.
    """
    joined, sources = with_earlier(model, demonstrations, takes, chain)
    return train_operator(
        model.chain if chain is None else chain,
        joined,
        seed=model.seed if seed is None else seed,
        options=options_of(model) if options is None else options,
        metrics=metrics,
        takes=sources,
        sigma_x=model.sigma_x,
        start=model,
        kept=kept,
        progress=progress,
        should_stop=should_stop,
    )


def options_of(model: OperatorModel) -> TrainingOptions:
    """Returns the options a model was trained with."""
    return TrainingOptions.from_dict(model.training["options"])


def with_earlier(
    model: OperatorModel,
    demonstrations: Demonstrations,
    takes: Sequence[TakeSource] = (),
    chain: TaskChain | None = None,
) -> tuple[Demonstrations, tuple[TakeSource, ...]]:
    """Returns a model's demonstrations and new ones after them, and where each take came from.

    Args:
        model: The model.
        demonstrations: What to add.
        takes: Where each new take came from; numbered names if not given.
        chain: The chain the new ones are of.

    Raises:
        DemonstrationError: See `add_demonstrations`.
    """
    if model.samples is None:
        raise DemonstrationError(
            "the model does not hold what it was trained on, so nothing can be added to it: train "
            "on all recordings together"
        )
    if isinstance(chain, Chain) and model.skeleton is not None:
        check_same_person(model.skeleton, Skeleton.of(chain))
    if demonstrations.joint_names != model.joint_names:
        raise DemonstrationError(
            f"the demonstrations have {len(demonstrations.joint_names)} joints and the model "
            f"{len(model.joint_names)}, or others: give demonstrations of the model's chain"
        )
    earlier = model.samples.demonstrations(model.chain if chain is None else chain)
    known = len(model.samples.takes)
    if not takes:
        count = len(np.unique(demonstrations.trajectory_id))
        takes = [TakeSource(f"take {known + number}") for number in range(1, count + 1)]
    return join([earlier, demonstrations]), (*model.samples.sources, *takes)


def check_same_person(known: Skeleton, new: Skeleton) -> None:
    """Refuses another person's skeleton, or that of another chain of the same person.

    Raises:
        DemonstrationError: Subject, chain or bones differ.
    """
    for one in fields(Skeleton):
        before, now = getattr(known, one.name), getattr(new, one.name)
        if one.name == "offsets" or before == now:
            continue
        raise DemonstrationError(
            f"the model is of {one.name} {before}, the demonstrations are of {now}: one model per "
            "person and chain"
        )
    apart = float(np.abs(known.offsets - new.offsets).max())
    if apart > SAME_BONES_M:
        raise DemonstrationError(
            f"the bones differ by {100 * apart:.1f} cm from the model's (accepted: "
            f"{100 * SAME_BONES_M:.0f} cm): these are recordings of another person"
        )
