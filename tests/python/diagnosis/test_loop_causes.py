# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A rod or pin that is off by ten times what the others are is named, and none where all are alike."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import calibrate, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis.loop_causes import _Cause, _Rows
from fastcal.measurements.dataset import Dataset
from fastcal.robot.loops import closed_within
from fastcal.robot.robot import Robot

NOISE = 5e-5
BENCH: dict[str, Any] = runpy.run_path(str(Path(__file__).parents[3] / "bench" / "python" / "bench_loop_causes.py"))


def measured(nominal: Robot, changes: dict[str, dict[str, Any]], seed: int) -> Dataset:
    """60 points of a robot as a workshop builds it, of whose loops some numbers are off by more [mm]."""
    real = perturbed(nominal, seed=seed)
    loops = [dict(loop) for loop in real.description.loops]
    for loop in loops:
        for key, change in changes.get(loop["name"], {}).items():
            loop[key] = (np.asarray(loop[key]) + change).tolist()
    real = real.with_(loops=loops)
    q = closed_within(real.core, random_poses(nominal, 80, seed=seed + 1000), nominal.limits)[:60]
    return simulate(real, q, noise=NOISE, seed=seed + 5000)


@pytest.mark.parametrize(
    ("name", "rod"),
    [("delta", "rod2a"), ("delta_printer", "arm_b1"), ("hexapod", "leg3"), ("palletizer", "upper_level_bar")],
)
def test_a_rod_of_wrong_length_is_named(name: str, rod: str) -> None:
    nominal = load_robot(name)
    found = diagnose(nominal, measured(nominal, {rod: {"length_mm": 6.0}}, seed=1))
    assert found.verdict == "named"
    assert [(f.label, f.grade) for f in found.effects] == [(f"loop_length@{rod}", "A")]
    length = found.effects[0].parameters["length_mm"]
    assert length.std is not None
    assert length.value == pytest.approx(6.0, abs=max(4 * length.std, 2.0))  # the others are off by 0.5 mm themselves
    assert "length not as the file says" in found.sentence


def test_a_rod_of_ten_millimetres_more_draws_no_fit_elsewhere() -> None:
    nominal = load_robot("delta")
    data = measured(nominal, {"rod1b": {"length_mm": 10.0}}, seed=43)
    assert calibrate(nominal, data, loss="none").train.after.rms < 2 * NOISE
    assert [f.label for f in diagnose(nominal, data).effects] == ["loop_length@rod1b"]


@pytest.mark.parametrize(("name", "rod", "key"), [("delta", "rod2a", "from"), ("hexapod", "leg3", "to")])
def test_a_pin_in_another_place_is_named(name: str, rod: str, key: str) -> None:
    nominal = load_robot(name)
    data = measured(nominal, {rod: {f"{key}_xyz_mm": np.array([8.0, 0.0, 0.0])}}, seed=2)
    (finding,) = diagnose(nominal, data).effects
    assert (finding.label, finding.grade) == (f"loop_pin@{rod}", "A")
    assert finding.parameters[f"{key}_x_mm"].value == pytest.approx(8.0, abs=2.0)


def test_which_end_of_a_bar_is_moved_along_it_is_not_told() -> None:
    nominal = load_robot("palletizer")
    data = measured(nominal, {"bar": {"from_xyz_mm": np.array([8.0, 0.0, 0.0])}}, seed=2)
    (finding,) = diagnose(nominal, data).effects
    assert finding.label == "loop_pin@bar"
    assert ("loop_pin", "bar") not in finding.equivalents


@pytest.mark.parametrize("name", ["delta", "delta_printer", "five_bar", "palletizer", "parallelogram_6r"])
def test_a_robot_whose_parts_are_all_alike_has_none(name: str) -> None:
    nominal = load_robot(name)
    assert diagnose(nominal, measured(nominal, {}, seed=4)).verdict == "none"


def test_a_soft_rod_is_named_where_rods_bend_the_rows() -> None:
    """What lacks it lies far along the loops' valleys, and its linearized rows feign that geometry does as well."""
    found = BENCH["trial"]("delta_printer", "yields", 1002)
    assert found["cause"] == "rod_compliance@arm_c1"
    assert [label for label, _, _ in found["effects"]] == ["rod_compliance@arm_c1"]


def test_an_excluded_name_is_not_given_and_another_rod_is_no_better_than_b() -> None:
    nominal = load_robot("delta")
    data = measured(nominal, {"rod2a": {"length_mm": 6.0}}, seed=1)
    assert not diagnose(nominal, data, exclude=["loop_length"]).effects
    assert [f.grade for f in diagnose(nominal, data, exclude=["loop_length@rod1a"]).effects] == ["B"]


def test_the_likelihood_is_that_of_a_normal_distribution() -> None:
    random = np.random.default_rng(1)
    F, Z, y = random.normal(size=(30, 2)), random.normal(size=(30, 5)), random.normal(size=30)
    rows = _Rows.of(F, Z, y)
    cause = _Cause("loop_pin", "rod", [1, 3])
    across = np.linalg.svd(F)[0][:, 2:]  # what F leaves
    s, w = rows.best(cause.columns)
    G = (across.T @ Z)[:, cause.columns]

    def twice_log(wide: float, narrow: float) -> float:
        V = np.eye(28) + narrow**2 * (across.T @ Z) @ (across.T @ Z).T + wide**2 * G @ G.T
        return float(-np.linalg.slogdet(V)[1] - (across.T @ y) @ np.linalg.solve(V, across.T @ y))

    assert rows.likelihoods(cause.columns).max() - rows.likelihoods().max() == pytest.approx(
        twice_log(w, s) - twice_log(0.0, rows.spread()), abs=1e-9
    )
    V = np.eye(28) + s**2 * (across.T @ Z) @ (across.T @ Z).T + w**2 * G @ G.T
    by_all = (s**2 + w**2) * G.T @ np.linalg.solve(V, np.column_stack([across.T @ y, (s**2 + w**2) * G]))
    value, std = rows.estimate(cause.columns)
    assert value == pytest.approx(by_all[:, 0], abs=1e-9)
    assert std**2 == pytest.approx((s**2 + w**2) - np.diag(by_all[:, 1:]), abs=1e-9)
