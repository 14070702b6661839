"""Names that clients give to files: shown, never used as a path."""

#: Longest name kept.
_LENGTH = 120


def clean_name(name: str, otherwise: str) -> str:
    """Returns a client's file name as text that is safe to show.

    Args:
        name: As it came.
        otherwise: What to use when nothing is left of it.
    """
    base = name.replace("\\", "/").rsplit("/", 1)[-1]
    kept = "".join(char for char in base if char.isprintable()).strip()
    return kept[:_LENGTH] or otherwise
