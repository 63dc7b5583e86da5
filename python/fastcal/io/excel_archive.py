# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an xlsx file would unpack to, looked at before a decoder fills in rows and cells that it only claims."""

from __future__ import annotations

import io
import re
import zipfile

from fastcal.errors import ParseError, TooLarge
from fastcal.io.table import unreadable

MAX_BYTES = 64_000_000  # of all its parts, unpacked
MAX_PARTS = 2000
MAX_ROWS = 1_048_576  # as Excel
MAX_CELLS = 8_000_000  # rows times columns, empty ones too
_SHEET = re.compile(r"(?i)xl/(worksheets/[^/]*|[^/]*sheet[^/]*)\.xml\Z")
_ROW = re.compile(rb"""<(?:\w+:)?row(?=[\s/>])([^>]*)""")
_NUMBER = re.compile(rb"""\sr\s*=\s*["']\s*([^"']*?)\s*["']""")
_COLUMN = re.compile(rb"""<(?:\w+:)?c\s[^>]*?\br\s*=\s*["']\s*([A-Za-z]+)[0-9]""")
_FORMULA = re.compile(rb"<(?:\w+:)?f[\s/>]")
_CELL = re.compile(rb"<(?:\w+:)?c(?=[\s/>])")


def check_archive(content: bytes, path: str) -> bool:
    """Refuses a workbook that unpacks to more than a table of measurements could be; whether it holds formulas.

    Raises:
        TooLarge: Its parts, rows or cells are too many; says how many.
        ParseError: It is no archive.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            parts = archive.infolist()
            size = sum(part.file_size for part in parts)
            if size > MAX_BYTES or len(parts) > MAX_PARTS:
                message = f"expected a workbook of at most {MAX_BYTES} bytes unpacked, got {size} in {len(parts)} parts"
                raise TooLarge(message, path)
            has_formulas = False
            for part in parts:
                if _SHEET.search(part.filename):
                    xml = archive.read(part)
                    _check_sheet(xml, path)
                    has_formulas = has_formulas or _FORMULA.search(xml) is not None
            return has_formulas
    except (OSError, ValueError, RuntimeError, NotImplementedError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, ParseError):
            raise
        raise unreadable("Excel", error, path) from None
    except zipfile.zlib.error as error:  # type: ignore[attr-defined]
        raise unreadable("Excel", error, path) from None


def _check_sheet(xml: bytes, path: str) -> None:
    """Refuses a sheet whose rows, by their own numbers, or cells are too many."""
    last = 0
    for count, row in enumerate(_ROW.finditer(xml), start=1):
        if found := _NUMBER.search(row[1]):
            if not found[1].isdigit() or len(found[1]) > 7:
                number = found[1][:20].decode("latin-1")
                raise TooLarge(f"expected row numbers of at most {MAX_ROWS}, got {number!r}", path)
            last = max(last, int(found[1]))
        else:
            last = max(last + 1, count)
    columns = {name[1].upper() for name in _COLUMN.finditer(xml)}
    widest = max((_place(name) for name in columns), default=0)
    cells = len(_CELL.findall(xml))
    if last > MAX_ROWS or widest > MAX_CELLS or max(last * widest, cells) > MAX_CELLS:
        raise TooLarge(f"expected a sheet of at most {MAX_CELLS} cells, got {last} rows and {widest} columns", path)


def _place(name: bytes) -> int:
    """The number of a column, A being 1."""
    place = 0
    for letter in name[:8]:
        place = 26 * place + letter - ord("A") + 1
    return place
