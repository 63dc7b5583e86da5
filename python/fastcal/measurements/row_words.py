# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows of a data set in words: as ranges, and in the files that hold them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.dataset import Dataset
from fastcal.said import Said, joined, said

_MOST = 8  # ranges that a sentence names


def row_ranges(rows: Sequence[int] | NDArray[np.intp]) -> Said:
    """Rows, ascending, such as: 0 to 39, 45, 50 to 61 and 12 more rows."""
    at = np.asarray(rows, dtype=np.intp)
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(at) else []
    parts = [
        said("{first} to {last}", first=int(run[0]), last=int(run[-1])) if len(run) > 1 else str(int(run[0]))
        for run in runs
    ]
    shown = joined(", ", parts[:_MOST])
    more = sum(len(run) for run in runs[_MOST:])
    return said("{shown} and {count} more rows", shown=shown, count=more) if more else shown


def rows_in_files(data: Dataset, rows: Sequence[int] | NDArray[np.intp]) -> Said:
    """Which rows of which file, each file's counted from 0, such as: rows 0 to 39 of a.csv, rows 3 and 4 of b.csv.

    Files that were joined are told apart by their labels, a station each.
    """
    at, out = np.sort(np.asarray(rows, dtype=np.intp)), []
    for file, first, last in _files(data):
        own = at[(at >= first) & (at < last)]
        if len(own):
            shown = said("rows {rows}", rows=row_ranges(own - first))
            out.append(said("{rows} of {file}", rows=shown, file=file) if file else shown)
    return joined(", ", out)


def _files(data: Dataset) -> list[tuple[str, int, int]]:
    """Each file with its first row and the one behind its last; without a name where the rows came from none."""
    files = [PurePath(path).name for path in data.source.split(", ")]
    if data.station is not None and len(files) > 1:
        ends = [0, *(np.flatnonzero(np.diff(data.station)) + 1).tolist(), len(data)]
        if len(ends) == len(files) + 1:
            return list(zip(files, ends[:-1], ends[1:], strict=True))
    return [("" if data.source == "arrays" else ", ".join(files), 0, len(data))]
