# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of arms of which only the flange's pose is known: ARM.x_mm, ARM.y_mm, ARM.z_mm, ARM.qw ... ARM.qz."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.pose_arm import PARTS, pose_joints
from fastcal.io.table import Table
from fastcal.place import joint_position
from fastcal.units import UNITS, parse_name, to_si, unit_names

_UNIT_LENGTH = 1e-2  # of a quaternion, that is then made one


def flange_columns(table: Table, arms: list[str]) -> dict[str, dict[str, int]]:
    """Of each arm where its columns are, by what they hold.

    Raises:
        ParseError: One is missing, comes twice or has no unit of length.
    """
    out: dict[str, dict[str, int]] = {arm: {} for arm in arms}
    for place, title in enumerate(table.names):
        base, unit = parse_name(title)
        arm, _, part = base.rpartition(".")
        if arm not in out or part.lower() not in PARTS:
            continue
        part = part.lower()
        if part in out[arm]:
            raise table.error(f"columns '{table.names[out[arm][part]]:.60}' and '{title:.60}' hold the same")
        if part in "xyz" and (unit is None or UNITS[unit].kind != "length"):
            raise table.error(f"column '{title:.60}' needs a unit of length at its end: {unit_names('length')}")
        out[arm][part] = place
    for arm, found in out.items():
        for part in PARTS:
            if part not in found:
                wanted = f"{arm}.{part}" + ("_mm" if part in "xyz" else "")
                raise table.error(f"there is no column {wanted}; the pose of arm '{arm}' is {arm}.x_mm ... {arm}.qz")
    return out


def flange_joints(table: Table, found: dict[str, int]) -> FloatArray:
    """(N, 6) joint positions of one arm's poses, SI.

    Raises:
        ParseError: A cell is empty, or a quaternion is not of length 1.
    """
    values = np.column_stack([table.numbers(found[part]) for part in PARTS])
    if np.isnan(values).any():
        row, column = np.argwhere(np.isnan(values))[0].tolist()
        raise table.wrong_cell(found[PARTS[column]], row, "a number")
    for column in range(3):
        values[:, column] = to_si(values[:, column], parse_name(table.names[found[PARTS[column]]])[1] or "m")
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
    found = flange_columns(table, [arm])[arm]
    q = flange_joints(table, found)
    kept = [place for place in range(len(table.names)) if place not in found.values()]
    names = [f"{joint_position(k)}_{'m' if k < 3 else 'rad'}" for k in range(6)]
    return replace(
        table,
        names=[*names, *(table.names[place] for place in kept)],
        columns=[*q.T, *(table.columns[place] for place in kept)],
    )
