# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell of several arms is predicted, simulated, planned and compared, as one arm is."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.compare import compare_cells
from fastcal.cells.design import design_cell
from fastcal.cells.predict import predict_cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.cli import main
from fastcal.errors import InvalidInput
from fastcal.io.tree_file import load_cell, write_cell
from fastcal.io.tree_readings import load_readings
from fastcal.io.tree_readings_out import write_readings

from .test_calibrate import NOISE, content, written


def two_arms(folder: Path) -> Cell:
    """Two arms and a tracker, a target each."""
    arms = {name: entry for name, entry in content()["arms"].items() if name != "column"}
    for entry in arms.values():
        entry["on"] = "world"
    return load_cell(written(folder, content(arms=arms, sensors={})))


def postures(cell: Cell, count: int, seed: int) -> Readings:
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, (count, len(cell.joint_columns)))
    return Readings(q, {}, "postures")


def disturbed(cell: Cell, seed: int) -> Cell:
    """The cell with other geometry and places, by half a plausible size or so."""
    start = np.asarray(cell.core.nominal)
    size = np.array([p.sigma for p in cell.core.parameters])
    return cell.with_values(start + 0.5 * size * np.random.default_rng(seed).standard_normal(len(start)))


def test_readings_go_out_and_come_back_bit_for_bit(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    sent = postures(cell, 7, 1)
    read = simulate_cell(cell, sent, ["smr", "tag:camera"], noise=1e-4, noise_rotation=1e-4, seed=3)
    write_readings(tmp_path / "read.csv", cell, read)
    again = load_readings(tmp_path / "read.csv", cell)
    assert again.views == read.views == ["smr", "tag:camera"]
    assert np.abs(again.q - read.q).max() < 1e-15
    assert all(np.abs(again.tables[name] - table).max() < 1e-15 for name, table in read.tables.items())
    other = simulate_cell(cell, sent, ["smr", "tag:camera"], noise=1e-4, noise_rotation=1e-4, seed=3)
    assert all(np.array_equal(other.tables[name], table) for name, table in read.tables.items())


def test_noise_is_what_was_asked_for(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    sent = postures(cell, 400, 1)
    read = simulate_cell(cell, sent, ["tag:camera"], noise=1e-4, seed=3)
    left = read.tables["position@tag:camera"] - view_poses(cell, sent, "tag:camera")[:, :3, 3]
    assert 0.93e-4 < left.std() < 1.07e-4
    shaken = simulate_cell(cell, sent, ["smr"], repeatability=1e-4, seed=3)
    moved = shaken.tables["position@smr"] - view_poses(cell, sent, "smr")[:, :3, 3]
    assert 2e-5 < moved.std() < 5e-4
    assert np.array_equal(shaken.q, sent.q)


def test_a_prediction_covers_with_its_deviation(tmp_path: Path) -> None:
    cell = two_arms(tmp_path)
    inside = []
    for seed in range(4):
        true = disturbed(cell, seed)
        found = calibrate_cell(cell, simulate_cell(true, postures(cell, 60, 10 + seed), noise=NOISE, seed=seed))
        new = postures(cell, 40, 50 + seed)
        predicted = predict_cell(found.cell, new)
        for target in ("smr", "tag"):
            error = predicted[target].position - view_poses(true, new, target)[:, :3, 3]
            inside.append(np.abs(error) < 1.96 * predicted[target].sigma_position)
    assert 0.85 <= np.mean(inside) <= 1.0
    nominal = predict_cell(cell, postures(cell, 3, 1))
    assert np.isnan(nominal["smr"].sigma_position).all()


def test_chosen_postures_tell_more_than_random_ones(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    found = design_cell(cell, 40, ["smr", "tag"], candidate_count=600, seed=1)
    assert found.q.shape == (40, 13)
    assert found.observability["O1"] > 0
    assert np.array_equal(design_cell(cell, 40, ["smr", "tag"], candidate_count=600, seed=1).q, found.q)
    true, new = disturbed(cell, 2), anywhere(cell, 200, 9)

    def error(q: np.ndarray) -> float:
        """[m] RMS of what a calibration with these postures predicts of others."""
        read = simulate_cell(true, Readings(q, {}, "q"), ["smr", "tag"], noise=NOISE, seed=5)
        model = calibrate_cell(cell, read).cell
        poses = [[view_poses(cell, Readings(new, {}, ""), of) for of in ("smr", "tag")] for cell in (model, true)]
        left = np.subtract(*poses)[:, :, :3, 3]
        return float(np.sqrt(np.mean(np.square(left))))

    assert error(found.q) < 2 * found.sigma
    # What is chosen from as many as are wanted is a draw at random.
    drawn = [design_cell(cell, 40, ["smr", "tag"], candidate_count=40, seed=seed) for seed in range(3)]
    assert found.observability["O1"] > max(of.observability["O1"] for of in drawn)


def anywhere(cell: Cell, count: int, seed: int) -> np.ndarray:
    """Postures over the joints' whole ranges."""
    return np.random.default_rng(seed).uniform(-2 * np.pi, 2 * np.pi, (count, len(cell.joint_columns)))


def test_two_models_differ_where_a_joint_moved(tmp_path: Path) -> None:
    cell = two_arms(tmp_path)
    true = disturbed(cell, 1)
    moved = np.asarray(true.core.nominal).copy()
    k = next(i for i, p in enumerate(true.core.parameters) if (p.owner, p.name) == ("left.joint3", "theta"))
    moved[k] += 2e-3
    models = [
        calibrate_cell(cell, simulate_cell(of, postures(cell, 160, seed), noise=NOISE, seed=seed)).cell
        for of, seed in ((true, 3), (true.with_values(moved), 4))
    ]
    found = compare_cells(*models)
    by_name = {each.way.name: each for each in found.ways}
    surest = min(by_name["smr"].significant, key=lambda of: of.p_value or 0.0)
    assert (surest.owner, surest.name) == ("left.joint3", "theta_deg")
    assert surest.difference == pytest.approx(np.degrees(2e-3), abs=4 * (surest.std or 0.0))
    assert by_name["tag"].significant == []
    for model, name in zip(models, "ab", strict=True):
        write_cell(model, tmp_path / f"{name}.yaml")
    out = tmp_path / "compared"
    arguments = ["compare", str(tmp_path / "a.yaml"), str(tmp_path / "b.yaml"), "-o", str(out), "--page-language", "de"]
    assert main(arguments) == 0
    assert json.loads((out / "compare.json").read_text())["ways"]["smr"]["arms"] == ["left"]
    assert "Zahlen unterscheiden sich" in (out / "report.html").read_text()
    assert (out / "smr" / "report.html").is_file()


def test_the_commands_take_a_cell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, content())
    poses, read, predicted = (tmp_path / f"{name}.csv" for name in ("poses", "read", "predicted"))
    assert main(["design", str(path), "--count", "12", "--views", "smr,tag:camera", "-o", str(poses)]) == 0
    assert "12 postures of 4000, to read smr, tag:camera in each" in capsys.readouterr().out
    assert main(["simulate", str(path), str(poses), "--noise-mm", "0.05", "--views", "smr", "-o", str(read)]) == 0
    assert main(["predict", str(path), str(read), "-o", str(predicted)]) == 0
    with predicted.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert {"row", "x_mm@smr", "qw@tag", "sigma_x_mm@smr"} <= rows[0].keys()
    with read.open() as file:
        first = next(csv.DictReader(file))
    assert abs(float(first["x_mm@smr"]) - float(rows[0]["x_mm@smr"])) < 0.3
    capsys.readouterr()
    assert main(["design", str(path), "--count", "12", "--effects", "backlash", "-o", str(poses)]) == 2
    assert "--effects is for one arm" in capsys.readouterr().err
    assert main(["simulate", "ur5", str(poses), "--views", "smr", "-o", str(read)]) == 2
    assert "--views is for a cell of several arms" in capsys.readouterr().err
    assert main(["simulate", str(path), str(poses), "--views", "hand", "-o", str(read)]) == 2
    assert "'hand' is no target or sensor of the cell; there are camera, smr, tag" in capsys.readouterr().err


def test_cells_that_have_nothing_in_common_are_not_compared(tmp_path: Path) -> None:
    cell = two_arms(tmp_path)
    other = Cell("other", cell.arms, ())
    with pytest.raises(InvalidInput, match="no target on an arm's flange in common"):
        compare_cells(cell, other)


@pytest.mark.parametrize("command", ["template", "train", "drop"])
def test_what_takes_one_arm_says_what_takes_several(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, poses = written(tmp_path, content()), tmp_path / "poses.csv"
    poses.write_text("q1_deg\n0\n")
    more = {
        "template": [],
        "train": [str(poses), "--network", "gp"],
        "drop": ["backlash"],
    }[command]
    assert main([command, str(path), *more, "-o", str(tmp_path / "out.csv")]) == 2
    said = capsys.readouterr().err
    assert (
        "expected one arm, got 3; calibrate, evaluate, diagnose, check, update, compare, predict, simulate, design"
        in said
    )
    assert said.count("\n") == 1
