# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows are named as ranges, and by the file that holds them."""

from dataclasses import replace

import numpy as np

from fastcal.measurements.dataset import Dataset
from fastcal.measurements.row_words import row_ranges, rows_in_files
from fastcal.report.language import _, in_language


def rows(count: int, source: str) -> Dataset:
    return replace(Dataset.from_arrays(np.zeros((count, 6)), position=np.zeros((count, 3))), source=source)


def test_runs_of_rows_are_ranges() -> None:
    assert row_ranges([*range(40), 45, 50, 51]) == "0 to 39, 45, 50 to 51"
    assert row_ranges(range(0, 40, 2)) == "0, 2, 4, 6, 8, 10, 12, 14 and 12 more rows"
    assert row_ranges([]) == ""
    with in_language("de"):
        assert _(row_ranges(range(0, 40, 2))) == "0, 2, 4, 6, 8, 10, 12, 14 und 12 weitere Zeilen"


def test_each_file_counts_its_own_rows() -> None:
    both = Dataset.concatenate([rows(20, "a.csv"), rows(30, "b.csv")], labels=["a", "b"])
    assert rows_in_files(both, [3, 18, 19, 20, 21, 49]) == "rows 3, 18 to 19 of a.csv, rows 0 to 1, 29 of b.csv"
    assert rows_in_files(both, [25]) == "rows 5 of b.csv"
    assert rows_in_files(rows(9, "a.csv"), [0, 1]) == "rows 0 to 1 of a.csv"
    assert rows_in_files(rows(9, "arrays"), [0, 1]) == "rows 0 to 1"
    # One file with a column of stations holds all its rows.
    assert rows_in_files(replace(both, source="c.csv"), [19, 20]) == "rows 19 to 20 of c.csv"
