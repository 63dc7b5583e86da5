# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows of a measurement file that come one at a time, below a header that came before."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from fastcal.errors import ParseError
from fastcal.io.columns import match_columns
from fastcal.io.measurements import dataset_from_table
from fastcal.io.table import Table
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

_POINT = ("x", "y", "z")


class Header:
    """The header line of a measurement file.

    Args:
        line: As it came.
        robot: The arm, whose joints must have their columns.
        source: For messages.

    Raises:
        ParseError: A column is missing, unknown without a unit, or given twice.
    """

    def __init__(self, line: str, robot: Robot, source: str = "the header") -> None:
        self.line, self.robot, self.source = line.strip("\r\n\ufeff"), robot, source
        self.mark = max(";\t,", key=self.line.count)
        self.names = [" ".join(name.split()) for name in self._cells(self.line)]
        table = Table(source, self.names, [[""]] * len(self.names))
        known, _ = match_columns(table, robot.joint_types)
        if missing := [axis for axis in _POINT if axis not in known]:
            raise table.error(f"expected measured points, x_mm, y_mm and z_mm; {missing[0]} has no column")
        if not any(name in known for name in ("q1", "j1")):
            raise table.error("expected joint positions, q1_deg ... (or j1_deg ..., as the controller counts)")

    def dataset(self, lines: Sequence[str]) -> Dataset:
        """The rows as a data set; a point that was not measured is NaN.

        Raises:
            ParseError: A cell holds no number, or a row has another count of cells than the header.
        """
        rows = [self._row(line) for line in lines]
        columns = [list(cells) for cells in zip(*rows, strict=True)]
        return dataset_from_table(Table(self.source, self.names, columns), self.robot, require_measured=False)

    def _row(self, line: str) -> list[str]:
        cells = self._cells(line)
        if len(cells) != len(self.names):
            raise ParseError(f"expected {len(self.names)} cells as the header has, got {len(cells)}", self.source)
        return cells

    def _cells(self, line: str) -> list[str]:
        try:
            cells = next(csv.reader([line.strip("\r\n")], delimiter=self.mark), [])
        except csv.Error as error:
            raise ParseError(f"expected one row of cells: {error}".partition(" - ")[0], self.source) from None
        return [cell.strip() for cell in cells]
