"""A broken-off training goes on where it was; more demonstrations join a model."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from human import Chain, Subject, generate_model
from prediction import (
    DemonstrationError,
    Skeleton,
    TakeSource,
    TrainingCancelledError,
    TrainingOptions,
    add_demonstrations,
    check_same_person,
    model_bytes,
    model_from_bytes,
    train_operator,
)
from prediction.search.recall import Recall

CHAIN = PlanarChain()
BIPOP = TrainingOptions(
    method="mi-nsgp", tasks=("position",), blocks=3, max_evaluations=120, max_samples=80
)
GRADIENT = replace(BIPOP, optimizer="gradient", max_evaluations=400)


@pytest.fixture(scope="module")
def demonstrations():
    return planar_demonstrations(seed=3, samples=240)[1]


class StopsAt:
    """Says stop once it was asked so often."""

    def __init__(self, asked: int) -> None:
        self.left = asked

    def __call__(self) -> bool:
        self.left -= 1
        return self.left < 0


@pytest.mark.parametrize("steps", [0, 5, 40])
def test_a_resumed_training_gives_the_same_bytes(demonstrations, steps, monkeypatch):
    monkeypatch.setattr("prediction.search.recall._PERIOD_S", 0.0)
    few = demonstrations.take(slice(0, 80))
    whole = model_bytes(train_operator(CHAIN, few, seed=4, options=BIPOP))
    kept: dict[str, bytes] = {}
    for _ in range(2):  # broken off twice
        with pytest.raises(TrainingCancelledError):
            train_operator(CHAIN, few, seed=4, options=BIPOP, kept=kept, should_stop=StopsAt(steps))
    assert bool(kept) == (steps > 0)
    again = train_operator(CHAIN, few, seed=4, options=BIPOP, kept=kept)
    assert model_bytes(again) == whole
    assert sorted(name.rsplit("position-")[1] for name in kept) == sorted(again.method_names)


def test_what_is_done_is_not_done_again(demonstrations, monkeypatch):
    few = demonstrations.take(slice(0, 80))
    kept: dict[str, bytes] = {}
    whole = train_operator(CHAIN, few, seed=4, options=GRADIENT, kept=kept)

    def fail(*_: object, **__: object) -> None:
        raise AssertionError("fitted again")

    monkeypatch.setattr("prediction.training.train.fit_predictor", fail)
    again = train_operator(CHAIN, few, seed=4, options=GRADIENT, kept=kept)
    assert model_bytes(again) == model_bytes(whole)
    for other in ({"seed": 5}, {"options": replace(GRADIENT, blocks=2)}):
        with pytest.raises(AssertionError, match="fitted again"):
            train_operator(CHAIN, few, **{"seed": 4, "options": GRADIENT, "kept": kept, **other})
    with pytest.raises(AssertionError, match="fitted again"):
        train_operator(
            CHAIN, demonstrations.take(slice(1, 81)), seed=4, options=GRADIENT, kept=kept
        )


def test_a_damaged_part_is_done_again(demonstrations):
    few = demonstrations.take(slice(0, 80))
    kept: dict[str, bytes] = {}
    options = replace(GRADIENT, method="cov-ik")
    whole = train_operator(CHAIN, few, seed=4, options=options, kept=kept)
    damaged = {name: piece[:-9] for name, piece in kept.items()}
    again = train_operator(CHAIN, few, seed=4, options=options, kept=damaged)
    assert model_bytes(again) == model_bytes(whole)
    assert damaged == kept


def test_recalled_answers_are_those_given(monkeypatch):
    monkeypatch.setattr("prediction.search.recall._PERIOD_S", 0.0)
    rng = np.random.default_rng(0)
    answers = [rng.normal(size=size) for size in (3, 1, 7)]
    kept: dict[str, bytes] = {}
    recall = Recall(kept, "a")
    for answer in answers[:2]:
        recall(lambda answer=answer: answer)
    again = Recall(kept, "a")
    got = [again(lambda answer=answer: answer) for answer in (np.ones(9), np.ones(9), answers[2])]
    for one, other in zip(got, answers, strict=True):
        np.testing.assert_array_equal(one, other)
    again.forget()
    assert kept == {}
    np.testing.assert_array_equal(Recall({"a": b"nonsense"}, "a")(lambda: np.ones(2)), np.ones(2))


def test_added_demonstrations_give_what_training_on_all_at_once_gives(demonstrations):
    options = replace(GRADIENT, max_samples=240, weights="diagonal", criterion="marginal")
    first, second = demonstrations.take(slice(0, 120)), demonstrations.take(slice(120, 240))
    second = replace(second, trajectory_id=second.trajectory_id + 1000)
    both = replace(
        demonstrations,
        trajectory_id=np.concatenate([first.trajectory_id, second.trajectory_id]),
    )
    old = train_operator(CHAIN, first, seed=4, options=options)
    # through the file: what is added to is what was saved
    old = model_from_bytes(model_bytes(old))
    takes = [TakeSource(f"b{n}") for n in range(len(np.unique(second.trajectory_id)))]
    added = add_demonstrations(old, second, chain=CHAIN, takes=takes)
    at_once = train_operator(CHAIN, both, seed=4, options=options)
    assert added.data_digest == at_once.data_digest
    assert added.training["options"] == at_once.training["options"]
    assert [take.name for take in added.samples.takes][-1] == takes[-1].name
    one, other = (m.fitted("mi-nsgp", "position").predictor.law for m in (added, at_once))
    # the search ends where another round gains less than 1e-4 nats
    assert one.score == pytest.approx(other.score, abs=1e-4)
    np.testing.assert_allclose(one.log_weights, other.log_weights, atol=0.01)
    assert one.evaluations < other.evaluations
    for key in ("cov-ik", "minimum-norm"):
        a, b = (m.fitted(key, "position").predictor for m in (added, at_once))
        np.testing.assert_allclose(a.weights, b.weights, rtol=1e-12)


def test_what_is_in_the_model_already_is_refused(demonstrations, tmp_path):
    ids = np.repeat([0, 1], 40)
    few = replace(demonstrations.take(slice(0, 80)), trajectory_id=ids)
    model = train_operator(
        CHAIN, few, seed=4, options=GRADIENT, takes=[TakeSource("a", "1f"), TakeSource("b", "2f")]
    )
    again = few.take(ids == 1)
    with pytest.raises(DemonstrationError, match="new is the same recording as b"):
        add_demonstrations(model, again, chain=CHAIN, takes=[TakeSource("new")])
    other = demonstrations.take(slice(100, 140))
    with pytest.raises(DemonstrationError, match="other is the same recording as a"):
        add_demonstrations(model, other, chain=CHAIN, takes=[TakeSource("other", "1f")])
    with pytest.raises(DemonstrationError, match="does not hold"):
        add_demonstrations(replace(model, samples=None), other, chain=CHAIN)
    with pytest.raises(DemonstrationError, match="3 sources for 2 takes"):
        train_operator(CHAIN, few, seed=4, options=GRADIENT, takes=[TakeSource("a")] * 3)


@pytest.mark.parametrize(
    ("subject", "tip", "words"),
    [
        (Subject(1.70, 68.0, "female"), "LeftHandCOM", "LeftHandCOM"),
        (Subject(1.70, 69.0, "female"), "RightHandCOM", "mass"),
        (Subject(1.70, 68.0, "male"), "RightHandCOM", "male"),
    ],
)
def test_another_person_or_hand_is_refused(subject, tip, words):
    known = Skeleton.of(Chain(generate_model(Subject(1.70, 68.0, "female"))))
    check_same_person(known, known)
    with pytest.raises(DemonstrationError, match=words):
        check_same_person(known, Skeleton.of(Chain(generate_model(subject), tip=tip)))


def test_other_bones_are_refused():
    known = Skeleton.of(Chain(generate_model(Subject(1.70, 68.0, "female"))))
    check_same_person(known, replace(known, offsets=known.offsets + 0.02))
    with pytest.raises(DemonstrationError, match=r"4\.0 cm"):
        check_same_person(known, replace(known, offsets=known.offsets + 0.04))
