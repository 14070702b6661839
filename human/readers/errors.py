"""What can be wrong with a file, each with the place, what was expected and what was got.

RecordingError (human.errors)
└── RecordingFileError
    ├── UnknownFormatError       not a recording this package reads
    ├── MalformedRecordingError  the grammar or the numbers are wrong at one place
    ├── TruncatedRecordingError  the file ends too soon
    ├── UnsafeRecordingError     entities, or sizes no recording has
    └── AmbiguousRecordingError  units or axes that the evidence does not settle: the caller must
    say
"""

from human.errors import RecordingError


class RecordingFileError(RecordingError):
    """A file cannot be read as a recording.

    Attributes:
        place: where in the file (line, frame, element).
        expected: what should have stood there.
        got: what stands there.
    """

    def __init__(self, place: str, expected: str, got: str, advice: str = "") -> None:
        """Builds the message ``place: expected …, got …. advice``."""
        self.place = place
        self.expected = expected
        self.got = got
        self.advice = advice
        message = f"{place}: expected {expected}, got {got}."
        super().__init__(f"{message} {advice}" if advice else message)


class UnknownFormatError(RecordingFileError):
    """The content is of no format that is read here."""


class MalformedRecordingError(RecordingFileError):
    """The grammar, a count or a number is wrong at the named place."""


class TruncatedRecordingError(RecordingFileError):
    """The file is empty or ends before what it declares."""


class UnsafeRecordingError(RecordingFileError):
    """The file uses XML entities or exceeds a size that no recording has."""


class AmbiguousRecordingError(RecordingFileError):
    """Units or axes cannot be told from the skeleton: pass the named parameter.

    Attributes:
        parameter: the argument of `read_recording` that settles it.
    """

    def __init__(self, place: str, expected: str, got: str, parameter: str, advice: str) -> None:
        """As the base, with the parameter to pass."""
        self.parameter = parameter
        super().__init__(place, expected, got, advice)
