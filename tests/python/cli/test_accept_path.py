# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A path from its program to its figures: the program is driven by a simulated arm that a tracker follows."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal as library
from fastcal.acceptance import PathRun, path_figures, plan_path
from fastcal.acceptance.path_runs import aligned, runs_of
from fastcal.calibration.simulation import perturbed
from fastcal.compensation.curves import between
from fastcal.compensation.following import follow
from fastcal.errors import InvalidInput
from fastcal.measurements.targets import targets_of
from fastcal.robot.robot import Robot

CORNERS = np.array([[-0.45, -0.15, 0.3], [-0.6, -0.15, 0.3], [-0.6, 0.15, 0.35], [-0.45, 0.15, 0.3]])
NOISE = 1e-5
EACH = 0.0005  # m between two points of the tracker, but for its noise
STANDING = 400  # points of a dwell


def joints_of(script: str) -> np.ndarray:
    """The corners of a URScript."""
    return np.array([[float(x) for x in line.split(",")] for line in re.findall(r"P\d = \[(.*?)\]", script)])


def driven(nominal: Robot, true: Robot, q: np.ndarray, runs: int) -> np.ndarray:
    """(N, 4, 4) where the true arm's tool is as the program runs: dwell, lines of the nominal arm, dwell, way back."""
    T = nominal.forward(q)
    counts = [int(np.linalg.norm(b[:3, 3] - a[:3, 3]) / EACH) for a, b in pairwise(T)]
    way = np.concatenate([T[:1], *(between(a, b, n) for (a, b), n in zip(pairwise(T), counts, strict=True))])
    on_way, reached, jumps = follow(nominal, targets_of(way, q[0], 6, {}))
    assert reached.all()
    assert not jumps
    back = np.linspace(q[-1], q[0], 500)
    one = [np.repeat(q[:1], STANDING, axis=0), on_way, np.repeat(q[-1:], STANDING, axis=0), back]
    approach = np.linspace(q[0] + 0.1, q[0], 100)
    return np.asarray(true.forward(np.concatenate([approach, *(one * runs)])))


def csv(points: np.ndarray, path: Path) -> Path:
    path.write_text("x_mm,y_mm,z_mm\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in (1e3 * points).tolist()))
    return path


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray, np.ndarray]:
    """Folder with arm, program and corners, the tool's true path (N, 3) [m] of ten runs, and what a tracker sent."""
    from fastcal.cli import main

    folder = tmp_path_factory.mktemp("path")
    arm = library.load_robot("ur5")
    arm.save(folder / "arm.yaml")
    csv(CORNERS, folder / "corners.csv")
    line = ["accept", f"{folder}/arm.yaml", "--plan", "--path", f"{folder}/corners.csv", "--language", "urscript"]
    assert main([*line, "-o", f"{folder}/way.script"]) == 0
    true = perturbed(arm, length=3e-4, angle=3e-4, seed=5)
    points = driven(arm, true, joints_of((folder / "way.script").read_text()), 10)[:, :3, 3]
    return folder, points, points + np.random.default_rng(7).normal(scale=NOISE, size=points.shape)


def written_out(sent: np.ndarray) -> tuple[float, float]:
    """AT and RT [m] of ten runs by their known rows in the stream: 50 planes, in plain NumPy."""
    counts = [round(np.linalg.norm(b - a) / EACH) for a, b in pairwise(CORNERS)]
    length = sum(np.linalg.norm(b - a) for a, b in pairwise(CORNERS))
    each = (len(sent) - 100) // 10
    accuracy, repeatability = [], []
    at = 0
    for (a, b), count in zip(pairwise(CORNERS), counts, strict=True):
        t = (b - a) / np.linalg.norm(b - a)
        planes = max(2, round(50 * np.linalg.norm(b - a) / length))
        for k in range(planes):
            c = a + (k + 0.5) / planes * (b - a)
            x = []
            for run in range(10):
                first = 100 + run * each + STANDING + at
                own = sent[first : first + count + 2]
                s = (own - c) @ t
                i = next(n for n in range(len(s) - 1) if s[n] < 0 <= s[n + 1])
                x.append(own[i] - s[i] / (s[i + 1] - s[i]) * (own[i + 1] - own[i]))
            middle = np.mean(x, axis=0)
            apart = np.linalg.norm(np.array(x) - middle, axis=1)
            accuracy.append(np.linalg.norm(middle - c))
            repeatability.append(apart.mean() + 3 * apart.std(ddof=1))
        at += count
    return max(accuracy), max(repeatability)


