# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables from CSV, Parquet and Excel files, recognized by their content; CSV files out."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from fastcal.errors import InvalidInput, ParseError
from fastcal.io.atomic import write_text
from fastcal.io.regular_file import read_bytes
from fastcal.io.table import Table, is_formula, without_arrow
from fastcal.io.text_tables import read_text_table

MAX_BYTES = 256_000_000


def read_parquet(content: bytes, path: str) -> Table:
    """`read_parquet_table`, where Arrow is installed.

    Raises:
        ParseError: It is not, or the content is damaged.
    """
    try:
        from fastcal.io.arrow import read_parquet_table  # Arrow takes longer to import than a CSV to read
    except ImportError:
        raise without_arrow(path) from None
    return read_parquet_table(content, path)


def read_table(path: str | os.PathLike[str]) -> Table:
    """Reads a CSV (comma, semicolon or tab; decimal point or comma), Parquet or Excel (xlsx) file.

    Raises:
        ParseError: It cannot be read; names the file and, where it can, the line.
    """
    name = os.fspath(path)
    content = read_bytes(path, MAX_BYTES)
    if not content:
        raise ParseError("is empty; expected a header and rows of numbers", name)
    if content.startswith(b"PAR1"):
        return read_parquet(content, name)
    if content.startswith(b"PK\x03\x04"):
        from fastcal.io.excel import read_excel_table  # openpyxl takes longer to import than a CSV to read

        return read_excel_table(content, name)
    if content.startswith(b"\xd0\xcf\x11\xe0"):
        raise ParseError("is an old Excel file (xls); save it as xlsx or CSV", name)
    return read_text_table(content, name)


def write_csv(path: str | os.PathLike[str], columns: Mapping[str, Iterable[float | int | str]]) -> None:
    """Writes columns of one length, whole or not at all.

    Numbers have the fewest digits that give them back; one that is not finite is an empty cell.

    Raises:
        InvalidInput: The file cannot be written, or its name promises another format.
    """
    check_csv_name(path)
    write_text(path, csv_text(columns))


def check_csv_name(path: str | os.PathLike[str]) -> None:
    """InvalidInput where a file's name promises another format than CSV."""
    if Path(path).suffix.lower() in (".xlsx", ".xls", ".parquet", ".pq"):
        raise InvalidInput(f"{path}: only CSV can be written; give a name that ends in .csv")


def csv_text(columns: Mapping[str, Iterable[float | int | str]]) -> str:
    """Columns of one length as the text of a CSV file; as `write_csv` writes them."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    cells = (map(_cell, column) for column in columns.values())
    writer.writerows(zip(*cells, strict=True))
    return text.getvalue()


def _cell(value: float | int | str) -> str:
    """The text of a cell; what a spreadsheet would run as a formula begins with an apostrophe, as it writes texts."""
    if isinstance(value, str):
        return f"'{value}" if is_formula(value) else value
    # A numpy scalar prints its type since numpy 2.
    plain = getattr(value, "item", lambda: value)()
    return "" if isinstance(plain, float) and not math.isfinite(plain) else str(plain)
