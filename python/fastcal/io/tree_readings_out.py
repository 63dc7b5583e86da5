# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures and readings of a cell as a table that `load_readings` reads."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell
from fastcal.cells.predict import CellPrediction
from fastcal.cells.readings import Readings
from fastcal.io.arm_readings import OF_ALL_ARMS
from fastcal.io.columns import is_condition
from fastcal.io.measurements_out import file_columns
from fastcal.io.tables import write_csv
from fastcal.units import from_si, parse_name

_AXES, _PARTS = "xyz", "wxyz"


def posture_columns(cell: Cell, q: FloatArray) -> dict[str, Any]:
    """The columns ARM.qN_deg (_mm of a joint that slides) of postures q (N, n)."""
    units = ["deg" if kind == "revolute" else "mm" for kind in cell.joint_types]
    names = [titles[0] for titles in cell.joint_columns]
    return {f"{name}_{unit}": from_si(q[:, i], unit) for i, (name, unit) in enumerate(zip(names, units, strict=True))}


def write_readings(path: str | os.PathLike[str], cell: Cell, readings: Readings) -> None:
    """Writes postures with what is known of them, positions, orientations and lengths, whole or not at all."""
    columns = posture_columns(cell, readings.q) | _conditions(cell, readings)
    for name, values in readings.tables.items():
        field, _, view = name.partition("@")
        columns |= _titled(field, view, values)
    columns |= {name: of.texts for name, of in readings.labels.items()}
    write_csv(path, columns)


def _conditions(cell: Cell, readings: Readings) -> dict[str, Any]:
    """The columns ARM.payload_kg, ARM.approach1 ...; those that are the same in all arms once, without an arm."""
    own = {
        arm.name: file_columns(replace(data, q_read=None), arm.robot.joint_types)
        for arm in cell.arms
        if (data := readings.arms.get(arm.name)) is not None
    }
    joints = {f"q{joint + 1}" for joint in range(readings.q.shape[1])}
    out: dict[str, Any] = {}
    for arm, columns in own.items():
        for title, values in columns.items():
            if parse_name(title)[0] in joints:
                continue
            is_one = all(title in of and np.array_equal(of[title], values) for of in own.values())
            is_of_all = not is_condition(title) or parse_name(title)[0] in OF_ALL_ARMS
            out[title if is_one and is_of_all else f"{arm}.{title}"] = values
    return out


def write_cell_prediction(path: str | os.PathLike[str], found: Mapping[str, CellPrediction]) -> None:
    """Writes `row`, and of each view its position, orientation and standard deviation."""
    columns: dict[str, Any] = {"row": range(max(len(of.position) for of in found.values()))}
    for view, of in found.items():
        columns |= _titled("position", view, of.position) | _titled("rotation", view, of.rotation)
        columns |= _titled("sigma_position", view, of.sigma_position)
    write_csv(path, columns)


def _titled(field: str, view: str, values: FloatArray) -> dict[str, Any]:
    if field == "rotation":
        return {f"q{part}@{view}": values[:, k] for k, part in enumerate(_PARTS)}
    if field == "distance":
        return {f"distance_mm@{view}": from_si(values[:, 0], "mm")}
    before = "sigma_" if field == "sigma_position" else ""
    return {f"{before}{axis}_mm@{view}": from_si(values[:, k], "mm") for k, axis in enumerate(_AXES)}
