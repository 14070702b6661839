"""Files are whole or absent, and uploads stop at the limit."""

import hashlib
from collections.abc import AsyncIterator
from pathlib import Path

import anyio
import pytest

from app.files import check_id, dump_json, read_json, receive, scratch_file, write_bytes, write_json
from app.problems import NotFound, TooLarge


async def chunks(*parts: bytes) -> AsyncIterator[bytes]:
    for part in parts:
        yield part


def test_a_written_file_is_whole_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    write_json(tmp_path / "a" / "b.json", {"x": 1.5, "y": "ä"})
    assert read_json(tmp_path / "a" / "b.json") == {"x": 1.5, "y": "ä"}
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b.json"]


def test_a_failed_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_bytes(tmp_path / "f", b"old")

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_bytes(tmp_path / "f", b"new")
    assert (tmp_path / "f").read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["f"]


def test_not_a_number_never_becomes_json() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        dump_json({"x": float("nan")})


def test_an_upload_is_hashed_while_it_is_stored(tmp_path: Path) -> None:
    with scratch_file(tmp_path) as path:
        digest, size = anyio.run(receive, chunks(b"abc", b"", b"def"), path, 6)
        assert path.read_bytes() == b"abcdef"
    assert (digest, size) == (hashlib.sha256(b"abcdef").hexdigest(), 6)
    assert not list(tmp_path.iterdir())


def test_an_upload_past_the_limit_is_dropped(tmp_path: Path) -> None:
    with pytest.raises(TooLarge), scratch_file(tmp_path) as path:
        anyio.run(receive, chunks(b"abc", b"def"), path, 5)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("value", ["rec_../..", "rec_", "rec_XYZ", "", "rec_" + "0" * 15, "/etc"])
def test_what_cannot_be_an_id_is_not_found(value: str) -> None:
    with pytest.raises(NotFound):
        check_id(value, "recording")
    assert check_id("rec_" + "0" * 64, "recording")
