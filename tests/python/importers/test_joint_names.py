# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns by the names of a URDF's joints, some of which others drive: a lift of two stages with one motor."""

from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.errors import ParseError
from fastcal.importers import import_measurements

LIFT = """<robot name="lift"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="tip"/>
<joint name="lower" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="0" upper="2" effort="1" velocity="1"/></joint>
<joint name="upper" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="0" upper="2" effort="1" velocity="1"/><mimic joint="lower" multiplier="0.5" offset="0.1"/></joint>
<joint name="turn" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="nod" type="revolute"><parent link="c"/><child link="tip"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


def robot_of(folder: Path) -> fastcal.Robot:
    (folder / "lift.urdf").write_text(LIFT)
    return fastcal.load_robot(folder / "lift.urdf", tip_link="tip")


def table(folder: Path, names: list[str], rows: int = 12) -> tuple[Path, np.ndarray]:
    values = np.random.default_rng(1).uniform(0.1, 1.0, (rows, len(names)))
    lines = [",".join(names), *(",".join(map(repr, row)) for row in values.tolist())]
    (folder / "rows.csv").write_text("\n".join(lines))
    return folder / "rows.csv", values


def test_a_joint_that_another_drives_needs_no_column(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    path, values = table(tmp_path, ["lower_m", "turn_rad", "nod_rad", "x_m", "y_m", "z_m"])
    data = fastcal.load_measurements(path, robot)
    np.testing.assert_allclose(data.q[:, [0, 2, 3]], values[:, :3], atol=1e-12)
    np.testing.assert_allclose(data.q[:, 1], 0.5 * values[:, 0] + 0.1, atol=1e-12)


def test_one_that_has_a_column_is_read_and_follows_nonetheless(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    path, values = table(tmp_path, ["lower_m", "upper_m", "turn_rad", "nod_rad", "x_m", "y_m", "z_m"])
    data = fastcal.load_measurements(path, robot)
    np.testing.assert_allclose(data.q[:, [0, 2, 3]], values[:, [0, 2, 3]], atol=1e-12)


def test_a_name_that_is_missing_is_said(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    path, _ = table(tmp_path, ["lift_m", "turn_rad", "nod_rad", "x_m", "y_m", "z_m"])
    with pytest.raises(ParseError, match="joint 'lower' has no column; expected the robot's own names, lower, turn"):
        import_measurements([path], robot=robot)
