"""Keeps operator models by content; the same file is the same model."""

import threading
from collections import OrderedDict
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from pathlib import Path

from anyio import to_thread

from app.files import check_id, read_json, receive, scratch_file, write_bytes, write_json
from app.models.description import described
from app.models.operator import Operator, open_operator
from app.models.schemas import Model, Subject
from app.names import clean_name
from app.problems import NotFound
from human import to_urdf

#: Models kept open; each is a few megabytes.
_OPEN = 8


class Models:
    """One folder per model: its file and a record for the list."""

    def __init__(self, folder: Path) -> None:
        """Keeps models under ``folder``."""
        self._folder = folder
        self._open: OrderedDict[str, Operator] = OrderedDict()
        self._lock = threading.Lock()

    async def add(self, chunks: AsyncIterator[bytes], name: str, limit: int) -> Model:
        """Stores an uploaded model file, once it is known to be one.

        Raises:
            TooLarge: It is larger than ``limit`` bytes.
            UnsupportedFormat: It is no model file.
            Unreadable: It is damaged or of another version.
        """
        with scratch_file(self._folder) as path:
            await receive(chunks, path, limit)
            return await to_thread.run_sync(self._keep, path, name)

    def add_file(self, path: Path, name: str) -> Model:
        """Stores a copy of a model file; as `add`."""
        return self.add_content(path.read_bytes(), name)

    def add_content(self, content: bytes, name: str) -> Model:
        """Stores a model file's bytes; as `add`."""
        with scratch_file(self._folder) as path:
            write_bytes(path, content)
            return self._keep(path, name)

    def _keep(self, path: Path, name: str) -> Model:
        shown = clean_name(name, "operator")
        operator = open_operator(path, shown)
        home = self._folder / operator.id
        if (home / "model.json").is_file():
            return self.get(operator.id)
        record = _record(operator, shown)
        home.mkdir(parents=True, exist_ok=True)
        path.replace(home / "model.safetensors")
        write_json(home / "model.json", record.model_dump())
        return record

    def open(self, identifier: str) -> Operator:
        """Returns a model ready to predict.

        Raises:
            NotFound: There is none by that id.
        """
        with self._lock:
            if identifier in self._open:
                self._open.move_to_end(identifier)
                return self._open[identifier]
        home = self._home(identifier)
        operator = open_operator(home / "model.safetensors", identifier)
        with self._lock:
            self._open[identifier] = operator
            while len(self._open) > _OPEN:
                self._open.popitem(last=False)
        return operator

    def get(self, identifier: str) -> Model:
        """Returns a model's record.

        Raises:
            NotFound: There is none by that id.
        """
        return Model.model_validate(read_json(self._home(identifier) / "model.json"))

    def urdf(self, identifier: str) -> str:
        """Returns the person's body as URDF.

        Raises:
            NotFound: There is none by that id.
        """
        return to_urdf(self.open(identifier).model)

    def all(self) -> list[Model]:
        """Returns every model, newest first."""
        if not self._folder.is_dir():
            return []
        records = [
            Model.model_validate(read_json(path)) for path in self._folder.glob("mdl_*/model.json")
        ]
        return sorted(records, key=lambda record: (record.created, record.id), reverse=True)

    def _home(self, identifier: str) -> Path:
        home = self._folder / check_id(identifier, "model")
        if not (home / "model.json").is_file():
            raise NotFound(f"There is no model {identifier!r}.")
        return home


def _record(operator: Operator, name: str) -> Model:
    held = described(operator.content)
    created = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    return Model(
        id=operator.id,
        name=name,
        subject=Subject(**held.pop("subject")),
        hand=held.pop("hand"),
        base=held.pop("base"),
        method=held.pop("method"),
        created=created,
        metrics=held.pop("metrics"),
        holds=held,
        urdf_url=f"/v1/models/{operator.id}/urdf",
    )
