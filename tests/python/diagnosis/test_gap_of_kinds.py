# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures and touches of one arm: what is said of held-out poses is of the kind that is spoken of, in its unit."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from fastcal.cli.app import main

from ..cells import camera_scene as scene

TIP, HEIGHT = np.array([10.0, 5.0, 120.0, 1.0]), 60.0  # [mm] on the flange; of the plane
NOISE_PX = 0.1


def touched(count: int, seed: int, noise_mm: float) -> scene.FloatArray:
    """(count, 6) [deg] postures in which the tip of the arm lies in the plane, but for a noise of its height."""
    random = np.random.default_rng(seed)
    out: list[scene.FloatArray] = []
    while len(out) < count:
        height = HEIGHT + noise_mm * random.standard_normal()
        q = np.array([0.0, 0.0, 20.0, 0.0, 60.0, 0.0]) + random.uniform(-1, 1, 6) * [40, 0, 25, 60, 40, 170]

        def above(shoulder: float, at: scene.FloatArray = q, height: float = height) -> float:
            return float((scene.flange(np.array([at[0], shoulder, *at[2:]]), 0.5) @ TIP)[2] - height)

        if above(0) * above(60) < 0:
            q[1] = brentq(above, 0, 60)
            out.append(q)
    return np.array(out)


def write(folder: Path, noise_mm: float = 0.0) -> list[str]:
    """Twenty pictures and as many touches; the arguments of a command."""
    scene.write(folder, 20, 1, NOISE_PX, error_mm=0.5)
    q = np.loadtxt(folder / "poses.csv", delimiter=",", skiprows=1)
    titles = ",".join([*(f"arm.q{k}_deg" for k in range(1, 7)), "plane"])
    rows = [(*row, label) for part, label in ((q, ""), (touched(20, 3, noise_mm), "table")) for row in part.tolist()]
    (folder / "poses.csv").write_text("\n".join([titles, *(",".join(map(str, row)) for row in rows)]) + "\n")
    cell, poses, corners, out = (str(folder / name) for name in ("cell.yaml", "poses.csv", "corners.csv", "out"))
    return [cell, poses, "--corners", corners, "-o", out]


def test_exact_touches_leave_a_camera_as_well_known(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", *write(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "touches of a plane" in said
    assert "camera wrist on flange: known to" in said


def test_the_gap_of_pictures_beside_touches_is_in_pixels(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", *write(tmp_path, noise_mm=0.05)]) == 0
    first = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["gap"][0]["kinds"]
    assert next(iter(first)) == "corner"
    # Two numbers of a corner at the noise, some more for what few pictures leave open.
    assert 0.9 * NOISE_PX * np.sqrt(2) < first["corner"]["held_out_rms"] < 3 * NOISE_PX * np.sqrt(2)
