"""A measured number beside the bar it must keep."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured number; with neither ``least`` nor ``most`` it is shown and not judged.

    ``beside`` is what it is to be seen beside: a peer of the same run, or a number of a paper.
    """

    name: str
    value: float
    unit: str = ""
    least: float | None = None
    most: float | None = None
    beside: str = ""

    @property
    def passed(self) -> bool | None:
        """Whether the bars are kept; None without a bar."""
        if self.least is None and self.most is None:
            return None
        return (self.least is None or self.value >= self.least) and (
            self.most is None or self.value <= self.most
        )

    @property
    def bars(self) -> str:
        """Its bars in words."""
        return ", ".join(
            f"{sign} {bar:g}"
            for sign, bar in ((">=", self.least), ("<=", self.most))
            if bar is not None
        )

    def line(self) -> str:
        """One line for the terminal."""
        verdict = {True: "pass", False: "FAIL", None: "    "}[self.passed]
        return (
            f"{verdict}  {self.value:9.4g} {self.unit:8} {self.bars:16}  {self.name}"
            f"{f'  ({self.beside})' if self.beside else ''}"
        )


def shown(figures: Iterable[Figure]) -> int:
    """Prints one line a figure as they come; returns 1 if one misses its bar."""
    failed = False
    for figure in figures:
        print(figure.line(), flush=True)
        failed |= figure.passed is False
    return int(failed)
