# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pages of cells: two arms on a column, a track and a turntable, cameras, loops; calibrated, diagnosed and checked."""

from __future__ import annotations

from pathlib import Path

from ..cells import camera_scene, track_scene
from ..cells.test_diagnose import cell_of, waved, write_poses
from .pages_of_fits import case, run


def two_arms(folder: Path, joint: str | None, rows: int = 60) -> None:
    """cell.yaml, poses.csv and test.csv of two arms on a column; one joint waves."""
    cell = cell_of(folder)
    write_poses(folder, cell, waved(cell, rows, joint))
    write_poses(folder, cell, waved(cell, 25, joint), "test.csv")


@case
def cell_of_two_arms(folder: Path) -> Path:
    two_arms(folder, None)
    run("calibrate", folder / "cell.yaml", folder / "poses.csv", "--test", folder / "test.csv", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def cell_updated(folder: Path) -> Path:
    cell_of_two_arms(folder)
    run("update", folder / "out" / "model.yaml", folder / "test.csv", "-o", folder / "new")
    return folder / "new" / "report.html"


@case
def cell_of_two_arms_checked(folder: Path) -> Path:
    """One arm's wrist turns otherwise than it did."""
    cell_of_two_arms(folder)
    cell = cell_of(folder)
    write_poses(folder, cell, waved(cell, 12, "left.q5"), "later.csv")
    run("check", folder / "out" / "model.yaml", folder / "later.csv", "-o", folder / "check.html")
    return folder / "check.html"


@case
def diagnose_two_arms(folder: Path) -> Path:
    two_arms(folder, "right.q2", rows=100)
    run("diagnose", folder / "cell.yaml", folder / "poses.csv", "--test", folder / "test.csv", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def diagnose_two_arms_nothing(folder: Path) -> Path:
    two_arms(folder, None, rows=100)
    run("diagnose", folder / "cell.yaml", folder / "poses.csv", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def diagnose_two_arms_german(folder: Path) -> Path:
    two_arms(folder, "column.q1", rows=100)
    options = ("--page-language", "de", "-o", folder / "out")
    run("diagnose", folder / "cell.yaml", folder / "poses.csv", *options)
    return folder / "out" / "report.html"


@case
def cell_of_a_track(folder: Path) -> Path:
    """An arm on a track whose camera looks at a board on a turntable."""
    scene = track_scene.Scene(8)
    scene.write(folder, 30)
    scene.write(folder, 12, prefix="test_")
    files = ("--corners", folder / "corners.csv", "--test-corners", folder / "test_corners.csv")
    run("calibrate", folder / "cell.yaml", folder / "poses.csv", "--test", folder / "test_poses.csv", *files,
        "-o", folder / "out")  # fmt: skip
    return folder / "out" / "report.html"


@case
def cell_checked(folder: Path) -> Path:
    camera_scene.write(folder, 30, seed=1)
    corners = ("--corners", folder / "corners.csv")
    run("calibrate", folder / "cell.yaml", folder / "poses.csv", *corners, "-o", folder / "model")
    later = folder / "later"
    later.mkdir()
    camera_scene.write(later, 10, seed=5, error_mm=1.0)
    run("check", folder / "model" / "model.yaml", later / "poses.csv", "--corners", later / "corners.csv",
        "-o", folder / "check.html")  # fmt: skip
    return folder / "check.html"


@case
def camera_diagnosed(folder: Path) -> Path:
    camera_scene.write(folder, 60, seed=1, error_mm=0.0, joint_noise_deg=0.01)
    corners = ("--corners", folder / "corners.csv")
    run("diagnose", folder / "cell.yaml", folder / "poses.csv", *corners, "-o", folder / "out")
    return folder / "out" / "report.html"
