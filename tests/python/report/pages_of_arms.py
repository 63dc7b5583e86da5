# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pages of checks, histories, comparisons, acceptance tests, fleets, cameras and paths with every verdict."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.robot.robot import Robot

from .pages_of_fits import NOISE, case, entry, run


def year(folder: Path) -> tuple[Robot, Robot]:
    """A calibrated model and checks of a year, joint 3 moved by 0.02 deg in October; the arm before and after."""
    nominal = fastcal.load_robot("staubli_rx160l")
    arm = fastcal.perturbed(nominal, seed=1)
    data = fastcal.simulate(arm, fastcal.random_poses(nominal, 60, seed=2), noise=NOISE, seed=3)
    result = fastcal.calibrate(nominal, data, who={"serial": "RX-0042", "date": "2026-01-15"})
    result.save(folder / "model")
    poses = fastcal.check_poses(result.model, 8).q
    spec = fastcal.load_robot(arm.spec).spec
    spec["joints"][2]["theta_deg"] += 0.02
    moved = fastcal.load_robot(spec)
    for month in range(2, 13):
        real = arm if month < 10 else moved
        measured = fastcal.simulate(real, poses, noise=NOISE, seed=month)
        fastcal.write_measurements(folder / f"{month}.csv", measured, nominal.joint_types)
    return arm, moved


def checked(folder: Path, month: int, *options: str) -> Path:
    """The page of one month's check."""
    run("check", folder / "model" / "model.yaml", folder / f"{month}.csv", *options, "-o", folder / "check.html")
    return folder / "check.html"


@case
def check_holds(folder: Path) -> Path:
    year(folder)
    return checked(folder, 3, "--date", "2026-03-02", "--tolerance-mm", "0.3")


@case
def check_changed(folder: Path) -> Path:
    year(folder)
    return checked(folder, 10, "--date", "2026-10-02")


@case
def check_collision(folder: Path) -> Path:
    """Several links bent: changed, and no one cause explains it."""
    arm, _moved = year(folder)
    spec = fastcal.load_robot(arm.spec).spec
    for k, joint in enumerate(spec["joints"]):
        joint["theta_deg"] += (0.03, -0.02, 0.025, 0.04, -0.03, 0.02)[k]
        joint["a_mm"] = joint.get("a_mm", 0.0) + (0.3, -0.4, 0.2, 0.1, 0.2, 0.0)[k]
    poses = fastcal.load_measurements(folder / "3.csv", arm).q
    measured = fastcal.simulate(fastcal.load_robot(spec), poses, noise=NOISE, seed=30)
    fastcal.write_measurements(folder / "20.csv", measured, arm.joint_types)
    return checked(folder, 20)


@case
def check_cannot_tell(folder: Path) -> Path:
    arm, _moved = year(folder)
    data = fastcal.load_measurements(folder / "3.csv", arm)
    fastcal.write_measurements(folder / "21.csv", data.select([0, 1, 2]), arm.joint_types)
    return checked(folder, 21)


