"""Mapping files: a user's own marker set, JSON of the same form as those in the package."""

import json
from os import PathLike
from pathlib import Path

from human.markers.errors import MarkerSetError
from human.markers.marker_set import MarkerSet, marker_set_from_dict

_LARGEST_BYTES = 1 << 20


def read_marker_set(path: str | PathLike[str]) -> MarkerSet:
    """Reads a mapping file: which marker sits on which segment and what bony point it shows.

    Args:
        path: a JSON file; `human.markers.marker_set_from_dict` says what it holds, and
            ``human/markers/README.md`` shows one.

    Raises:
        MarkerSetError: the file cannot be read, is no JSON, or names what does not exist.
    """
    file = Path(path)
    try:
        size = file.stat().st_size
        if size > _LARGEST_BYTES:
            raise MarkerSetError(
                file.name, f"expected at most {_LARGEST_BYTES} bytes, got {size}: not a mapping."
            )
        text = file.read_text("utf-8-sig")
    except OSError as error:
        raise MarkerSetError(file.name, f"expected a readable file, got: {error.strerror}.") from (
            error
        )
    except UnicodeDecodeError as error:
        raise MarkerSetError(file.name, f"expected UTF-8 text, got: {error.reason}.") from error
    try:
        value = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise MarkerSetError(file.name, f"expected JSON, got: {error}.") from error
    return marker_set_from_dict(value)
