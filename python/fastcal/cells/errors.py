# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far readings are from what a cell predicts, by kind: distances of points, angles of turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.kind_errors import KindErrors, table
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.knocked import name_since
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.measurements.kinds import Kind, of_observation
from fastcal.robot.rig import pictures


def kind_errors(after: Cell, readings: Readings, before: Cell | None = None) -> dict[str, KindErrors]:
    """Predicted less measured of each kind, by its name, positions first.

    Args:
        after: The cell that is judged.
        readings: In which it is.
        before: Another one of the same frames beside it.
    """
    return table(_numbers(after, readings), None if before is None else _numbers(before, readings))


def view_errors(after: Cell, readings: Readings, before: Cell | None = None) -> dict[str, KindErrors]:
    """Predicted less measured of each view, such as `position@smr:camera`, and of each `corner@BOARD:CAMERA`.

    Arguments as of `kind_errors`.
    """
    then = {} if before is None else _views(before, readings)
    return {
        name: KindErrors(kind, numbers, then[name][1] if name in then else None)
        for name, (kind, numbers) in _views(after, readings).items()
        if not np.isnan(numbers).all()
    }


def kinds_json(kinds: Mapping[str, KindErrors]) -> dict[str, Any]:
    """The blocks `kinds` and `views` of a result: unit, count, before, after."""
    return {name: of.to_json_dict() for name, of in kinds.items()}


def unknowns_as_they_are(cell: Cell, readings: Readings) -> FloatArray:
    """(U,) of the unknowns of what was read: 0 of cameras and boards, which stand where the cell has them.

    Of other observations, as of a socket or a floor over which heights are read, as the cell has found them, else the
    closed form by these readings. InvalidInput where they are too few for it.
    """
    parameters = readings.measured(cell).parameters
    out = np.array([cell.found.get((of.owner, of.name), 0.0) for of in parameters])
    own = [i for i, of in enumerate(parameters) if not is_of_rig(of) and (of.owner, of.name) not in cell.found]
    if own:
        others = replace(readings, tables={name: of for name, of in readings.tables.items() if name != CORNERS})
        there = others.measured(cell)
        try:
            values = _core.start_unknowns(cell.model, others.samples(cell), there)
        except InvalidInput as error:
            raise InvalidInput(f"{readings.source}: {error}") from None
        started = {(of.owner, of.name): value for of, value in zip(there.parameters, values.tolist(), strict=True)}
        out[own] = [started[parameters[i].owner, parameters[i].name] for i in own]
    return out


def is_of_rig(unknown: _core.Parameter) -> bool:
    """Is an unknown that of a camera or board, whose numbers the cell's file has?"""
    return unknown.owner.partition(" ")[0] in ("camera", "board")


def _numbers(cell: Cell, readings: Readings) -> dict[Kind, FloatArray]:
    """(N, views, c) of each kind."""
    found: dict[Kind, list[FloatArray]] = {}
    for kind, part in _views(cell, readings).values():
        found.setdefault(kind, []).append(part)
    return {kind: np.concatenate(parts, axis=1) for kind, parts in found.items()}


def _views(cell: Cell, readings: Readings) -> dict[str, tuple[Kind, FloatArray]]:
    """Kind and numbers (N, readings, c) of each view; corners of each camera and board are one."""
    readings = readings.of_frames(cell)
    model, measured = cell.model, readings.measured(cell)
    as_it_is = np.append(np.asarray(model.start), unknowns_as_they_are(cell, readings))
    r = np.asarray(_core.residuals(model, readings.samples(cell), measured, as_it_is))
    out = dict[str, tuple[Kind, FloatArray]]()

    def add(name: str, kind: Kind, numbers: FloatArray) -> None:
        """To what was read of the same point before or since it was knocked."""
        name = name_since(name)
        out[name] = (kind, np.where(np.isnan(out[name][1]), numbers, out[name][1]) if name in out else numbers)

    for of in measured.observations:
        if of.is_known:
            continue
        part = r[:, of.first_number : of.first_number + len(of.components)]
        part, kind = part.reshape(len(part), of.reading_count, -1), of_observation(of)
        if of.field != CORNERS:
            views = [of.name] if "@" in of.name else [f"{of.name}@{view}" for view in readings.touched_by(kind.name)]
            for k, name in enumerate(views):
                add(name, kind, part if len(views) == 1 else part[:, k : k + 1])
            continue
        for (camera, board), corners in pictures(cell).items():
            out[f"{kind.name}@{board}:{camera}"] = (kind, part[:, corners])
    return out
