# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Of fewer postures than the geometry takes, nothing can be told: that is the answer, with a model and a status."""

import json
from pathlib import Path

import pytest

from fastcal import Dataset, diagnose, load_robot, write_measurements
from fastcal.cli.app import main
from fastcal.fleet.arms import Arm
from fastcal.fleet.one_arm import diagnose_arm
from fastcal.io.robot_file import write_spec

from .rules import small_arm


def few(rows: int) -> Dataset:
    """That many postures."""
    return small_arm.measured([], rows=rows)


@pytest.mark.parametrize("rows", [3, 4])
def test_the_answer_is_that_they_are_too_few(rows: int) -> None:
    found = diagnose(small_arm.arm(), few(rows))
    assert (found.status, found.verdict, found.effects) == ("too_few_postures", "none", [])
    assert f"{rows} rows show {rows} different postures" in found.sentence
    assert "No missing effect" not in found.sentence
    assert found.model.joint_count == 3


def test_ten_postures_are_enough() -> None:
    assert diagnose(small_arm.arm(), few(10)).status != "too_few_postures"


def test_a_fleet_has_no_model_of_such_an_arm(tmp_path: Path) -> None:
    row = diagnose_arm(Arm("cell_1", small_arm.arm(), few(4)), {}, folder=str(tmp_path / "cell_1"))
    assert row.verdict == ""
    assert "4 different postures" in row.message


def test_the_command_writes_what_there_is_and_exits_with_3(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_spec(dict(small_arm.arm().spec), tmp_path / "arm.yaml")
    write_measurements(tmp_path / "few.csv", few(4), small_arm.arm().joint_types)
    files = [str(tmp_path / name) for name in ("arm.yaml", "few.csv")]
    assert main(["diagnose", *files, "-o", str(tmp_path / "out")]) == 3
    said = capsys.readouterr().out
    assert "too few measurements" in said.splitlines()[0]
    assert "next: Measure more postures" in said
    written = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    assert written["status"] == "too_few_postures"
    assert load_robot(tmp_path / "out" / "model.yaml").joint_count == 3
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Too few measurements" in page
    assert "What was tried" not in page