def history_of(folder: Path, last: int) -> Path:
    year(folder)
    (folder / "arms").mkdir()
    model = folder / "model" / "model.yaml"
    shutil.copy(model, folder / "arms" / "model.yaml")
    for month in range(2, last + 1):
        kept = folder / "arms" / f"2026-{month:02}.json"
        run("check", model, folder / f"{month}.csv", "--date", f"2026-{month:02}-02", "-o", kept)
    run("history", folder / "arms", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def history_calm(folder: Path) -> Path:
    return history_of(folder, 9)


@case
def history_alarm(folder: Path) -> Path:
    return history_of(folder, 12)


def write_hundred(folder: Path) -> None:
    """Six monthly checks each of a hundred arms, as `check` writes them; two changed in June."""
    folder.mkdir()
    for arm in range(100):
        for month in range(1, 7):
            bad = arm in (17, 60) and month == 6
            content = {
                "verdict": "changed" if bad else "holds",
                "sentence": "The arm has changed: joint 3 zero by +0.0200 +- 0.0006 deg." if bad else "",
                "rms_mm": 0.3 if bad else 0.05,
                "expected_rms_mm": 0.05,
                "p_value": 0.5,
                "misfit_p_value": 0.5,
                "robot": "ur10",
                "made_by": {"serial": f"A{arm:03d}", "date": f"2026-{month:02d}-03", "robot_sha256": "0" * 64},
                "tests": [],
                "causes": [],
            }
            (folder / f"{arm}-{month}.json").write_text(json.dumps(content))


@case
def history_hundred(folder: Path) -> Path:
    write_hundred(folder / "arms")
    run("history", folder / "arms", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def compare_same(folder: Path) -> Path:
    arm, _moved = year(folder)
    again = fastcal.simulate(arm, fastcal.random_poses(arm, 60, seed=9), noise=NOISE, seed=9)
    nominal = fastcal.load_robot("staubli_rx160l")
    fastcal.calibrate(nominal, again, who={"serial": "RX-0042", "date": "2026-06-15"}).save(folder / "again")
    run("compare", folder / "model" / "model.yaml", folder / "again" / "model.yaml", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def compare_differs(folder: Path) -> Path:
    _arm, moved = year(folder)
    model = fastcal.load_robot(folder / "model" / "model.yaml")
    again = fastcal.simulate(moved, fastcal.check_poses(model, 12).q, noise=NOISE, seed=20)
    fastcal.update(model, again).save(folder / "updated")
    run("compare", folder / "model" / "model.yaml", folder / "updated" / "model.yaml", "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def update_arm(folder: Path) -> Path:
    _arm, moved = year(folder)
    model = fastcal.load_robot(folder / "model" / "model.yaml")
    again = fastcal.simulate(moved, fastcal.check_poses(model, 12).q, noise=NOISE, seed=20)
    fastcal.write_measurements(folder / "again.csv", again, model.joint_types)
    run("update", folder / "model" / "model.yaml", folder / "again.csv", "-o", folder / "out")
    return folder / "out" / "report.html"


def accepted(folder: Path, tolerance: str, rp: str = "0.2") -> Path:
    run("demo", "-o", folder / "demo")
    model, plan, measured = folder / "demo" / "model.yaml", folder / "iso_plan.csv", folder / "iso.csv"
    written_to = ("--compensated", "--directions", "-o", folder / "iso.mod")
    run("accept", model, "--plan", "--language", "rapid", *written_to)
    noise = ("--noise-mm", "0.02", "--repeatability-deg", "0.0005", "--seed", "1")
    run("simulate", model, plan, *noise, "-o", measured)
    limits = ("--tolerance-mm", tolerance, "--limit", f"rp_mm={rp}")
    run("accept", model, measured, "--targets", plan, *limits, "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def accept_pass(folder: Path) -> Path:
    return accepted(folder, "0.3")


@case
def accept_cannot_tell(folder: Path) -> Path:
    return accepted(folder, "0.01")


@case
def accept_fail(folder: Path) -> Path:
    return accepted(folder, "0.3", rp="0.04")


def fleet_of(folder: Path, arms: int, *options: str, rows: int = 40) -> Path:
    """One arm in ten yields five times as much; the third file is of another robot."""
    nominal = fastcal.load_robot("ur5e")
    lines = ["robot,data,name"]
    for arm in range(1, arms + 1):
        yielding = entry("joint_compliance", "joint2", compliance_rad_nm=2e-5 if arm % 10 == 7 else 4e-6)
        real = fastcal.perturbed(nominal.with_(effects=[yielding]), seed=arm)
        data = fastcal.simulate(real, fastcal.random_poses(nominal, rows, seed=arm), noise=NOISE, seed=arm)
        if arm == 3:
            data = replace(data, position=np.roll(data.position, 1, axis=0))
        fastcal.write_measurements(folder / f"cell_{arm}.csv", data, nominal.joint_types)
        lines.append(f"ur5e,cell_{arm}.csv,cell_{arm}")
    (folder / "arms.csv").write_text("\n".join([*lines, ""]))
    run("fleet", folder / "arms.csv", *options, "-o", folder / "out")
    return folder / "out" / "report.html"


@case
def fleet_twenty(folder: Path) -> Path:
    return fleet_of(folder, 20, "--reports")


@case
def fleet_hundred(folder: Path) -> Path:
    return fleet_of(folder, 100)


@case
def fleet_diagnosed(folder: Path) -> Path:
    return fleet_of(folder, 6, "--diagnose", rows=60)


@case
def camera(folder: Path) -> Path:
    run("demo", "--camera", "-o", folder / "demo")
    return folder / "demo" / "report.html"


@case
def detect(folder: Path) -> Path:
    run("demo", "--camera", "-o", folder / "demo")
    return next((folder / "demo").glob("corners*.html"))


@case
def path_compensated(folder: Path) -> Path:
    run("demo", "-o", folder / "demo")
    model = fastcal.load_robot(folder / "demo" / "model.yaml")
    q = np.linspace([0.0, 0.2, 1.2, 0.1, 0.4, 0.2], [0.4, 0.4, 1.1, 0.2, 0.5, 0.4], 20)
    T = model.forward(q)
    turns = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    rows = np.hstack([1e3 * T[:, :3, 3], turns])
    text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
    (folder / "path.csv").write_text(f"x_mm,y_mm,z_mm,qw,qx,qy,qz\n{text}\n")
    driven = ("--path", "line", "--report", folder / "path.html", "-o", folder / "commands.csv")
    run("compensate", folder / "demo" / "model.yaml", folder / "path.csv", *driven)
    return folder / "path.html"
