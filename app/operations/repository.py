"""Keeps operations as files: the record, the request it stands for, and its events."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from app.files import check_id, read_json, write_bytes, write_json
from app.operations.schemas import Operation
from app.problems import NotFound


class OperationFiles:
    """One folder per operation: ``operation.json``, ``request.json``, ``events.jsonl``."""

    def __init__(self, folder: Path) -> None:
        """Uses ``folder``, which is made when the first operation is saved."""
        self._folder = folder

    def _path(self, identifier: str) -> Path:
        return self._folder / check_id(identifier, "operation")

    def save(self, operation: Operation) -> None:
        """Writes the record, whole or not at all."""
        write_json(self._path(operation.id) / "operation.json", operation.model_dump())

    def load(self, identifier: str) -> Operation:
        """Reads a record.

        Raises:
            NotFound: There is none by that id.
        """
        path = self._path(identifier) / "operation.json"
        if not path.is_file():
            raise NotFound(f"There is no operation {identifier!r}.")
        return Operation.model_validate(read_json(path))

    def all(self) -> list[Operation]:
        """Returns every record, oldest first (ids grow with time)."""
        if not self._folder.is_dir():
            return []
        return [
            self.load(path.name)
            for path in sorted(self._folder.iterdir())
            if (path / "operation.json").is_file()
        ]

    def save_request(self, identifier: str, request: Any) -> None:
        """Writes what was asked, so that it can be done again after a restart."""
        # A candidate may hold a NaN, which is then a problem in its slot: keep it as it came.
        content = json.dumps(request).encode()
        write_bytes(self._path(identifier) / "request.json", content)

    def load_request(self, identifier: str) -> Any:
        """Reads what was asked."""
        return read_json(self._path(identifier) / "request.json")

    def forget_request(self, identifier: str) -> None:
        """Removes what was asked, once it is answered: it may hold personal data."""
        (self._path(identifier) / "request.json").unlink(missing_ok=True)

    def append_event(self, operation: Operation) -> None:
        """Adds the record as it now is to the operation's events."""
        with (self._path(operation.id) / "events.jsonl").open("a", encoding="utf-8") as stream:
            stream.write(operation.model_dump_json() + "\n")

    def events(self, identifier: str, after: int) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yields events numbered from 1, those after number ``after``."""
        path = self._path(identifier) / "events.jsonl"
        if not path.is_file():
            return
        with path.open(encoding="utf-8") as stream:
            for number, line in enumerate(stream, start=1):
                # A line without its end is still being written.
                if number > after and line.endswith("\n"):
                    yield number, json.loads(line)
