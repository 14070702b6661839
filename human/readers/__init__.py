"""Readers of recordings: motions, markers, force plates and tables.

`read_recording` reads MVNX (versions 3 and 4) and BVH (Xsens and CMU style); `inspect_recording`
says what a file holds; `human.pose.fit_recording` makes a motion of it. `read_markers` and
`read_plates` read markers and force plates (C3D, TRC, MOT, CSV, .mat), of which `human.markers`
makes a motion; `inspect_file` says what any of these files holds.
"""

from human.readers.axes import UNITS_M
from human.readers.bvh_writer import write_bvh
from human.readers.c3d import read_c3d
from human.readers.column_map import ColumnMap, TablePart, read_column_map
from human.readers.column_records import TableRecording
from human.readers.csv_motive import read_motive_csv
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    RecordingFileError,
    TruncatedRecordingError,
    UnknownFormatError,
    UnsafeRecordingError,
)
from human.readers.inspect import Inspection, inspect_recording, inspection_of
from human.readers.inspect_markers import MarkerInspection, inspect_file
from human.readers.marker_files import MarkerFormat, marker_format, read_markers, read_plates
from human.readers.marker_set_file import read_marker_set
from human.readers.opensim_table import OpenSimTable, plate_forces, read_opensim_table
from human.readers.opensim_writer import write_plates, write_trc
from human.readers.read import read_recording
from human.readers.read_table import read_table
from human.readers.trc import read_trc

__all__ = [
    "UNITS_M",
    "AmbiguousRecordingError",
    "ColumnMap",
    "Inspection",
    "MalformedRecordingError",
    "MarkerFormat",
    "MarkerInspection",
    "OpenSimTable",
    "RecordingFileError",
    "TablePart",
    "TableRecording",
    "TruncatedRecordingError",
    "UnknownFormatError",
    "UnsafeRecordingError",
    "inspect_file",
    "inspect_recording",
    "inspection_of",
    "marker_format",
    "plate_forces",
    "read_c3d",
    "read_column_map",
    "read_marker_set",
    "read_markers",
    "read_motive_csv",
    "read_opensim_table",
    "read_plates",
    "read_recording",
    "read_table",
    "read_trc",
    "write_bvh",
    "write_plates",
    "write_trc",
]
