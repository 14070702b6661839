"""Errors of the scoring package: one base, one subclass per thing a user can do about it.

ErgonomicsError
├── WorksheetError    a worksheet holds something the method cannot score
├── PostureError      arrays of postures, angles or moments are malformed
├── UnmeasuredError   one score was asked for where only an interval can be given
└── CostError         a cost, or the samples it ranks, cannot be worked out
"""

from collections.abc import Iterable


class ErgonomicsError(Exception):
    """Base of every error raised by the ``ergonomics`` package."""


class WorksheetError(ErgonomicsError):
    """A worksheet, or an option of a method, holds a value that cannot be scored.

    Attributes:
        pointer: JSON pointer to the offending value.
        expected: What would have been accepted, in words.
        got: The offending value.
    """

    def __init__(self, pointer: str, expected: str, got: object) -> None:
        """Keeps the three parts and joins them into one sentence."""
        self.pointer = pointer
        self.expected = expected
        self.got = got
        shown = repr(got)
        if len(shown) > 80:
            shown = shown[:77] + "..."
        super().__init__(f"at {pointer or 'the top'}: expected {expected}, got {shown}")


class PostureError(ErgonomicsError):
    """An array of postures, angles or moments has a wrong shape or a value that is not finite.

    Attributes:
        name: The argument or field at fault.
        index: Index of the first bad entry, or None when the shape is at fault.
    """

    def __init__(self, name: str, problem: str, index: tuple[int, ...] | None = None) -> None:
        """Joins field, place and problem into one sentence."""
        self.name = name
        self.index = index
        place = f" at index {list(index)}" if index else ""
        super().__init__(f"{name}{place}: {problem}")


class UnmeasuredError(ErgonomicsError):
    """A single score was asked for although a body part was not measured.

    Attributes:
        parts: Names of the parts without a measurement.
    """

    def __init__(self, parts: Iterable[str]) -> None:
        """Names the parts and the call that gives an interval instead."""
        self.parts = tuple(sorted(parts))
        super().__init__(
            f"not measured: {', '.join(self.parts)}; a single score would be a guess: ask for the "
            "interval (score_rula_interval, score_reba_interval), or measure the part"
        )


class CostError(ErgonomicsError):
    """A cost definition, or the samples that it should weigh, do not fit together."""
