# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot file with targets of its own is a cell of that arm, in whose files columns need no prefix."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.calibration.simulation import perturbed
from fastcal.cli.app import main
from fastcal.errors import ParseError
from fastcal.io.robot_file import load_robot
from fastcal.io.tree_file import is_cell

NOISE_MM = 0.02
POINTS_MM = {"n1": [120.0, 0.0, 90.0], "n2": [-60.0, 100.0, 90.0], "tool": [0.0, 0.0, 150.0]}
BASE = {"xyz_mm": [2500.0, -1900.0, 400.0], "rpy_deg": [1.0, -2.0, 128.0]}
JOINTS = [f"q{i}_deg" for i in range(1, 7)]


def column(part: str, name: str) -> str:
    """Of the target `tool`, without its name."""
    return f"{part}_mm" + ("" if name == "tool" else f"@{name}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An M-20iA with errors, far from where its file has it: two reflectors by their names, and one at the tool."""
    out = tmp_path_factory.mktemp("targets")
    nominal = load_robot("fanuc_m20ia")
    spec = {key: value for key, value in nominal.spec.items() if key not in ("base", "source")}
    named = {name: {"on": "arm"} for name in POINTS_MM if name != "tool"}
    spec |= {"tool": {"xyz_mm": [0.0, 0.0, 100.0]}, "targets": named}
    (out / "robot.yaml").write_text(yaml.safe_dump(spec))
    (out / "alone.yaml").write_text(yaml.safe_dump({key: value for key, value in spec.items() if key != "targets"}))
    random = np.random.default_rng(5)
    q = random.uniform(-70, 70, (90, 6))
    arm, columns = perturbed(nominal, seed=3), {}
    for name, xyz_mm in POINTS_MM.items():
        built = arm.with_(base=BASE, tool={"xyz_mm": xyz_mm})
        seen = 1e3 * np.asarray(built.forward(np.radians(q)))[:, :3, 3] + random.normal(0, NOISE_MM, (90, 3))
        columns |= {column(part, name): seen[:, k] for k, part in enumerate("xyz")}
    table = np.column_stack([q, *columns.values()])
    for name, rows in (("train", table[:60]), ("test", table[60:])):
        np.savetxt(out / f"{name}.csv", rows, "%.6f", ",", header=",".join([*JOINTS, *columns]), comments="")
    return out


@pytest.fixture(scope="module")
def one_target(folder: Path) -> Path:
    rows = np.loadtxt(folder / "train.csv", delimiter=",", skiprows=1)[:, :9]
    header = ",".join([*JOINTS, *(column(part, "n1") for part in "xyz")])
    np.savetxt(folder / "one.csv", rows, "%.6f", ",", header=header, comments="")
    return folder / "one.csv"


def test_it_is_calibrated_wherever_it_stands(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A fit from where the file has it ended 1.5 m off, and the arm stayed as it was."""
    assert is_cell(folder / "robot.yaml")
    files = [str(folder / name) for name in ("robot.yaml", "train.csv")]
    assert main(["calibrate", *files, "--test", str(folder / "test.csv"), "-o", str(folder / "out")]) == 0
    result = json.loads((folder / "out" / "result.json").read_text())
    assert result["status"] == "converged"
    for view in POINTS_MM:
        of_test = result["test"]["views"][f"position@{view}"]
        assert of_test["after"]["rms"] < 2 * NOISE_MM * np.sqrt(3), of_test
    places = {of["name"]: of for of in result["placements"]}
    assert places["n2"]["xyz_mm"] == pytest.approx(POINTS_MM["n2"], abs=5.0)
    assert main(["evaluate", str(folder / "out" / "model.yaml"), str(folder / "test.csv")]) == 0
    capsys.readouterr()


def test_its_diagnosis_finds_nothing_missing(
    folder: Path, one_target: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diagnose", str(folder / "robot.yaml"), str(one_target), "-o", str(folder / "diagnosis")]) == 0
    found = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())
    assert (found["verdict"], found["effects"]) == ("none", [])
    capsys.readouterr()


def test_a_file_without_the_targets_is_told_where_they_stand(
    folder: Path, one_target: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", str(folder / "alone.yaml"), str(one_target), "-o", str(folder / "none")]) == 2
    assert "`targets: {n1: {on: arm}}`" in capsys.readouterr().err
    assert not (folder / "none").exists()


def test_a_target_that_stands_on_nothing_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = yaml.safe_load((folder / "robot.yaml").read_text())
    spec["targets"]["n1"] = {"on": "table"}
    (folder / "wrong.yaml").write_text(yaml.safe_dump(spec))
    assert main(["calibrate", str(folder / "wrong.yaml"), str(folder / "train.csv"), "-o", str(folder / "none")]) == 2
    assert "table" in capsys.readouterr().err


def test_what_the_pendant_shows_is_read_in_cells_too(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """FANUC's J3 is q3 - q2; as q3 it is refused, whatever column says where the points are of."""
    rows = np.loadtxt(folder / "train.csv", delimiter=",", skiprows=1)
    rows[:, 2] -= rows[:, 1]
    titles = (folder / "train.csv").read_text().splitlines()[0]
    codes = {}
    for letter in "qj":
        header = titles.replace("q", letter)
        np.savetxt(tmp_path / f"{letter}.csv", rows, "%.9f", ",", header=header, comments="")
        files = [str(folder / "robot.yaml"), str(tmp_path / f"{letter}.csv")]
        codes[letter] = main(["calibrate", *files, "-o", str(tmp_path / letter)])
    assert codes == {"q": 2, "j": 0}
    assert "with q3 + q2 for joint 3" in capsys.readouterr().err
    result = json.loads((tmp_path / "j" / "result.json").read_text())
    assert result["kinds"]["position"]["after"]["rms"] < 2 * NOISE_MM * np.sqrt(3)


def test_an_import_takes_the_arm_of_such_a_file(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = np.loadtxt(folder / "train.csv", delimiter=",", skiprows=1)[:, :9]
    np.savetxt(tmp_path / "bare.csv", table, "%.6f", ",")
    names = [*JOINTS, *(column(part, "n1") for part in "xyz")]
    (tmp_path / "map.yaml").write_text(yaml.safe_dump({"columns": {name: k for k, name in enumerate(names, 1)}}))
    files = ["import", str(tmp_path / "bare.csv"), "--map", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "out.csv")]
    assert main([*files, "--robot", str(folder / "robot.yaml")]) == 0
    assert (tmp_path / "out.csv").read_text().splitlines()[0] == ",".join(names)
    capsys.readouterr()


def test_an_axis_without_a_column_is_named(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (folder / "train.csv").read_text().replace("q", "j").replace("j4_deg", "note")
    (tmp_path / "j.csv").write_text(text)
    assert main(["calibrate", str(folder / "robot.yaml"), str(tmp_path / "j.csv"), "-o", str(tmp_path / "no")]) == 2
    assert "there is no column of arm.j4; expected arm.j4_deg" in capsys.readouterr().err


def test_what_takes_no_cell_says_so(folder: Path) -> None:
    with pytest.raises(ParseError, match=r"targets: makes the file a cell, which calibrate, .* take"):
        load_robot(folder / "robot.yaml")


def test_known_distances_of_sockets_make_a_robot_file_no_cell(folder: Path, tmp_path: Path) -> None:
    spec = yaml.safe_load((folder / "alone.yaml").read_text())
    spec["known_distances"] = [{"from": "socket a", "to": "socket b", "mm": 100.0, "sigma_mm": 0.1}]
    (tmp_path / "sockets.yaml").write_text(yaml.safe_dump(spec))
    assert not is_cell(tmp_path / "sockets.yaml")
    assert load_robot(tmp_path / "sockets.yaml").joint_count == 6
