"""Input that is not what it seems is refused or flagged with the reason, never answered wrong."""

import pytest

from benchmarks.prediction.demonstration_cases import DEMONSTRATIONS
from benchmarks.prediction.input_world import World
from benchmarks.prediction.inputs import verdict
from benchmarks.prediction.path_cases import PATHS

CASES = {
    f"{section}: {name}": case
    for section, cases in (("demonstrations", DEMONSTRATIONS), ("paths", PATHS))
    for name, case in cases.items()
    if not case.slow
}


@pytest.fixture(scope="module")
def world() -> World:
    return World()


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_refused_or_flagged(name: str, world: World) -> None:
    found = verdict(CASES[name], world)
    assert found.passed, f"{found.outcome}: {found.words}"
