# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From a file to the grids in it: one of a text, one a sheet of a workbook."""

from __future__ import annotations

import datetime
import os

import numpy as np

from fastcal.errors import ParseError, TooLarge
from fastcal.importers.arrays import array_tables, is_matlab, is_numpy
from fastcal.importers.grid import Grid, Row, export_text, text_grid
from fastcal.io.excel_sheets import sheets
from fastcal.io.regular_file import read_bytes
from fastcal.io.table import Uncalculated, unreadable
from fastcal.io.tables import read_parquet

MAX_BYTES = 32_000_000
MAX_LINES = 200_000
MAX_LINE = 100_000  # characters
MAX_CELLS = 1_500_000


def read_grids(path: str | os.PathLike[str], encoding: str | None = None) -> list[Grid]:
    """The grids of a file that hold anything.

    Args:
        path: The file.
        encoding: Of its text, where the user gives it; of a workbook it says nothing.

    Raises:
        TooLarge: It holds more than poses and points, or a record of a session, could.
        ParseError: It can't be read.
    """
    name = os.fspath(path)
    content = read_bytes(path, MAX_BYTES)
    if not content.strip():
        raise ParseError("is empty; expected an export of an instrument or a controller", name)
    if is_matlab(content) or is_numpy(content):
        return _arrays(content, name)
    if content.startswith(b"PK\x03\x04"):
        return _sheets(content, name)
    if content.startswith(b"PAR1"):
        return [_parquet(content, name)]
    if content.startswith(b"\xd0\xcf\x11\xe0"):
        raise ParseError("is an old Excel file (xls); save it as xlsx or CSV", name)
    text, notes = export_text(content, name, encoding)
    _check_text(text, name)
    grid = text_grid(text, name, notes)
    _check_cells(sum(len(row.cells) for row in grid.rows), name)
    return [grid]


def _check_text(text: str, path: str) -> None:
    """Refuses a text whose lines are too many or too long to be taken apart."""
    lines = 1 + max(text.count("\n"), text.count("\r"))
    if lines > MAX_LINES:
        raise TooLarge(f"expected an export of at most {MAX_LINES} lines, got {lines}", path)
    longest = max(map(len, text.splitlines()), default=0)
    if longest > MAX_LINE:
        raise TooLarge(f"expected lines of at most {MAX_LINE} characters, got {longest}", path)


def _check_cells(cells: int, path: str) -> None:
    if cells > MAX_CELLS:
        raise TooLarge(f"expected an export of at most {MAX_CELLS} cells, got {cells} and more", path)


def _sheets(content: bytes, path: str) -> list[Grid]:
    cells = 0
    try:
        grids = []
        for title, found in sheets(content, path):
            rows = []
            for line, values in enumerate(found, 1):
                cells += 1 + len(values)
                _check_cells(cells, path)
                rows.append(Row(line, tuple(map(_text, values))))
            grids.append(Grid(path, tuple(rows), sheet=title))
    except ParseError:
        raise
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
    if isinstance(cell, Uncalculated):
        return cell
    if isinstance(cell, float):
        return f"{cell:.17g}" if float(f"{cell:.15g}") != cell else f"{cell:.15g}"
    if isinstance(cell, datetime.date | datetime.time):
        return cell.isoformat()
    return str(cell).strip()


def _arrays(content: bytes, path: str) -> list[Grid]:
    tables = array_tables(content, path)
    _check_cells(sum(len(titles) * len(rows) for _, titles, rows in tables), path)
    return [
        Grid(
            path,
            (
                Row(1, tuple(titles)),
                *(Row(line, tuple(map(_number, row))) for line, row in enumerate(rows, start=2)),
            ),
            sheet=names,
        )
        for names, titles, rows in tables
    ]


def _number(value: float) -> str:
    return "" if np.isnan(value) else str(_text(value))


def _parquet(content: bytes, path: str) -> Grid:
    table = read_parquet(content, path)
    _check_cells(len(table) * len(table.columns), path)
    columns = [
        ["" if np.isnan(value) else _text(value) for value in column.tolist()]
        if isinstance(column, np.ndarray)
        else column
        for column in table.columns
    ]
    body = (Row(line, tuple(cells)) for line, cells in enumerate(zip(*columns, strict=True), start=2))
    return Grid(path, (Row(1, tuple(table.names)), *body))
