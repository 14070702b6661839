"""The worksheets' input, field by field, and the strict check of it.

A field left out is what an empty box on the printed sheet means: no flag, zero degrees, no load,
good coupling. A key that is not in the schema is refused, because a misspelt modifier that is
silently dropped gives a score that is too low.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from .errors import WorksheetError
from .method_data import Method

FORCE_MODES = ("intermittent", "static", "repeated", "shock")
MAX_ANGLE_DEG = 180.0
MAX_LOAD_KG = 1000.0

#: A worksheet after the check: every field present and of the right type.
CheckedSheet = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Number:
    """A finite number inside bounds; ``default`` stands for a field left out."""

    low: float
    high: float
    unit: str
    default: float = 0.0

    def check(self, value: object, pointer: str) -> float:
        """Returns the number, or raises WorksheetError."""
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
            or not self.low <= value <= self.high
        ):
            raise WorksheetError(
                pointer, f"a number of {self.unit} from {self.low:g} to {self.high:g}", value
            )
        return float(value)


@dataclass(frozen=True, slots=True)
class Flag:
    """True or false."""

    default: bool = False

    def check(self, value: object, pointer: str) -> bool:
        """Returns the flag, or raises WorksheetError."""
        if not isinstance(value, bool):
            raise WorksheetError(pointer, "true or false", value)
        return value


@dataclass(frozen=True, slots=True)
class Choice:
    """One word of a list."""

    words: tuple[str, ...]

    @property
    def default(self) -> str:
        """The first word: the one that adds nothing."""
        return self.words[0]

    def check(self, value: object, pointer: str) -> str:
        """Returns the word, or raises WorksheetError."""
        if not isinstance(value, str) or value not in self.words:
            raise WorksheetError(pointer, "one of " + ", ".join(map(repr, self.words)), value)
        return value


@dataclass(frozen=True, slots=True)
class Points:
    """A whole number of points."""

    high: int
    default: int = 0

    def check(self, value: object, pointer: str) -> int:
        """Returns the points, or raises WorksheetError."""
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= self.high:
            raise WorksheetError(pointer, f"a whole number from 0 to {self.high}", value)
        return value


@dataclass(frozen=True, slots=True)
class Section:
    """A group of named fields."""

    fields: Mapping[str, "Field"]

    @property
    def default(self) -> CheckedSheet:
        """The group with every field left out."""
        return {name: field.default for name, field in self.fields.items()}

    def check(self, value: object, pointer: str) -> CheckedSheet:
        """Returns the group with every field filled in, or raises WorksheetError."""
        if not isinstance(value, Mapping):
            raise WorksheetError(pointer, "an object with " + ", ".join(self.fields), value)
        for key in value:
            if key not in self.fields:
                raise WorksheetError(
                    f"{pointer}/{escaped(key)}",
                    "only these fields: " + ", ".join(self.fields),
                    value[key],
                )
        return {
            name: field.check(value[name], f"{pointer}/{name}") if name in value else field.default
            for name, field in self.fields.items()
        }


@dataclass(frozen=True, slots=True)
class Force:
    """RULA's force: points read off the sheet, or a load and how it acts."""

    high: int
    default: int = 0

    def check(self, value: object, pointer: str) -> int | CheckedSheet:
        """Returns points or a filled-in load, or raises WorksheetError."""
        if isinstance(value, Mapping):
            return _LOAD.check(value, pointer)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= self.high:
            raise WorksheetError(
                pointer, f"a whole number from 0 to {self.high}, or an object with kg, mode", value
            )
        return value


Field = Number | Flag | Choice | Points | Section | Force


def escaped(key: object) -> str:
    """Returns a key as a JSON pointer token (RFC 6901)."""
    return str(key).replace("~", "~0").replace("/", "~1")


def _section(**fields: Field) -> Section:
    return Section(MappingProxyType(fields))


_ANGLE = Number(-MAX_ANGLE_DEG, MAX_ANGLE_DEG, "degrees")
_KG = Number(0.0, MAX_LOAD_KG, "kg")
_LOAD = _section(kg=_KG, mode=Choice(FORCE_MODES))

SCHEMAS: Mapping[Method, Section] = MappingProxyType(
    {
        "rula": _section(
            upper_arm=_section(
                flexion_deg=_ANGLE, shoulder_raised=Flag(), abducted=Flag(), supported=Flag()
            ),
            lower_arm=_section(flexion_deg=_ANGLE, across_midline_or_out_to_side=Flag()),
            wrist=_section(flexion_deg=_ANGLE, deviated=Flag(), twist=Choice(("mid", "end"))),
            neck=_section(flexion_deg=_ANGLE, twisted=Flag(), side_bent=Flag()),
            trunk=_section(
                flexion_deg=_ANGLE, twisted=Flag(), side_bent=Flag(), seated_supported=Flag()
            ),
            legs=_section(supported_balanced=Flag()),
            muscle_use_a=Points(1),
            muscle_use_b=Points(1),
            force_a=Force(3),
            force_b=Force(3),
        ),
        "reba": _section(
            neck=_section(flexion_deg=_ANGLE, twisted=Flag(), side_bent=Flag()),
            trunk=_section(flexion_deg=_ANGLE, twisted=Flag(), side_bent=Flag()),
            legs=_section(bilateral=Flag(), sitting=Flag(), knee_flexion_deg=_ANGLE),
            upper_arm=_section(
                flexion_deg=_ANGLE,
                shoulder_raised=Flag(),
                abducted_or_rotated=Flag(),
                supported_or_gravity_assisted=Flag(),
            ),
            lower_arm=_section(flexion_deg=_ANGLE),
            wrist=_section(flexion_deg=_ANGLE, deviated_or_twisted=Flag()),
            load=_section(kg=_KG, shock=Flag()),
            coupling=Choice(("good", "fair", "poor", "unacceptable")),
            activity=_section(
                static_over_1min=Flag(),
                repeated_over_4_per_min=Flag(),
                rapid_large_change_or_unstable=Flag(),
            ),
        ),
    }
)


def checked_worksheet(method: Method, sheet: object, pointer: str = "") -> CheckedSheet:
    """Returns a worksheet with every field present.

    Args:
        method: ``rula`` or ``reba``.
        sheet: The worksheet's input, as parsed from JSON.
        pointer: JSON pointer of ``sheet`` inside the document it came in.

    Raises:
        WorksheetError: At the first unknown key, wrong type, value out of range or not finite.
    """
    return SCHEMAS[method].check(sheet, pointer)
