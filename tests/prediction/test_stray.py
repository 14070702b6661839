"""Samples stray from the central path as the band says, in what leaves the hand where it is."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    Familiarity,
    Follower,
    HandPath,
    JointLimits,
    JointReduction,
    MinimumNormIk,
    PostureBand,
)
from prediction.following.familiarity import widening
from prediction.following.propagation import propagate
from prediction.laws.null_space import row_space

SMALL = np.diag([2.0, 1.0, 3.0, 1.5, 2.5]) * 1e-4  # rad: so small that the null space hardly turns
LENGTH = 0.8
POINTS = 9


class Resting:
    """A person whose hand rests for a second, while the rest of the body sways with time."""

    def __init__(self, familiar, factor=SMALL):
        demonstrations = planar_demonstrations(seed=3, samples=60)[1]
        self.chain, self.q0 = PlanarChain(), demonstrations.q[0]
        wide = np.full(5, 10.0)
        self.follower = Follower(
            MinimumNormIk.fit(demonstrations, np.random.default_rng(0)),
            self.chain,
            JointReduction.identity(self.chain.dof_names),
            JointLimits(np.eye(5), -wide, wide),
            PostureBand(factor, LENGTH, np.eye(5), clock=1.0),
            Familiarity(self.q0[None] + (0.0 if familiar else 10.0), 1e6, 0.05, 1.0),
            "position",
        )
        time_s = np.linspace(0.0, 1.0, POINTS)
        still = np.repeat(self.q0[None], POINTS, axis=0)
        self.path = HandPath.recorded(self.chain, still, time_s, "position")
        rows = row_space(self.chain.forward_and_jacobian(self.q0)[2])
        self.free = np.eye(5) - rows.T @ rows


@pytest.mark.parametrize("familiar", [True, False])
def test_samples_spread_as_the_band_says(familiar):
    person = Resting(familiar)
    run = person.follower.rollout(person.path, person.q0, 4000, np.random.default_rng(2))
    strayed = run.q[:, -1] - run.central[-1]
    wide = widening(np.array(float(familiar)))
    root = wide * np.sqrt(-np.expm1(-2.0 / LENGTH)) * person.free @ SMALL
    expected = root @ root.T
    largest = np.diagonal(expected).max()
    np.testing.assert_allclose(strayed.T @ strayed / 4000, expected, atol=0.06 * largest)


def test_what_strays_at_the_start_returns_over_the_length_of_the_band(rng):
    person = Resting(True, factor=1e-9 * np.eye(5))
    strayed = 1e-4 * rng.normal(size=(4, 5)) @ person.free
    strayed[0] = 0.0  # the central path
    starts = person.q0 + strayed
    run = propagate(person.follower, [person.path], starts[None], 3, rng, deviation=strayed[None])
    time_s = person.path.time_s
    left = run.q[0] - run.q[0, :1]
    expected = np.exp(-time_s / LENGTH)[:, None] * strayed[:, None]
    np.testing.assert_allclose(left, expected, atol=2e-7)


def test_white_noise_is_the_law_of_one_step_drawn_at_every_point():
    """However finely the way between two points is cut."""
    person = Resting(True)
    assert person.path.substeps() > 1
    law = person.follower.predictor.rescaled(1e-6)
    white = replace(person.follower, predictor=law)
    rng = np.random.default_rng(2)
    run = white.rollout(person.path, person.q0, 4000, rng, noise="white")
    strayed = run.q[:, -1] - run.central[-1]
    jacobian = person.chain.forward_and_jacobian(person.q0)[2]
    step = law.predict(person.q0, np.zeros(2), jacobian).covariance(np.zeros((2, 2)))
    expected = (POINTS - 1) * person.path.time_s[1] ** 2 * step
    largest = np.diagonal(expected).max()
    np.testing.assert_allclose(strayed.T @ strayed / 4000, expected, atol=0.06 * largest)
