# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal train` and what the other commands make of its result."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal as fc
from fastcal.cli import main
from fastcal.measurements.rotations import quaternions

pytest.importorskip("torch")

FEW = ("--rivals", "knn", "--folds", "4")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A calibrated model, and measurements of an arm with a periodic error besides."""
    folder = tmp_path_factory.mktemp("train")
    arm = fc.load_robot("staubli_rx160l")
    wave = {"amplitude_rad": {"value": 5e-4}, "phase_rad": {"value": 0.3}}
    true = fc.Robot(
        arm.spec | {"effects": [{"effect": "gear_harmonic", "owner": "joint1", "order": 2, "parameters": wave}]}
    )
    q = np.random.default_rng(0).uniform(-1, 1, (120, 6))
    arm.save(folder / "robot.yaml")
    true.save(folder / "true.yaml")
    for name, rows in (("data", q[:80]), ("test", q[80:])):
        fc.write_measurements(folder / f"{name}.csv", fc.simulate(true, rows, noise=1e-5, seed=1), arm.joint_types)
    return folder


@pytest.fixture(scope="module")
def trained(files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model with its network; only to be read."""
    folder = tmp_path_factory.mktemp("trained")
    assert main(["train", str(files / "robot.yaml"), str(files / "data.csv"), *FEW, "-o", str(folder)]) == 0
    return folder / "model.yaml"


