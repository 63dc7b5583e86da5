# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell of several arms is brought up to date: what moved is named, what is known stays, truth lies inside."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.motions import carried
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.cells.update import update_cell
from fastcal.cli.app import main
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import cell_text, load_cell, write_cell
from fastcal.io.tree_readings_out import write_readings
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.core_model import pose

from . import track_scene as track
from .test_calibrate import NOISE, content, written
from .test_uses import disturbed, postures

TURN = 1e-4  # [rad] noise of an orientation
SLIP = 1e-3  # [rad]
ELSEWHERE = pose({"xyz_mm": [1000.0, 500.0, 200.0], "rpy_deg": [10.0, 20.0, -70.0]})


def read(cell: Cell, q: NDArray[np.float64], seed: int, *, slip: int | None = None, noise: float = 1.0) -> Readings:
    """Positions and orientations of both targets; a joint is off by SLIP of what its column says."""
    sent = q.copy()
    if slip is not None:
        sent[:, slip] += SLIP
    sizes = {"noise": noise * NOISE, "noise_rotation": noise * TURN}
    return replace(simulate_cell(cell, Readings(sent, {}, "simulated"), ["smr", "tag"], seed=seed, **sizes), q=q)


def calibrated(folder: Path, seed: int, count: int = 100) -> tuple[Cell, Cell]:
    """The true cell, and what a calibration makes of it."""
    cell = load_cell(written(folder, content(sensors={})))
    true = disturbed(cell, seed)
    return true, calibrate_cell(cell, read(true, postures(cell, count, seed).q, seed)).cell


def off(model: Cell, exact: Readings) -> NDArray[np.float64]:
    """What a model predicts of readings without noise, in its own standard deviations."""
    measured = exact.measured(model)
    ones = [1.0] * len(measured.observations)
    near = _core.linearize(model.model, exact.samples(model), measured, model.model.start, ones)
    record = CalibrationRecord.from_spec(model.record)
    assert record is not None
    none = np.zeros(len(record.parameters))
    root = np.array([record.roots.get(full_name(p), none) for p in model.model.parameters])
    out: NDArray[np.float64] = np.asarray(near.r) / np.linalg.norm(np.asarray(near.J) @ root, axis=1)
    return out


def test_what_rounding_leaves_of_nothing_is_not_written(tmp_path: Path) -> None:
    """The reader takes no number below 1e-100 but 0."""
    _, known = calibrated(tmp_path, 0)
    record = dict(known.record) | {"sigma_mm": 0.05}
    row = list(record["covariance_root"][3])
    record["covariance_root"] = [
        *record["covariance_root"][:3],
        [*row[:-2], 3e-140, row[-1]],
        *record["covariance_root"][4:],
    ]
    write_cell(replace(known, record=record), tmp_path / "traces.yaml")
    again = load_cell(tmp_path / "traces.yaml").record
    assert again["covariance_root"][3][-2] == 0


@pytest.mark.parametrize(("slip", "moved"), [(None, []), (4, ["left.joint4 zero"])])
def test_the_truth_is_inside_over_seeds(tmp_path: Path, slip: int | None, moved: list[str]) -> None:
    """With the instrument set up elsewhere, and a joint's zero that slipped."""
    each = []
    for seed in range(8):
        true, known = calibrated(tmp_path, seed)
        now = carried(true, ELSEWHERE)
        found = update_cell(known, read(now, postures(known, 12, 50 + seed).q, 90 + seed, slip=slip))
        assert found.status == "converged"
        assert found.moved == moved
        exact = read(now, postures(known, 30, 20 + seed).q, 1, slip=slip, noise=1e-4)
        each.append(off(found.cell, exact))
    assert 0.9 < np.mean(np.abs(np.concatenate(each)) < 1.96) < 0.99
    assert 0.8 < np.sqrt(np.mean(np.square(each))) < 1.2


