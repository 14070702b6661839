import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))  # importlib mode puts no test folder on the path

from planar import PlanarChain, planar_demonstrations


@pytest.fixture(scope="session")
def chain() -> PlanarChain:
    return PlanarChain()


@pytest.fixture(scope="session")
def planar():
    """One planar operator: the raw simulation and the demonstrations made of it."""
    return planar_demonstrations(seed=3)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
