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

pytest.importorskip("torch")

FEW = ("--rivals", "knn", "--folds", "2")


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
    for name, rows in (("data", q[:80]), ("test", q[80:])):
        fc.write_measurements(folder / f"{name}.csv", fc.simulate(true, rows, noise=1e-5, seed=1), arm.joint_types)
    return folder


def test_train_then_predict_and_evaluate(files: Path, tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    said = fastcal("train", files / "robot.yaml", files / "data.csv", *FEW, "-o", tmp_path / "out")
    assert said.code == 0
    assert said.out.splitlines()[-1] == str(tmp_path / "out" / "model.yaml")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "model.safetensors", "model.yaml", "training.json",
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


def test_a_row_far_out_is_warned_of(files: Path, tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    assert fastcal("train", files / "robot.yaml", files / "data.csv", *FEW, "-o", tmp_path).code == 0
    far = tmp_path / "far.csv"
    far.write_text(",".join(f"q{i}_deg" for i in range(1, 7)) + "\n150,0,0,0,0,0\n")
    said = fastcal("predict", tmp_path / "model.yaml", far, "-o", tmp_path / "p.csv")
    assert said.code == 0
    assert "1 of 1 rows lie outside the joints and loads that the correction was trained on" in said.err


def test_nothing_is_written_where_it_cannot_be_trained(
    files: Path, tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    out = tmp_path / "out"
    said = fastcal("train", files / "robot.yaml", files / "data.csv", "--rivals", "chance", "-o", out)
    assert said.code == 2
    assert said.error.startswith("expected rivals of gp, knn, boosting, joint-profiles")
    assert not out.exists()
    assert fastcal("train", files / "robot.yaml", files / "data.csv", "--network", "magic", "-o", out).code == 2
