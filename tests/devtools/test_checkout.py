"""Steps: taken once, taken again when something changed, never half taken."""

import pytest

from devtools.checkout import Checkout
from devtools.commands import Stop, ask, call


def test_a_step_is_taken_again_only_when_something_changed(checkout: Checkout) -> None:
    output = checkout.root / "made"
    taken: list[int] = []

    def action() -> None:
        output.touch()
        taken.append(1)

    def take(inputs: object) -> bool:
        return checkout.step("make", inputs, [output], action)

    assert [take("a"), take("a"), take("b"), take("b")] == [True, False, True, False]
    output.unlink()
    assert take("b")
    assert len(taken) == 3


def test_a_failed_step_is_not_stamped(checkout: Checkout) -> None:
    def fail() -> None:
        raise Stop("no", "try")

    for _ in range(2):
        with pytest.raises(Stop):
            checkout.step("make", "a", [], fail)
    assert not (checkout.stamps / "make").exists()


@pytest.mark.parametrize("argv", [["false"], ["no-such-program-here"]])
def test_a_failing_program_stops_with_its_remedy(argv: list[str]) -> None:
    with pytest.raises(Stop, match="did not") as stop:
        call(argv, "It did not work.", "do the one thing")
    assert stop.value.remedy == "do the one thing"
    assert ask(argv) is None
