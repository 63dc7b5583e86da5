# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How the gap between a cell and what was read closes: places alone, the geometry, what a diagnosis found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fastcal.calibration.kind_errors import KindErrors
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.errors import kind_errors, kinds_json
from fastcal.cells.readings import Readings
from fastcal.cells.rig_start import judged_readings

GEOMETRY, FOUND = "geometry", "the effects found"  # what steps of the gap add


@dataclass(frozen=True, eq=False)
class CellStep:
    """How far the readings are from a cell on the way to the one that is written.

    Attributes:
        cell: As it is at this step.
        added: What it has beside the one before; None: places alone are fitted, the arms are as their files say.
        train, test: Errors of each kind of reading; test is None where nothing was held back.
    """

    cell: Cell
    added: str | None
    train: dict[str, KindErrors]
    test: dict[str, KindErrors] | None

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `gap`."""
        test = None if self.test is None else kinds_json(self.test)
        return {"added": self.added, "train": kinds_json(self.train), "test": test}


def gap_of(
    cell: Cell, written: Cell, readings: Readings, test: Readings | None, mend: bool, threads: int
) -> list[CellStep]:
    """Before, with the geometry, and as it is written; empty where the geometry alone cannot be fitted.

    Args:
        cell: As its file says.
        written: As its diagnosis writes it.
        readings: What was read.
        test: In postures that are only reported on.
        mend: As of `calibrate_cell`.
        threads: Cores.
    """
    plain = calibrate_cell(cell, readings, mend=mend, as_read=True, threads=threads)
    if plain.status != "converged":
        return []
    steps = [(None, plain.nominal), (GEOMETRY, plain.cell), (FOUND, written)]
    used = judged_readings(written, readings, known=True, mend=mend)
    held = None if test is None else judged_readings(written, test, known=True, mend=mend)
    return [
        CellStep(step, added, kind_errors(step, used), None if held is None else kind_errors(step, held))
        for added, step in steps
    ]
