# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cameras and boards of cells that are not where the joints say: in files, predictions, diagnoses."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.cells.carried_rig import seen_from
from fastcal.cells.cell import Cell
from fastcal.cells.errors import kind_errors
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import SensorWay, seen_ways
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse

from . import camera_scene as camera
from . import track_scene as track

FloatArray = NDArray[np.float64]
SAG = {
    "sag_mm": [[0.3, 0.0, 0.1], [0.0, 0.2, 0.0], [0.0, 0.1, -0.2]],
    "sag_deg": [[0.2, 0.0, 0.0], [0.0, -0.15, 0.1], [0.05, 0.0, 0.0]],
}
KNOCKED = {"at_row": 5, "before_mm": [2.0, -1.0, 0.5], "before_deg": [0.3, 0.0, -0.2]}


def sagging(cell: Cell, **more: Any) -> Cell:
    return replace(cell, cameras={"wrist": {**cell.cameras["wrist"], **SAG, **more}})


def exp(xi: FloatArray) -> FloatArray:
    """(4, 4) of a twist [v; w], by its series."""
    twist = np.zeros((4, 4))
    twist[:3, :3] = [[0, -xi[5], xi[4]], [xi[5], 0, -xi[3]], [-xi[4], xi[3], 0]]
    twist[:3, 3] = xi[:3]
    out = np.eye(4)
    for order in range(14, 0, -1):
        out = np.eye(4) + twist @ out / order
    return out


def drawn(cell: Cell, q: FloatArray, **given: Any) -> FloatArray:
    """(N, K, 2) where a cell draws the corners of its board [px]."""
    count = len(camera.corners())
    nothing = Readings(q, {"corner": np.zeros((len(q), 2 * count))}, "", **given)
    return kind_errors(cell, nothing)["corner"].numbers.reshape(len(q), count, 2)


@pytest.fixture
def scene(tmp_path: Path) -> tuple[Path, Cell, FloatArray]:
    """A camera on an arm on a track, and postures (8, n) in which it sees the board, in the order of the tree."""
    own = track.Scene(5)
    own.write(tmp_path, 8)
    cell = load_cell(tmp_path / "cell.yaml")
    cell = replace(cell, cameras={"wrist": {**cell.cameras["wrist"], **frame_spec(camera.WRIST)}})
    readings = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    return tmp_path, cell, readings.q


def test_a_file_with_what_moves_loads_back_bit_for_bit(scene: tuple[Path, Cell, FloatArray]) -> None:
    folder, cell, _ = scene
    moving = sagging(cell, knocked=KNOCKED, time_offset_s=0.01, readout_s=0.02)
    (folder / "model.yaml").write_text(cell_text(moving), encoding="utf-8")
    again = load_cell(folder / "model.yaml")
    assert again.cameras == moving.cameras
    (folder / "model.yaml").write_text(cell_text(again), encoding="utf-8")
    assert cell_text(load_cell(folder / "model.yaml")) == cell_text(again)


def test_a_mount_that_gives_stands_in_each_posture_where_gravity_bends_it(
    scene: tuple[Path, Cell, FloatArray],
) -> None:
    """T_F exp(S g) X, one posture after the other, g by the arm's own flange."""
    _, cell, q = scene
    S = np.vstack([np.array(SAG["sag_mm"]) / 1e3, np.radians(SAG["sag_deg"])])
    found = drawn(sagging(cell), q)
    for k, row in enumerate(q):
        flange = cell.frames_at(row[np.newaxis], cell.cameras["wrist"]["on"])[0]
        step = exp(S @ (flange[:3, :3].T @ [0.0, 0.0, -1.0]))
        there = pose(cell.cameras["wrist"])
        bent = replace(cell, cameras={"wrist": {**cell.cameras["wrist"], **frame_spec(step @ there)}})
        assert np.allclose(found[k], drawn(bent, row[np.newaxis])[0], atol=1e-7)
    assert np.abs(found - drawn(cell, q)).max() > 1.0


def test_a_knock_is_of_the_rows_before_it_and_of_those_alone(scene: tuple[Path, Cell, FloatArray]) -> None:
    _, cell, q = scene
    knocked = replace(cell, cameras={"wrist": {**cell.cameras["wrist"], "knocked": KNOCKED}})
    before, after = drawn(cell, q), drawn(knocked, q, row=np.arange(len(q)))
    assert np.array_equal(after[5:], before[5:])
    assert (np.abs(after[:5] - before[:5]).max(axis=(1, 2)) > 1.0).all()
    assert np.array_equal(drawn(knocked, q), before)  # of postures to come


def test_late_pictures_are_drawn_where_the_joints_were(scene: tuple[Path, Cell, FloatArray]) -> None:
    """With speeds, 10 ms late is where the joints are 10 ms later."""
    _, cell, q = scene
    speed = np.random.default_rng(1).uniform(-0.3, 0.3, q.shape)
    late = replace(cell, cameras={"wrist": {**cell.cameras["wrist"], "time_offset_s": 0.01}})
    moved = drawn(cell, q + 0.01 * speed)
    assert np.abs(drawn(late, q, speed=speed) - moved).max() < 0.02 * np.abs(moved - drawn(cell, q)).max()
    assert np.array_equal(drawn(late, q), drawn(cell, q))  # speeds are not known


