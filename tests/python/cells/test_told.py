# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a cell's file knows and the readings contradict is named with both numbers and left out; what holds is used."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Arm, Cell, Distance, Known
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.cli.app import main
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell
from fastcal.io.tree_readings_out import write_readings

from . import track_scene as track
from .test_calibrate import content, simulated, written
from .test_distances import BAR, cell_of
from .test_uses import disturbed, postures, two_arms

NOISE = 2e-5  # [m]
WITHIN = Known(sigma_mm=0.1)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> tuple[Cell, Readings]:
    """Two targets 98 mm apart on one arm, and points of both."""
    cell = cell_of(tmp_path_factory.mktemp("cell"))
    return cell, simulated(cell, np.random.default_rng(3), 40, {"smr": "point", "other": "point"})


def rms(found: CellResult) -> float:
    after = found.train["position"].statistics[1]
    assert after is not None
    return after.rms


@pytest.mark.parametrize("mm", [98.0, 98.02, 98.5, 245.0])
def test_a_known_distance_is_used_unless_the_readings_contradict_it(plain: tuple[Cell, Readings], mm: float) -> None:
    """245 for 98 mm got no word: its own error was taken for the noise of its kind."""
    cell, readings = plain
    told = Distance("smr", "other", mm, 0.01)
    found = calibrate_cell(replace(cell, distances=(told,)), readings)
    (length,) = found.known_distances
    assert length["used"] == (mm < 98.1)
    assert found.cell.distances == ((told,) if length["used"] else ())
    assert rms(found) < 1.05 * NOISE * np.sqrt(3)
    (note,) = found.notes or [""]
    if length["used"]:  # of both by their weights: 40 differences of points are known to 20 um sqrt(2 / 40) = 4.5 um
        weights = np.array([0.01, 4.5e-3]) ** -2.0
        assert length["found_mm"] == pytest.approx(weights @ [mm, 97.997] / weights.sum(), abs=2e-3)
        assert not note
    else:
        assert note.startswith(f"from smr to other the file knows {mm:.3f} mm (standard deviation 0.01), the readings")
        assert length["found_mm"] == pytest.approx(98, abs=0.015)
        assert "97.99" in note
    assert found.to_json_dict()["known_distances"] == [length]


def test_a_wrong_place_neither_bends_the_fit_nor_throws_out_readings(plain: tuple[Cell, Readings]) -> None:
    """A target known within 0.05 mm, 147 mm off, left 147 mm on all its rows without a word."""
    cell, readings = plain
    wrong = Known(sigma_mm=0.05)
    points = tuple(
        replace(of, known=wrong, place={**of.place, "xyz_mm": [187.0, 10.0, 120.0]}) if of.name == "smr" else of
        for of in cell.points
    )
    found = calibrate_cell(replace(cell, points=points), readings)
    assert rms(found) < 1.05 * NOISE * np.sqrt(3)
    (note,) = found.notes
    assert note.startswith("smr: the file knows the place 187.000 10.000 120.000 mm, the readings say ")
    assert found.cell.known("smr") == Known()


def test_one_wrong_length_of_several_is_named_and_the_others_stay(plain: tuple[Cell, Readings]) -> None:
    cell, readings = plain
    right, wrong = Distance("smr", "other", 98.0, 0.01), Distance("other", "smr", 97.0, 0.01)
    found = calibrate_cell(replace(cell, distances=(right, wrong)), readings)
    assert [of["used"] for of in found.known_distances] == [True, False]
    assert found.cell.distances == (right,)


def test_a_bar_between_two_arms(tmp_path: Path) -> None:
    """In all postures a bar of 300 mm; told 447 mm, all rows were left out of the fit, or none."""
    cell = two_arms(tmp_path)
    rng = np.random.default_rng(8)
    q = rng.uniform(-1.5, 1.5, (30, len(cell.joint_columns)))

    def gap(at: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(view_poses(cell, Readings(at, {}, ""), "tag:smr")[:, :3, 3], axis=1) - 0.3)

    for _ in range(30):  # damped steps of both arms to the ends of the bar
        slope = np.stack([(gap(q + 1e-6 * e) - gap(q - 1e-6 * e)) / 2e-6 for e in np.eye(12)], axis=1)
        step = slope * (gap(q) / np.maximum((slope**2).sum(axis=1), 1e-3))[:, np.newaxis]
        q -= step * np.minimum(1, 0.3 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-9))
    reached = np.abs(gap(q)) < 1e-9
    assert reached.sum() > 20
    readings = simulate_cell(cell, Readings(q[reached], {}, "bar"), noise=NOISE, seed=1)
    for mm, used in ((300.0, True), (447.0, False)):
        found = calibrate_cell(replace(cell, distances=(Distance("smr", "tag", mm, 0.01),)), readings)
        assert [of["used"] for of in found.known_distances] == [used]
        assert rms(found) < 1.2 * NOISE * np.sqrt(3)
        assert found.outliers == []


