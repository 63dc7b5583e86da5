# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""AT, RT and corners of measured paths against a computation that is written out in numpy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.acceptance.path_figures import PathRun, path_figures
from fastcal.errors import InvalidInput

SQUARE = np.array([[0.0, 0, 0.5], [0.4, 0, 0.5], [0.4, 0.3, 0.5], [0, 0.3, 0.5], [0, 0, 0.5]])
UPRIGHT = Rotation.identity()


def driven(seed: int, count: int = 400) -> PathRun:
    """The square at 0.2 mm of error, points as a tracker that samples in time sends them."""
    random = np.random.default_rng(seed)
    points = []
    for a, b in pairwise(SQUARE):
        share = np.sort(np.append(random.uniform(0, 1, count - 2), [0.0, 1.0]))
        smooth = 2e-4 * np.sin(np.outer(share, [3, 5, 7]) * np.pi + random.uniform(0, 6, 3))
        points.append(a + np.outer(share, b - a) + smooth * np.sin(np.pi * share)[:, np.newaxis])
    turns = Rotation.from_rotvec(1e-3 * np.random.default_rng(seed + 50).standard_normal((4 * count, 3)))
    return PathRun(np.vstack(points), turns.as_matrix())


def test_at_and_rt_are_those_of_a_written_out_computation() -> None:
    runs = [driven(seed) for seed in range(10)]
    found = path_figures(SQUARE, runs, planes=40, rotation=UPRIGHT.as_matrix())
    at, rt, at_turn, rt_turn = [], [], [], []
    for side, (a, b) in enumerate(pairwise(SQUARE)):
        count = round(40 * np.linalg.norm(b - a) / 1.4)
        t = (b - a) / np.linalg.norm(b - a)
        for k in range(count):
            c = a + (k + 0.5) / count * (b - a)
            x, angles = [], []
            for run in runs:
                assert run.rotations is not None
                own = run.points[400 * side : 400 * (side + 1)]
                s = (own - c) @ t
                i = next(n for n in range(399) if s[n] < 0 <= s[n + 1])
                w = -s[i] / (s[i + 1] - s[i])
                x.append(own[i] + w * (own[i + 1] - own[i]))
                two = Rotation.from_matrix(run.rotations[400 * side + i : 400 * side + i + 2]).as_rotvec()
                angles.append((1 - w) * two[0] + w * two[1])
            x_mean = np.mean(x, axis=0)
            at.append(np.sqrt(np.sum((x_mean - c) ** 2)))
            length = [np.sqrt(np.sum((p - x_mean) ** 2)) for p in x]
            rt.append(np.mean(length) + 3 * np.sqrt(np.sum((length - np.mean(length)) ** 2) / 9))
            at_turn.append(np.abs(np.mean(angles, axis=0)))
            rt_turn.append(3 * np.std(angles, axis=0, ddof=1))
    assert found.accuracy == pytest.approx(np.array(at), abs=1e-9)
    assert found.repeatability == pytest.approx(np.array(rt), abs=1e-9)
    assert found.turn_accuracy == pytest.approx(np.array(at_turn), abs=1e-9)
    assert found.turn_repeatability == pytest.approx(np.array(rt_turn), abs=1e-9)
    content = found.to_json_dict()
    assert content["AT_mm"] == pytest.approx(1e3 * max(at), abs=1e-9)
    assert content["RT_mm"] == pytest.approx(1e3 * max(rt), abs=1e-9)


def test_corners_are_rounded_or_overshot() -> None:
    """3 mm beyond the first corner before it turns; and a cut from 4 mm before it to 3 mm behind: 12 / 5 mm away."""
    angle = SQUARE[:3]

    def through(points: list[list[float]]) -> PathRun:
        chain = np.array([[0, 0, 0.5], *points, [0.4, 0.3, 0.5]])
        return PathRun(np.vstack([np.linspace(a, b, 1000) for a, b in pairwise(chain)]))

    beyond = through([[0.403, 0, 0.5], [0.403, 0.01, 0.5], [0.4, 0.02, 0.5]])
    (over,) = path_figures(angle, [beyond, beyond]).corners
    assert over.corner == 2
    assert over.overshoot == pytest.approx(3e-3, abs=1e-6)
    assert over.rounding < 1e-3
    cut = through([[0.396, 0, 0.5], [0.4, 0.003, 0.5]])
    (rounded,) = path_figures(angle, [cut, cut]).corners
    assert rounded.rounding == pytest.approx(2.4e-3, abs=1e-5)
    assert rounded.overshoot == 0


@pytest.mark.parametrize(
    ("corners", "count", "said"),
    [
        (SQUARE, 1, "at least 2 points and at least 2 runs of it, got 5 points and 1 run$"),
        (SQUARE[[0, 0, 1]], 2, "points 1 and 2 of the path are equal"),
        (SQUARE[:2] * [2, 1, 1], 2, "does not pass the plane"),
    ],
)
def test_paths_that_cannot_be_judged_are_refused(corners: np.ndarray, count: int, said: str) -> None:
    half = PathRun(np.linspace(SQUARE[0], SQUARE[1], 100))
    with pytest.raises(InvalidInput, match=said):
        path_figures(corners, [half] * count)


def test_the_run_that_misses_a_corner_is_named() -> None:
    whole, bare = driven(1), PathRun(SQUARE[[0, -1]] + [[0, 0, 0], [0, 1e-3, 0]])
    with pytest.raises(InvalidInput, match=r"^run 2 has no point near corner 2 of the path"):
        path_figures(SQUARE, [whole, bare])
