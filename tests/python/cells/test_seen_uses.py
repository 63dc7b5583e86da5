# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What cameras and sensors of a cell of several arms see is predicted, planned and compared."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.compare import compare_cells
from fastcal.cells.design import design_cell
from fastcal.cells.predict import predict_cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.cells.view_points import view_points, with_rig_as_points
from fastcal.cli import main
from fastcal.errors import InvalidInput
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell, write_cell

from . import camera_scene as camera
from .test_calibrate import content, written
from .track_scene import COLUMNS, Scene, cell


def calibrated(folder: Path, scene: Scene, count: int = 30) -> Cell:
    """The cell of a scene, by pictures of its own."""
    folder.mkdir()
    scene.write(folder, count)
    nominal = load_cell(folder / "cell.yaml")
    return calibrate_cell(nominal, load_seen_readings(folder / "poses.csv", nominal, folder / "corners.csv")).cell


def about_there(folder: Path) -> Path:
    """The file of the track's cell, its camera and board where they are within a few mm."""
    Scene().write(folder, 1)
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell(cameras=camera.cell()["cameras"])))
    return folder / "cell.yaml"


@pytest.mark.parametrize(
    ("view", "at"), [("plate:wrist", (0.1, 0.05, 0.0)), ("wrist", (0, 0, 0)), ("plate", (0, 0, 0))]
)
def test_points_follow_what_they_are_said_to(tmp_path: Path, view: str, at: tuple[float, ...]) -> None:
    nominal = load_cell(about_there(tmp_path))
    sent = Readings(np.random.default_rng(1).uniform(-0.5, 0.5, (4, 8)), {}, "")
    own = list(nominal.model.parameters)
    points = view_points(nominal, sent, view, at)
    corners = np.zeros((1, 2 * len(camera.corners())))
    unknowns = Readings(sent.q[:1], {"corner": corners}, "").measured(nominal).parameters
    names = [f"{of.owner} {of.name}" for of in (*own, *unknowns)]
    for k in np.random.default_rng(2).choice(len(points.names), 12, replace=False):
        step = 1e-6 * (np.array(names) == points.names[k])
        ends = []
        for sign in (1, -1):
            moved = nominal.with_values(np.asarray(nominal.model.start) + sign * step[: len(own)])
            moved = moved.with_rig(unknowns, sign * step[len(own) :], np.full(len(unknowns), np.nan))
            ends.append(view_points(moved, sent, view, at).position)
        assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(points.J[:, :, k], abs=1e-5)


def test_boards_are_predicted_where_cameras_see_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = Scene(3)
    model = calibrated(tmp_path / "a", scene)
    q = scene.postures(5)
    true = []
    for row in q:
        slide = camera.pose((0, 0, 0), (90, 0, 0)) @ camera.pose((0, 0, row[0]), (0, 0, 0))
        eye = scene.track @ slide @ scene.arm @ camera.flange(row[1:7], scene.arm_mm) @ camera.WRIST
        table = scene.table @ camera.pose((0, 0, 150.0), (0, 0, row[7]))
        true.append((np.linalg.inv(eye) @ table @ scene.board)[:3, 3])
    names = [f"{titles[0]}_{'mm' if titles[0] == 'track.q1' else 'deg'}" for titles in model.joint_columns]
    sent = np.column_stack([q[:, 0] / 1000, np.radians(q[:, 1:])])[:, [COLUMNS.index(name) for name in names]]
    found = predict_cell(model, Readings(sent, {}, ""))["plate:wrist"]
    assert np.abs(1e3 * found.position - true).max() < 1e3 * 4 * found.sigma_position.max() < 1.0
    write_cell(model, tmp_path / "model.yaml")
    poses = tmp_path / "a" / "poses.csv"
    assert main(["predict", str(tmp_path / "model.yaml"), str(poses), "-o", str(tmp_path / "p.csv")]) == 0
    assert "plate:wrist: standard deviation of a coordinate at most 0." in capsys.readouterr().out
    with (tmp_path / "p.csv").open() as file:
        assert {"x_mm@plate:wrist", "qw@wrist", "sigma_z_mm@plate:wrist"} <= next(csv.DictReader(file)).keys()


