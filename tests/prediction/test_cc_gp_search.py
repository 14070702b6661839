"""The kernel of CC-GP is searched, not the one the search sets out from."""

import numpy as np
from planar import planar_demonstrations

from prediction import CcGp
from prediction.laws.kernels import InputScaling
from prediction.search.held_out_likelihood import HeldOutEngine
from prediction.search.law_search import HELD_OUT_PARTS


def test_no_kernel_some_way_from_the_one_found_is_better(rng):
    some = planar_demonstrations(seed=3, samples=160)[1]
    found = CcGp.fit(some, rng).process.theta
    scaling = InputScaling.of("separate", some.q, some.xdot, some.linear_rows)
    engine = HeldOutEngine(scaling, some.q, some.xdot, some.blocks(HELD_OUT_PARTS))

    def score(theta):
        residual, variance = engine.scorer(theta).residuals(some.qdot)
        return CcGp.held_out_score(residual, variance, some.jacobian)

    around = [found + sign * 0.7 * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]
    around = [theta for theta in around if theta[-1] >= engine.noise_bounds[0]]
    assert max(map(score, around)) < score(found) + 0.02
