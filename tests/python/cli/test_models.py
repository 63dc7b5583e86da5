# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal predict`, `evaluate` and `convert`: what they write is what the library says, digit for digit."""

import csv
import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal as library


def columns(path) -> dict[str, np.ndarray]:
    """The columns of a CSV file, NaN where a cell is empty."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def test_predict_needs_only_q_and_conditions(demo, tmp_path, fastcal, rewritten) -> None:
    blind = rewritten(
        demo / "test.csv", tmp_path / "blind.csv", lambda rows: [row.__delitem__(slice(6, 9)) for row in rows]
    )
    assert "x_mm" not in blind.read_text()
    assert fastcal("predict", demo / "model.yaml", blind, "-o", tmp_path / "said.csv").code == 0
    said = columns(tmp_path / "said.csv")
    assert list(said) == [
        *("row", "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"),
        *("sigma_x_mm", "sigma_y_mm", "sigma_z_mm"),
    ]
    model = library.load_robot(demo / "model.yaml")
    data = library.load_measurements(blind, model, require_measured=False)
    T = model.forward(data.q, payload=data.payload)
    np.testing.assert_array_equal(said["row"], np.arange(len(data)))
    for i, name in enumerate(("x_mm", "y_mm", "z_mm")):
        np.testing.assert_array_equal(said[name], T[:, i, 3] * 1000)
    wxyz = np.column_stack([said[name] for name in ("qw", "qx", "qy", "qz")])
    np.testing.assert_allclose(Rotation.from_quat(wxyz, scalar_first=True).as_matrix(), T[:, :3, :3], atol=1e-14)
    deviation = np.column_stack([said[f"sigma_{axis}_mm"] for axis in "xyz"])
    np.testing.assert_array_equal(deviation, model.position_deviation(data.q, payload=data.payload) * 1000)


def test_predict_leaves_an_unknown_deviation_empty(demo, tmp_path, fastcal) -> None:
    assert fastcal("predict", demo / "robot.yaml", demo / "test.csv", "-o", tmp_path / "said.csv").code == 0
    said = columns(tmp_path / "said.csv")
    assert np.isnan([said[f"sigma_{axis}_mm"] for axis in "xyz"]).all()
    assert np.isfinite([said[name] for name in ("x_mm", "qw")]).all()


def test_evaluate_writes_the_test_block_of_the_result(demo, tmp_path, fastcal) -> None:
    said = fastcal("evaluate", demo / "model.yaml", demo / "test.csv", "-o", tmp_path / "block.json")
    assert said.code == 0
    block = json.loads((tmp_path / "block.json").read_text())
    test = json.loads((demo / "result.json").read_text())["test"]
    points = {name: test["kinds"]["position"][name] for name in ("unit", "count", "after")}
    assert block == {name: test[name] for name in ("count", "after_mm")} | {"kinds": {"position": points}}
    assert f"rms {test['after_mm']['rms']:.4f} mm" in said.out


def test_two_visits_of_a_pose_show_the_noise_and_no_rp(demo, tmp_path, fastcal, rewritten) -> None:
    """Each pose twice, the second visit 2 mm beside the first in x; two visits d apart: sigma^2 = (d^2 / 2) / 3."""

    def twice(rows: list[list[str]]) -> None:
        rows += [[*row[:6], repr(float(row[6]) + 2.0), *row[7:]] for row in rows[1:]]

    repeated = rewritten(demo / "test.csv", tmp_path / "twice.csv", twice)
    said = fastcal("evaluate", demo / "model.yaml", repeated, "-o", tmp_path / "block.json")
    block = json.loads((tmp_path / "block.json").read_text())["repeated_poses"]
    assert (block["poses"], block["visits"], block["rp_visits"], block["iso_9283"]) == (60, 120, 0, False)
    assert "repeatability_mm" not in block
    assert block["sigma_mm"] == pytest.approx(math.sqrt(2.0 / 3.0), abs=1e-9)
    assert "60 poses in 120 visits" in said.out
    assert "too few visits for RP" in said.out


@pytest.mark.parametrize("kind", ["dh", "mdh", "poe", "urdf"])
def test_a_calibrated_model_converts_to_every_kind(demo, tmp_path, fastcal, kind) -> None:
    new = tmp_path / "new.yaml"
    assert fastcal("convert", demo / "model.yaml", "--to", kind, "-o", new).code == 0
    old, converted = library.load_robot(demo / "model.yaml"), library.load_robot(new)
    assert converted.kinematics == kind
    q = library.random_poses(old, 100)
    np.testing.assert_allclose(converted.forward(q, payload=7.0), old.forward(q, payload=7.0), atol=1e-12)


def test_what_a_urdf_has_no_place_for_must_be_dropped_by_name(demo, tmp_path, fastcal) -> None:
    arguments = "convert", demo / "model.yaml", "--to", "urdf", "-o", tmp_path / "new.urdf"
    said = fastcal(*arguments)
    assert said.code == 2
    names = [f"{of['effect']}@{of['owner']}" for of in library.load_robot(demo / "model.yaml").spec["effects"]]
    assert names
    assert all(name in said.error for name in (*names, "--drop-effects"))
    assert list(tmp_path.iterdir()) == []
    said = fastcal(*arguments, "--drop-effects")
    assert said.code == 0
    assert all(name in said.err for name in names)
    bare = library.load_robot(demo / "model.yaml").spec | {"effects": []}
    q = library.random_poses(library.load_robot(demo / "robot.yaml"), 100)
    converted = library.load_robot(tmp_path / "new.urdf").forward(q)
    np.testing.assert_allclose(converted, library.Robot(bare).forward(q), atol=1e-12)


def test_the_version_is_that_of_the_package(fastcal) -> None:
    assert fastcal("--version").out == f"fastcal {library.__version__}\n"


@pytest.mark.parametrize("command", ["calibrate", "predict", "evaluate", "simulate", "convert", "demo"])
def test_every_command_explains_itself(fastcal, command) -> None:
    listed, own = fastcal("--help"), fastcal(command, "--help")
    assert listed.code == own.code == 0
    assert f"\n  {command} " in listed.out
    assert f"fastcal {command} [OPTIONS]" in own.out
