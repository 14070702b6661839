"""Damaged and hostile files: one error class, always with the place, and nothing else ever."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from human.errors import HumanError
from human.readers import (
    MalformedRecordingError,
    RecordingFileError,
    TruncatedRecordingError,
    UnknownFormatError,
    UnsafeRecordingError,
    read_recording,
    write_bvh,
)

from .making import walker, write_mvnx


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("good")
    model, motion = walker(frames=6)
    write_bvh(folder / "a.bvh", model, motion)
    return {
        "bvh": (folder / "a.bvh").read_text(),
        "mvnx": write_mvnx(folder / "a.mvnx", model, motion),
    }


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE mvnx [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">]><mvnx version="&c;">&c;</mvnx>'
)
OUTSIDE = (
    '<?xml version="1.0"?><!DOCTYPE mvnx [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
    '<mvnx version="4">&f;</mvnx>'
)
FOREIGN = {
    "empty": (b"", TruncatedRecordingError, "an empty file"),
    "blank": (b" \n\t\n", TruncatedRecordingError, "an empty file"),
    "zip": (b"PK\x03\x04rest", UnknownFormatError, "ZIP archive.*Unpack"),
    "fbx": (b"Kaydara FBX Binary  \x00", UnknownFormatError, "binary FBX scene.*as BVH"),
    "c3d": (b"\x02\x50\x00\x00\x01", UnknownFormatError, "C3D"),
    "trc": (b"PathFileType\t4", UnknownFormatError, "TRC"),
    "junk": (bytes(range(128, 256)), UnknownFormatError, "content that begins with"),
    "text": (b"time,x,y\n0,1,2\n", UnknownFormatError, "begins with 'time,x,y'"),
    "urdf": (b"<robot name='r'/>", UnknownFormatError, "root <robot>"),
    "bomb": (BOMB.encode(), UnsafeRecordingError, "line 1.*type definition inside"),
    "bomb in utf-16": (BOMB.encode("utf-16"), UnsafeRecordingError, "type definition inside"),
    "outside entity": (OUTSIDE.encode(), UnsafeRecordingError, "type definition inside"),
    "nesting": (b"<mvnx>" + b"<a>" * 40, UnsafeRecordingError, "nested"),
    "long text": (
        b"<mvnx><segment label='s'><pos_b>" + b"1 " * 200_000,
        UnsafeRecordingError,
        "characters in <pos_b>",
    ),
    "no frames": (b"<mvnx version='4'/>", TruncatedRecordingError, "at least one frame"),
    "frame in frame": (
        b"<mvnx><frame><frame/></frame></mvnx>",
        MalformedRecordingError,
        "end of the frame",
    ),
    "long line": (b"HIERARCHY\n" + b"x" * (1 << 21), UnsafeRecordingError, "line 2"),
    "deep tree": (
        b"HIERARCHY\nROOT a\n{\n" + b"JOINT a\n{\n" * 300,
        UnsafeRecordingError,
        "200 deep",
    ),
    "encoding": (
        b"<?xml version='1.0' encoding='klingon'?><mvnx/>",
        MalformedRecordingError,
        "encoding",
    ),
}


@pytest.mark.parametrize("name", list(FOREIGN))
def test_foreign_and_hostile_files(tmp_path: Path, name: str) -> None:
    content, error, message = FOREIGN[name]
    (tmp_path / "a.dat").write_bytes(content)
    with pytest.raises(error, match=message):
        read_recording(tmp_path / "a.dat")


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    with pytest.raises(RecordingFileError, match="no such file"):
        read_recording(tmp_path / "none.bvh")
    with pytest.raises(RecordingFileError, match="is a directory"):
        read_recording(tmp_path)


def test_a_reference_to_the_published_dtd_is_not_followed_and_not_refused(
    tmp_path: Path, good: dict[str, str]
) -> None:
    dtd = '<!DOCTYPE mvnx SYSTEM "http://www.xsens.com/mvn/mvnx/schema.dtd">\n<mvnx'
    (tmp_path / "a.mvnx").write_text(good["mvnx"].replace("<mvnx", dtd, 1))
    assert read_recording(tmp_path / "a.mvnx").frames == 6


#: format, pattern, replacement, error, what the message must say: place, expected, got.
DAMAGE = {
    "bvh nan": (
        "bvh",
        r"(?m)(Frame Time.*\n.*\n)\S+",
        r"\1nan",
        MalformedRecordingError,
        r"line \d+: expected finite numbers \(channels of frame 1\), got 'nan'",
    ),
    "bvh huge": (
        "bvh",
        r"(?m)(Frame Time.*\n.*\n)\S+",
        r"\g<1>1e300",
        MalformedRecordingError,
        r"line \d+: expected finite numbers \(channels of frame 1\), got '1e300'",
    ),
    "bvh word": ("bvh", r"OFFSET \S+", "OFFSET abc", MalformedRecordingError, r"line 4: .*'abc'"),
    "bvh short line": (
        "bvh",
        r" \S+\n\Z",
        "\n",
        MalformedRecordingError,
        r"72 numbers \(channels of frame 6\), got 71",
    ),
    "bvh fewer frames": (
        "bvh",
        r"Frames: 7",
        "Frames: 9",
        TruncatedRecordingError,
        "9 frames as declared, got 7",
    ),
    "bvh more frames": (
        "bvh",
        r"Frames: 7",
        "Frames: 3",
        MalformedRecordingError,
        "3 declared frames",
    ),
    "bvh no frames": (
        "bvh",
        r"Frames: 7",
        "Frames: 0",
        MalformedRecordingError,
        "1 or more, got 0",
    ),
    "bvh frame time": (
        "bvh",
        r"Frame Time: \S+",
        "Frame Time: 0",
        MalformedRecordingError,
        "frame time between",
    ),
    "bvh channel name": ("bvh", "Yrotation", "Wrotation", MalformedRecordingError, "Wrotation"),
    "bvh channel count": (
        "bvh",
        "CHANNELS 3",
        "CHANNELS 4",
        MalformedRecordingError,
        "CHANNELS 3 before 3",
    ),
    "bvh two people": (
        "bvh",
        "MOTION",
        "ROOT Second\nMOTION",
        MalformedRecordingError,
        "one person",
    ),
    "bvh root": ("bvh", "6 Xposition Yposition Zposition", "3", MalformedRecordingError, "."),
    "mvnx nan": (
        "mvnx",
        r"(?s)(type=\"normal\"><orientation>)\S+",
        r"\1NaN",
        MalformedRecordingError,
        r"line \d+, frame 0: expected finite numbers \(<orientation>.*got NaN at position 0",
    ),
    "mvnx huge": (
        "mvnx",
        r"(?s)(type=\"normal\"><orientation>)\S+",
        r"\g<1>1e300",
        MalformedRecordingError,
        r"line \d+, frame 0: expected finite numbers \(<orientation>.*got 1e300 at position 0",
    ),
    "mvnx count": (
        "mvnx",
        r"(type=\"normal\"><orientation>)\S+",
        r"\1",
        MalformedRecordingError,
        r"frame 0: expected 92 numbers",
    ),
    "mvnx word": (
        "mvnx",
        r"(type=\"normal\"><position>|</orientation><position>)\S+",
        r"\1x1",
        MalformedRecordingError,
        "x1",
    ),
    "mvnx quaternion": (
        "mvnx",
        r"(index=\"3\" type=\"normal\"><orientation>)\S+ \S+",
        r"\g<1>2.0 2.0",
        MalformedRecordingError,
        "frame 3, orientation of Pelvis: .*unit quaternion",
    ),
    "mvnx repeated time": (
        "mvnx",
        'time="50"',
        'time="33"',
        MalformedRecordingError,
        "frame 3: .*the same time as frame 2",
    ),
    "mvnx unsorted": (
        "mvnx",
        'time="50"',
        'time="20"',
        MalformedRecordingError,
        "frame 3: .*a time before frame 2",
    ),
    "mvnx index": ("mvnx", 'index="3"', 'index="2"', MalformedRecordingError, "frame 3"),
    "mvnx time word": (
        "mvnx",
        'time="50"',
        'time="soon"',
        MalformedRecordingError,
        "a number as time, got 'soon'",
    ),
    "mvnx rate": ("mvnx", 'frameRate="60"', 'frameRate="-1"', MalformedRecordingError, "frameRate"),
    "mvnx label": (
        "mvnx",
        'segment label="L3"',
        'segment label="L5"',
        MalformedRecordingError,
        "new label",
    ),
    "mvnx joint": (
        "mvnx",
        "<connector2>L3/jL4L3",
        "<connector2>L3/jNone",
        MalformedRecordingError,
        "jNone",
    ),
    "mvnx tag": (
        "mvnx",
        "</segments>",
        "</segment>",
        MalformedRecordingError,
        "line .*mismatched tag",
    ),
    "mvnx no position": (
        "mvnx",
        r"<position>[^<]*</position></frame>\n</frames>",
        "</frame></frames>",
        MalformedRecordingError,
        "frame 5: expected an <position> element",
    ),
}


@pytest.mark.parametrize("name", list(DAMAGE))
def test_damage_is_named_with_its_place(tmp_path: Path, good: dict[str, str], name: str) -> None:
    kind, pattern, replacement, error, message = DAMAGE[name]
    text, changed = re.subn(pattern, replacement, good[kind], count=1)
    assert changed, "the case no longer damages anything"
    (tmp_path / "a").write_text(text)
    with pytest.raises(error, match=message) as caught:
        read_recording(tmp_path / "a")
    assert caught.value.place
    assert caught.value.expected
    assert caught.value.got


def test_rounding_of_quaternions_is_undone_and_more_is_said(
    tmp_path: Path, good: dict[str, str]
) -> None:
    text = re.sub(
        r'(index="3" type="normal"><orientation>)(\S+)',
        lambda m: f"{m[1]}{float(m[2]) * 1.0004:.6f}",
        good["mvnx"],
    )
    (tmp_path / "a.mvnx").write_text(text)
    said = " ".join(read_recording(tmp_path / "a.mvnx").report.conversions)
    assert "1 quaternions normalised" in said
    (tmp_path / "b.mvnx").write_text(good["mvnx"])
    assert "normalised" not in " ".join(read_recording(tmp_path / "b.mvnx").report.conversions)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(kind=st.sampled_from(["bvh", "mvnx"]), share=st.floats(0.0, 0.9999))
def test_a_file_cut_anywhere_is_refused(
    tmp_path_factory: pytest.TempPathFactory, good: dict[str, str], kind: str, share: float
) -> None:
    content = good[kind].rstrip().encode()
    path = tmp_path_factory.getbasetemp() / "cut"
    path.write_bytes(content[: int(share * len(content))])
    try:
        read_recording(path)
    except RecordingFileError:
        return
    # A BVH cut inside its last number is still a BVH; nothing can notice that.
    assert kind == "bvh"
    assert share > 0.99


@settings(max_examples=200, deadline=None, derandomize=True)
@given(data=st.data(), kind=st.sampled_from(["bvh", "mvnx"]))
def test_bytes_changed_anywhere_give_a_recording_or_our_error(
    tmp_path_factory: pytest.TempPathFactory, good: dict[str, str], data: st.DataObject, kind: str
) -> None:
    content = bytearray(good[kind].encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=4))
    path = tmp_path_factory.getbasetemp() / "changed"
    path.write_bytes(bytes(content))
    try:
        read_recording(path)
    except HumanError as error:
        assert isinstance(error, RecordingFileError)
