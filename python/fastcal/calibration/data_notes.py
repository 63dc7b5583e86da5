# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Notes on the coverage of the data: ranges, directions held at nominal, too little data."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.measurements.copied_rows import row_bytes
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_column
from fastcal.robot.robot import Robot
from fastcal.said import joined, said
from fastcal.units import from_si, to_si

_BESIDE = 0.3  # of the reach, from the base to a tracker
THIN = 2.0  # numbers a parameter: with fewer, most of the noise goes into the parameters


def ranges(robot: Robot, data: Dataset) -> dict[str, FloatArray]:
    """(N,) each joint, the payload and the temperature where it is given, at the edge's units, by column."""
    out = {joint_column(i, unit): np.asarray(from_si(data.q[:, i], unit)) for i, unit in enumerate(_joint_units(robot))}
    out["payload_kg"] = data.payload
    if data.temperature is not None:
        out["temperature_c"] = np.asarray(from_si(data.temperature, "c"))
    return out


def _joint_units(robot: Robot) -> list[str]:
    return [joint.unit for joint in robot.joints]


def covered(robot: Robot, data: Dataset) -> dict[str, tuple[float, float]]:
    """Least and greatest of `ranges`, passive joints left out; of an arm of poses none. Units keep the order."""
    if robot.of_poses:
        return {}
    ends = zip(data.q.min(axis=0).tolist(), data.q.max(axis=0).tolist(), strict=True)
    out = {
        joint_column(i, unit): (from_si(least, unit), from_si(greatest, unit))
        for i, (unit, (least, greatest)) in enumerate(zip(_joint_units(robot), ends, strict=True))
        if i not in robot.passive
    }
    out["payload_kg"] = float(data.payload.min()), float(data.payload.max())
    if (heat := data.temperature) is not None:
        out["temperature_c"] = from_si(float(heat.min()), "c"), from_si(float(heat.max()), "c")
    return out


def unseen_directions(found: _core.Identification, names: list[str]) -> tuple[list[str], FloatArray]:
    """Names of the parameters that move with what was held, and their directions (M, held); see CalibrationRecord."""
    directions = np.asarray(found.held_directions)
    if not directions.size:
        return [], np.zeros((0, 0))
    asked = found.asked
    directions = directions.reshape(len(asked), -1)
    moved = (directions != 0).any(axis=1).tolist()
    rows = [k for k, i in enumerate(asked) if i < len(names) and moved[k]]
    return [names[asked[k]] for k in rows], directions[rows]


def shared_row_notes(parts: Iterable[Dataset], test: Dataset) -> list[str]:
    """A sentence where test rows are rows of the fit as well: same joints, same measured point."""
    rows = row_bytes(_rows(test))
    wanted, seen = set(rows), set[bytes]()
    for data in parts:
        if data.q.shape[1] == test.q.shape[1]:
            seen |= wanted.intersection(row_bytes(_rows(data)))
    count = sum(row in seen for row in rows)
    if not count:
        return []
    if count == len(test):
        text = said("all its rows are among the rows of the fit; its error says little about unseen poses")
    else:
        text = said(
            "{count} of its {rows} rows are among the rows of the fit; its error says little about unseen poses",
            count=count,
            rows=len(test),
        )
    return [joined(": ", [test.source, text])]


def _rows(data: Dataset) -> FloatArray:
    """(N, n + 3) joints and points."""
    measured = np.zeros((len(data), 0)) if data.position is None else data.position
    return np.hstack([data.q, measured])


def instrument_notes(model: Robot, data: Dataset) -> list[str]:
    """A sentence where a tracker would stand beside the arm's base: the measuring frame may be another one."""
    if data.instrument is None:
        return []
    base = to_si(np.array(model.description.base.xyz_mm), "mm")
    away = float(np.nanmin(np.linalg.norm(data.instrument - base, axis=1)))
    if away > _BESIDE * model.reach:
        return []
    return [
        said(
            "the tracker would have stood {away:.0f} mm from the robot's base: if the measuring frame is not the "
            "tracker's, say where it stood (instrument_x_mm ..., --instrument-at-mm)",
            away=float(from_si(away, "mm")),
        )
    ]


def thin_data_notes(found: _core.Identification, loss: str) -> list[str]:
    """A sentence where the measured numbers hardly outnumber the parameters."""
    numbers = int(np.sum(~np.isnan(np.asarray(found.residuals))))
    parameters = len(found.free)
    rows, left_out = int((~np.isnan(np.asarray(found.residuals)).all(axis=1)).sum()), len(found.outliers)
    if found.status == "too_few_equations" and 2 * left_out > rows:
        # The numbers are few only because most rows weigh nothing: more of the same would not mend it.
        return [
            said(
                "{left_out} of {rows} rows do not fit the others and were left out, so too few remain: are all labels "
                "and columns those of their rows?",
                left_out=left_out,
                rows=rows,
            )
        ]
    if numbers >= THIN * parameters or found.status == "too_few_equations":
        return []
    counts = {"parameters": parameters, "numbers": numbers, "freedom": max(found.degrees_of_freedom, 0)}
    if loss != "none" and found.loss == "none":
        return [
            said(
                "{parameters} parameters from {numbers} numbers: {freedom} degrees of freedom are left to judge the "
                "noise by, too few to distinguish outliers from the other rows; measure more poses",
                **counts,
            )
        ]
    return [
        said(
            "{parameters} parameters from {numbers} numbers: {freedom} degrees of freedom are left; measure more poses",
            **counts,
        )
    ]
