# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners as other programs list them: other titles, counted from 1, without the only camera and board."""

from pathlib import Path

import numpy as np
import pytest

from fastcal.calibration.unknowns import CORNERS
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.corners import load_corners, load_seen, load_seen_or_open
from fastcal.io.robot_file import load_robot
from fastcal.robot.robot import Robot

BOARD = "{on: world, kind: charuco, columns: 3, rows: 3, square_mm: 20}"  # four corners
CAMERA = "{on: arm, size_px: [640, 480], focal_px: [600, 600], centre_px: [320, 240]}"
SEEN = [[10.0, 20.0], [30.0, 21.0], [11.0, 40.0]]  # of corners 0, 1 and 3


def rig(folder: Path, boards: str = f"{{plate: {BOARD}}}") -> Robot:
    (folder / "cell.yaml").write_text(f"arms: {{arm: ur5}}\ncameras: {{wrist: {CAMERA}}}\nboards: {boards}\n")
    return load_robot(folder / "cell.yaml")


def table(folder: Path, titles: str, first: int, rows: int = 2) -> Path:
    lines = [f"{first + i},{k},{u + i},{v}" for i in range(rows) for k, (u, v) in zip((0, 1, 3), SEEN, strict=True)]
    (folder / "corners.csv").write_text("\n".join([titles, *lines]) + "\n")
    return folder / "corners.csv"


@pytest.mark.parametrize(
    ("titles", "first"),
    [
        ("row,corner,u_px,v_px", 0),
        ("frame,corner_id,u,v", 0),
        ("image_id,charuco_id,x,y", 1),
        ("Picture,ID,X_px,Y_px", 1),
    ],
)
def test_titles_of_other_programs_are_read(tmp_path: Path, titles: str, first: int) -> None:
    found = load_corners(table(tmp_path, titles, first), rig(tmp_path).description, 2)
    expected = np.full((2, 4, 2), np.nan)
    expected[0, [0, 1, 3]] = SEEN
    expected[1, [0, 1, 3]] = np.array(SEEN) + np.array([1.0, 0.0])
    np.testing.assert_array_equal(found.tables[CORNERS].reshape(2, 4, 2), expected)
    assert any("counts from 1" in note for note in found.notes) is (first == 1)
    assert any(" as corner" in note for note in found.notes) is (titles[0] != "r")


def test_our_own_rows_count_from_zero(tmp_path: Path) -> None:
    with pytest.raises(ParseError, match=r"row must be 0 to 1"):
        load_corners(table(tmp_path, "row,corner,u_px,v_px", 1), rig(tmp_path).description, 2)


def test_one_of_several_boards_is_named(tmp_path: Path) -> None:
    two = rig(tmp_path, f"{{plate: {BOARD}, other: {BOARD}}}").description
    with pytest.raises(ParseError, match="column 'board' is missing"):
        load_corners(table(tmp_path, "frame,id,u,v", 0), two, 2)


def postures(folder: Path, more: str = "") -> Path:
    lines = ["q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", f"10,-80,70,10,20,30{more}", f"20,-70,60,20,30,10{more}"]
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    return folder / "poses.csv"


def test_files_that_are_exchanged_or_left_out_are_named(tmp_path: Path) -> None:
    robot, corners, poses = rig(tmp_path), table(tmp_path, "row,corner,u_px,v_px", 0), postures(tmp_path)
    assert len(load_seen([poses], robot, corners)) == 2
    for load in (load_seen, lambda *given: load_seen_or_open(*given, seen=lambda rows: rows)):
        with pytest.raises(InvalidInput, match=r"corners\.csv: holds corners, which --corners takes"):
            load([corners], robot, poses)
        with pytest.raises(InvalidInput, match=r"poses\.csv: holds nothing measured.* expected --corners FILE"):
            load([poses], robot, None)
        with pytest.raises(ParseError, match=r"holds nothing measured; expected numbers in x_mm"):
            load([poses], load_robot("ur5"), None)
        with pytest.raises(ParseError, match=r"poses\.csv:2"):
            load([postures(tmp_path, ",1")], robot, None)
        postures(tmp_path)
