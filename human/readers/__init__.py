"""Readers of recordings: MVNX (versions 3 and 4) and BVH (Xsens and CMU style).

`read_recording` returns a `human.recording.Recording` in house units and axes; `inspect_recording`
says what a file holds; `human.pose.fit_recording` makes a motion of it.
"""

from human.readers.axes import UNITS_M
from human.readers.bvh_writer import write_bvh
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    RecordingFileError,
    TruncatedRecordingError,
    UnknownFormatError,
    UnsafeRecordingError,
)
from human.readers.inspect import Inspection, inspect_recording, inspection_of
from human.readers.read import read_recording

__all__ = [
    "UNITS_M",
    "AmbiguousRecordingError",
    "Inspection",
    "MalformedRecordingError",
    "RecordingFileError",
    "TruncatedRecordingError",
    "UnknownFormatError",
    "UnsafeRecordingError",
    "inspect_recording",
    "inspection_of",
    "read_recording",
    "write_bvh",
]
