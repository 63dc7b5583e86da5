# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The first sheet of an Excel file (xlsx): a header in its first filled row, one pose a row below."""

from __future__ import annotations

import sys

import numpy as np

from fastcal.errors import ParseError, TooLarge
from fastcal.io.excel_archive import MAX_BYTES
from fastcal.io.excel_sheets import sheets
from fastcal.io.table import Cells, Table, Uncalculated, unreadable, without_blank_columns

EXPLANATIONS = "Columns"  # the sheet of fastcal's own templates that explains the columns


def read_excel_table(content: bytes, path: str) -> Table:
    """Reads the content of an xlsx file; `path` is for the errors. Formulas count with the values saved beside them.

    Raises:
        ParseError: It is damaged, has no sheet of cells, or a row is longer than the header.
    """
    try:
        found = sheets(content, path)
        title, rows = next(found)
        filled = [(line, row) for line, row in enumerate(rows, 1) if any(cell not in (None, "") for cell in row)]
        left_out = [name for name, _ in found if name != EXPLANATIONS]
    except ParseError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file makes the decoder raise what it happens to meet
        raise unreadable("Excel", error, path) from None
    if sum(len(cell) for _, row in filled for cell in row if isinstance(cell, str)) > MAX_BYTES:
        raise TooLarge(f"expected a sheet of at most {MAX_BYTES} characters", path)
    if not filled:
        raise ParseError(f"sheet '{title}' is empty; expected a header and rows of numbers", path)
    width = len(filled[0][1])
    for line, row in filled[1:]:
        if any(cell is not None for cell in row[width:]):
            raise ParseError(f"expected {width} cells as in the header, got {len(row)}", path, line)
    (_, header), *body = filled
    names = ["" if name is None else str(name) for name in header]
    columns = [_column([row[place] if place < len(row) else None for _, row in body]) for place in range(width)]
    others = ", ".join(f"'{name}'" for name in left_out)
    notes = (f"sheet '{title}' is read; left out: {others}",) if others else ()
    return Table(path, *without_blank_columns(names, columns), lines=[line for line, _ in body], notes=notes)


def _column(cells: list[object]) -> Cells:
    """Numbers if all filled cells hold numbers that fit a double, else texts; 3.0 is the text 3."""
    if all(cell is None or _is_number(cell) for cell in cells):
        return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
    return [_text(cell) for cell in cells]


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, Uncalculated):
        return cell
    return f"{cell:.17g}" if isinstance(cell, float) else str(cell).strip()


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool) and abs(cell) <= sys.float_info.max
