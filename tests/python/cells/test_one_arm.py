# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""convert, compensate and accept take one arm of a cell, by the target that it carries."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from fastcal.cells.branches import possible_ways
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.simulate import simulate_cell
from fastcal.cells.update import update_cell
from fastcal.cli import main
from fastcal.io.robot_file import load_robot
from fastcal.io.tables import write_csv
from fastcal.io.tree_file import load_cell, write_cell
from fastcal.robot.robot import Robot

from .test_calibrate import NOISE
from .test_uses import disturbed, postures, two_arms

Q = np.array([[0.4, -1.1, 1.2, -0.5, 0.9, 0.3], [-0.3, -0.8, 0.9, 0.4, 1.1, -0.6]])


def arm_of(cell: Cell, target: str) -> Robot:
    return possible_ways(cell, [target])[0].robot


def run(*words: object) -> int:
    return main([*map(str, words)])


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cell, Cell]:
    """The folder of cell.yaml and model.yaml, and both."""
    folder = tmp_path_factory.mktemp("calibrated")
    cell = two_arms(folder)
    found = calibrate_cell(cell, simulate_cell(disturbed(cell, 3), postures(cell, 60, 4), noise=NOISE, seed=5))
    write_cell(found.cell, folder / "model.yaml")
    return folder, cell, load_cell(folder / "model.yaml")


def column(path: Path, name: str) -> np.ndarray:
    with path.open(encoding="utf-8", newline="") as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


def commands(path: Path) -> np.ndarray:
    return np.radians(np.column_stack([column(path, f"q{k + 1}_deg") for k in range(6)]))


def targets(folder: Path, arm: Robot) -> Path:
    """Where an arm is in the postures Q, as a table of points and turns."""
    from scipy.spatial.transform import Rotation

    T = arm.forward(Q)
    x, y, z, w = Rotation.from_matrix(T[:, :3, :3]).as_quat().T
    places = dict(zip(("x_mm", "y_mm", "z_mm"), 1e3 * T[:, :3, 3].T, strict=True))
    write_csv(folder / "targets.csv", {**places, "qw": w, "qx": x, "qy": y, "qz": z})
    return folder / "targets.csv"


@pytest.mark.parametrize("target", ["smr", "tag"])
def test_an_arm_is_commanded_to_where_its_target_is_to_go(
    tmp_path: Path, calibrated: tuple[Path, Cell, Cell], target: str
) -> None:
    folder, cell, model = calibrated
    wanted = targets(tmp_path, arm_of(model, target))
    for nominal in ([], ["--nominal", folder / "cell.yaml"]):
        out = tmp_path / "commands.csv"
        args = (folder / "model.yaml", wanted, "--name", target, *nominal, "-o", out, "-q")
        assert run("compensate", *args) == 0
        np.testing.assert_allclose(commands(out), Q, atol=1e-9)
    shifts = tmp_path / "shifts.csv"
    assert run("compensate", *args, "--corrections", shifts) == 0
    # What the controller, which knows the cell's file alone, would have missed by.
    assert column(shifts, "error_mm").min() > 0.05
    assert cell.record is None


def test_an_update_keeps_what_the_controllers_have(calibrated: tuple[Path, Cell, Cell]) -> None:
    _, cell, model = calibrated
    read = simulate_cell(disturbed(cell, 3), postures(cell, 20, 6), noise=NOISE, seed=7)
    again = update_cell(model, read).cell
    assert again.records["smr"]["nominal"] == model.records["smr"]["nominal"]
    assert model.records["smr"]["nominal"]["joints"][1]["a_mm"] == arm_of(cell, "smr").spec["joints"][1]["a_mm"]


def test_an_arm_is_written_as_a_robot_file(tmp_path: Path, calibrated: tuple[Path, Cell, Cell]) -> None:
    folder, _, model = calibrated
    assert run("convert", folder / "model.yaml", "--to", "poe", "--name", "tag", "-o", tmp_path / "tag.yaml") == 0
    written = load_robot(tmp_path / "tag.yaml")
    np.testing.assert_allclose(written.forward(Q), arm_of(model, "tag").forward(Q), atol=1e-9)


def test_an_arm_is_tested(tmp_path: Path, calibrated: tuple[Path, Cell, Cell]) -> None:
    folder, _, model = calibrated
    asked = ("--plan", "--language", "urscript", "--compensated", "--cycles", 2, "--edge-mm", 300, "--name", "smr")
    assert run("accept", folder / "model.yaml", *asked, "-o", tmp_path / "iso.script", "-q") == 0
    plan = tmp_path / "iso_plan.csv"
    goal = np.column_stack([column(plan, f"target_{axis}_mm") for axis in "xyz"])
    arm = arm_of(model, "smr").with_(base={"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]})
    assert np.abs(1e3 * arm.forward(commands(plan))[:, :3, 3] - goal).max() < 0.01


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("convert", "model.yaml", "--to", "urdf"),
            "expected --name with a target on the arm: smr, tag; none was given",
        ),
        (("convert", "model.yaml", "--to", "urdf", "--name", "left"), "smr, tag; got 'left'"),
        (("compensate", "model.yaml", "targets.csv", "--name", "x"), "smr, tag; got 'x'"),
        (("convert", "ur5", "--to", "urdf", "--name", "smr"), "--name chooses a target of a cell"),
        (("compensate", "old.yaml", "targets.csv", "--name", "smr"), "give --nominal with the cell file"),
        (("accept", "old.yaml", "--plan", "--compensated", "--name", "smr"), "compensate the program with --nominal"),
    ],
)
def test_what_is_no_arm_is_said(
    tmp_path: Path,
    calibrated: tuple[Path, Cell, Cell],
    words: Sequence[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, _, model = calibrated
    targets(tmp_path, arm_of(model, "smr"))
    for name in ("model.yaml", "old.yaml"):  # models of earlier releases do not keep the nominal geometry
        text = (folder / "model.yaml").read_text(encoding="utf-8")
        (tmp_path / name).write_text(text if name == "model.yaml" else text[: text.index("\ncalibrations:")] + "\n")
    given = [str(tmp_path / word) if word.endswith((".yaml", ".csv")) else word for word in words]
    asked = ["--language", "krl"] if words[0] == "accept" else []
    assert run(*given, *asked, "-o", tmp_path / "out.yaml") == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()
