# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell's wrong input gets one sentence on the command line, exit code 2, and nothing is written."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cli.app import main
from fastcal.errors import InvalidInput
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell

from . import track_scene as track
from .test_calibrate import JOINTS, content, csv_of, written

READ = ["x_mm@smr", "y_mm@smr", "z_mm@smr"]
POSTURE = list(range(13))


def standing(arm: str, on: str) -> dict[str, Any]:
    """The arms of the cell, one of them on something else."""
    arms: dict[str, Any] = content()["arms"]
    return arms | {arm: {**arms[arm], "on": on}}


@pytest.mark.parametrize("command", ["calibrate", "diagnose"])
@pytest.mark.parametrize(
    ("changes", "titles", "row", "sentence"),
    [
        (
            {"sensors": {"smr": {"on": "column"}}},
            [*JOINTS, *READ],
            [*POSTURE, 1, 2, 3],
            "cell.yaml: two members of the cell are named 'smr'; expected a name for each",
        ),
        (
            {"arms": standing("column", "left")},
            [*JOINTS, *READ],
            [*POSTURE, 1, 2, 3],
            "cell.yaml: 'column' stands on 'left.link6', which in the end stands on 'column' itself",
        ),
        (
            {"sensors": {"camera": {"on": "torso"}}},
            [*JOINTS, *READ],
            [*POSTURE, 1, 2, 3],
            "cell.yaml: 'camera' stands on 'torso', and there is no such frame; expected world, column, column.base or "
            "column.link1, left, left.base or left.link1 to left.link6, right, right.base or right.link1 to "
            "right.link6",
        ),
        (
            {},
            [*JOINTS, "mid.q1_deg", *READ],
            [*POSTURE, 0, 1, 2, 3],
            "poses.csv: column 'mid.q1_deg' names no arm of this cell; its arms are column, left, right",
        ),
        (
            {},
            JOINTS,
            POSTURE,
            "poses.csv: holds no reading; expected columns such as x_mm@TARGET or x_mm@TARGET:SENSOR",
        ),
        ({}, [*JOINTS, *READ], [*POSTURE, "", "", ""], "poses.csv:2: holds a posture and no reading of any target"),
        (
            {},
            [*JOINTS[:-1], *READ],
            [*POSTURE[:-1], 1, 2, 3],
            "poses.csv: there is no column of the joint right.q6; expected right.q6_deg",
        ),
        (
            {"targets": {"smr": {"on": "smr"}}},
            [*JOINTS, *READ],
            [*POSTURE, 1, 2, 3],
            "cell.yaml: 'smr' stands on 'smr', which in the end stands on 'smr' itself",
        ),
    ],
    ids=["name", "cycle", "frame", "arm", "reading", "empty", "joint", "itself"],
)
def test_a_wrong_cell_gets_one_sentence(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    command: str,
    changes: dict[str, Any],
    titles: list[str],
    row: list[Any],
    sentence: str,
) -> None:
    cell = written(tmp_path, content(**changes))
    poses = csv_of(tmp_path, titles, [row])
    assert main([command, str(cell), str(poses), "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.splitlines() == [f"fastcal: error: {tmp_path}/{sentence}"]
    assert not (tmp_path / "out").exists()


def test_two_targets_of_one_key_get_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """YAML itself would keep the last of them without a word."""
    cell = written(tmp_path, content())
    text = cell.read_text(encoding="utf-8")
    twice = text.replace("tag: {", "smr: {")
    assert twice != text
    cell.write_text(twice, encoding="utf-8")
    poses = csv_of(tmp_path, [*JOINTS, *READ], [[*POSTURE, 1, 2, 3]])
    assert main(["calibrate", str(cell), str(poses), "-o", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cell.yaml" in line
    assert "smr" in line


def test_a_board_of_another_size_gets_one_sentence(tmp_path: Path) -> None:
    """A tenth of its size ended in an internal error."""
    track.Scene(2).write(tmp_path, 20)
    content = track.cell()
    content["boards"]["plate"]["square_mm"] /= 10
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    readings = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    with pytest.raises(InvalidInput, match="Are the boards as large as the file says"):
        calibrate_cell(cell, readings)