def test_a_camera_at_a_wrong_place_is_named(tmp_path: Path) -> None:
    track.Scene(3).write(tmp_path, 30)
    content = track.cell()
    content["cameras"]["wrist"] |= {"xyz_mm": [147.0, -70.0, 50.0], "rpy_deg": [0.0, 0.0, 0.0], "sigma_mm": 0.1}
    (tmp_path / "cell.yaml").write_text(json.dumps(content), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    found = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv"))
    assert any(note.startswith("wrist: the file knows the place 147.000 -70.000 50.000 mm") for note in found.notes)
    after = found.train["corner"].statistics[1]
    assert after is not None
    assert after.rms < 0.2


def test_what_is_known_and_true_is_hardly_ever_left_out(tmp_path: Path) -> None:
    """Places within their sigmas, drawn anew: chance leaves one out in a million."""
    cell = two_arms(tmp_path)
    for seed in range(12 if os.environ.get("FASTCAL_TEST_FULL") else 2):
        rng = np.random.default_rng(100 + seed)
        true = disturbed(cell, seed)
        q = rng.uniform(-1.5, 1.5, (30, len(cell.joint_columns)))
        readings = simulate_cell(true, Readings(q, {}, "drawn"), noise=NOISE, seed=seed)
        off = {of.name: rng.normal(0, 0.1, 3) for of in true.points}
        points = tuple(
            replace(of, place={**of.place, "xyz_mm": (of.place["xyz_mm"] + off[of.name]).tolist()}, known=WITHIN)
            for of in true.points
        )
        told = replace(cell, points=points)
        assert calibrate_cell(told, readings).notes == []


def test_the_command_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = cell_of(tmp_path, known_distances=[{**BAR, "mm": 245.0}])
    readings = simulated(cell, np.random.default_rng(3), 20, {"smr": "point", "other": "point"})
    write_readings(tmp_path / "poses.csv", cell, readings)
    files = [str(tmp_path / name) for name in ("cell.yaml", "poses.csv", "out")]
    assert main(["calibrate", *files[:2], "-o", files[2]]) == 0
    assert "from smr to other the file knows 245.000 mm (standard deviation 0.001), the readings say 9" in (
        capsys.readouterr().err
    )
    result = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    assert result["known_distances"][0]["used"] is False
    assert "known_distances" not in (tmp_path / "out/model.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(("mm", "named"), [(0.0, False), (3.0, True)])
def test_a_fixed_base_that_is_wrong_is_named_and_left_out(tmp_path: Path, mm: float, named: bool) -> None:
    """A base that the file calls fixed, mm off, bent the arms on it without a word."""
    cell = two_arms(tmp_path)
    true = disturbed(cell, 4)
    readings = simulate_cell(true, postures(cell, 40, 104), noise=NOISE, seed=4)

    def standing(arm: Arm) -> Arm:
        base = dict(vars(next(of for of in true.arms if of.name == arm.name).robot.description.base))
        base["xyz_mm"] = [base["xyz_mm"][0] + mm * (arm.name == "right"), *base["xyz_mm"][1:]]
        return replace(arm, robot=arm.robot.with_(base=base), known=Known(fixed=True))

    found = calibrate_cell(replace(cell, arms=tuple(map(standing, cell.arms))), readings)
    assert [note.partition(":")[0] for note in found.notes if "the file knows the place" in note] == ["right"] * named
    assert [found.cell.known(name).fixed for name in ("left", "right")] == [True, not named]
    assert rms(found) < 1.1 * NOISE * np.sqrt(3)


def test_a_fixed_board_that_is_wrong_is_named(tmp_path: Path) -> None:
    scene = track.Scene(3)
    scene.write(tmp_path, 30)
    content = track.cell()
    at = scene.board[:3, 3] + [0.0, 4.0, 0.0]
    content["boards"]["plate"] |= {"xyz_mm": at.tolist(), "fixed": True}
    (tmp_path / "cell.yaml").write_text(json.dumps(content), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    found = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv"))
    assert any(note.startswith("plate: the file knows the place") for note in found.notes)
    assert "fixed" not in found.cell.boards["plate"]


def test_a_turn_that_is_told_wrong_is_named(tmp_path: Path) -> None:
    """It was told from where the closed form had put the member, which is right, and not from where the file has it."""
    arms = {"left": {"robot": "ur5", "fixed": True}, "right": {"robot": "ur10", "xyz_mm": [0, -900, 0], "fixed": True}}
    sensors = {"camera": {"on": "world", "xyz_mm": [1000.0, 0.0, 300.0], "rpy_deg": [0.0, 90.0, 0.0]}}
    cell = load_cell(written(tmp_path, content(arms=arms, sensors=sensors)))
    views = ["smr:camera", "tag:camera"]
    readings = simulate_cell(cell, postures(cell, 40, 1), views, noise=NOISE, noise_rotation=NOISE, seed=1)

    def told(turn_deg: float) -> list[str]:
        camera = next(of for of in cell.points if of.name == "camera")
        place = {**camera.place, "rpy_deg": [turn_deg, 90.0, 0.0]}
        camera = replace(camera, known=Known(sigma_deg=0.02), place=place)
        points = tuple(camera if of.name == "camera" else of for of in cell.points)
        found = calibrate_cell(replace(cell, points=points), readings)
        return [note for note in found.notes if "the file knows the place" in note]

    assert told(0.0) == []
    (note,) = told(0.5)
    assert note.startswith("camera: the file knows")
    assert "0.500 deg from it" in note
