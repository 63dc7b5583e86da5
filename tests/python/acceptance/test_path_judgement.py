# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Limits of measured paths: guard bands by the scatter of the runs, corners as they are."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from fastcal.acceptance import PathRun, judged_path, path_figures
from fastcal.errors import InvalidInput

LINE = np.array([[0.0, 0, 0], [0.4, 0, 0]])
ANGLE = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.4, 0.3, 0]])
OFF = np.array([0.10, 0.12, 0.08, 0.10])  # mm, or mrad: mean 0.1, standard error of the mean 0.00816497
# Student's t of 3 degrees of freedom at 95 % is 2.353363, so the guard band is 0.0192152 wide.
GUARD = 2.353363 * math.sqrt(0.0008 / 3 / 4)


def shifted(turned: bool = False) -> list[PathRun]:
    """Four runs beside the line by OFF along y, turned about z by -OFF where asked."""
    runs = []
    for off in OFF:
        points = np.linspace(*LINE, 300) + np.array([0, 1e-3 * off, 0])
        R = Rotation.from_rotvec([0, 0, -1e-3 * off]).as_matrix()
        runs.append(PathRun(points, np.tile(R, (300, 1, 1)) if turned else None))
    return runs


def test_the_hand_s_guard_band_is_that_of_student_s_t() -> None:
    assert pytest.approx(stats.t.ppf(0.95, 3) * OFF.std(ddof=1) / 2, rel=1e-6) == GUARD


@pytest.mark.parametrize(
    ("limit", "verdict"),
    [
        (0.1 + 1.01 * GUARD, "pass"),
        (0.1 + 0.99 * GUARD, "cannot_tell"),
        (0.1 - 0.99 * GUARD, "cannot_tell"),
        (0.1 - 1.01 * GUARD, "fail"),
    ],
)
def test_a_path_passes_below_its_guard_band_and_fails_above_it(limit: float, verdict: str) -> None:
    found = path_figures(LINE, shifted(turned=True), rotation=np.eye(3))
    for limits in ({"at_mm": limit}, {"at_deg": math.degrees(1e-3 * limit)}):
        told = judged_path(found, limits)
        assert told.verdict == verdict
        (own,) = told.to_json_dict()["figures"] if "at_mm" in limits else [told.to_json_dict()["figures"][-1]]
        assert own["symbol"] in ("AT", "AT_rz")
        assert own["degrees_of_freedom"] == 3
    assert own["value"] == pytest.approx(math.degrees(-1e-4), rel=1e-6)
    assert own["guard"] == pytest.approx(math.degrees(1e-3 * GUARD), rel=1e-5)


def test_the_repeatability_is_judged_by_the_jackknife_written_out() -> None:
    """RT of the offsets: l = 0, .02, .02, 0; mean .01, S = .0115470: .0446410 mm. Without each run in turn, by hand."""

    def rt(off: np.ndarray) -> float:
        size = np.abs(off - off.mean())
        return float(size.mean() + 3 * size.std(ddof=1))

    left = [rt(np.delete(OFF, j)) for j in range(4)]
    u = math.sqrt(3 / 4 * sum((each - sum(left) / 4) ** 2 for each in left))
    (own,) = judged_path(path_figures(LINE, shifted()), {"rt_mm": 0.2}).to_json_dict()["figures"]
    assert own["value"] == pytest.approx(0.0446410, abs=1e-7)
    assert own["standard"] == pytest.approx(u, rel=1e-9)


def test_corners_are_held_against_their_limits_as_they_are() -> None:
    """3 mm beyond the corner before the run turns: the greatest of the runs."""
    chain = np.array([[0, 0, 0], [0.403, 0, 0], [0.403, 0.01, 0], [0.4, 0.02, 0], [0.4, 0.3, 0]])
    run = PathRun(np.vstack([np.linspace(a, b, 1000) for a, b in pairwise(chain)]))
    found = path_figures(ANGLE, [run] * 3)
    assert judged_path(found, {"co_mm": 3.01}).verdict == "pass"
    told = judged_path(found, {"co_mm": 2.99, "cr_mm": 1.0})
    assert told.verdict == "fail"
    assert [(e.figure.symbol, str(e.figure.where), e.verdict) for e in told.figures] == [
        ("CR", "corner 2", "pass"),
        ("CO", "corner 2", "fail"),
    ]


def test_a_limit_that_nothing_shows_is_no_pass() -> None:
    found = path_figures(LINE, shifted())
    told = judged_path(found, {"at_mm": 1.0, "rt_deg": 0.1, "co_mm": 1.0})
    assert told.verdict == "cannot_tell"
    assert told.missing == ("rt_deg", "co_mm")
    assert judged_path(found, {}).verdict is None


@pytest.mark.parametrize(
    ("limits", "runs", "said"),
    [
        ({"ap_mm": 1.0}, 4, "unknown limit 'ap_mm', expected one of at_mm, rt_mm, cr_mm, co_mm, at_deg, rt_deg"),
        ({"at_mm": 0.0}, 4, "a limit must be above 0, got at_mm=0"),
        ({"at_mm": 1.0}, 2, "limits of a path need at least 3 runs of it, got 2"),
    ],
)
def test_limits_that_cannot_be_judged_are_refused(limits: dict[str, float], runs: int, said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        judged_path(path_figures(LINE, shifted()[:runs]), limits)
