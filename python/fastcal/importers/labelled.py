# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Logs whose every value stands behind its name: P1 {A1 -22.9, A2 ...} {X ...}, or P1 J1=-22.9 ... X=-432.5."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from fastcal.importers.dialect import Dialect, made
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import find_header
from fastcal.importers.words import meaning

_PAIR = re.compile(r"(?<![\w.$])([A-Za-z_$][\w.$]*)(?:\s*[=:]\s*|\s+)([-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)(?![\w.])")
_NAME = re.compile(r"[\w-]+")
_FEWEST = 3  # rows, and values with a name that is known
_OPENING = 40  # lines in which such rows are looked for
_LONGEST = 2000  # characters of a line


Record = tuple[int, str, tuple[str, ...], list[str]]


def _records(lines: Sequence[str]) -> list[Record]:
    """Line from 1, name of the row, names and values, of the lines that hold values."""
    found = []
    for number, line in enumerate(lines, start=1):
        pairs = list(_PAIR.finditer(line)) if len(line) <= _LONGEST else []
        if len(pairs) >= _FEWEST:
            name = _NAME.search(line[: pairs[0].start()])
            titles = tuple(pair[1] for pair in pairs)
            found.append((number, "" if name is None else name[0], titles, [pair[2] for pair in pairs]))
    return found


def _usual(records: Sequence[Record]) -> tuple[tuple[str, ...], int]:
    """The names that most lines have, and how many have them."""
    return Counter(record[2] for record in records).most_common(1)[0]


def _recognizes(grid: Grid) -> bool:
    records = _records(grid.text.splitlines()[:_OPENING])
    if len(records) < _FEWEST:
        return False
    titles, count = _usual(records)
    header = find_header(grid)
    return (
        2 * count > len(records)
        and len(set(titles)) == len(titles)
        and sum(meaning(title) is not None for title in titles) >= _FEWEST
        and (header is None or grid.rows[header].line in {record[0] for record in records})
    )


def _read(grid: Grid) -> Export:
    """A row a line; a line with other names than most is an error.

    Raises:
        ParseError: So it is; names the line.
    """
    records = _records(grid.text.splitlines())
    titles, _ = _usual(records)
    for line, _, others, _ in records:
        if others != titles:
            raise grid.error(f"expected the values {', '.join(titles)}, got {', '.join(others)}", line)
    named = all(record[1] for record in records)
    rows = [[*([name] if named else []), *values] for _, name, _, values in records]
    return made(grid, [*(["name"] if named else []), *titles], rows, [record[0] for record in records])


DIALECT = Dialect("values with their names", _recognizes, _read)
