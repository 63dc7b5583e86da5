# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks of cells of several arms: what changed is named with its arm, in files, pages and exit codes."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cli.app import main
from fastcal.errors import ParseError
from fastcal.io.tree_file import cell_text, load_cell

from .test_diagnose import NOISE, cell_of, waved, write_poses

SLIP = 1e-3  # of a zero [rad]


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cell]:
    """A folder with model.yaml, and the cell that was calibrated."""
    folder = tmp_path_factory.mktemp("calibrated")
    found = calibrate_cell(cell_of(folder), waved(cell_of(folder), 120, None))
    assert set(found.cell.records) == {"smr_left", "smr_right"}
    (folder / "model.yaml").write_text(cell_text(found.cell), encoding="utf-8")
    return folder, found.cell


def new_rows(cell: Cell, slipped: str | None, rows: int = 12) -> Readings:
    """New postures of the calibrated cell, its instrument set up again, with a zero that has slipped or none."""
    rng = np.random.default_rng(21)
    q = rng.uniform(-2.5, 2.5, (rows, len(cell.joint_columns)))
    true = q.copy()
    if slipped is not None:
        true[:, [names[0] for names in cell.joint_columns].index(slipped)] += SLIP
    R, p = np.asarray(_core.exp_so3(np.array([0.02, -0.01, 0.4]))), np.array([0.3, -0.2, 0.1])
    tables = {}
    for view in ("smr_left", "smr_right"):
        T = np.asarray(cell.model.predict(_core.Samples(true), cell.model.start, of=view))
        tables[f"position@{view}"] = T[:, :3, 3] @ R.T + p + rng.normal(0, NOISE, (rows, 3))
    return Readings(q, tables, "new")


def checked(model: Path, poses: Path, folder: Path, code: int, *options: str) -> dict[str, Any]:
    out = folder / "check.json"
    assert main(["check", str(model), str(poses), *options, "-o", str(out)]) == code
    return dict(json.loads(out.read_text(encoding="utf-8")))


def test_a_cell_that_holds(calibrated: tuple[Path, Cell], tmp_path: Path) -> None:
    folder, cell = calibrated
    poses = write_poses(tmp_path, cell, new_rows(cell, None))
    found = checked(folder / "model.yaml", poses, tmp_path, 0, "--tolerance-mm", "1")
    assert (found["verdict"], found["within_tolerance"]) == ("holds", True)
    assert found["changed"] == []
    assert found["ways"]["smr_left"]["arms"] == ["column", "left"]
    assert main(["check", str(folder / "model.yaml"), str(poses), "-o", str(tmp_path / "check.html")]) == 0
    page = (tmp_path / "check.html").read_text(encoding="utf-8")
    for text in ("Does the calibration still hold?", "smr_left", "column + right", "Holds"):
        assert text in page
    # Within the noise of the tolerance nothing is decided.
    assert checked(folder / "model.yaml", poses, tmp_path, 3, "--tolerance-mm", "0.04")["verdict"] == "cannot_tell"


def test_a_slipped_zero_is_named_with_its_arm(calibrated: tuple[Path, Cell], tmp_path: Path) -> None:
    folder, cell = calibrated
    poses = write_poses(tmp_path, cell, new_rows(cell, "left.q3"))
    found = checked(folder / "model.yaml", poses, tmp_path, 4, "--tolerance-mm", "0.1")
    assert found["within_tolerance"] is False
    assert found["verdict"] == "changed"
    assert {of["way"] for of in found["changed"]} == {"smr_left"}
    assert found["ways"]["smr_right"]["verdict"] == "holds"
    (cause,) = found["ways"]["smr_left"]["causes"]
    assert "left.joint3" in {of.partition(" ")[0] for of in (cause["label"], *cause["equivalents"])}
    assert "left.joint" in found["sentence"]
    owners = {of["owner"] for of in found["changed"]}
    assert owners == {"left.joint3"} or cause["equivalents"]
    if owners == {"left.joint3"}:
        assert abs(found["changed"][0]["value"] - found["changed"][0]["was"]) == pytest.approx(
            np.degrees(SLIP), rel=0.3
        )
    main(["check", str(folder / "model.yaml"), str(poses), "-o", str(tmp_path / "check.html")])
    page = (tmp_path / "check.html").read_text(encoding="utf-8")
    assert "left.joint\N{NO-BREAK SPACE}3" in page
    assert "smr_left: Next: re-master left.joint" in page
    assert "smr_right: Next" not in page


def test_the_model_keeps_its_records_bit_for_bit(calibrated: tuple[Path, Cell]) -> None:
    folder, cell = calibrated
    again = load_cell(folder / "model.yaml")
    assert again.records == cell.records
    assert cell_text(again) == (folder / "model.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"nobody": {}}, "calibrations.nobody: expected the name of a target on an arm's flange"),
        ({"smr_left": {"parameters": []}}, "calibrations.smr_left: "),
    ],
)
def test_a_wrong_record_gets_one_sentence(
    calibrated: tuple[Path, Cell], tmp_path: Path, change: dict[str, Any], sentence: str
) -> None:
    (tmp_path / "model.yaml").write_text(cell_text(replace(calibrated[1], records=change)), encoding="utf-8")
    with pytest.raises(ParseError) as error:
        load_cell(tmp_path / "model.yaml")
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_what_cannot_be_checked_gets_one_sentence(
    calibrated: tuple[Path, Cell], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, cell = calibrated
    poses = write_poses(tmp_path, cell, new_rows(cell, None))
    for model, more, sentence in (
        (folder / "cell.yaml", [], "keeps no covariance of what carries smr_left; expected a model.yaml"),
        (folder / "model.yaml", ["--corners", str(poses)], "holds corners, and the file has no cameras"),
        (folder / "model.yaml", ["--serial", "7"], "--serial is for one arm"),
    ):
        assert main(["check", str(model), str(poses), *more]) == 2
        assert sentence in capsys.readouterr().err.strip().splitlines()[-1]
