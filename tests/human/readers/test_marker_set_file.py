"""Mapping files of users: read, or refused with the file's name."""

import json
from pathlib import Path

import pytest

from human.markers import MarkerSetError
from human.readers import read_marker_set

README = Path(__file__).parents[3] / "human" / "markers" / "README.md"


def test_the_example_in_the_readme_is_read(tmp_path: Path) -> None:
    example = README.read_text("utf-8").split("```json\n")[1].split("```")[0]
    file = tmp_path / "mine.json"
    # As some editors of Windows save it.
    file.write_bytes(b"\xef\xbb\xbf" + example.encode())
    mine = read_marker_set(file)
    assert {"right_asis", "left_asis", "right_psis", "left_psis"} <= mine.roles()
    assert [p.name for p in mine.places] == [m["name"] for m in json.loads(example)["markers"]]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{", "expected JSON"),
        (b"[" * 100_000, "expected JSON"),
        (b"\xff\xfe{}", "expected UTF-8"),
        (b"[]", "expected an object"),
        (b" " * ((1 << 20) + 1), "expected at most"),
    ],
)
def test_what_is_no_mapping_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    file = tmp_path / "mine.json"
    file.write_bytes(content)
    with pytest.raises(MarkerSetError, match=said):
        read_marker_set(file)


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(MarkerSetError, match=r"^marker set, none\.json: expected a readable file"):
        read_marker_set(tmp_path / "none.json")
