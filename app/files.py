"""Files that are either whole or absent: written beside, flushed, then renamed into place."""

import contextlib
import hashlib
import json
import os
import re
import tempfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

from app.problems import NotFound, TooLarge

#: Shape of every id the service makes; anything else never becomes a path.
_ID = re.compile(r"[a-z]{2,4}_[0-9a-f]{16,64}")


def check_id(value: str, what: str) -> str:
    """Returns ``value`` if it can be one of our ids.

    Raises:
        NotFound: It cannot, so nothing has it.
    """
    if not _ID.fullmatch(value):
        raise NotFound(f"There is no {what} {value!r}.")
    return value


def write_bytes(path: Path, content: bytes) -> None:
    """Writes a file so that a reader sees all of it or none of it.

    Raises:
        OSError: It cannot be written, as on a full disk; its ``filename`` is ``path``.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".part-")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        Path(name).replace(path)
    except BaseException as error:
        Path(name).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno is not None:
            # A full disk is told without saying where.
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise


def dump_json(value: Any) -> bytes:
    """Returns canonical JSON: UTF-8, no NaN, same value same bytes."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # Half a surrogate pair, as a client may send, has no UTF-8: it goes back escaped, as it came.
    return text.encode(errors="backslashreplace")


def write_json(path: Path, value: Any) -> None:
    """Writes a JSON file atomically."""
    write_bytes(path, dump_json(value))


def read_json(path: Path) -> Any:
    """Reads a JSON file written by :func:`write_json`."""
    return json.loads(path.read_bytes())


@contextlib.contextmanager
def scratch_file(folder: Path, suffix: str = "") -> Iterator[Path]:
    """Yields the path of an empty temporary file in ``folder``; it is gone afterwards.

    Rename it away inside the block to keep it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=folder, prefix=".part-", suffix=suffix)
    os.close(handle)
    path = Path(name)
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


async def receive(chunks: AsyncIterator[bytes], path: Path, limit: int) -> tuple[str, int]:
    """Streams an upload into ``path`` while hashing it.

    Args:
        chunks: The request's body.
        path: File to fill.
        limit: Most bytes taken.

    Returns:
        The SHA-256 of the content (hex) and its size in bytes.

    Raises:
        TooLarge: More than ``limit`` bytes came.
    """
    digest = hashlib.sha256()
    size = 0
    with path.open("wb") as stream:
        async for chunk in chunks:
            size += len(chunk)
            if size > limit:
                raise TooLarge(f"The upload is larger than {limit} bytes; nothing was kept.")
            digest.update(chunk)
            stream.write(chunk)
        stream.flush()
        os.fsync(stream.fileno())
    return digest.hexdigest(), size
