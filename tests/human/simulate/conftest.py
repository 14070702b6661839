import numpy as np
import pytest

from human import HumanModel, Subject, generate_model
from human.simulate import Operator, SimulatedMotion, operator, simulate_reaching


@pytest.fixture(scope="session")
def person() -> HumanModel:
    return generate_model(Subject(1.75, 70.0, "male"))


@pytest.fixture(scope="session")
def average(person: HumanModel) -> Operator:
    return operator("average", np.random.default_rng(0), person)


@pytest.fixture(scope="session")
def reaching(person: HumanModel, average: Operator) -> SimulatedMotion:
    return simulate_reaching(person, average, np.random.default_rng(1), movements=3)
