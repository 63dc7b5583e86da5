# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The simulated year: its arm against the product's, the committed figures against their goals and the page."""

import dataclasses
import json
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal.robot.robot import Robot

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def bench() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "bench" / "python")
        return runpy.run_path(str(ROOT / "bench" / "python" / "bench_year.py"))


@pytest.fixture(scope="module")
def kept() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((ROOT / "bench" / "python" / "bench_year.json").read_text(encoding="utf-8"))
    return found


def test_the_years_arm_is_the_products_to_rounding(bench) -> None:
    """Two programs of one arm, loads at equilibrium among it."""
    random = np.random.default_rng(1)
    arm = bench["built"](random)
    spec = bench["nominal"]().spec
    for i, joint in enumerate(spec["joints"]):
        theta, d, a, alpha, beta = arm.rows[i]
        joint |= {"theta_deg": np.degrees(theta), "d_mm": 1e3 * d, "a_mm": 1e3 * a}
        joint |= {"alpha_deg": np.degrees(alpha), "beta_deg": np.degrees(beta)}
        joint["link"] = {"mass_kg": arm.masses[i], "com_mm": 1e3 * arm.centres[i]}
    spec["tool"]["xyz_mm"] = 1e3 * arm.tool
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": arm.compliance[j - 1]}}
        for j in bench["COMPLIANCE"]
    ]
    q, payload = bench["postures"](30, random)
    expected = Robot(spec).forward(q, payload=payload)[:, :3, 3]
    got = dataclasses.replace(arm, base=np.eye(4)).points(q, payload)
    np.testing.assert_allclose(got, expected, atol=1e-12)
    assert (
        np.abs(dataclasses.replace(arm, base=np.eye(4), compliance=np.zeros(6)).points(q, payload) - expected).max()
        > 1e-3
    )


def test_kept_figures_are_those_of_the_kept_arms(bench, kept) -> None:
    years = [bench["Year"](**row) for row in kept["years"]]
    for key, value in bench["table"](years).items():
        assert kept[key] == pytest.approx(value) if isinstance(value, float) else kept[key] == value


def test_the_year_keeps_its_goals(bench, kept) -> None:
    goals = bench["GOALS"]
    assert kept["all"]["within_two"] >= goals["alarm"]
    assert kept["all"]["right_cause"] >= goals["cause"]
    assert kept["false_rate"] < goals["false"]
    assert kept["update"]["all"]["ratio"] <= goals["update"]


def test_the_page_has_these_figures(bench, kept) -> None:
    page = (ROOT / "docs" / "monitoring.md").read_text(encoding="utf-8")
    assert bench["markdown"](kept) in page
    checks, alarms = kept["quiet_checks"], kept["false_alarms"]
    assert f"False alarms: {alarms} in {checks:,} checks" in page
    assert f"{kept['arms']} arms" in page
