# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The cells of a workbook (xlsx) with the values that are saved in it, and the formulas that have none."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any

from fastcal.io.excel_archive import check_archive
from fastcal.io.table import Uncalculated

Cell = object
_FEWEST = 5  # formulas of a sheet, all of them 0, that nobody has calculated


def sheets(content: bytes, path: str) -> Iterator[tuple[str, Iterator[Sequence[Cell]]]]:
    """Title and rows of each sheet; to be read one after the other.

    A formula counts with the value saved beside it; where none is, or where all of a sheet's have the 0 that some
    writers put there, the cell is a `Uncalculated`.

    Raises:
        TooLarge, ParseError: As `check_archive`; whatever the decoder raises of a damaged file.
    """
    import openpyxl  # takes longer to import than a CSV to read

    has_formulas = check_archive(content, path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about styles and extensions, which are not read here
        saved = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        written = openpyxl.load_workbook(io.BytesIO(content), read_only=True) if has_formulas else None
        for place, sheet in enumerate(saved.worksheets):
            rows = _rows(sheet)
            yield sheet.title, rows if written is None else _with_formulas(rows, _rows(written.worksheets[place]))


def _rows(sheet: Any) -> Iterator[Sequence[Cell]]:
    sheet.reset_dimensions()  # some writers state them wrongly
    rows: Iterator[Sequence[Cell]] = sheet.iter_rows(values_only=True)
    return rows


def _with_formulas(saved: Iterator[Sequence[Cell]], written: Iterator[Sequence[Cell]]) -> Iterator[Sequence[Cell]]:
    pairs = [list(zip_longest(*both)) for both in zip_longest(saved, written, fillvalue=())]
    values = [value for row in pairs for value, formula in row if _is_formula(value, formula)]
    never = len(values) >= _FEWEST and all(type(value) is int and value == 0 for value in values if value is not None)
    for row in pairs:
        yield [
            Uncalculated(getattr(formula, "text", None) or formula)
            if _is_formula(value, formula) and (value is None or never)
            else value
            for value, formula in row
        ]


def _is_formula(value: Cell, formula: Cell) -> bool:
    """Whether a cell, by its saved value and by what was written, is a formula."""
    if isinstance(formula, str):
        return formula.startswith("=") and formula != value
    return hasattr(formula, "ref") and value is not formula  # of an array of cells
