"""Has another process parse a file in native code: one that contradicts itself can end it."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.readers.errors import MalformedRecordingError

_LONGEST_S = 120


def parsed_apart(path: Path, script: str, what: str, advice: str) -> dict[str, NDArray[Any]]:
    """Returns the arrays that a script of this folder leaves of a file, by name.

    Args:
        path: the file.
        script: such as ``c3d_parse.py``; run with the file and the place of an npz file to write.
        what: what the file should be, such as ``a C3D file``.
        advice: what to do with one that is not.

    Raises:
        MalformedRecordingError: the script failed, or took too long.
    """
    with TemporaryDirectory() as folder:
        out = Path(folder) / "parsed.npz"
        # -P: the script's own folder must not shadow modules of the standard library.
        command = [sys.executable, "-P", str(Path(__file__).with_name(script))]
        command += [str(path.resolve()), str(out)]
        try:
            ended = subprocess.run(command, capture_output=True, timeout=_LONGEST_S, check=False)
        except subprocess.TimeoutExpired as problem:
            raise MalformedRecordingError(
                path.name, f"{what} that parses within {_LONGEST_S} s", "a longer one"
            ) from problem
        if ended.returncode != 0 or not out.is_file():
            last = ended.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
            raise MalformedRecordingError(
                path.name, what, last[0][:200] if last else "one that ends the parser", advice
            )
        with np.load(out, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
