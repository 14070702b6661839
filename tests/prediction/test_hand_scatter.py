import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import CovIk, DemonstrationError, TrainingOptions, learned_sigma_x, train_operator
from prediction.comparison.evaluate import score_method
from prediction.model_file import model_bytes, model_from_bytes


@pytest.fixture(scope="module")
def seen():
    return planar_demonstrations(seed=3, samples=200)[1]


@pytest.fixture
def truth():
    root = np.array([[0.02, 0.0], [0.008, 0.01]])
    return root @ root.T


@pytest.fixture
def commanded(seen, truth, rng):
    return seen.xdot + rng.multivariate_normal(np.zeros(2), truth, len(seen))


def test_the_learned_scatter_is_the_true_one_and_the_most_likely(seen, truth, commanded):
    learned = learned_sigma_x(seen, commanded)
    # a second moment of 200 samples is within a few of its standard errors of the truth
    error = np.sqrt((truth**2 + np.outer(np.diag(truth), np.diag(truth))) / len(seen))
    assert (np.abs(learned - truth) < 4.0 * error).all()
    law = CovIk.fit(seen, np.random.default_rng(0))

    def density(sigma_x):
        parts = law.log_prob(seen.q, commanded, seen.qdot, seen.jacobian, sigma_x)
        return parts.total.mean()

    for other in (0.9 * learned, 1.1 * learned, np.diag(np.diag(learned))):
        assert density(other) < density(learned)


def test_a_hand_that_always_lags_scatters_by_its_lag(seen, truth, commanded):
    lag = np.array([0.3, -0.2])
    learned = learned_sigma_x(seen, commanded + lag)
    np.testing.assert_allclose(learned, truth + np.outer(lag, lag), rtol=0.1)


def test_the_model_keeps_it_and_quotes_densities_at_it(seen, commanded):
    options = TrainingOptions(method="cov-ik", tasks=("position",))
    chain, sigma_x = PlanarChain(), learned_sigma_x(seen, commanded)
    plain = train_operator(chain, seen, seed=1, options=options)
    model = train_operator(chain, seen, seed=1, options=options, sigma_x=sigma_x)
    assert plain.sigma_x is None
    np.testing.assert_array_equal(model_from_bytes(model_bytes(model)).sigma_x, sigma_x)
    one, other = (
        score_method(m, "cov-ik", seen, np.random.default_rng(0), task="position", chain=chain)
        for m in (plain, model)
    )
    assert one.null_log_likelihood == other.null_log_likelihood
    # the motion obeys exactly, so that the densities differ by the normalisation alone
    volumes = [np.linalg.slogdet(s)[1] for s in (sigma_x, 0.002**2 * np.eye(2))]
    shift = 0.5 * (volumes[1] - volumes[0])
    assert other.log_likelihood - one.log_likelihood == pytest.approx(shift, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d, c: (d, c[:-1]), "shape"),
        (lambda d, c: (d, np.where(np.arange(len(c))[:, None] == 3, np.nan, c)), "sample 3"),
        (lambda d, c: (d.take(slice(0, 19)), c[:19]), "at least 20"),
        (lambda d, c: (d, d.xdot), "no density"),
        (lambda d, c: (d, np.stack([c[:, 0], d.xdot[:, 1]], axis=1)), "no density"),
    ],
)
def test_what_cannot_teach_a_scatter_is_refused(seen, commanded, change, said):
    with pytest.raises(DemonstrationError, match=said):
        learned_sigma_x(*change(seen, commanded))


def test_what_is_no_covariance_is_refused(seen):
    for wrong in (np.eye(3), np.diag([1.0, -1.0]), np.array([[1.0, 0.2], [0.0, 1.0]])):
        with pytest.raises(DemonstrationError, match="sigma_x"):
            train_operator(PlanarChain(), seen, seed=1, sigma_x=wrong)
