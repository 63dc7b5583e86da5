# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pages of lengths, whole poses, two stations, cells, closed loops, loads, recorded paths and papers."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np

import fastcal
from fastcal.measurements.dataset import Dataset

from ..cells import camera_scene, track_scene
from .pages_of_fits import NOISE, WAVE, YIELDS, calibrated, case, diagnosed, entry, outlying, payloads, run, written


def lengths_of(folder: Path) -> None:
    """fit.csv and test.csv of a ball-bar about two balls on the floor, and no point."""
    nominal = fastcal.load_robot("ur5e")
    balls = {"north": np.array([0.9, 0.3, 0.1]), "south": np.array([-0.2, -0.9, 0.2])}
    for name, count in (("fit", 120), ("test", 40)):
        q = fastcal.random_poses(nominal, count, seed=count)
        at = fastcal.simulate(fastcal.perturbed(nominal, seed=4), q, noise=NOISE, seed=count).position
        which = np.array(["north", "south"])[np.arange(count) % 2]
        far = np.linalg.norm(at - np.array([balls[ball] for ball in which]), axis=1)
        data = Dataset.from_arrays(q, distance=far, anchor=which)
        fastcal.write_measurements(folder / f"{name}.csv", data, nominal.joint_types)


@case
def calibrate_lengths(folder: Path) -> Path:
    lengths_of(folder)
    return calibrated(folder)


@case
def diagnose_lengths(folder: Path) -> Path:
    lengths_of(folder)
    return diagnosed(folder)


@case
def calibrate_full_poses(folder: Path) -> Path:
    nominal = written(folder, rows=60)
    real = fastcal.perturbed(nominal, seed=1)
    for name in ("fit", "test"):
        q = fastcal.load_measurements(folder / f"{name}.csv", nominal).q
        data = fastcal.simulate(real, q, noise=NOISE, noise_rotation=1e-4, seed=len(name))
        fastcal.write_measurements(folder / f"{name}.csv", data, nominal.joint_types)
    return calibrated(folder)


@case
def calibrate_two_stations(folder: Path) -> Path:
    def stood_twice(data: Dataset) -> Dataset:
        assert data.position is not None
        second = np.arange(len(data)) % 2 == 1
        position = data.position + np.where(second[:, None], [0.4, -0.2, 0.05], 0.0)
        return replace(data, position=position, station=second.astype(np.int32), station_names=("door", "window"))

    written(folder, bent=stood_twice)
    return calibrated(folder)


@case
def calibrate_german(folder: Path) -> Path:
    written(folder, rows=60, bent=outlying)
    return calibrated(folder, "--page-language", "de", "--limit-mm", "0.1")


@case
def diagnose_german(folder: Path) -> Path:
    written(folder, YIELDS, WAVE, rows=120, payload=payloads)
    return diagnosed(folder, "--page-language", "de")


@case
def calibrate_seven_axes(folder: Path) -> Path:
    nominal = written(folder, arm="lbr_iiwa14", rows=80)
    run("calibrate", nominal.name, folder / "fit.csv", "--test", folder / "test.csv", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def calibrate_delta(folder: Path) -> Path:
    """Three arms that hold one platform: closed loops."""
    nominal = fastcal.load_robot("delta")
    q = fastcal.random_poses(nominal, 60, seed=3)
    data = fastcal.simulate(fastcal.perturbed(nominal, seed=3), q, noise=NOISE, seed=3)
    fastcal.write_measurements(folder / "fit.csv", data, nominal.joint_types)
    run("calibrate", "delta", folder / "fit.csv", "-o", folder / "out")
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


@case
def compliance_of_loads(folder: Path) -> Path:
    """The same postures without and with a load."""
    nominal = fastcal.load_robot("ur5e")
    real = fastcal.perturbed(
        nominal.with_(effects=[YIELDS, entry("joint_compliance", "joint3", compliance_rad_nm=9e-6)]), seed=1
    )
    q = np.repeat(fastcal.random_poses(nominal, 40, seed=5), 2, axis=0)
    data = fastcal.simulate(real, Dataset.from_arrays(q, payload=payloads(80)), noise=NOISE, seed=5)
    fastcal.write_measurements(folder / "fit.csv", data, nominal.joint_types)
    run("compliance", "ur5e", folder / "fit.csv", "--joints", "2,3", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def accept_path(folder: Path) -> Path:
    """A square that was driven three times and recorded."""
    corners = np.array([[400, -200, 300], [400, 200, 300], [700, 200, 300], [700, -200, 300], [400, -200, 300.0]])
    text = "x_mm,y_mm,z_mm,qw,qx,qy,qz\n" + "".join(f"{x},{y},{z},0,1,0,0\n" for x, y, z in corners)
    (folder / "corners.csv").write_text(text)
    random = np.random.default_rng(7)
    along = np.concatenate([np.linspace(a, b, 60, endpoint=False) for a, b in itertools.pairwise(corners)])
    files = []
    for k in range(3):
        wave = 0.08 * np.sin(np.linspace(0, 25, len(along)))[:, None] * [1, 1, 1]
        points = along + wave + 0.02 * random.standard_normal(along.shape)
        files.append(folder / f"run_{k}.csv")
        files[-1].write_text("x_mm,y_mm,z_mm\n" + "".join("{:.4f},{:.4f},{:.4f}\n".format(*row) for row in points))
    run("demo", "-o", folder / "demo")
    driven = ("--path", folder / "corners.csv")
    limits = ("--tolerance-mm", "0.2", "--limit", "rt_mm=0.1", "--limit", "co_mm=1", "--limit", "at_deg=0.1")
    run("accept", folder / "demo" / "model.yaml", *files, *driven, *limits, "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def paper_kr500(folder: Path) -> Path:
    run("paper", "kuka_kr500", "--arms", "1", "-o", folder / "out")
    return folder / "out" / "report.html"
