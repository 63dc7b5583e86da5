# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An observation of one's own is one C++ file: every command takes it, and no other file knows it.

A height over a level floor, tests/cpp/examples/plumb_height.cpp. The C++ test examples/own_observation_in_the_core runs
these tests with it compiled into the core; without it the core says that it does not know such a column.
"""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cli.app import main
from fastcal.io.yaml_text import yaml_text

from .bench_arm import disturbed, postures, spec, tool_points

FloatArray = NDArray[np.float64]

NOISE, FLOOR = 2e-5, -0.35  # [m]
WAVE = 8e-4  # [rad] of joint 2, two cycles a turn
IN_CORE = os.environ.get("FASTCAL_OWN") == "core"
in_core = pytest.mark.skipif(not IN_CORE, reason="ctest runs it: examples/own_observation_in_the_core")


def written(folder: Path, name: str, count: int, seed: int, *, wave: float = 0.0, moved: float = 0.0) -> Path:
    """Heights of the tool, and points of it in every second row, of an arm off its file by 0.5 mm and 0.5 mrad."""
    rows = disturbed(11)
    rows[2, 0] += moved
    q = postures(count, seed)
    there = q.copy()
    there[:, 1] += wave * np.sin(2 * q[:, 1] + 0.4)
    random = np.random.default_rng([seed, 3])
    points = tool_points(rows, there)
    heights = points[:, 2] - FLOOR + NOISE * random.standard_normal(count)
    points = points + NOISE * random.standard_normal(points.shape)
    titles = [*(f"q{k}_deg" for k in range(1, 7)), "x_mm", "y_mm", "z_mm", "plumb_mm"]
    with (folder / name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(titles)
        for k in range(count):
            point = [f"{1e3 * of:.6f}" for of in points[k]] if k % 2 == 0 else ["", "", ""]
            writer.writerow([*(f"{of:.9f}" for of in np.degrees(q[k])), *point, f"{1e3 * heights[k]:.6f}"])
    return folder / name


def run(*command: object) -> int:
    return main([str(part) for part in command])


def content(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("plumb")
    (out / "robot.yaml").write_text(yaml_text(spec(disturbed(0))), encoding="utf-8")
    if IN_CORE:
        poses = written(out, "poses.csv", 120, 1)
        assert (
            run("calibrate", out / "robot.yaml", poses, "--test", written(out, "test.csv", 40, 2), "-o", out / "c") == 0
        )
    return out


def test_it_is_in_the_core_where_it_was_compiled_in() -> None:
    assert ("plumb" in _core.observation_names()) == IN_CORE


@in_core
def test_calibrate_identifies_with_it_and_the_page_speaks_of_it(folder: Path) -> None:
    found = content(folder / "c/result.json")
    for part in ("train", "test"):
        rms = found[part]["kinds"]["plumb"]["after"]["rms"]
        assert 0.7e3 * NOISE < rms < 1.5e3 * NOISE  # mm
    assert found["train"]["kinds"]["plumb"]["count"] == 120
    assert 0.7e3 * NOISE < found["noise"]["plumb"]["value"] < 1.3e3 * NOISE
    assert "heights over the floor" in (folder / "c/report.html").read_text(encoding="utf-8").lower()


@in_core
def test_diagnose_names_a_cause_by_it(folder: Path, tmp_path: Path) -> None:
    poses = written(folder, "waved.csv", 160, 4, wave=WAVE)
    assert run("diagnose", folder / "robot.yaml", poses, "-o", tmp_path / "d") == 0
    found = content(tmp_path / "d/diagnosis.json")
    assert [(of["effect"], of["owner"]) for of in found["effects"]] == [("gear_harmonic", "joint2")]
    assert set(found["noise"]) == {"position", "plumb"}
    assert "heights over the floor" in (tmp_path / "d/report.html").read_text(encoding="utf-8").lower()


@in_core
def test_check_holds_and_names_a_zero_that_slipped(folder: Path, tmp_path: Path) -> None:
    model = folder / "c/model.yaml"
    assert run("check", model, written(folder, "new.csv", 30, 5), "-o", tmp_path / "check.json") == 0
    assert "plumb" in content(tmp_path / "check.json")["kinds"]
    assert run("check", model, written(folder, "slipped.csv", 30, 6, moved=2e-3), "-o", tmp_path / "check.json") == 4
    assert {of["owner"] for of in content(tmp_path / "check.json")["changed"]} == {"joint3"}


@in_core
def test_design_evaluate_and_update_take_what_was_read_with_it(folder: Path, tmp_path: Path) -> None:
    model = folder / "c/model.yaml"
    assert run("design", model, "--count", 12, "-o", tmp_path / "poses.csv") == 0
    assert len((tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()) == 13
    assert run("evaluate", model, folder / "test.csv", "-o", tmp_path / "e.json") == 0
    assert set(content(tmp_path / "e.json")["kinds"]) == {"position", "plumb"}
    moved = written(folder, "moved.csv", 40, 7, moved=2e-3)
    assert run("update", model, moved, "-o", tmp_path / "u") == 0
    assert run("check", tmp_path / "u/model.yaml", written(folder, "after.csv", 30, 8, moved=2e-3)) == 0


@in_core
def test_it_is_read_of_a_target_of_a_cell(folder: Path, tmp_path: Path) -> None:
    """Two arms of which one reads heights: calibrate, diagnose, check, design and the pages."""
    robot = spec(disturbed(0))
    tool = robot.pop("tool")
    assert isinstance(tool, dict)
    arms = {name: {"robot": robot} for name in ("left", "right")}
    targets = {f"smr_{name}": {"on": name, **tool} for name in arms}
    cell = {"cell": "two", "arms": arms, "targets": targets}
    (tmp_path / "cell.yaml").write_text(yaml_text(cell), encoding="utf-8")
    poses = _of_a_cell(folder, tmp_path, "poses.csv", 1)
    assert run("calibrate", tmp_path / "cell.yaml", poses, "-o", tmp_path / "c") == 0
    found = content(tmp_path / "c/result.json")
    assert found["train"]["kinds"]["plumb"]["count"] == 120
    assert 0.7e3 * NOISE < found["train"]["kinds"]["plumb"]["after"]["rms"] < 1.3e3 * NOISE
    assert "heights over the floor" in (tmp_path / "c/report.html").read_text(encoding="utf-8").lower()
    new = _of_a_cell(folder, tmp_path, "new.csv", 11)
    assert run("evaluate", tmp_path / "c/model.yaml", new, "-o", tmp_path / "e.json") == 0
    assert content(tmp_path / "e.json")["kinds"]["plumb"]["after"]["rms"] < 1.6e3 * NOISE
    assert run("check", tmp_path / "c/model.yaml", new, "-o", tmp_path / "check.json") == 0
    waved = _of_a_cell(folder, tmp_path, "waved.csv", 4, wave=WAVE)
    assert run("diagnose", tmp_path / "cell.yaml", waved, "-o", tmp_path / "d") == 0
    named = [(of["effect"], of["owner"]) for of in content(tmp_path / "d/diagnosis.json")["effects"]]
    assert named == [("gear_harmonic", "right.joint2")]
    design = ("design", tmp_path / "cell.yaml", "--count", 30, "--views", "smr_left,plumb@smr_right")
    assert run(*design, "-o", tmp_path / "plan.csv") == 0
    assert len((tmp_path / "plan.csv").read_text(encoding="utf-8").splitlines()) == 31


def _of_a_cell(folder: Path, out: Path, name: str, seed: int, wave: float = 0.0) -> Path:
    """Points of the left arm, points and heights of the right one, in one file."""
    own = [written(folder, f"one_{name}", 120, seed + k, wave=wave * k).read_text(encoding="utf-8") for k in (0, 1)]
    of = [list(csv.reader(text.splitlines())) for text in own]
    titles = [f"left.{title}" if title.startswith("q") else f"{title}@smr_left" for title in of[0][0][:-1]]
    titles += [f"right.{title}" if title.startswith("q") else f"{title}@smr_right" for title in of[1][0]]
    with (out / name).open("w", encoding="utf-8", newline="") as file:
        rows = [[*left[:-1], *right] for left, right in zip(of[0][1:], of[1][1:], strict=True)]
        csv.writer(file).writerows([titles, *rows])
    return out / name
