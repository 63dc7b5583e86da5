# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sensors and cameras of a cell as hand-eye tools say it: in the frame of what they stand on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.result import IdentifiedParameter
from fastcal.cells.cell import Cell
from fastcal.errors import InvalidInput
from fastcal.robot.core_model import pose
from fastcal.robot.hand_eye import HandEye, deviations
from fastcal.robot.robot_spec import Spec
from fastcal.units import to_si

_PLACE = ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")


def cell_hand_eyes(cell: Cell, parameters: Sequence[IdentifiedParameter] = ()) -> list[HandEye]:
    """Every sensor and camera of a cell, on its arm's flange or link, or in the room.

    Args:
        cell: Identified.
        parameters: What was identified, for standard deviations.

    Raises:
        InvalidInput: The cell has neither.
    """
    found = {(p.owner, p.name): p.std for p in parameters}
    sensors: list[tuple[str, str, Spec, FloatArray, Spec | None]] = [
        (
            of.name,
            of.on,
            of.place,
            np.array([_si(found.get((of.name, key)), key.partition("_")[2]) for key in _PLACE]),
            None,
        )
        for of in cell.points
        if of.role == "sensor"
    ]
    sensors += [(name, str(entry["on"]), entry, deviations(entry), entry) for name, entry in cell.cameras.items()]
    if not sensors:
        raise InvalidInput(
            f"{cell.name}: has no sensor whose place could be written; expected `sensors` or `cameras` in the cell"
        )
    flanges = {arm.flange: arm for arm in cell.arms}
    marker = next((of.name for of in cell.points if of.role == "target"), next(iter(cell.boards), "board"))
    out = []
    for name, on, place, std, lens in sensors:
        arm = flanges.get(on, cell.arms[0])
        source = arm.robot.description.source
        base, effector = str(source.get("base_link", "base_link")), str(source.get("tip_link", "flange"))
        T, in_hand = pose(place), on != "world"
        if not in_hand and arm.on == "world":
            T = np.linalg.inv(arm.robot.T_world_base) @ T
        parent = effector if on in flanges else on if in_hand else base
        out.append(HandEye(name, parent, T, std, in_hand, base, effector, str(marker), lens))
    return out


def _si(std: float | None, unit: str) -> float:
    return float("nan") if std is None else float(to_si(std, unit))
