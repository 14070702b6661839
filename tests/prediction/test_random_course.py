"""Random functions are those of the process, and the same for everyone who reads them."""

import numpy as np

from prediction.following.random_course import RandomCourse

PLACES = np.array([0.0, 0.01, 0.1, 0.33, 1.0, 1.02, 2.5])


def read(seed, places, samples=3, root=None):
    course = RandomCourse(np.random.default_rng(seed), samples, np.eye(2) if root is None else root)
    return np.stack([course.at(np.atleast_1d(p)) for p in places], axis=1)


def test_covariance_is_that_of_the_process():
    root = np.array([[0.2, 0.0], [0.1, 0.3]])
    values = read(0, PLACES, samples=40000, root=root)[0]
    for i, s in enumerate(PLACES):
        for j, t in enumerate(PLACES):
            expected = np.exp(-abs(s - t)) - np.exp(-(s + t))
            seen = values[i].T @ values[j] / values.shape[1]
            # A cell is a sixteenth of a length: two places in it are that much too alike.
            allowed = 0.012 if i == j else 0.04
            np.testing.assert_allclose(seen, expected * root @ root.T, atol=allowed * 0.1)


def test_what_is_read_does_not_depend_on_where_else_was_read():
    dense, sparse = read(5, np.linspace(0.0, 3.0, 301)), read(5, np.linspace(0.0, 3.0, 31))
    np.testing.assert_allclose(dense[:, ::10], sparse, atol=1e-12)
    course = RandomCourse(np.random.default_rng(5), 3, np.eye(2))
    course.at(np.zeros(2))
    both = course.at(np.array([0.5, 3.0]))  # two candidates, the one far ahead of the other
    np.testing.assert_allclose(both[0], sparse[0, 5], atol=1e-12)
    np.testing.assert_allclose(both[1], sparse[0, 30], atol=1e-12)


def test_functions_are_continuous_and_differ_between_samples_and_seeds():
    values = read(1, np.linspace(0.0, 2.0, 2001))[0]
    assert np.abs(np.diff(values, axis=0)).max() < 0.15
    assert values[0].any() == 0
    assert np.ptp(values[-1], axis=0).min() > 0.05
    assert np.abs(values[-1] - read(2, [2.0])[0, 0]).min() > 1e-3
    single = read(1, [2.0], root=np.eye(2, dtype=np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single[0, 0], values[-1], atol=1e-5)
