# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sound files of cells, of their corners and readings, and of rows that come one at a time, and what reads them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml

import fastcal
from fastcal.errors import FastcalError
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.io.tree_readings import load_readings
from fastcal.live.rows import Header
from fastcal.robot.rig import board_corners

CAMERA = """cell: one
arms: {arm: {robot: ur5}}
cameras:
  wrist: {on: arm, xyz_mm: [0, -70, 50], rpy_deg: [-8, 0, 5], size_px: [1280, 1024], focal_px: [1400, 1402],
          centre_px: [640, 512], distortion: [-0.1, 0.05, 0.0001, -0.0002, 0], model: pinhole, intrinsics: identify}
boards:
  plate: {on: world, xyz_mm: [400, 0, 10], rpy_deg: [178, 0, 0], kind: checkerboard, columns: 4, rows: 3,
          square_mm: 20, sigma_mm: 5, sigma_deg: 2}
"""
ARMS = """cell: two
arms:
  left: {robot: ur5, on: world, xyz_mm: [0, 200, 100], rpy_deg: [-50, 0, 0]}
  right: {robot: ur5, on: left.base, xyz_mm: [0, -400, 0], rpy_deg: [100, 0, 0]}
sensors:
  camera: {on: world, xyz_mm: [100, 0, 900], rpy_deg: [0, 90, 0]}
targets:
  smr: {on: left, xyz_mm: [40, 10, 120]}
  tag: {on: right, xyz_mm: [0, 0, 30], rpy_deg: [0, 0, 45], sigma_mm: 1, sigma_deg: 1}
cameras:
  wrist: {on: left, size_px: [640, 480], focal_px: [600, 600], centre_px: [320, 240], fixed: true}
boards:
  plate: {on: right.link2, xyz_mm: [10, 0, 5], kind: circles, columns: 3, rows: 4, square_mm: 15}
calibrations:
  smr: {parameters: [joint2 a, tool x], covariance_root: [[1.0e-05], [0, 2.0e-05]], degrees_of_freedom: 90,
        sigma_mm: null, noise: {position: {value: 0.02, unit: mm}}}
"""
HEADER = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,sigma_mm,payload_kg"
POSTURES = np.random.default_rng(3).uniform(-90, 90, (8, 12)).round(3)  # [deg], of two arms


def readers(folder: Path) -> dict[str, tuple[str, bytes, Callable[[Path], object]]]:
    """A sound file a reader: its ending, its content, what reads it; what it needs beside it is in `folder`."""
    poses = table([f"q{i}_deg" for i in range(1, 7)], POSTURES[:, :6])
    spots = [(r, c) for r in range(len(POSTURES)) for c in range(6)]
    corners = "row,camera,board,corner,u_px,v_px,sigma_px\n"
    corners += "".join(f"{r},wrist,plate,{c},{600 + 20 * c + r},{500 + 10 * c},0.1\n" for r, c in spots)
    joints = [f"{arm}.q{i}_deg" for arm in ("left", "right") for i in range(1, 7)]
    measured = np.column_stack([POSTURES, POSTURES[:, :3] * 10, POSTURES[:, 3:6] * 10, np.tile([1, 0, 0, 0], (8, 1))])
    views = [f"{axis}_mm@smr" for axis in "xyz"]
    views += [*(f"{axis}_mm@tag:camera" for axis in "xyz"), *(f"q{axis}@tag:camera" for axis in "wxyz")]
    rows = "".join(",".join(map(str, row)) + ",0.05,2\n" for row in POSTURES[:, :9].tolist())
    for name, content in (("poses.csv", poses), ("camera.yaml", CAMERA), ("corners.csv", corners), ("two.yaml", ARMS)):
        (folder / name).write_text(content)
    return {
        "cell with a camera": (".yaml", CAMERA.encode(), read_camera),
        "corners": (".csv", corners.encode(), read_corners),
        "cell of two arms": (".yaml", ARMS.encode(), read_arms),
        "readings of a cell": (".csv", table([*joints, *views], measured).encode(), read_readings),
        "rows that come": (".csv", f"{HEADER}\n{rows}".encode(), read_rows),
    }


def table(names: list[str], rows: np.typing.NDArray[np.float64]) -> str:
    """As CSV."""
    return "\n".join([",".join(names), *(",".join(map(str, row)) for row in rows.tolist())]) + "\n"


def finite(*values: object) -> None:
    """Refuses infinite numbers; NaN, or None for a whole table, stands for what was not measured."""
    for value in values:
        if value is not None and np.isinf(np.asarray(value, dtype=float)).any():
            raise AssertionError("an infinite number was read")


def read_camera(path: Path) -> None:
    """The cell, what it predicts, its corners, and what would be written of it."""
    robot = load_robot(path)
    finite(robot.forward(np.full((1, 6), 0.3)))
    finite(load_seen([path.with_name("poses.csv")], robot, path.with_name("corners.csv")).q)
    text = yaml.safe_dump(robot.spec)
    if ".inf" in text or ".nan" in text:
        raise AssertionError("a number that is none was written")


def read_corners(path: Path) -> None:
    """Corners of the pictures of a sound cell."""
    seen = load_seen([path.with_name("poses.csv")], load_robot(path.with_name("camera.yaml")), path)
    finite(seen.q, seen.observed["corner"])


def read_arms(path: Path) -> None:
    """The cell and where all of its parameters stand."""
    cell = load_cell(path)
    finite(cell.core.nominal, *map(board_corners, cell.boards.values()))
    _ = cell.rig  # stands in the tree
    text = cell_text(cell)
    if ".inf" in text or ".nan" in text:
        raise AssertionError("a number that is none was written")


def read_readings(path: Path) -> None:
    """Readings of a sound cell."""
    readings = load_readings(path, load_cell(path.with_name("two.yaml")))
    finite(readings.q, *readings.tables.values())


def read_rows(path: Path) -> None:
    """A header and rows of a connection; a row that is refused does not end it."""
    head, *lines = path.read_bytes().decode("utf-8", errors="replace").split("\n")
    header = Header(head, fastcal.load_robot("ur5"))
    refused: list[FastcalError] = []
    for line in filter(str.strip, lines):
        try:
            data = header.dataset([line])
            finite(data.q, data.position)
        except FastcalError as error:
            refused.append(error)
    if refused:
        raise refused[0]