def test_train_then_predict_and_evaluate(files: Path, tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    said = fastcal("train", files / "robot.yaml", files / "data.csv", *FEW, "-o", tmp_path / "out")
    assert said.code == 0
    assert said.out.splitlines()[-1] == str(tmp_path / "out" / "model.yaml")
    (network,) = (path.name for path in (tmp_path / "out").glob("model-*.safetensors"))
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        network, "model.yaml", "training.json",
    ]  # fmt: skip
    told = json.loads((tmp_path / "out" / "training.json").read_text())
    assert told["used"] == "mlp"
    assert told["held_out_mm"]["mlp"]["mean"] < told["held_out_mm"]["knn"]["mean"]

    for name in ("robot", "out/model"):
        folder = files if name == "robot" else tmp_path
        out = tmp_path / f"{Path(name).name}.json"
        assert fastcal("evaluate", folder / f"{name}.yaml", files / "test.csv", "-o", out).code == 0
    before, after = (
        json.loads((tmp_path / f"{name}.json").read_text())["after_mm"]["mean"] for name in ("robot", "model")
    )
    assert after < 0.4 * before

    assert fastcal("predict", tmp_path / "out/model.yaml", files / "test.csv", "-o", tmp_path / "p.csv").code == 0
    with (tmp_path / "p.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40
    weight = [float(row["correction_weight"]) for row in rows]
    assert 0 <= min(weight) <= max(weight) <= 1
    assert all(0 < float(row["sigma_x_mm"]) < 1 for row in rows)


def test_a_row_far_out_is_warned_of(trained: Path, tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    far = tmp_path / "far.csv"
    far.write_text(",".join(f"q{i}_deg" for i in range(1, 7)) + "\n150,0,0,0,0,0\n")
    said = fastcal("predict", trained, far, "-o", tmp_path / "p.csv")
    assert said.code == 0
    assert "1 of 1 rows lie outside the joints and loads that the correction was trained on" in said.err


def test_the_network_is_compensated_as_far_as_its_guard_lets_it(
    files: Path, trained: Path, tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    """Commands make up for what the network says; two targets beyond joints 1 and 4 as trained are left as they are."""
    arm, model, true = (fc.load_robot(path) for path in (files / "robot.yaml", trained, files / "true.yaml"))
    q = np.random.default_rng(5).uniform(-0.8, 0.8, (22, 6))
    q[20, 0], q[21, 3] = 2.2, 2.5
    T = arm.forward(q)
    numbers = np.column_stack([T[:, :3, 3] * 1000, quaternions(T[:, :3, :3]), np.degrees(q)])
    header = ",".join(["x_mm,y_mm,z_mm,qw,qx,qy,qz", *(f"q{i}_deg" for i in range(1, 7))])
    np.savetxt(tmp_path / "targets.csv", numbers, delimiter=",", header=header, comments="", fmt="%.17g")
    said = fastcal("compensate", trained, tmp_path / "targets.csv", "--single", "-o", tmp_path / "out.csv")
    assert said.code == 0
    assert "22 targets: 22 reached" in said.out
    assert "2 of 22 rows lie outside the joints and loads that the correction was trained on" in said.err
    with (tmp_path / "out.csv").open() as file:
        rows = list(csv.DictReader(file))
    weight = np.array([float(row["correction_weight"]) for row in rows])
    assert (weight[:20].min(), weight[20], weight[21]) == (1.0, 0.0, 0.0)
    commanded = np.radians([[float(row[f"q{i}_deg"]) for i in range(1, 7)] for row in rows])
    assert np.abs(model.forward(commanded) - T).max() < 3e-9
    np.testing.assert_allclose(commanded[20:], q[20:], atol=1e-7)
    before, after = (np.linalg.norm((true.forward(at) - T)[:20, :3, 3], axis=1).mean() for at in (q, commanded))
    assert after < 0.2 * before


def test_a_program_beyond_what_was_trained_says_so(trained: Path, tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    program = "def job():\n  movej([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])\n  movej([2.2, 0.2, 0.3, 0.4, 0.5, 0.6])\nend\n"
    (tmp_path / "job.script").write_text(program)
    said = fastcal("compensate", trained, tmp_path / "job.script", "-o", tmp_path / "new.script")
    assert said.code == 0
    assert "1 of 2 rows lie outside the joints and loads that the correction was trained on" in said.err
    old, new = (path.read_text().splitlines() for path in (tmp_path / "job.script", tmp_path / "new.script"))
    moves = [[line for line in lines if "movej" in line] for lines in (old, new)]
    assert [a == b for a, b in zip(*moves, strict=True)][:1] == [False]


def test_nothing_is_written_where_it_cannot_be_trained(
    files: Path, tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    out = tmp_path / "out"
    said = fastcal("train", files / "robot.yaml", files / "data.csv", "--rivals", "chance", "-o", out)
    assert said.code == 2
    assert said.error.startswith("expected rivals of gp, knn, boosting, joint-profiles")
    assert not out.exists()
    assert fastcal("train", files / "robot.yaml", files / "data.csv", "--network", "magic", "-o", out).code == 2


def test_a_tracker_that_stood_elsewhere_is_no_error_to_learn(files: Path, tmp_path: Path, fastcal) -> None:
    """Of two files the second is of another place; calibrated on both, the model has a base for each."""
    arm, true = (fc.load_robot(files / f"{name}.yaml") for name in ("robot", "true"))
    moved = fc.Robot(true.spec | {"base": {"xyz_mm": [1500, 300, -200], "rpy_deg": [1, 2, 60]}})
    q = np.random.default_rng(3).uniform(-1, 1, (60, 6))
    fc.write_measurements(tmp_path / "later.csv", fc.simulate(moved, q, noise=1e-5, seed=4), arm.joint_types)
    both = (files / "data.csv", tmp_path / "later.csv")
    said = fastcal("train", files / "robot.yaml", *both, *FEW, "-o", tmp_path / "out")
    assert said.code == 2
    assert "the rows of station later fit the model with the tracker moved by" in said.error
    assert not (tmp_path / "out").exists()
    assert fastcal("calibrate", files / "robot.yaml", *both, "-o", tmp_path / "both").code == 0
    options = ("--network", "gp", "--rivals", "none", "--folds", "2")
    assert fastcal("train", tmp_path / "both" / "model.yaml", *both, *options, "-o", tmp_path / "out").code == 0
