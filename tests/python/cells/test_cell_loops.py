# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`loops` of a cell: those of the robot file of its only arm."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal import load_robot, random_poses
from fastcal.errors import ParseError
from fastcal.io.robot_file import read_spec
from fastcal.io.tree_file import is_cell, load_cell
from fastcal.robots import path_of


def cell_of(folder: Path, **changes: Any) -> Path:
    """A five-bar whose rod stands in the cell file."""
    shipped = path_of("five_bar")
    assert shipped is not None
    spec = yaml.safe_load(shipped.read_text(encoding="utf-8"))
    loops = spec.pop("loops")
    (folder / "open.yaml").write_text(yaml.safe_dump(spec, sort_keys=False), encoding="utf-8")
    loops[0]["from"] = "bars.link1"
    cell = {"cell": "test", "arms": {"bars": {"robot": "open.yaml"}}, "loops": loops, **changes}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell), encoding="utf-8")
    return folder / "cell.yaml"


def test_the_arm_of_a_cell_closes_by_the_loops_of_the_cell(tmp_path: Path) -> None:
    path = cell_of(tmp_path)
    assert not is_cell(path)
    robot, alone = load_robot(path), load_robot("five_bar")
    assert robot.spec["loops"] == alone.spec["loops"]
    q = random_poses(alone, 5, seed=1)
    np.testing.assert_array_equal(robot.forward(q), alone.forward(q))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"targets": {"smr": {"on": "bars"}}}, "loops: only the arm of a cell of one arm, without targets and sensors"),
        ({"loops": 3}, "loops: expected a list"),
        ({"loops": [{"from": "bars.link9", "to": "tool", "length_mm": 320}]}, r"loops\[0\].from: expected base, tool"),
    ],
)
def test_loops_that_do_not_fit_get_one_sentence(tmp_path: Path, changes: dict[str, Any], sentence: str) -> None:
    path = cell_of(tmp_path, **changes)
    with pytest.raises(ParseError, match=sentence):
        load_cell(path) if is_cell(path) else read_spec(path)


def test_loops_of_a_bare_urdf_need_a_robot_file_with_its_motors(tmp_path: Path) -> None:
    link = "<link name='{}'/>".format
    joint = "<joint name='j' type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint>"
    (tmp_path / "arm.urdf").write_text(f"<robot name='r'>{link('a')}{link('b')}{joint}</robot>", encoding="utf-8")
    with pytest.raises(ParseError, match=r"arm\.urdf: its loops go into a robot file"):
        read_spec(cell_of(tmp_path, arms={"bars": {"robot": "arm.urdf"}}))
