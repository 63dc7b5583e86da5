# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye samples as files of fastcal: a table of poses, and the cell that reads it beside it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.importers.pose_pairs import PosePairs
from fastcal.io.atomic import atomic_paths
from fastcal.io.tables import check_csv_name, csv_text
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_TITLES = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
_TURN = 1e-12  # of a rotation vector that is no turn


def write_pose_pairs(path: Path, pairs: PosePairs, robot: Robot | None = None, name: str = "") -> Path:
    """Writes the table, and beside it the cell of an arm of poses, or of its joints; returns the cell's path.

    Args:
        path: The table's.
        pairs: What was read.
        robot: The arm, where its joints are known.
        name: By which the cell names it.

    Raises:
        InvalidInput: A file cannot be written, or is no CSV by its name.
    """
    check_csv_name(path)
    cell = path.with_name(f"{path.stem}_cell.yaml")
    arm: str = "pose"
    if pairs.joints is None or robot is None:
        columns = pose_columns(pairs.flange, "arm.{}")
    else:
        columns, arm = joint_columns(pairs.joints, robot, "arm."), named_beside(name, path)
    columns |= pose_columns(pairs.seen, "{}@board:camera")
    on = {"camera": "arm", "board": "world"} if pairs.in_hand else {"camera": "world", "board": "arm"}
    content = {
        "arms": {"arm": {"robot": arm}},
        "sensors": {"camera": {"on": on["camera"]}},
        "targets": {"board": {"on": on["board"]}},
    }
    with atomic_paths([path, cell]) as (table, beside):
        table.write_text(csv_text(columns), encoding="utf-8", newline="\n")
        beside.write_text(yaml_text(content), encoding="utf-8", newline="\n")
    return cell


def named_beside(name: str, path: Path) -> str:
    """A robot as a cell beside `path` names it: its file from there, or a shipped arm."""
    return os.path.relpath(name, path.parent) if Path(name).is_file() else name


def joint_columns(q: NDArray[np.float64], robot: Robot, owner: str = "") -> dict[str, list[float]]:
    """Columns of joints (N, n) in the units of tables, as the controller counts them where the arm has a pendant."""
    letter = "j" if robot.description.pendant else "q"
    units = ["mm" if joint.type == "prismatic" else "deg" for joint in robot.joints]
    return {
        f"{owner}{letter}{k + 1}_{unit}": np.round(from_si(values, unit), 9).tolist()
        for k, (values, unit) in enumerate(zip(q.T, units, strict=True))
    }


def pose_columns(T: NDArray[np.float64], title: str) -> dict[str, list[float]]:
    """Columns of poses (N, 4, 4) [m], their titles as `title` has them: "arm.{}"."""
    values = np.column_stack([from_si(T[:, :3, 3], "mm"), [_wxyz(R) for R in T[:, :3, :3]]])
    return {title.format(name): column.tolist() for name, column in zip(_TITLES, values.T, strict=True)}


def _wxyz(R: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[float]:
    """The unit quaternion of a rotation."""
    turn = _core.log_so3(R)
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > _TURN else np.zeros(3)
    return [float(np.cos(angle / 2)), *(np.sin(angle / 2) * axis).tolist()]
