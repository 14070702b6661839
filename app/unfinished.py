"""What a broken-off training has finished, in a folder, so that it can go on."""

import shutil
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any

from app.files import read_json, write_bytes, write_json
from app.problems import Conflict

_ABOUT = "about.json"
_PIECE = ".part"


class Unfinished(MutableMapping[str, bytes]):
    """Pieces by name, each whole or not there, and what they are of.

    The folder appears with the first piece. It holds personal data, is readable by its owner
    alone, and is removed with the training's end.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        """Takes the folder up if it is there.

        Args:
            folder: Where the pieces are.
            about: What the training is of, JSON values.

        Raises:
            Conflict: The folder is of another training, the message says in what it differs; or
                of something else altogether.
        """
        self.folder = folder
        self._about = dict(about)
        if (folder / _ABOUT).is_file():
            before = _told(folder / _ABOUT)
            keys = sorted(before.keys() | self._about.keys())
            differing = [key for key in keys if before.get(key) != self._about.get(key)]
            if differing:
                changes = "; ".join(
                    f"{key}: {_shown(before.get(key))} then, {_shown(self._about.get(key))} now"
                    for key in differing
                )
                raise Conflict(f"{folder} holds another training that was broken off ({changes}).")
        elif folder.exists() and not _holds_pieces_alone(folder):
            raise Conflict(f"{folder} is in the way: it is no training that was broken off.")

    @staticmethod
    def discard(folder: Path) -> None:
        """Removes what any broken-off training left in a folder; nothing else."""
        if (folder / _ABOUT).is_file():
            shutil.rmtree(folder)

    def remove(self) -> None:
        """Removes all of it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def finished(self) -> int:
        """How many fits are done; a search under way is none."""
        return sum(not name.endswith("-search") for name in self)

    def __getitem__(self, name: str) -> bytes:
        """Returns a piece."""
        try:
            return self._path(name).read_bytes()
        except FileNotFoundError as error:
            raise KeyError(name) from error

    def __setitem__(self, name: str, content: bytes) -> None:
        """Writes a piece."""
        if not (self.folder / _ABOUT).is_file():
            self.folder.mkdir(parents=True, mode=0o700, exist_ok=True)
            write_json(self.folder / _ABOUT, self._about)
        write_bytes(self._path(name), content)

    def __delitem__(self, name: str) -> None:
        """Removes a piece."""
        try:
            self._path(name).unlink()
        except FileNotFoundError as error:
            raise KeyError(name) from error

    def __iter__(self) -> Iterator[str]:
        """Iterates over the names of the pieces."""
        for path in sorted(self.folder.glob(f"*{_PIECE}")):
            yield path.name.removesuffix(_PIECE)

    def __len__(self) -> int:
        """Number of pieces."""
        return sum(1 for _ in self)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{_PIECE}"


def _holds_pieces_alone(folder: Path) -> bool:
    """Returns whether nothing else is in a folder: one that a crash left while it was emptied.

    A piece without the note of what it is of is no danger: its name says it.
    """
    return folder.is_dir() and all(
        one.name.endswith(_PIECE) or one.name.startswith(f"{_PIECE}-") for one in folder.iterdir()
    )


def _told(about: Path) -> dict[str, Any]:
    try:
        before = read_json(about)
        if not isinstance(before, dict):
            raise ValueError("no object")
    except ValueError as error:
        raise Conflict(
            f"{about.parent} holds a training that was broken off, but {about.name} in it is "
            "damaged, so nobody knows which."
        ) from error
    return before


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(one)}" for key, one in value.items())
    if isinstance(value, list):
        return ", ".join(map(_shown, value))
    return "nothing" if value is None else str(value)
