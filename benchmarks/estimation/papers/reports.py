"""What an experiment hands over: tables as text, figures, and what they show in words."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

_MARKS = {True: "pass", False: "FAIL", None: ""}


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of numbers under headings; a cell that is true or false is a bar passed or failed."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]

    def text(self) -> str:
        """Returns the table as aligned lines."""
        body = [[shown(cell) for cell in row] for row in self.rows]
        lines = [list(self.columns), *body]
        widths = [max(len(line[k]) for line in lines) for k in range(len(self.columns))]
        out = [f"  {self.title}"]
        for line in lines:
            first, *rest = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
            out.append("    " + "  ".join([first, *rest]).rstrip())
        return "\n".join(out)

    @property
    def failed(self) -> int:
        """How many bars were failed."""
        return sum(cell is False for row in self.rows for cell in row)


@dataclass(frozen=True, slots=True)
class Report:
    """One experiment.

    Attributes:
        title: what it is, with the papers' figures and tables.
        tables: ours beside the papers'.
        figures: file stem to drawing, one for each of the papers' figures.
        notes: what is seen, and where it contradicts the paper.
    """

    title: str
    tables: Sequence[Table] = ()
    figures: dict[str, Figure] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def text(self) -> str:
        """Returns everything but the drawings."""
        parts = [f"{self.title}\n{'-' * len(self.title)}"]
        parts += [table.text() for table in self.tables]
        parts += [f"  * {note}" for note in self.notes]
        return "\n\n".join(parts)

    @property
    def failed(self) -> int:
        """How many bars were failed."""
        return sum(table.failed for table in self.tables)

    def save(self, folder: Path, dpi: int = 110) -> list[Path]:
        """Writes the figures as PNG, ``dpi`` dots an inch."""
        folder.mkdir(parents=True, exist_ok=True)
        paths = []
        for stem, figure in self.figures.items():
            paths.append(folder / f"{stem}.png")
            figure.savefig(paths[-1], dpi=dpi)
        return paths


def shown(cell: object) -> str:
    """Returns a cell as text: three digits for numbers."""
    if cell is None or isinstance(cell, bool):
        return _MARKS[cell]
    return f"{cell:.3g}" if isinstance(cell, float) else str(cell)


def rms(values: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Returns the root of the mean square."""
    return np.sqrt(np.mean(np.square(values), axis=axis))


def spread(values: np.ndarray) -> str:
    """Returns mean and standard deviation as text."""
    return f"{np.mean(values):.3g} ± {np.std(values):.2g}"
