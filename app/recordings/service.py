"""Keeps recordings by content; the same bytes are the same recording.

What is added to a motion (static trial, forces, mappings) is kept beside it, by content too: work
that was asked for before a file was replaced still finds what it was asked for.
"""

import hashlib
import threading
from collections.abc import AsyncIterator
from pathlib import Path

from anyio import to_thread

from app.files import check_id, read_json, receive, scratch_file, write_bytes, write_json
from app.names import clean_name
from app.problems import NotFound, Unreadable, UnsupportedFormat
from app.recordings.inspection import inspection_record
from app.recordings.schemas import Recording, RecordingFile
from app.takes import Part, PartRole, Take
from human.errors import RecordingError
from human.markers import MarkerError
from human.readers import (
    UnknownFormatError,
    inspect_file,
    marker_format,
    read_column_map,
    read_marker_set,
    read_plates,
)


class Recordings:
    """One folder per recording: its bytes as they came and what was found in them."""

    def __init__(self, folder: Path) -> None:
        """Keeps recordings under ``folder``."""
        self._folder = folder
        self._changing = threading.Lock()

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

    async def add_part(
        self,
        identifier: str,
        role: PartRole,
        chunks: AsyncIterator[bytes],
        name: str,
        limit: int,
    ) -> Recording:
        """Adds a file to a recording, once it is known to be readable; replaces one of that role.

        Raises:
            NotFound: There is no such recording.
            TooLarge: It is larger than ``limit``.
            UnsupportedFormat: It is in no format that the role can have.
            Unreadable: It is damaged.
        """
        self._home(identifier)
        with scratch_file(self._folder) as path:
            digest, size = await receive(chunks, path, limit)
            shown = clean_name(name, role)
            file = RecordingFile(role=role, name=shown, size_bytes=size, sha256=digest)
            return await to_thread.run_sync(self._keep_part, identifier, path, file)

    def _keep_part(self, identifier: str, path: Path, file: RecordingFile) -> Recording:
        home = self._home(identifier)
        with self._changing:
            record = self.get(identifier)
            self._check_part(path, file, self.take(identifier))
            others = [one for one in record.files if one.role != file.role]
            changed = record.model_copy(update={"files": [*others, file]})
            path.replace(home / _part_name(file))
            write_json(home / "recording.json", changed.model_dump())
        return changed

    def _check_part(self, path: Path, file: RecordingFile, take: Take) -> None:
        columns = take.columns.path if take.columns else None
        try:
            if file.role == "marker_set":
                read_marker_set(path)
            elif file.role == "columns":
                read_column_map(path)
            elif file.role == "static":
                if marker_format(path) in (None, "opensim-table"):
                    raise UnsupportedFormat(
                        f"{file.name}: expected a static trial of markers (C3D, TRC, CSV, .mat)."
                    )
                inspect_file(path)
            else:
                read_plates(path, columns)
        except UnknownFormatError as error:
            raise UnsupportedFormat(str(error).replace(path.name, file.name)) from error
        except (RecordingError, MarkerError) as error:
            raise Unreadable(str(error).replace(path.name, file.name)) from error

    def take(self, identifier: str) -> Take:
        """Returns a recording's motion and what goes with it.

        Raises:
            NotFound: There is none by that id.
        """
        record, home = self.get(identifier), self._home(identifier)
        parts = {one.role: Part(home / _part_name(one), one.name) for one in record.files}
        return Take(motion=Part(home / "content", record.name), **parts)

    def _keep(self, path: Path, identifier: str, name: str, size: int) -> Recording:
        record = self._inspect(path, identifier, name, size)
        home = self._folder / identifier
        home.mkdir(parents=True, exist_ok=True)
        with self._changing:
            if (home / "recording.json").is_file():
                record = record.model_copy(update={"files": self.get(identifier).files})
            path.replace(home / "content")
            write_json(home / "recording.json", record.model_dump())
        return record

    def _inspect(self, path: Path, identifier: str, name: str, size: int) -> Recording:
        # The reader knows the file by its temporary name; the client by theirs.
        shown = clean_name(name, "recording")
        try:
            found = inspect_file(path)
        except UnknownFormatError as error:
            raise UnsupportedFormat(str(error).replace(path.name, shown)) from error
        except RecordingError as error:
            raise Unreadable(str(error).replace(path.name, shown)) from error
        inspection = {**inspection_record(found), "source": shown}
        if inspection["format"] == "opensim-table":
            raise UnsupportedFormat(
                f"{shown}: a table of forces is no motion. Send the motion, then add this to it: "
                "POST /v1/recordings/{id}/files?role=grf."
            )
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


def _part_name(file: RecordingFile) -> str:
    return f"{file.role}-{file.sha256}"
