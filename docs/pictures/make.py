# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Takes the pictures of the documentation from reports that fastcal writes, in headless Chromium.

python docs/pictures/make.py        needs chromium and Pillow
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image, ImageOps

import fastcal
from fastcal.cli import main as command

HERE = Path(__file__).parent
WIDTH = 1100


def photograph(page: Path, name: str, height: int) -> None:
    """The first `height` pixels of a page, as docs/pictures/NAME.png."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("chromium is missing")
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        size = f"--window-size={WIDTH},{height}"
        flags = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=8000", size]
        arguments = [chromium, *flags, f"--screenshot={shot}", page.as_uri()]
        subprocess.run(arguments, check=True, capture_output=True)  # noqa: S603 - our own page
        # 256 colours: a chart loses nothing by it, and the repository stays small.
        picture = Image.open(shot).convert("RGB").quantize(256)
        ImageOps.expand(picture.convert("RGB"), 1, "#d0d0d0").quantize(256).save(HERE / f"{name}.png", optimize=True)


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


def main() -> None:
    """Takes all pictures."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if command(["demo", "-o", str(folder / "demo"), "--quiet"]) != 0:
            raise SystemExit("the demonstration failed")
        photograph(folder / "demo" / "report.html", "calibration", 1250)
        nominal, data, test = flawed_arm()
        result = fastcal.calibrate(nominal, data, test=test)
        figure = result.plot_residuals("q2")
        figure.write_html(folder / "wave.html", include_plotlyjs=True)
        photograph(folder / "wave.html", "wave", 480)
        fastcal.diagnose(nominal, data, test=test).save(folder / "diagnosis")
        photograph(folder / "diagnosis" / "report.html", "diagnosis", 1500)


if __name__ == "__main__":
    main()
