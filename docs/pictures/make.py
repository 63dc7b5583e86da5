# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Takes the pictures of the documentation from reports that fastcal writes, in headless Chromium.

python docs/pictures/make.py            needs chromium and Pillow
python docs/pictures/make.py --studio   those of the studio alone, as its tests see it
python docs/pictures/make.py --pages    those of reports alone
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

import fastcal
from fastcal.cli import main as command

HERE = Path(__file__).parent
WIDTH = 1100
CELL = """cell: two_arms
arms:
  column: {robot: column.yaml, xyz_mm: [0, 0, 0]}
  left: {robot: left.yaml, on: column, xyz_mm: [0, 200, 100], rpy_deg: [-50, 0, 0]}
  right: {robot: right.yaml, on: column, xyz_mm: [0, -200, 100], rpy_deg: [50, 0, 0]}
targets:
  smr_left: {on: left, xyz_mm: [40, 10, 120]}
  smr_right: {on: right, xyz_mm: [-30, 20, 100]}
"""


def photograph(page: Path, name: str, height: int, top: int = 0) -> None:
    """`height` pixels of a page from `top` on, as docs/pictures/NAME.png."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("chromium is missing")
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        size = f"--window-size={WIDTH},{top + height}"
        flags = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=8000", size]
        arguments = [chromium, *flags, f"--screenshot={shot}", page.as_uri()]
        for left in (2, 1, 0):  # on a busy machine Chromium sometimes never ends
            try:
                subprocess.run(arguments, check=True, capture_output=True, timeout=60)  # noqa: S603 - our own page
                break
            except subprocess.TimeoutExpired:
                if left == 0:
                    raise
        keep(Image.open(shot).convert("RGB").crop((0, top, WIDTH, top + height)), name)


def keep(picture: Image.Image, name: str) -> None:
    """Writes docs/pictures/NAME.png in 256 colours: a chart loses nothing by it, and the repository stays small."""
    framed = ImageOps.expand(picture.quantize(256).convert("RGB"), 1, "#d0d0d0")
    framed.quantize(256).save(HERE / f"{name}.png", optimize=True)


def studio() -> None:
    """The screens of the studio, taken by the tests that drive them."""
    with tempfile.TemporaryDirectory() as folder:
        tests = HERE.parents[1] / "tests" / "python" / "studio"
        environment = {**os.environ, "FASTCAL_STUDIO_SHOTS": folder}
        driving = [str(tests / name) for name in ("test_screens.py", "test_more_screens.py")]
        command = [sys.executable, "-m", "pytest", "-q", *driving]
        subprocess.run(command, check=True, env=environment)  # noqa: S603 - our own tests
        for shot in sorted(Path(folder).glob("*.png")):
            picture = Image.open(shot).convert("RGB")
            picture.thumbnail((WIDTH, 4 * WIDTH))
            keep(picture.crop((0, 0, picture.width, min(picture.height, 1250))), shot.stem)


def flawed_arm() -> tuple[fastcal.Robot, fastcal.Dataset, fastcal.Dataset]:
    """The arm of docs/tutorials/what-is-missing.md, its measurements and its test poses."""
    nominal = fastcal.load_robot("ur10e")
    built = fastcal.perturbed(nominal, seed=3)
    wave = {"amplitude_rad": 0.0004, "phase_rad": 0.7}
    built.spec["effects"].append({"effect": "gear_harmonic", "owner": "joint2", "order": 2, "parameters": wave})
    flawed = fastcal.load_robot(built.spec)
    poses = fastcal.random_poses(flawed, 160, seed=5)
    data = fastcal.simulate(flawed, poses[:120], noise=0.05e-3, seed=6)
    return nominal, data, fastcal.simulate(flawed, poses[120:], noise=0.05e-3, seed=7)


def run(*arguments: str | Path, expected: int = 0) -> None:
    """A fastcal command that must end with this exit code."""
    if (code := command([str(argument) for argument in (*arguments, "--quiet")])) != expected:
        raise SystemExit(f"fastcal {arguments[0]} ended with {code}")


def months_after(folder: Path) -> None:
    """A year of monthly checks, joint 3 moved by 0.02 deg in October: that check, the history, old against new."""
    nominal = fastcal.load_robot("staubli_rx160l")
    arm = fastcal.perturbed(nominal, seed=1)
    data = fastcal.simulate(arm, fastcal.random_poses(nominal, 60, seed=2), noise=3e-5, seed=3)
    result = fastcal.calibrate(nominal, data, who={"serial": "RX-0042", "date": "2026-01-15"})
    result.save(folder / "results")
    poses = fastcal.check_poses(result.model, 8).q
    moved = fastcal.load_robot(arm.spec)
    moved.spec["joints"][2]["theta_deg"] += 0.02
    moved = fastcal.load_robot(moved.spec)
    (folder / "arms").mkdir()
    for month in range(2, 13):
        real = arm if month < 10 else moved
        measured = folder / f"{month}.csv"
        fastcal.write_measurements(measured, fastcal.simulate(real, poses, noise=3e-5, seed=month), nominal.joint_types)
        arguments = ("check", folder / "results" / "model.yaml", measured, "--date", f"2026-{month:02}-02")
        expected = 0 if month < 10 else 4
        run(*arguments, "-o", folder / "arms" / f"2026-{month:02}.json", expected=expected)
        if month == 10:
            run(*arguments, "-o", folder / "check.html", expected=expected)
    photograph(folder / "check.html", "check", 1250)
    run("history", folder / "arms", "-o", folder / "history", expected=4)
    photograph(folder / "history" / "report.html", "history", 1250)
    again = fastcal.simulate(moved, fastcal.check_poses(result.model, 12).q, noise=3e-5, seed=20)
    fastcal.update(result.model, again).save(folder / "updated")
    run("compare", folder / "results" / "model.yaml", folder / "updated" / "model.yaml", "-o", folder / "comparison")
    photograph(folder / "comparison" / "report.html", "comparison", 1250)


def acceptance(folder: Path) -> None:
    """The acceptance test of docs/acceptance.md, without its budget."""
    model = folder / "demo" / "model.yaml"
    program, plan, measured = folder / "iso.mod", folder / "iso_plan.csv", folder / "iso.csv"
    run("accept", model, "--plan", "--language", "rapid", "--compensated", "--directions", "-o", program)
    noise = ("--noise-mm", "0.02", "--repeatability-deg", "0.0005", "--seed", "1")
    run("simulate", model, plan, *noise, "-o", measured)
    limits = ("--tolerance-mm", "0.3", "--limit", "rp_mm=0.2")
    run("accept", model, measured, "--targets", plan, *limits, "-o", folder / "acceptance")
    photograph(folder / "acceptance" / "report.html", "acceptance", 1250)


def cell(folder: Path) -> None:
    """Two arms on a column that turns, each with a reflector; no two are built as their files say."""
    (folder / "true").mkdir(parents=True)
    column = (
        "name: column\nkinematics: dh\njoints: [{type: revolute, theta_deg: 0, d_mm: 600, a_mm: 0, alpha_deg: 0}]\n"
    )
    members = {"column": "column.yaml", "left": "left.yaml", "right": "right.yaml"}
    for place in (folder, folder / "true"):
        (place / "column.yaml").write_text(column)
        (place / "cell.yaml").write_text(CELL)
        for name, arm, seed in (("left", "ur5e", 1), ("right", "ur10e", 2)):
            robot = fastcal.load_robot(arm)
            (robot if place == folder else fastcal.perturbed(robot, seed=seed)).save(place / members[name])
    random = np.random.default_rng(4)
    reach = np.array([60, *[100, 40, 60, 90, 90, 170] * 2])
    middle = np.array([0, *[0, -80, 90, -60, -90, 0] * 2])
    q = middle + reach * random.uniform(-1, 1, (80, 13))
    titles = ["column.q1_deg", *(f"{arm}.q{k}_deg" for arm in ("left", "right") for k in range(1, 7))]
    rows = [",".join(f"{value:.4f}" for value in row) for row in q]
    (folder / "poses.csv").write_text("\n".join([",".join(titles), *rows, ""]))
    measured = folder / "measured.csv"
    run(
        "simulate",
        folder / "true" / "cell.yaml",
        folder / "poses.csv",
        "--noise-mm",
        "0.03",
        "--seed",
        "1",
        "-o",
        measured,
    )
    run("calibrate", folder / "cell.yaml", measured, "-o", folder / "out")
    photograph(folder / "out" / "report.html", "cell", 1450)


def fleet(folder: Path) -> None:
    """Twenty arms, one of which stands out: its reducer of joint 2 yields five times as much."""
    nominal = fastcal.load_robot("ur5e")
    lines = ["robot,data,name"]
    for arm in range(1, 21):
        compliance = 2e-5 if arm == 7 else 4e-6
        entry = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": compliance}}
        real = fastcal.perturbed(nominal.with_(effects=[entry]), seed=arm)
        data = fastcal.simulate(real, fastcal.random_poses(nominal, 40, seed=arm), noise=3e-5, seed=arm)
        fastcal.write_measurements(folder / f"cell_{arm}.csv", data, nominal.joint_types)
        lines.append(f"ur5e,cell_{arm}.csv,cell_{arm}")
    (folder / "arms.csv").write_text("\n".join([*lines, ""]))
    run("fleet", folder / "arms.csv", "--reports", "-o", folder / "fleet")
    photograph(folder / "fleet" / "report.html", "fleet", 1250)


def main() -> None:
    """Takes all pictures."""
    if "--pages" not in sys.argv:
        studio()
    if "--studio" in sys.argv:
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run("demo", "-o", folder / "demo")
        photograph(folder / "demo" / "report.html", "calibration", 1250)
        acceptance(folder)
        months_after(folder)
        fleet(folder)
        cell(folder / "cell")
        nominal, data, test = flawed_arm()
        result = fastcal.calibrate(nominal, data, test=test)
        figure = result.plot_residuals("q2")
        figure.write_html(folder / "wave.html", include_plotlyjs=True)
        photograph(folder / "wave.html", "wave", 480)
        fastcal.diagnose(nominal, data, test=test).save(folder / "diagnosis")
        photograph(folder / "diagnosis" / "report.html", "diagnosis", 1250)


if __name__ == "__main__":
    main()
