# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From a file to the grids in it: one of a text, one a sheet of a workbook."""

from __future__ import annotations

import datetime
import io
import os
import warnings
from pathlib import Path

import numpy as np

from fastcal.errors import ParseError
from fastcal.importers.grid import Grid, Row, decoded, text_grid
from fastcal.io.arrow import read_parquet_table
from fastcal.io.table import unreadable


def read_grids(path: str | os.PathLike[str]) -> list[Grid]:
    """The grids of a file that hold anything.

    Raises:
        ParseError: It can't be read.
    """
    name = os.fspath(path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise ParseError(f"cannot be read: {error.strerror or error}", name) from None
    if not content.strip():
        raise ParseError("is empty; expected an export of an instrument or a controller", name)
    if content.startswith(b"PK\x03\x04"):
        return _sheets(content, name)
    if content.startswith(b"PAR1"):
        return [_parquet(content, name)]
    if content.startswith(b"\xd0\xcf\x11\xe0"):
        raise ParseError("is an old Excel file (xls); save it as xlsx or CSV", name)
    return [text_grid(decoded(content, name), name)]


def _sheets(content: bytes, path: str) -> list[Grid]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and extensions, which nobody reads here
            import openpyxl  # takes longer to import than a CSV to read

            book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            grids = []
            for sheet in book.worksheets:
                sheet.reset_dimensions()  # some writers state them wrongly
                rows = tuple(
                    Row(line, tuple(map(_text, cells)))
                    for line, cells in enumerate(sheet.iter_rows(values_only=True), 1)
                )
                grids.append(Grid(path, rows, sheet=sheet.title))
    except Exception as error:  # noqa: BLE001 - a damaged file makes the decoder raise what it happens to meet
        raise unreadable("Excel", error, path) from None
    filled = [grid for grid in grids if not all(row.blank for row in grid.rows)]
    if not filled:
        raise ParseError("all sheets are empty", path)
    return filled


def _text(cell: object) -> str:
    """A cell as text: dates as ISO writes them, whole numbers without a point."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return f"{cell:.17g}" if float(f"{cell:.15g}") != cell else f"{cell:.15g}"
    if isinstance(cell, datetime.date | datetime.time):
        return cell.isoformat()
    return str(cell).strip()


def _parquet(content: bytes, path: str) -> Grid:
    table = read_parquet_table(content, path)
    columns = [
        ["" if np.isnan(value) else _text(value) for value in column.tolist()]
        if isinstance(column, np.ndarray)
        else column
        for column in table.columns
    ]
    body = (Row(line, tuple(cells)) for line, cells in enumerate(zip(*columns, strict=True), start=2))
    return Grid(path, (Row(1, tuple(table.names)), *body))
