# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Results of known content: a UR10 whose residuals are planted, so that the page must find them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.calibrate import CalibrationResult, IdentifiedParameter, Unidentifiable
from fastcal.calibration.evaluation import ErrorStatistics, Evaluation, distances
from fastcal.calibration.kind_errors import table
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import KindNoise, kind_named
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]
MakeResult = Callable[..., CalibrationResult]

SIGMA = 4e-5  # m, noise of a coordinate
WAVE = 7e-5  # m, what stays of a gear error of joint 4 with four cycles a turn
GROSS = 6e-4  # m, on each coordinate of an outlying row


def _evaluation(robot: Robot, count: int, seed: int, outliers: list[int], name: str, **kind: object) -> Evaluation:
    random = np.random.default_rng(seed)
    q = random.uniform([-2.6, -2.4, -2.2, -2.5, -2.0, -3.0], [2.6, -0.3, 2.2, 2.5, 2.0, 3.0], (count, 6))
    true = robot.forward(q)[:, :3, 3]
    after = random.normal(0, SIGMA, (count, 3)) + WAVE * np.sin(4 * q[:, [3]]) * np.array([0.6, 0.8, 0.0])
    temperature = 295 + 3.5 * np.sin(np.linspace(0, 4, count)) if kind["conditions"] else None
    after[outliers] += GROSS * random.choice([-1, 1], (len(outliers), 3))
    before = robot.forward(q + np.array([6, -9, 12, 8, -15, 0]) * 1e-4)[:, :3, 3] - true + after
    position, lengths = true.copy(), (None, None)
    if kind["lengths"]:
        lengths = before[:, 0].copy(), after[:, 0].copy()
        before[:], after[:] = np.nan, np.nan
    for array in (before, after, position):
        array[np.random.default_rng(seed + 100).random((count, 3)) < kind["missing"]] = np.nan
    data = Dataset(
        q,
        np.zeros(count),
        position=None if kind["lengths"] else position,
        distance=np.linalg.norm(true, axis=1) if kind["lengths"] else None,
        temperature=temperature,
        time=8.0 * np.arange(count) if kind["conditions"] else None,
        source=f"campaign/{name}.csv",
    )
    kind = kind_named("length" if kind["lengths"] else "position")
    was, now = (
        {kind: points[:, np.newaxis] if length is None else length.reshape(-1, 1, 1)}
        for points, length in zip((before, after), lengths, strict=True)
    )
    return Evaluation(
        data,
        after,
        lengths[1],
        None,
        ErrorStatistics.of(distances(after)),
        before,
        ErrorStatistics.of(distances(before)),
        kinds=table(now, was),
    )


def _parameters(robot: Robot) -> list[IdentifiedParameter]:
    random = np.random.default_rng(3)
    found = []
    for k, joint in enumerate(robot.spec["joints"]):
        for name, change, std in (
            ("theta_deg", 0.05, 8e-4),
            ("d_mm", 0.4, 8e-3),
            ("a_mm", 0.4, 9e-3),
            ("alpha_deg", 0.04, 7e-4),
        ):
            value = joint[name] + random.normal(0, change)
            unit = name.split("_")[1]
            found.append(IdentifiedParameter(name, f"joint{k + 1}", value, std, unit, float(joint[name])))
    found += [
        IdentifiedParameter(f"{axis}_mm", owner, random.normal(0, 900), 0.012, "mm", 0.0)
        for owner in ("base", "tool")
        for axis in "xyz"
    ]
    return [*found, IdentifiedParameter("compliance_rad_nm", "joint2", 3.14e-7, 2.2e-9, "rad_nm", 0.0)]


@pytest.fixture(scope="session")
def make_result() -> MakeResult:
    """Builds results of `rows` and `test_rows` poses.

    conditions: temperature and time are known. missing: share of coordinates not measured. lengths: only lengths were.
    """
    nominal = load_robot("ur10")

    def make(
        rows: int = 700,
        test_rows: int = 300,
        *,
        outlier_count: int = 9,
        name: str = "ur10_cell_3",
        conditions: bool = True,
        missing: float = 0.0,
        lengths: bool = False,
        **changes: object,
    ) -> CalibrationResult:
        outliers = [int(row) for row in np.linspace(3, rows - 2, outlier_count)]
        weights = np.ones(rows)
        weights[outliers] = 0.12
        kind = {"conditions": conditions, "missing": missing, "lengths": lengths}
        robot = Robot(copy.deepcopy(nominal.spec) | {"name": name})
        parameters = _parameters(robot)
        kind_of = kind_named("length" if lengths else "position")
        noise = {kind_of.name: KindNoise(kind_of, SIGMA, "residual", "estimated from the residuals; no sigma column")}
        content = {
            "status": "converged",
            "message": "the relative change of the cost fell below 1e-15",
            "model": robot,
            "nominal": robot,
            "loss": "tukey",
            "method": "nls",
            "parameters": parameters,
            "covariance": np.eye(len(parameters)),
            "unidentifiable": [
                Unidentifiable("joint1 d and base z move together", ["joint1 d", "base z"]),
                Unidentifiable("joint6 theta is not observable", ["joint6 theta"]),
            ],
            "correlated": [("joint2 theta", "joint3 theta", -0.968), ("base z", "joint1 d", 0.9991)],
            "rank": len(parameters),
            "asked_count": len(parameters) + 2,
            "degrees_of_freedom": 3 * rows - len(parameters),
            "iterations": 6,
            "noise": noise,
            "outliers": outliers,
            "weights": weights,
            "train": _evaluation(robot, rows, 1, outliers, "measurements", **kind),
            "test": _evaluation(robot, test_rows, 2, [], "test", **kind) if test_rows else None,
            "notes": ["column 'operator' is not known and is kept as it is"],
        }
        return CalibrationResult(**content | changes)

    return make


@pytest.fixture
def fit_for_all(chromium: Any, accessible: Callable[[Any], None], tmp_path: Path) -> Callable[[str], None]:
    """Nothing serious for axe-core, a quiet console, no sideways scrolling; light, and a dark phone."""

    def check(document: str) -> None:
        file = tmp_path / "page.html"
        file.write_text(document, encoding="utf-8")
        for scheme, width in (("light", 1400), ("dark", 400)):
            context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
            page = context.new_page()
            said: list[str] = []
            page.on("console", lambda message, said=said: said.append(message.text))
            page.on("pageerror", lambda error, said=said: said.append(str(error)))
            page.goto(file.as_uri())
            page.locator('body[data-state="ready"]').wait_for(timeout=120_000)
            assert [text for text in said if "Canvas2D" not in text] == []
            assert page.evaluate("document.documentElement.scrollWidth") == width
            accessible(page)
            context.close()

    return check