def test_what_no_reading_looked_at_has_no_deviation(tmp_path: Path) -> None:
    """A sensor on an arm says nothing of where the world is: a target there is predicted, its deviation is not."""
    nominal = load_cell(written(tmp_path, content()))
    q = np.random.default_rng(1).uniform(-1.5, 1.5, (60, len(nominal.joint_columns)))
    read = simulate_cell(nominal, Readings(q, {}, ""), ["tag:camera"], noise=1e-4, noise_rotation=1e-4, seed=1)
    found = predict_cell(calibrate_cell(nominal, read).cell, Readings(q[:3], {}, ""))
    assert np.isfinite(found["tag:camera"].sigma_position).all()
    assert np.isnan(found["tag"].sigma_position).all()
    assert np.isfinite(found["tag"].position).all()


def test_pictures_are_planned_where_the_board_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nominal = load_cell(about_there(tmp_path))
    found = design_cell(nominal, 15, seed=1)
    assert found.views == ["plate:wrist"]
    T = view_poses(with_rig_as_points(nominal), Readings(found.q, {}, ""), "plate:wrist")
    for pose in T:
        uv = camera.drawn(1e-3 * camera.corners() @ pose[:3, :3].T + pose[:3, 3])
        assert (uv > 0).all()
        assert (uv < camera.SIZE).all()
    (place,) = found.cameras
    assert place.camera == "wrist"
    assert 0 < place.within < 1e-3
    assert np.array_equal(design_cell(nominal, 15, seed=1).q, found.q)
    some = design_cell(nominal, 15, seed=1, sigma_px=2.0).cameras[0]
    assert some.within > 2 * place.within
    plan = tmp_path / "plan.csv"
    assert main(["design", str(tmp_path / "cell.yaml"), "--count", "12", "-o", str(plan)]) == 0
    assert "then: camera wrist on arm.link6: known to" in capsys.readouterr().out
    with pytest.raises(InvalidInput, match="'plate:eye' is no picture of the cell; there are plate:wrist"):
        design_cell(nominal, 15, ["plate:eye"])
    with pytest.raises(InvalidInput, match=r"15 postures were asked for, and of .* only 0 show a board well"):
        design_cell(nominal, 15, focus=(0.005, 0.01))


def test_targets_and_pictures_are_planned_together(tmp_path: Path) -> None:
    about_there(tmp_path)
    targets = {"smr": {"on": "arm", "xyz_mm": [10, 20, 80]}}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell(cameras=camera.cell()["cameras"], targets=targets)))
    both = load_cell(tmp_path / "cell.yaml")
    found = design_cell(both, 20, candidate_count=300, seed=1)
    assert found.views == ["smr", "plate:wrist"]
    assert found.sigma is not None
    assert len(found.cameras) == 1
    assert design_cell(both, 20, ["smr"], candidate_count=300, seed=1).cameras == []


def test_a_camera_that_moved_is_found_between_two_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first, again = (calibrated(tmp_path / name, Scene(1)) for name in "ab")
    assert compare_cells(first, again).significant == []
    monkeypatch.setattr(camera, "WRIST", camera.WRIST @ camera.pose((3.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    second = calibrated(tmp_path / "c", Scene(1))
    found = compare_cells(first, second)
    assert found.ways == []
    assert found.seen is not None
    surest = found.significant[0]
    assert (surest.owner, surest.name) == ("camera wrist", "x_mm")
    assert surest.difference == pytest.approx(3.0, abs=4 * (surest.std or 0.0))
    assert found.seen.views["plate:wrist"].to_mm()["rms"] == pytest.approx(3.0, abs=0.3)
    for model, name in ((first, "first"), (second, "second")):
        write_cell(model, tmp_path / f"{name}.yaml")
    out = tmp_path / "compared"
    arguments = ["compare", str(tmp_path / "first.yaml"), str(tmp_path / "second.yaml"), "-o", str(out)]
    assert main([*arguments, "--page-language", "de"]) == 0
    assert "camera wrist x_mm: +3 +- 0.0" in capsys.readouterr().out
    assert json.loads((out / "compare.json").read_text())["seen"]["views"]["plate:wrist"]["rms"] > 2
    assert "Von Sensoren und Kameras gesehen" in (out / "report.html").read_text()


def test_cells_of_other_joints_are_not_compared(tmp_path: Path) -> None:
    one = load_cell(about_there(tmp_path))
    other = replace(one, arms=tuple(arm for arm in one.arms if arm.name != "table"), boards={})
    board = {**one.boards["plate"], "on": "world"}
    with pytest.raises(InvalidInput, match="expected two models of one cell"):
        compare_cells(one, replace(other, boards={"plate": board}))
