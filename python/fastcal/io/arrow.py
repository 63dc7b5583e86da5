# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of Arrow tables, and Parquet files through them."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from fastcal.errors import TooLarge
from fastcal.io.table import Cells, Table, unreadable, without_blank_columns

MAX_CELLS = 50_000_000


def column_from_arrow(column: pa.ChunkedArray) -> Cells:
    """Numbers as float64 with NaN for null; everything else (a truth value too) as text with "" for null."""
    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return _numbers(column)
    return ["" if value is None else str(value).strip() for value in column.to_pylist()]


def _numbers(column: pa.ChunkedArray) -> NDArray[np.float64]:
    """Doubles with NaN for null, straight from Arrow's buffers: its to_numpy imports pandas, its casts all it can do.

    Digits that a double does not have are rounded off: int64 and decimals have more.
    """
    stored = {pa.float64(): np.float64, pa.int64(): np.int64}.get(column.type)
    if stored is None:
        column, stored = column.cast(pa.float64(), safe=False), np.float64
    parts = []
    for chunk in column.chunks:
        if not len(chunk):
            continue
        bits, numbers = chunk.buffers()
        own = slice(chunk.offset, chunk.offset + len(chunk))
        values = np.frombuffer(numbers, stored)[own].astype(np.float64)
        if chunk.null_count:
            values[np.unpackbits(np.frombuffer(bits, np.uint8), bitorder="little")[own] == 0] = np.nan
        parts.append(values)
    return np.concatenate(parts) if parts else np.zeros(0)


def read_parquet_table(content: bytes, path: str) -> Table:
    """Reads the content of a Parquet file; `path` is for the errors.

    Raises:
        TooLarge: It holds more cells than a table of measurements could.
        ParseError: It is damaged.
    """
    import pyarrow.parquet  # a third of a large CSV's time, which needs `column_from_arrow` alone

    found: pa.Table | None = None
    try:
        size = pyarrow.parquet.ParquetFile(pa.BufferReader(content)).metadata
        if size.num_rows * size.num_columns <= MAX_CELLS:
            found = pyarrow.parquet.read_table(pa.BufferReader(content), use_threads=False)
        columns = [] if found is None else [column_from_arrow(column) for column in found.columns]
    except Exception as error:  # noqa: BLE001 - a damaged file makes the decoder raise what it happens to meet
        raise unreadable("Parquet", error, path) from None
    if found is None:
        message = f"expected at most {MAX_CELLS} cells, got {size.num_rows} rows and {size.num_columns} columns"
        raise TooLarge(message, path)
    return Table(path, *without_blank_columns(found.column_names, columns))
