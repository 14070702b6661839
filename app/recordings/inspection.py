"""What was found in a recording, as JSON."""

from typing import Any

from app.plain import plain


def inspection_record(inspection: Any) -> dict[str, Any]:
    """Returns an inspection as plain values.

    Args:
        inspection: The record that ``human.readers.inspect_recording`` returns.
    """
    record: dict[str, Any] = plain(inspection)
    return record