def test_a_target_that_was_mounted_anew_and_a_gross_row_are_told(tmp_path: Path) -> None:
    true, known = calibrated(tmp_path, 1)
    points = [replace(of, place={**of.place, "xyz_mm": [41.0, 9.0, 121.0]}) for of in true.points if of.name == "smr"]
    now = replace(true, points=(*points, *(of for of in true.points if of.name != "smr")))
    new = read(now, postures(known, 14, 51).q, 91)
    new.tables["position@tag"][5] += 0.01
    found = update_cell(known, new)
    assert found.moved == ["smr"]
    assert found.outliers == [5]
    assert found.status == "converged"


def test_what_no_move_explains_is_not_converged(tmp_path: Path) -> None:
    true, known = calibrated(tmp_path, 2)
    found = update_cell(known, read(true, postures(known, 16, 52).q, 92, noise=3.0))
    assert found.status == "not_converged"
    assert "not explained by what may have moved" in found.message


def test_a_camera_that_was_knocked_is_found_by_few_pictures(tmp_path: Path) -> None:
    scene = track.Scene(3)
    scene.write(tmp_path, 40)
    cell = load_cell(tmp_path / "cell.yaml")
    known = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")).cell
    scene.table = scene.table @ pose({"xyz_mm": [1.5, 0.0, 0.5], "rpy_deg": [0.0, 0.2, 0.0]})
    scene.write(tmp_path, 6, prefix="new_")
    new = load_seen_readings(tmp_path / "new_poses.csv", known, tmp_path / "new_corners.csv")
    found = update_cell(known, new)
    assert found.status == "converged"
    assert found.moved is not None
    assert "table.base" in found.moved[0]
    before, after = found.train["corner"].statistics
    assert before is not None
    assert after is not None
    assert after.rms < 0.16 < before.rms / 5


def test_the_command_and_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    true, known = calibrated(tmp_path, 4, 60)
    model, poses, out = tmp_path / "model.yaml", tmp_path / "new.csv", tmp_path / "out"
    write_cell(known, model)
    assert cell_text(load_cell(model)) == cell_text(known)  # with the covariance of all, bit for bit
    write_readings(poses, known, read(carried(true, ELSEWHERE), postures(known, 12, 54).q, 94, slip=4))
    assert main(["update", str(model), str(poses), "-o", str(out), "--page-language", "de"]) == 0
    assert "12 Stellungen; Nullpunkt left.joint4 bewegt" in capsys.readouterr().out
    result = json.loads((out / "result.json").read_text())
    assert (result["method"], result["moved"]) == ("update", ["left.joint4 zero"])
    assert "Seit der Kalibrierung hat sich bewegt: left.joint4 zero" in (out / "report.html").read_text()
    # What is written is checked, and brought up to date, as the first model.
    again = load_cell(out / "model.yaml")
    later = update_cell(again, read(carried(true, ELSEWHERE), postures(known, 12, 55).q, 95, slip=4))
    assert later.moved == []
    write_readings(poses, known, read(carried(true, ELSEWHERE), postures(known, 12, 56).q, 96, slip=4))
    assert main(["check", str(out / "model.yaml"), str(poses)]) == 0
    assert main(["update", str(model), str(poses), "--as-read", "-o", str(out)]) == 2
    assert "--as-read is for one arm" in capsys.readouterr().err


def test_a_wrong_update_gets_one_sentence(tmp_path: Path) -> None:
    true, known = calibrated(tmp_path, 5, 60)
    new = read(true, postures(known, 8, 1).q, 1)
    with pytest.raises(InvalidInput, match="keeps no covariance of all its parameters"):
        update_cell(replace(known, record=None), new)
    length = {"distance@smr:tag": np.full((8, 1), 1.0)}
    with pytest.raises(InvalidInput, match="no reading of the kind length; expected position, orientation"):
        update_cell(known, replace(new, tables=new.tables | length))
