"""The time series of an estimate as a Parquet file: written chunk by chunk, whole or absent."""

import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from app.estimates.columns import Column, units_of
from app.problems import InvalidRequest, shorten

Array = NDArray[np.float64]


class SeriesWriter:
    """Appends columns to one Parquet file."""

    def __init__(self, path: Path, metadata: Mapping[str, Any]) -> None:
        """Writes to ``path``; ``metadata`` goes into the file's header."""
        self._path = path
        self._metadata = metadata
        self._writer: pq.ParquetWriter | None = None
        self.rows = 0

    def append(self, columns: Mapping[str, Column]) -> None:
        """Adds rows; the columns must be those of the first call."""
        arrays = {name: _arrow(name, *column) for name, column in columns.items()}
        if self._writer is None:
            self._writer = pq.ParquetWriter(
                self._path,
                self._schema(arrays),
                compression="zstd",
                use_dictionary=[n for n, a in arrays.items() if pa.types.is_string(a.type)],
                column_encoding={
                    n: "BYTE_STREAM_SPLIT"
                    for n, a in arrays.items()
                    if pa.types.is_floating(a.type)
                },
            )
        table = pa.Table.from_arrays(list(arrays.values()), schema=self._writer.schema)
        self._writer.write_table(table)
        self.rows += table.num_rows

    def _schema(self, arrays: Mapping[str, pa.Array]) -> pa.Schema:
        units = units_of(list(arrays))
        fields = [
            pa.field(name, array.type, metadata={"unit": units[name]})
            for name, array in arrays.items()
        ]
        said = {key: value if isinstance(value, str) else json.dumps(value)
                for key, value in self._metadata.items()}  # fmt: skip
        return pa.schema(fields, metadata=said)

    def close(self) -> None:
        """Ends the file."""
        if self._writer is not None:
            self._writer.close()


def _arrow(name: str, values: NDArray[np.generic], known: NDArray[np.bool_] | None) -> pa.Array:
    """Returns a column; what is not known is null, never a number."""
    mask = None if known is None else ~known
    if values.dtype.kind == "U":
        return pa.array(values.tolist(), pa.string())
    if values.dtype == np.bool_:
        return pa.array(values)
    # Seven digits are more than any estimate has; an hour of times needs more.
    kind = np.float64 if name == "time_s" else np.float32
    return pa.array(values.astype(kind), mask=mask)


@contextmanager
def series_writer(path: Path, metadata: Mapping[str, Any]) -> Iterator[SeriesWriter]:
    """Yields a writer; the file is there under its name once the block has ended well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".part-", suffix=".parquet")
    part = Path(name)
    open(handle, "wb").close()
    writer = SeriesWriter(part, metadata)
    try:
        yield writer
        writer.close()
        if writer.rows:
            part.replace(path)
    finally:
        writer.close()
        part.unlink(missing_ok=True)


class Series:
    """Reads such a file, column by column."""

    def __init__(self, path: Path) -> None:
        """Opens the file."""
        self._file = pq.ParquetFile(path)

    @property
    def names(self) -> tuple[str, ...]:
        """The columns."""
        return tuple(self._file.schema_arrow.names)

    @property
    def metadata(self) -> dict[str, str]:
        """The file's header."""
        found = self._file.schema_arrow.metadata or {}
        return {
            key.decode(): value.decode() for key, value in found.items() if key != b"ARROW:schema"
        }

    def units(self, names: Sequence[str]) -> dict[str, str]:
        """Returns the unit of some columns; empty where they have none."""
        return dict(units_of(names))

    def __getitem__(self, name: str) -> Array:
        """Returns a column of numbers ``(rows,)``; NaN where it is not known."""
        column = self._file.read([name]).column(0)
        return np.asarray(column.to_numpy(), dtype=np.float64)

    def words(self, name: str) -> NDArray[np.str_]:
        """Returns a column of words ``(rows,)``."""
        return np.asarray(self._file.read([name]).column(0).to_pylist(), dtype=np.str_)

    def vectors(self, name: str, unit: str) -> Array:
        """Returns three columns ``(rows, 3)``."""
        return np.stack([self[f"{name}_{axis}_{unit}"] for axis in "xyz"], axis=-1)

    def part(
        self, columns: Sequence[str], start_s: float | None, end_s: float | None, most: int
    ) -> dict[str, list[Any]]:
        """Returns some columns of some time, thinned to at most ``most`` rows.

        Raises:
            InvalidRequest: There is no such column.
        """
        strange = [name for name in columns if name not in self.names]
        if strange:
            raise InvalidRequest(
                f"There is no column {shorten(strange[0])}; `columns` of the estimate lists them."
            )
        wanted = list(dict.fromkeys(["time_s", *columns]))
        table = self._file.read(wanted)
        time_s = table.column("time_s")
        keep = pc.and_(
            pc.greater_equal(time_s, -np.inf if start_s is None else start_s),
            pc.less(time_s, np.inf if end_s is None else end_s),
        )
        table = table.filter(keep)
        stride = max(1, -(-table.num_rows // most))
        if stride > 1:
            table = table.take(np.arange(0, table.num_rows, stride))
        return {name: _plain(table.column(name)) for name in wanted}


def _plain(column: pa.ChunkedArray) -> list[Any]:
    if not pa.types.is_floating(column.type):
        return list(column.to_pylist())
    return [None if value is None else float(f"{value:.6g}") for value in column.to_pylist()]
