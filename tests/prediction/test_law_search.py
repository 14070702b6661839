from dataclasses import replace

import numpy as np
import pytest
from planar import planar_demonstrations

from prediction import DemonstrationError, UnsupportedMethodError
from prediction.search.law_search import IN_SAMPLE_WARNING, SearchOptions, search_law


@pytest.fixture(scope="module")
def planar():
    return planar_demonstrations(seed=3, samples=120)


def in_takes(demonstrations, count):
    ids = np.arange(len(demonstrations)) * count // len(demonstrations)
    return replace(demonstrations, trajectory_id=ids)


def found(demonstrations, **options):
    return search_law(demonstrations, np.random.default_rng(1), SearchOptions(**options))


@pytest.mark.parametrize("criterion", ["marginal", "held-out"])
def test_bipop_and_the_gradient_reach_the_same_law(planar, criterion):
    climbed, searched = (
        found(planar[1], optimizer=optimizer, criterion=criterion)
        for optimizer in ("gradient", "bipop")
    )
    assert searched.score == pytest.approx(climbed.score, abs=1e-4)
    np.testing.assert_allclose(searched.log_weights, climbed.log_weights, atol=0.02)
    assert climbed.evaluations < searched.evaluations


def test_the_score_is_that_of_the_law_with_nothing_left_to_gain(planar):
    law = found(planar[1], optimizer="gradient")
    again = search_law(
        planar[1], np.random.default_rng(1), SearchOptions(optimizer="gradient"), start=law
    )
    assert again.score == pytest.approx(law.score, abs=1e-7)


def test_leaving_demonstrations_out_whole_is_held_out_by_demonstrations(planar):
    takes = in_takes(planar[1], 8)
    whole = found(takes, optimizer="gradient", criterion="leave-one-trajectory-out")
    parts = found(takes, optimizer="gradient", criterion="held-out")
    assert whole.score == parts.score  # eight demonstrations are the eight parts
    assert "8 demonstrations" in whole.notes[0] and "whole demonstrations" in parts.notes[0]
    few = in_takes(planar[1], 4)
    assert "stretches" in found(few, optimizer="gradient", criterion="held-out").notes[0]
    with pytest.raises(DemonstrationError, match="at least 3"):
        found(in_takes(planar[1], 2), optimizer="gradient", criterion="leave-one-trajectory-out")


def test_the_papers_own_score_warns_and_tells_less_of_the_weights(planar):
    raw, demonstrations = planar
    truth = np.log(raw.law.mobility)
    literal = found(demonstrations, criterion="in-sample", kernel="paper", max_evaluations=600)
    ours = found(demonstrations, optimizer="gradient")
    assert literal.notes == (IN_SAMPLE_WARNING,) and ours.notes == ()
    assert np.std(literal.log_weights - truth) > 3.0 * np.std(ours.log_weights - truth)


@pytest.mark.parametrize(
    "options",
    [
        {"criterion": "in-sample", "optimizer": "gradient"},
        {"criterion": "in-sample", "engine": "gpytorch"},
        {"criterion": "leave-one-trajectory-out", "engine": "gpytorch"},
        {"criterion": "paper"},
    ],
)
def test_what_does_not_go_together_is_refused(options):
    with pytest.raises(UnsupportedMethodError):
        SearchOptions(**options)


@pytest.mark.parametrize("optimizer", ["gradient", "bipop"])
def test_motion_that_spans_nothing_is_refused_instead_of_fitted(planar, optimizer):
    still = replace(planar[1], qdot=np.zeros_like(planar[1].qdot))
    with pytest.raises(DemonstrationError, match="finite likelihood"):
        found(still, optimizer=optimizer, max_evaluations=60)
