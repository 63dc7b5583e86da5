# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the cameras and boards of a cell stand, in closed form, from their pictures and the arms as they are given.

And which pictures are of other postures than the table says, with cameras and boards there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.pictures import judged
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RigStart:
    """Values of the unknowns of cameras and boards, SI, by owner and name: changes of what the file has."""

    values: Mapping[tuple[str, str], float]

    def of(self, unknowns: Sequence[_core.Parameter]) -> FloatArray:
        """(U,) of these unknowns; 0, as the file has it, of one that is not known."""
        return np.array([self.values.get((of.owner, of.name), 0.0) for of in unknowns])


def rig_start(cell: Cell, readings: Readings) -> RigStart:
    """Of all cameras and boards that the pictures show.

    Raises:
        InvalidInput: Fewer pictures than place a camera and a board, or one that no picture shows with four corners.
    """
    measured = readings.measured(cell)
    if not measured.parameters:
        return RigStart({})
    try:
        values = _core.start_unknowns(cell.model, readings.samples(cell), measured)
    except InvalidInput as error:
        raise InvalidInput(f"{readings.source}: {error}") from None
    return RigStart(
        {(of.owner, of.name): value for of, value in zip(measured.parameters, values.tolist(), strict=True)}
    )


def judged_readings(cell: Cell, readings: Readings, *, known: bool = False, mend: bool = False) -> Readings:
    """The readings with pictures of other rows left out and boards read from their other end renumbered, and said.

    Args:
        cell: With its cameras and boards.
        readings: What was read.
        known: Do cameras and boards stand where the cell has them? Else the closed form is tried too.
        mend: Put pictures into the rows that they fit, instead of leaving them out.
    """
    if CORNERS not in readings.tables:
        return readings
    places = [RigStart({})]
    if not known:
        with suppress(InvalidInput):  # which the fit will say
            places.append(rig_start(cell, readings))
    found = judged(cell, readings.tables, [_drawn(cell, readings, at) for at in places], mend=mend, first=not known)
    return replace(readings, tables={**readings.tables, CORNERS: found.uv}, notes=(*readings.notes, *found.notes))


def _drawn(cell: Cell, readings: Readings, places: RigStart) -> FloatArray:
    """(N, K, 2) where each posture draws each corner [px]: where all is seen at (0, 0), that is what is left."""
    nothing = np.zeros_like(readings.tables[CORNERS])
    everywhere = replace(readings, tables={CORNERS: nothing}).measured(replace(cell, distances=()))
    theta = np.append(np.asarray(cell.model.start), places.of(everywhere.parameters))
    r = np.asarray(_core.residuals(cell.model, readings.samples(cell), everywhere, theta))
    return r.reshape(len(r), -1, 2)
