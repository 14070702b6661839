"""Parses one .mat file and leaves its numeric arrays in an npz file; run as a process of its own.

Both parsers are native code and unpack what a file says it holds, so this is another process than
the caller's, with its memory bounded. This file is run by path and imports nothing of ours.
"""

import json
import resource
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

_MEMORY_BYTES = 8 << 30
_MOST_BYTES = 1 << 30
_MOST_ARRAYS = 10_000
_MOST_DEPTH = 12


def _of_struct(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yields the arrays of a MATLAB value (version 7 and below) by their dotted names."""
    if depth > _MOST_DEPTH or not isinstance(value, np.ndarray):
        return
    if value.dtype.names:
        # Arrays of structs are no time series.
        if value.size == 1:
            for field in value.dtype.names:
                yield from _of_struct(f"{name}.{field}", value[field].flat[0], depth + 1)
    elif value.dtype.kind in "fiub":
        yield name, value


def _of_group(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yields the arrays of an HDF5 group (version 7.3); its axes are in reverse order there."""
    import h5py

    if depth > _MOST_DEPTH:
        return
    for key in value:
        # Links to other files are not followed.
        if key.startswith("#") or not isinstance(value.get(key, getlink=True), h5py.HardLink):
            continue
        item, full = value[key], f"{name}.{key}" if name else key
        if isinstance(item, h5py.Group):
            yield from _of_group(full, item, depth + 1)
        elif item.dtype.kind in "fiub" and item.attrs.get("MATLAB_class") != b"char":
            if item.external or item.is_virtual or item.nbytes > _MOST_BYTES:
                raise ValueError(f"{full}: too large, or kept in another file")
            yield full, item[()].T


def parse(path: str) -> dict[str, Any]:
    """Returns arrays ``a0``, ``a1`` … and under ``names`` their dotted names as JSON."""
    with open(path, "rb") as stream:
        head = stream.read(1024)
    if b"\x89HDF" in head:
        import h5py

        with h5py.File(path, "r") as opened:
            return _collected(_of_group("", opened))
    from scipy.io import loadmat

    content = loadmat(
        path, struct_as_record=True, squeeze_me=False, verify_compressed_data_integrity=True
    )
    return _collected(
        pair for name, value in content.items() if not name.startswith("__")
        for pair in _of_struct(name, value)
    )  # fmt: skip


def _collected(pairs: Iterator[tuple[str, Any]]) -> dict[str, Any]:
    names: list[str] = []
    arrays: dict[str, Any] = {}
    size = 0
    for name, value in pairs:
        size += 8 * value.size
        if size > _MOST_BYTES or len(names) >= _MOST_ARRAYS:
            raise ValueError("more than 1 GiB of numbers or 10000 arrays")
        arrays[f"a{len(names)}"] = np.squeeze(np.asarray(value, dtype=np.float64))
        names.append(name)
    return {**arrays, "names": np.array(json.dumps(names))}


if __name__ == "__main__":
    resource.setrlimit(
        resource.RLIMIT_AS, (_MEMORY_BYTES, resource.getrlimit(resource.RLIMIT_AS)[1])
    )
    np.savez(sys.argv[2], **parse(sys.argv[1]))
