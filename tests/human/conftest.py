import numpy as np
import pytest

from human import HumanModel, Subject, generate_model


@pytest.fixture(scope="session")
def model() -> HumanModel:
    return generate_model(Subject(1.76, 74.3, "male"))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260101)


def random_configurations(model: HumanModel, rng: np.random.Generator, *batch: int) -> np.ndarray:
    """Any base pose, joint angles far beyond any limit: identities hold everywhere."""
    q = rng.normal(size=(*batch, model.nq))
    q[..., 3:7] /= np.linalg.norm(q[..., 3:7], axis=-1, keepdims=True)
    q[..., 7:] = rng.uniform(-3.0, 3.0, (*batch, model.n_dof))
    return q


@pytest.fixture
def configurations(rng):
    """A function ``(model, *batch)`` giving random configurations."""
    return lambda model, *batch: random_configurations(model, rng, *batch)
