# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cell files: the tools, frames and loads that a program names without saying where or how heavy they are.

base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}      # the robot file's base in the controller's base frame
flange: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}    # the controller's flange in the robot file's last frame
tools: {tGun: {xyz_mm: [0, 0, 230], rpy_deg: [0, 35, 0]}, "2": {xyz_mm: [0, 0, 100]}}
frames: {wTable: {xyz_mm: [1500, -200, 400]}, "1": {xyz_mm: [800, 0, 0]}}
start_deg: [0, -90, 90, 0, 90, 0]                  # where the arm stands when a program begins
loads: {"1": {mass_kg: 0}, "2": {mass_kg: 8.5}}    # what hangs on the flange, by the program's name or number
"""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from fastcal.io.fields import Fields
from fastcal.io.yaml_file import read_yaml
from fastcal.programs import Cell
from fastcal.robot.core_model import pose
from fastcal.units import to_si


def load_cell(path: str | os.PathLike[str]) -> Cell:
    """Reads a cell file.

    Raises:
        ParseError: One sentence that names the file, the key, what was expected and what came.
    """
    top = Fields(read_yaml(path), "", path)
    cell = Cell(
        _frame(top.take("base", {}), "base", path),
        _frame(top.take("flange"), "flange", path) if top.has("flange") else None,
        _frames(top.take("tools", {}), "tools", path),
        _frames(top.take("frames", {}), "frames", path),
        _start(top),
        _loads(top, path),
    )
    top.done()
    return cell


def _start(top: Fields) -> NDArray[np.float64] | None:
    if not top.has_quantity("start", "deg"):
        return None
    given = top.take("start_deg")
    return to_si(np.array(top.checked_vector("start_deg", given, len(given) if isinstance(given, list) else 6)), "deg")


def _loads(top: Fields, path: str | os.PathLike[str]) -> dict[str, float]:
    named = Fields(top.take("loads", {}), "loads", path).rest()
    found = {}
    for name, entry in named.items():
        fields = Fields(entry, f"loads.{name}", path)
        found[str(name)] = fields.quantity("mass", "kg")
        if found[str(name)] < 0:
            fields.fail("mass_kg", "a mass of 0 or more", found[str(name)])
        fields.done()
    return found


def _frames(value: object, where: str, path: str | os.PathLike[str]) -> dict[str, NDArray[np.float64]]:
    named = Fields(value, where, path).rest()
    return {str(name): _frame(entry, f"{where}.{name}", path) for name, entry in named.items()}


def _frame(value: object, where: str, path: str | os.PathLike[str]) -> NDArray[np.float64]:
    fields = Fields(value, where, path)
    frame = fields.frame()
    fields.done()
    return pose(frame)