def test_from_the_program_to_the_figures_of_one_stream(
    cell: tuple[Path, np.ndarray, np.ndarray], tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    folder, _, sent = cell
    stream = csv(sent, tmp_path / "stream.csv")
    out = tmp_path / "out"
    said = fastcal("accept", folder / "arm.yaml", stream, "--path", folder / "way_corners.csv", "-o", out)
    assert said.code == 0, said.err
    assert "10 runs: AT" in said.out
    found = json.loads((out / "path.json").read_text())
    accuracy, repeatability = written_out(sent)
    assert 0.2 < found["AT_mm"] < 5
    assert found["AT_mm"] == pytest.approx(1e3 * accuracy, abs=1e-9)
    assert found["RT_mm"] == pytest.approx(1e3 * repeatability, abs=1e-9)
    assert [corner["corner"] for corner in found["corners"]] == [2, 3]


def test_limits_of_a_path_end_in_the_exit_codes_of_an_acceptance_test(
    cell: tuple[Path, np.ndarray, np.ndarray], tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    """AT is some tenths of a mm, sure within microns; its scatter decides where a limit lies between pass and fail."""
    folder, _, sent = cell
    stream = csv(sent, tmp_path / "stream.csv")
    line = ("accept", folder / "arm.yaml", stream, "--path", folder / "corners.csv", "-o", tmp_path / "out")
    assert fastcal(*line).code == 0
    measured = json.loads((tmp_path / "out" / "path.json").read_text())
    assert (measured["verdict"], measured["figures"]) == (None, [])
    at, rt = measured["AT_mm"], measured["RT_mm"]
    for limits, code, verdict in (
        (("--tolerance-mm", 1.1 * at, "--limit", f"rt_mm={4 * rt}"), 0, "pass"),
        (("--tolerance-mm", 0.9 * at, "--limit", f"rt_mm={4 * rt}"), 4, "fail"),
        (("--tolerance-mm", at), 3, "cannot_tell"),
        (("--limit", f"rt_mm={rt / 4}"), 4, "fail"),
        (("--limit", "at_deg=1"), 3, "cannot_tell"),
    ):
        said = fastcal(*line, *limits)
        assert said.code == code, said.err
        found = json.loads((tmp_path / "out" / "path.json").read_text())
        assert found["verdict"] == verdict
        assert found["AT_mm"] == at
        page = (tmp_path / "out" / "report.html").read_text()
        assert {"pass": "meets every limit", "fail": "exceeds a limit", "cannot_tell": "cannot decide"}[verdict] in page
    said = fastcal(*line, "--tolerance-mm", 0.9 * at, "--page-language", "de")
    assert said.code == 4
    assert "Grenzen der Bahn: nicht bestanden" in said.out
    assert "mm der Bahn" in (tmp_path / "out" / "report.html").read_text()
    for wrong in (("--limit", "ap_mm=1"), ("--budget", stream), ("--limit", "rt_mm=0")):
        before = (tmp_path / "out" / "path.json").read_bytes()
        assert fastcal(*line, *wrong).code == 2
        assert (tmp_path / "out" / "path.json").read_bytes() == before


def test_an_instruments_export_is_a_recording_too(
    cell: tuple[Path, np.ndarray, np.ndarray], tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    """Decimal commas, a title of the instrument's own and no header at all: the same figures."""
    folder, _, sent = cell
    points = np.round(1e3 * sent, 5)
    rows = [f"{k / 1000:.3f};{x:.5f};{y:.5f};{z:.5f}" for k, (x, y, z) in enumerate(points)]
    (tmp_path / "titled.txt").write_text("\n".join(["Time [s];X [mm];Y [mm];Z [mm]", *rows]).replace(".", ","))
    (tmp_path / "bare.txt").write_text("\n".join(f"{x:.5f} {y:.5f} {z:.5f}" for x, y, z in points))
    csv(points / 1e3, tmp_path / "own.csv")
    found = []
    for name in ("own.csv", "titled.txt", "bare.txt"):
        out = tmp_path / name.partition(".")[0]
        said = fastcal("accept", folder / "arm.yaml", tmp_path / name, "--path", folder / "corners.csv", "-o", out)
        assert said.code == 0, said.err
        found.append(json.loads((out / "path.json").read_text()))
    for other in found[1:]:
        assert other["AT_mm"] == pytest.approx(found[0]["AT_mm"], abs=1e-9)
        assert other["RT_mm"] == pytest.approx(found[0]["RT_mm"], abs=1e-9)
    (tmp_path / "none.csv").write_text("a,b\n1,2\n")
    said = fastcal("accept", folder / "arm.yaml", tmp_path / "none.csv", "--path", folder / "corners.csv", "-o", out)
    assert said.code == 2
    assert "none.csv: holds no points of a path; expected x_m, x_mm" in said.err


def test_compensated_corners_halve_the_error_of_the_path(tmp_path: Path, fastcal: Callable[..., Any]) -> None:
    arm = library.load_robot("ur5")
    true = perturbed(arm, length=3e-4, angle=3e-4, seed=5)
    kept = library.simulate(true, library.random_poses(arm, 80, seed=1), noise=NOISE, seed=1)
    model = library.calibrate(arm, kept).model
    model.save(tmp_path / "model.yaml")
    csv(CORNERS, tmp_path / "corners.csv")
    left = []
    for name, more in (("bare", ()), ("sent", ("--compensated",))):
        line = ("--plan", "--path", tmp_path / "corners.csv", "--language", "urscript")
        said = fastcal("accept", tmp_path / "model.yaml", *line, *more, "-o", tmp_path / f"{name}.script")
        assert said.code == 0, said.err
        assert ("the lines between them are the controller's" in said.err) == bool(more)
        q = joints_of((tmp_path / f"{name}.script").read_text())
        sent = driven(arm, true, q, 2)[:, :3, 3]
        found = path_figures(CORNERS, runs_of([PathRun(sent)], CORNERS))
        left.append(found.accuracy.max())
    assert left[1] < 0.5 * left[0]


def test_an_instrument_that_stands_elsewhere_is_aligned(cell: tuple[Path, np.ndarray, np.ndarray]) -> None:
    """AT is then what no rigid motion of the whole path explains; RT has the same noise."""
    _, _, sent = cell
    here = path_figures(CORNERS, runs_of([PathRun(sent)], CORNERS))
    R = np.array([[0.0, -1, 0], [0.6, 0, -0.8], [0.8, 0, 0.6]])
    there = sent @ R.T + [3.0, -1, 0.5]
    with pytest.raises(InvalidInput, match=r"recording 1 holds no run of this path: expected .* in the frame"):
        runs_of([PathRun(there)], CORNERS)
    found = path_figures(CORNERS, aligned(runs_of([PathRun(there)], CORNERS, align=True), CORNERS))
    again = path_figures(CORNERS, aligned(runs_of([PathRun(sent)], CORNERS, align=True), CORNERS))
    assert found.runs == 10
    assert found.accuracy == pytest.approx(again.accuracy, abs=1e-12)
    # Planes fall between other points of the tracker: other draws of the same noise.
    assert found.repeatability.mean() == pytest.approx(here.repeatability.mean(), rel=0.1)
    assert found.accuracy.mean() < 0.5 * here.accuracy.mean()


def test_the_target_may_be_mounted_anyhow_where_the_frame_is_fitted() -> None:
    """A third of a turn of the target, and 1 mrad that comes and goes along the path: that alone is left."""
    share = np.linspace(0, 1, 1500)
    way = np.concatenate([a + np.linspace(0, 1, 500)[:, np.newaxis] * (b - a) for a, b in pairwise(CORNERS)])
    third = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    angle = 1e-3 * np.sin(6 * np.pi * share)
    turned = np.tile(np.eye(3), (len(way), 1, 1))
    turned[:, 0, 1], turned[:, 1, 0] = -angle, angle
    runs = [PathRun(way, turned @ third), PathRun(way, turned @ third)]
    found = path_figures(CORNERS, aligned(runs, CORNERS, np.eye(3)), rotation=np.eye(3))
    assert found.turn_accuracy is not None
    assert found.turn_accuracy.max(axis=0) == pytest.approx([0, 0, 1e-3], abs=2e-5)
    straight = CORNERS[:2]
    lines = [PathRun(np.linspace(*straight, 400), np.tile(third, (400, 1, 1)))] * 2
    assert all(run.rotations is None for run in aligned(lines, straight, np.eye(3)))


def test_runs_of_a_closed_path_follow_each_other() -> None:
    closed = np.vstack([CORNERS, CORNERS[:1]])
    way = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(closed)])
    stands = np.repeat(closed[:1], 300, axis=0)
    stream = np.concatenate([stands, *([way, stands] * 3)])
    stream = stream + np.random.default_rng(0).normal(scale=NOISE, size=stream.shape)
    assert len(runs_of([PathRun(stream)], closed)) == 3
    assert len(runs_of([PathRun(stream)] * 2, closed)) == 6


@pytest.mark.parametrize(
    ("corners", "rotations", "options", "said"),
    [
        (CORNERS[:1], None, {}, "expected at least 2 corners"),
        (CORNERS, None, {"speed": 0.0}, "a speed above 0"),
        (CORNERS * 3, None, {}, "ur5 drives this path in no configuration"),
        (CORNERS[:2], np.array([np.eye(3), np.diag([1.0, -1, -1])]), {}, "the corners turn the tool"),
    ],
)
def test_paths_that_no_program_drives_are_refused(
    corners: np.ndarray, rotations: np.ndarray | None, options: dict[str, float], said: str
) -> None:
    arm = library.load_robot("ur5")
    with pytest.raises(InvalidInput, match=said):
        plan_path(arm, PathRun(corners, rotations), language="urscript", program="way.script", **options)


def test_what_is_of_the_cube_is_refused(
    cell: tuple[Path, np.ndarray, np.ndarray], tmp_path: Path, fastcal: Callable[..., Any]
) -> None:
    folder, _, _ = cell
    line = ("--plan", "--path", folder / "corners.csv", "--language", "krl", "-o", tmp_path / "way.src")
    said = fastcal("accept", folder / "arm.yaml", *line, "--edge-mm", "400")
    assert said.code == 2
    assert "--plan --path takes no --directions, --centre-mm or --edge-mm" in said.err
    assert not list(tmp_path.iterdir())