def test_speeds_of_joints_are_read(scene: tuple[Path, Cell, FloatArray]) -> None:
    folder, cell, q = scene
    with (folder / "poses.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    titles = [*rows[0], "arm.qd2_deg_s", "track.qd1_mm_s"]
    with (folder / "moving.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *([*row, "3.5", "-20"] for row in rows[1:])])
    read = load_seen_readings(folder / "moving.csv", cell, folder / "corners.csv")
    assert read.speed is not None
    names = [titles[0] for titles in cell.joint_columns]
    assert np.allclose(np.degrees(read.speed[:, names.index("arm.q2")]), 3.5)
    assert np.allclose(read.speed[:, names.index("track.q1")], -0.02)
    assert np.isnan(read.speed[:, names.index("arm.q1")]).all()
    assert np.array_equal(read.q, q)
    assert not read.notes
    part = read.pick(np.array([2, 4]))
    assert part.speed is not None
    assert part.speed.shape == (2, len(names))


def test_a_member_seen_from_another_frame_is_the_same_member() -> None:
    entry = {"xyz_mm": [10.0, 20.0, 30.0], "rpy_deg": [5.0, -20.0, 40.0], **SAG, "knocked": KNOCKED}
    T = pose({"xyz_mm": [100.0, -50.0, 30.0], "rpy_deg": [10.0, 50.0, -70.0]})
    there = seen_from(entry, T)
    g = np.array([0.2, -0.5, 0.8])  # in the axes of F; in those of F_0 it is R g
    for key in ("sag", "knocked"):
        xi, xi_0 = (
            np.concatenate([np.array(of[f"sag_{u}"]) @ way for u in ("mm", "deg")])
            if key == "sag"
            else np.concatenate([of["knocked"][f"before_{u}"] for u in ("mm", "deg")])
            for of, way in ((entry, g), (there, T[:3, :3] @ g))
        )
        own, other = (exp(np.concatenate([x[:3] / 1e3, np.radians(x[3:])])) for x in (xi, xi_0))
        # F exp(xi) X = F_0 exp(xi_0) T X
        assert np.allclose(T @ own @ pose(entry), other @ pose(there), atol=1e-12)
    back = seen_from(there, inverse(T))
    for key in ("xyz_mm", "rpy_deg", "sag_mm", "sag_deg"):
        assert np.allclose(back[key], entry[key], atol=1e-9)
    assert np.allclose(back["knocked"]["before_mm"], KNOCKED["before_mm"], atol=1e-9)


def test_a_cell_file_of_several_arms_takes_a_mount_that_gives(scene: tuple[Path, Cell, FloatArray]) -> None:
    folder, _, _ = scene
    content = yaml.safe_load((folder / "cell.yaml").read_text(encoding="utf-8"))
    content["cameras"]["wrist"] |= SAG
    (folder / "sag.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    assert load_cell(folder / "sag.yaml").cameras["wrist"]["sag_deg"] == SAG["sag_deg"]


def test_a_way_to_a_camera_whose_mount_gives_draws_what_the_cell_draws(scene: tuple[Path, Cell, FloatArray]) -> None:
    """And what is found on the way is said on the cell's own frame."""
    _, cell, q = scene
    plate = {**cell.boards["plate"], "on": "world", "xyz_mm": [900.0, 0.0, -50.0]}
    cell = replace(sagging(cell, knocked=KNOCKED), boards={"plate": plate})
    count = len(camera.corners())
    readings = Readings(q, {"corner": np.zeros((len(q), 2 * count))}, "", row=np.arange(len(q)))
    (way,) = seen_ways(cell, readings)
    assert isinstance(way, SensorWay)
    names = [titles[0] for titles in cell.joint_columns]
    own = [names.index(f"{arm.name}.q{index + 1}") for arm, index in way.joints]
    data = replace(Dataset.from_arrays(np.ascontiguousarray(q[:, own])), row=np.arange(len(q)))
    data = way.measured(cell, data, readings)
    measured, model = measurements(data, way.robot), way.robot.error_model
    theta = np.append(np.asarray(model.start), np.zeros(len(measured.parameters)))
    r = np.asarray(_core.residuals(model, way.robot.samples(data), measured, theta))
    assert np.allclose(r.reshape(len(q), count, 2), drawn(cell, q, row=np.arange(len(q))), atol=1e-7)
    there = way.told_member("wrist", way.robot.description.cameras["wrist"])
    for key in ("xyz_mm", "rpy_deg", "sag_mm", "sag_deg"):
        assert np.allclose(there[key], cell.cameras["wrist"][key], atol=1e-9)
    assert np.allclose(there["knocked"]["before_mm"], KNOCKED["before_mm"], atol=1e-9)
