import numpy as np
import pytest

from human import HumanModel, Subject, generate_model
from human.simulate import SimulatedMotion, Stance, operator, simulate_walking


@pytest.fixture(scope="session")
def person() -> HumanModel:
    return generate_model(Subject(1.75, 70.0, "male"))


@pytest.fixture(scope="session")
def walk(person: HumanModel) -> SimulatedMotion:
    """Standing, walking around a bend with 4 kg in each hand, standing."""
    walker = operator("average", np.random.default_rng(0), person)
    route = (Stance(), Stance(x=2.0), Stance(2.6, 0.3, 0.7))
    return simulate_walking(person, walker, np.random.default_rng(1), route=route, load_kg=8.0)
