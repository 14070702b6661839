"""Keeps recordings by content; the same bytes are the same recording."""

import hashlib
from collections.abc import AsyncIterator
from pathlib import Path

from anyio import to_thread

from app.files import check_id, read_json, receive, scratch_file, write_bytes, write_json
from app.names import clean_name
from app.problems import NotFound, Unreadable, UnsupportedFormat
from app.recordings.inspection import inspection_record
from app.recordings.schemas import Recording
from human.errors import RecordingError
from human.readers import UnknownFormatError, inspect_recording


class Recordings:
    """One folder per recording: its bytes as they came and what was found in them."""

    def __init__(self, folder: Path) -> None:
        """Keeps recordings under ``folder``."""
        self._folder = folder

    async def add(self, chunks: AsyncIterator[bytes], name: str, limit: int) -> Recording:
        """Stores an upload, once it is known to be readable.

        Args:
            chunks: The request's body.
            name: What the client calls it.
            limit: Most bytes taken.

        Raises:
            TooLarge: It is larger than ``limit``.
            UnsupportedFormat: It is in no format that is read.
            Unreadable: It is damaged.
        """
        with scratch_file(self._folder) as path:
            digest, size = await receive(chunks, path, limit)
            return await to_thread.run_sync(self._keep, path, f"rec_{digest}", name, size)

    def add_file(self, path: Path, name: str) -> Recording:
        """Stores a copy of a recording; as `add`."""
        content = path.read_bytes()
        identifier = f"rec_{hashlib.sha256(content).hexdigest()}"
        with scratch_file(self._folder) as copy:
            write_bytes(copy, content)
            return self._keep(copy, identifier, name, len(content))

    def _keep(self, path: Path, identifier: str, name: str, size: int) -> Recording:
        record = self._inspect(path, identifier, name, size)
        home = self._folder / identifier
        home.mkdir(parents=True, exist_ok=True)
        path.replace(home / "content")
        write_json(home / "recording.json", record.model_dump())
        return record

    def _inspect(self, path: Path, identifier: str, name: str, size: int) -> Recording:
        # The reader knows the file by its temporary name; the client by theirs.
        shown = clean_name(name, "recording")
        try:
            found = inspect_recording(path)
        except UnknownFormatError as error:
            raise UnsupportedFormat(str(error).replace(path.name, shown)) from error
        except RecordingError as error:
            raise Unreadable(str(error).replace(path.name, shown)) from error
        inspection = {**inspection_record(found), "source": shown}
        return Recording(
            id=identifier,
            name=shown,
            format=str(inspection["format"]),
            size_bytes=size,
            inspection=inspection,
        )

    def get(self, identifier: str) -> Recording:
        """Returns a recording's record.

        Raises:
            NotFound: There is none by that id.
        """
        path = self._home(identifier) / "recording.json"
        return Recording.model_validate(read_json(path))

    def content(self, identifier: str) -> Path:
        """Returns the path of a recording's bytes.

        Raises:
            NotFound: There is none by that id.
        """
        return self._home(identifier) / "content"

    def all(self) -> list[Recording]:
        """Returns every recording, newest first."""
        if not self._folder.is_dir():
            return []
        records = sorted(
            self._folder.glob("rec_*/recording.json"),
            key=lambda path: (path.stat().st_mtime, path.parent.name),
            reverse=True,
        )
        return [Recording.model_validate(read_json(path)) for path in records]

    def _home(self, identifier: str) -> Path:
        home = self._folder / check_id(identifier, "recording")
        if not (home / "recording.json").is_file():
            raise NotFound(f"There is no recording {identifier!r}.")
        return home
