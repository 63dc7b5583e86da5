# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where each member of a calibrated cell stands, and how surely that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fastcal.calibration.result import IdentifiedParameter
from fastcal.cells.cell import Cell
from fastcal.robot.robot_spec import Spec

_AXES = ("x_mm", "y_mm", "z_mm"), ("rx_deg", "ry_deg", "rz_deg")


@dataclass(frozen=True)
class Placement:
    """One member.

    Attributes:
        kind: arm, target, sensor, camera or board.
        on: The frame that it stands on.
        xyz_mm, rpy_deg: Where it is there.
        std_mm, std_deg: Along and about x, y, z; None of what was not identified.
    """

    name: str
    kind: str
    on: str
    xyz_mm: tuple[float, ...]
    rpy_deg: tuple[float, ...]
    std_mm: tuple[float | None, ...]
    std_deg: tuple[float | None, ...]

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `placements` in result.json."""
        return {key: list(value) if isinstance(value, tuple) else value for key, value in vars(self).items()}


def placements(cell: Cell, parameters: Sequence[IdentifiedParameter]) -> list[Placement]:
    """Of all members, arms first, in the order of the file.

    Args:
        cell: Identified.
        parameters: What was identified.
    """
    deviations = {(p.owner, p.name): p.std for p in parameters}

    def placed(name: str, kind: str, on: str, place: Spec, owner: str) -> Placement:
        std_mm, std_deg = (tuple(deviations.get((owner, axis)) for axis in axes) for axes in _AXES)
        return Placement(name, kind, on, tuple(place["xyz_mm"]), tuple(place["rpy_deg"]), std_mm, std_deg)

    arms = [placed(arm.name, "arm", arm.on, vars(arm.robot.description.base), f"{arm.name}.base") for arm in cell.arms]
    points = [placed(of.name, of.role, of.on, of.place, of.name) for of in cell.points]
    rig = [
        placed(name, kind, str(entry["on"]), entry, f"{kind} {name}")
        for kind, members in (("camera", cell.cameras), ("board", cell.boards))
        for name, entry in members.items()
    ]
    return [*arms, *points, *rig]
