# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows below a table that are no poses: remarks, means and deviations, by their names or by their numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.importers.export import is_value, number
from fastcal.importers.words import STATISTICS, plain_words

_MOST = 10  # rows of a footer that are looked at
_FEWEST_ROWS = 5  # rows of a table before a statistics line can be recognized as one
_AGREEING = 0.8  # of a row's numbers
_LARGEST = 1e100  # whose square is a number as well
_TOLERANCE = 2e-4  # of the greatest number of a column: as statistics are rounded


def footer_start(rows: Sequence[Sequence[str]], lines: Sequence[int]) -> int:
    """How many rows are the table's; those behind are remarks or statistics of it."""
    kept = len(rows)
    while kept and (_is_named(rows[kept - 1]) or sum(map(is_value, rows[kept - 1])) <= 1):
        kept -= 1
    # Without names: rows behind an empty one, each a mean, a deviation or a limit of the rows before it.
    for start in range(max(_FEWEST_ROWS, kept - _MOST), kept):
        if lines[start] - lines[start - 1] > 1 and all(_is_computed(rows[:start], row) for row in rows[start:kept]):
            return start
    return kept


def _is_named(row: Sequence[str]) -> bool:
    """Whether a row is a mean, a deviation or the like, by its own name."""
    texts = [cell for cell in row if cell and not is_value(cell)]
    words = [word for text in texts[:2] for word in plain_words(text)]
    return bool(words) and words[0] in STATISTICS


def _is_computed(rows: Sequence[Sequence[str]], row: Sequence[str]) -> bool:
    """Whether the numbers of a row are one and the same statistic of the columns above."""
    found = [(place, value) for place, cell in enumerate(row) if (value := number(cell)) is not None]
    columns = [[v for each in rows if (v := number(each[place])) is not None] for place, _ in found]
    whole = [(values, value) for values, (_, value) in zip(columns, found, strict=True) if len(values) == len(rows)]
    if not whole:
        return False
    table, given = np.array([values for values, _ in whole]), np.array([value for _, value in whole])
    if not np.abs(table).max() < _LARGEST:
        return False
    near = _TOLERANCE * np.abs(table).max(axis=1)
    statistics = (
        table.mean(axis=1),
        table.std(axis=1, ddof=1),
        table.std(axis=1),
        table.min(axis=1),
        table.max(axis=1),
        np.ptp(table, axis=1),
        np.median(table, axis=1),
        table.sum(axis=1),
    )
    return any(np.mean(np.abs(each - given) <= near) >= _AGREEING for each in statistics)
