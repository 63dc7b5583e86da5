# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of arms of which only the flange's pose is known: ARM.x_mm, ARM.y_mm, ARM.z_mm, ARM.qw ... ARM.qz.

Or ARM.rx_deg, ARM.ry_deg, ARM.rz_deg, as measured orientations; the only arm's name may be left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.pose_arm import PARTS, pose_joints
from fastcal.io.table import Table
from fastcal.place import joint_position
from fastcal.units import UNITS, parse_name, to_si, unit_names

_PLACE, _QUATERNION = PARTS[:3], PARTS[3:]
_ANGLES = ("rx", "ry", "rz")  # roll, pitch and yaw, in place of the quaternion
_UNIT_LENGTH = 1e-2  # of a quaternion, that is then made one


def flange_columns(table: Table, arms: list[str], *, only: bool = False) -> dict[str, dict[str, int]]:
    """Of each arm where its columns are, by what they hold.

    Args:
        table: The poses.
        arms: The arms of poses.
        only: Is the one arm of poses the only arm? Then columns without its name are its pose, where none has its name.

    Raises:
        ParseError: One is missing, comes twice or has no unit.
    """
    out = _named_columns(table, arms)
    if only and len(arms) == 1 and not out[arms[0]]:
        out = {arms[0]: _named_columns(table, [""])[""]}
    for arm, found in out.items():
        angles = not found.keys() & {*_QUATERNION} and bool(found.keys() & {*_ANGLES})
        for part in (*_PLACE, *(_ANGLES if angles else _QUATERNION)):
            if part not in found:
                unit = "_mm" if part in _PLACE else "_deg" if part in _ANGLES else ""
                raise table.error(
                    f"there is no column {arm}.{part}{unit}; the pose of arm '{arm}' is {arm}.x_mm ... {arm}.qz, or "
                    f"{arm}.x_mm ... {arm}.rz_deg (roll, pitch and yaw)"
                )
    return out


def _named_columns(table: Table, arms: list[str]) -> dict[str, dict[str, int]]:
    """Where columns of poses are: of each arm (or of none, "") by what they hold."""
    out: dict[str, dict[str, int]] = {arm: {} for arm in arms}
    for place, title in enumerate(table.names):
        base, unit = parse_name(title)
        arm, _, part = base.rpartition(".")
        part = part.lower()
        if arm not in out or part not in (*PARTS, *_ANGLES):
            continue
        if part in out[arm]:
            raise table.error(f"columns '{table.names[out[arm][part]]:.60}' and '{title:.60}' hold the same")
        kind = "length" if part in _PLACE else "angle" if part in _ANGLES else None
        if kind is not None and (unit is None or UNITS[unit].kind != kind):
            raise table.error(f"column '{title:.60}' needs a unit of {kind} at its end: {unit_names(kind)}")
        out[arm][part] = place
    return out


def flange_joints(table: Table, found: dict[str, int]) -> FloatArray:
    """(N, 6) joint positions of one arm's poses, SI.

    Raises:
        ParseError: A cell is empty, or a quaternion is not of length 1.
    """
    angles = not found.keys() & {*_QUATERNION}
    parts = (*_PLACE, *(_ANGLES if angles else _QUATERNION))
    values = np.column_stack([table.numbers(found[part]) for part in parts])
    if np.isnan(values).any():
        row, column = np.argwhere(np.isnan(values))[0].tolist()
        raise table.wrong_cell(found[parts[column]], row, "a number")
    for column, part in enumerate(parts):
        if (unit := parse_name(table.names[found[part]])[1]) is not None:
            values[:, column] = to_si(values[:, column], unit)
    if angles:
        return np.column_stack([values[:, :3], values[:, :2:-1]])  # it turns about z, y and x
    wxyz = values[:, 3:]
    with np.errstate(over="ignore"):
        length = np.linalg.norm(wxyz, axis=1)
    if (wrong := ~(np.abs(length - 1) <= _UNIT_LENGTH)).any():
        row = int(np.argmax(wrong))
        raise table.error(f"expected a quaternion of length 1, got {length[row]:.4g}", row)
    return pose_joints(values[:, :3], wxyz / length[:, np.newaxis])


def joints_for_poses(table: Table, arm: str) -> Table:
    """The table with joints q1 ... of an arm of poses in place of the columns of its flange's pose; as it is with q1.

    Raises:
        ParseError: It has neither, or a pose is none.
    """
    if any(parse_name(title)[0] in ("q1", f"{arm}.q1") for title in table.names):
        return table
    found = flange_columns(table, [arm], only=True)[arm]
    q = flange_joints(table, found)
    kept = [place for place in range(len(table.names)) if place not in found.values()]
    names = [f"{joint_position(k)}_{'m' if k < 3 else 'rad'}" for k in range(6)]
    return replace(
        table,
        names=[*names, *(table.names[place] for place in kept)],
        columns=[*q.T, *(table.columns[place] for place in kept)],
    )
