"""The MVNX grammar, streamed: the header once, then one record per frame.

The XML parser never builds a tree and never sees an entity: a document type declaration with an
internal subset, or any entity declaration, is refused where it stands, which closes entity bombs
and outside references whatever the file's encoding. Memory is bounded by the fields kept.

Source: MVNX files of MVN 4.2 (version 3) and MVN 2019 (version 4).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from human.readers.errors import (
    MalformedRecordingError,
    TruncatedRecordingError,
    UnknownFormatError,
    UnsafeRecordingError,
)

Array = NDArray[np.float64]

_CHUNK_BYTES = 1 << 16
_MAX_TEXT = 1 << 18
_MAX_DEPTH = 32
#: Past this, a number is of no body in any unit, and would overflow once squared.
_TOO_LARGE = 1e9
_MAX_HEADER_ITEMS = 5000
#: Per-frame elements that are kept, with the numbers each must hold per segment, joint, or at all.
_KEPT = {"orientation": ("segment", 4), "position": ("segment", 3), "jointAngle": ("joint", 3),
         "jointAngleXZY": ("joint", 3), "footContacts": ("contact", 1)}  # fmt: skip


@dataclass(slots=True)
class MvnxFrame:
    """One frame element: its attributes and the kept arrays, flat, in file units."""

    line: int
    attributes: Mapping[str, str]
    values: dict[str, Array] = field(default_factory=dict)


@dataclass(slots=True)
class MvnxFile:
    """A parsed file: header and frames, nothing interpreted."""

    version: str = ""
    software: str = ""
    subject: Mapping[str, str] = field(default_factory=dict)
    segments: list[str] = field(default_factory=list)
    points: dict[str, dict[str, Array]] = field(default_factory=dict)
    sensors: list[str] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    connectors: dict[str, list[str]] = field(default_factory=dict)
    contacts: list[str] = field(default_factory=list)
    reference_frames: list[MvnxFrame] = field(default_factory=list)
    frames: list[MvnxFrame] = field(default_factory=list)
    channels: dict[str, int] = field(default_factory=dict)
    point_element: str = ""


def parse_mvnx(path: Path) -> MvnxFile:
    """Reads an MVNX file.

    Raises:
        RecordingFileError: the XML, a count or a number is wrong; the place is the line and the
            frame.
    """
    handler = _Handler(path.name)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    handler.attach(parser)
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(_CHUNK_BYTES):
                parser.Parse(chunk, False)
            parser.Parse(b"", True)
    except expat.ExpatError as problem:
        place = f"{path.name}, line {problem.lineno}"
        reason = expat.ErrorString(problem.code)
        if problem.code in _ENDED:
            raise TruncatedRecordingError(
                place,
                "the rest of the file",
                f"its end ({reason})",
                "The file is cut off; export it again.",
            ) from problem
        raise MalformedRecordingError(
            place, "well-formed XML", reason or "something else"
        ) from problem
    except (LookupError, UnicodeError, ValueError) as problem:
        raise MalformedRecordingError(
            path.name, "text in a known encoding", str(problem)
        ) from problem
    return handler.finished()


_ENDED = frozenset(
    expat.errors.codes[text]
    for text in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
    )
)


class _Handler:
    """Turns parser events into an `MvnxFile`; one method per element that matters."""

    def __init__(self, file_name: str) -> None:
        self.file = MvnxFile()
        self.name = file_name
        self.stack: list[str] = []
        self.text: list[str] | None = None
        self.length = 0
        self.segment = self.point = self.joint = ""
        self.frame: MvnxFrame | None = None
        self.line: Callable[[], int] = lambda: 0

    def attach(self, parser: expat.XMLParserType) -> None:
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.characters
        parser.StartDoctypeDeclHandler = self.doctype
        parser.EntityDeclHandler = self.entity
        self.line = lambda: parser.CurrentLineNumber

    @property
    def place(self) -> str:
        place = f"{self.name}, line {self.line()}"
        if self.frame is not None:
            place += f", frame {len(self.file.frames)}"
        return place

    def doctype(
        self, _name: str, _system: str | None, _public: str | None, has_internal_subset: bool
    ) -> None:
        if has_internal_subset:
            raise UnsafeRecordingError(
                self.place, "no document type definition inside the file", "one"
            )

    def entity(self, name: str, *_: object) -> None:
        raise UnsafeRecordingError(self.place, "no XML entities", f"a declaration of {name!r}")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rsplit(" ", 1)[-1]
        if not self.stack and tag != "mvnx":
            raise UnknownFormatError(
                self.place, "an MVNX file (root element <mvnx>)", f"XML with root <{tag[:40]}>"
            )
        if len(self.stack) >= _MAX_DEPTH:
            raise UnsafeRecordingError(self.place, f"at most {_MAX_DEPTH} nested elements", "more")
        self.stack.append(tag)
        file = self.file
        match tag:
            case "mvnx":
                file.version = attributes.get("version", "")
            case "mvn":
                file.software = attributes.get("version", "")
            case "subject":
                file.subject = dict(attributes)
            case "segment":
                self.segment = self.label(attributes, file.segments)
                file.points[self.segment] = {}
            case "point":
                self.point = attributes.get("label", "")
            case "pos_s" | "pos_b":
                file.point_element = tag
                self.text, self.length = [], 0
            case "sensor":
                self.label(attributes, file.sensors)
            case "joint":
                self.joint = self.label(attributes, file.joints)
                file.connectors[self.joint] = []
            case "connector1" | "connector2":
                self.text, self.length = [], 0
            case "contactDefinition":
                self.label(attributes, file.contacts)
            case "frame":
                if self.frame is not None:
                    raise MalformedRecordingError(
                        self.place, "the end of the frame", "another <frame>"
                    )
                self.frame = MvnxFrame(self.line(), dict(attributes))
            case _ if self.frame is not None and len(self.stack) >= 2 and self.stack[-2] == "frame":
                file.channels[tag] = file.channels.get(tag, 0) + 1
                if tag in _KEPT:
                    self.text, self.length = [], 0

    def label(self, attributes: dict[str, str], known: list[str]) -> str:
        label = attributes.get("label", "")
        if not label or label in known or len(known) >= _MAX_HEADER_ITEMS:
            raise MalformedRecordingError(
                self.place,
                f"a new label on <{self.stack[-1]}>",
                repr(label[:40]) if label else "none",
            )
        known.append(label)
        return label

    def characters(self, data: str) -> None:
        if self.text is None:
            return
        self.length += len(data)
        if self.length > _MAX_TEXT:
            raise UnsafeRecordingError(
                self.place, f"at most {_MAX_TEXT} characters in <{self.stack[-1]}>", "more"
            )
        self.text.append(data)

    def end(self, tag: str) -> None:
        tag = self.stack.pop()
        text = "".join(self.text) if self.text is not None else ""
        self.text = None
        match tag:
            case "pos_s" | "pos_b":
                points = self.file.points.setdefault(self.segment, {})
                if len(points) >= _MAX_HEADER_ITEMS:
                    raise UnsafeRecordingError(self.place, "fewer points on a segment", "more")
                points[self.point] = self.numbers(text, 3, f"point {self.point} of {self.segment}")
            case "connector1" | "connector2":
                self.file.connectors.setdefault(self.joint, []).append(text.strip())
            case "frame" if self.frame is not None:
                kind = self.frame.attributes.get("type", "normal")
                (self.file.frames if kind == "normal" else self.file.reference_frames).append(
                    self.frame
                )
                self.frame = None
            case _ if (
                tag in _KEPT and self.frame is not None and self.stack and self.stack[-1] == "frame"
            ):
                self.keep(self.frame, tag, text)

    def keep(self, frame: MvnxFrame, tag: str, text: str) -> None:
        counted, each = _KEPT[tag]
        labels = {
            "segment": self.file.segments,
            "joint": self.file.joints,
            "contact": self.file.contacts,
        }
        count = len(labels[counted]) or (len(text.split()) if counted == "contact" else 0)
        frame.values[tag] = self.numbers(text, count * each, f"<{tag}>, {each} per {counted}")

    def numbers(self, text: str, count: int, what: str) -> Array:
        words = text.split()
        if len(words) != count:
            raise MalformedRecordingError(self.place, f"{count} numbers ({what})", f"{len(words)}")
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError as problem:
            raise MalformedRecordingError(
                self.place, f"numbers ({what})", str(problem)[:80]
            ) from None
        bad = ~np.isfinite(values) | (np.abs(values) >= _TOO_LARGE)
        if bad.any():
            k = int(np.flatnonzero(bad)[0])
            raise MalformedRecordingError(
                self.place, f"finite numbers ({what})", f"{words[k][:20]} at position {k}",
                "Fill or cut the frame in MVN and export again.",
            )  # fmt: skip
        return values

    def finished(self) -> MvnxFile:
        if not self.file.frames:
            raise TruncatedRecordingError(
                self.name,
                "at least one frame of motion",
                f"none ({len(self.file.reference_frames)} reference poses)",
            )
        return self.file
