"""A measured number beside its bar."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured number and its bar; shares must reach it, all else must not exceed it."""

    name: str
    value: float
    bar: float | None
    unit: str

    @property
    def passed(self) -> bool:
        """Whether the bar is kept; what has none passes."""
        if self.bar is None:
            return True
        return self.value >= self.bar if self.unit == "share" else self.value <= self.bar

    def line(self) -> str:
        """One line for the terminal."""
        sign = ">=" if self.unit == "share" else "<="
        bar = "" if self.bar is None else f"{sign} {self.bar:g}"
        verdict = "    " if self.bar is None else "pass" if self.passed else "FAIL"
        return f"{verdict}  {self.value:8.4g} {self.unit:6} {bar:9}  {self.name}"
