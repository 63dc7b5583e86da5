# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far readings are from what a cell predicts, by kind: distances of points, angles of turns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.kind_errors import KindErrors, table
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.measurements.kinds import Kind, of_observation

FloatArray = NDArray[np.float64]


def kind_errors(after: Cell, readings: Readings, before: Cell | None = None) -> dict[str, KindErrors]:
    """Predicted less measured of each kind, by its name, positions first.

    Args:
        after: The cell that is judged.
        readings: In which it is.
        before: Another one of the same frames beside it.
    """
    return table(_numbers(after, readings), None if before is None else _numbers(before, readings))


def kinds_json(kinds: Mapping[str, KindErrors]) -> dict[str, Any]:
    """The block `kinds` of a result: unit, count, before, after."""
    return {name: of.to_json_dict() for name, of in kinds.items()}


def _numbers(cell: Cell, readings: Readings) -> dict[Kind, FloatArray]:
    """(N, views, c) of each kind."""
    model, measured = cell.model, readings.measured(cell)
    as_it_is = np.append(np.asarray(model.start), np.zeros(len(measured.parameters)))
    r = np.asarray(_core.residuals(model, readings.samples(), measured, as_it_is))
    found: dict[Kind, list[FloatArray]] = {}
    for of in measured.observations:
        part = r[:, of.first_number : of.first_number + len(of.components)]
        found.setdefault(of_observation(of), []).append(part.reshape(len(part), of.reading_count, -1))
    return {kind: np.concatenate(parts, axis=1) for kind, parts in found.items()}
