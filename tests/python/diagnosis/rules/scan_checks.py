# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Scans: what jumps, comes to rest or follows a distance is found at its own number, and nothing in noise."""

from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.diagnosis import periodic, scans
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.search import Search
from fastcal.diagnosis.step_or_condition import is_a_condition
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.measuring_order import in_order

from .mutants import falls_with
from .small_arm import arm, measured, problem

ROWS = 120
TIME = 30.0 * np.arange(ROWS)


def found(effects: list[dict[str, Any]], seed: int = 1) -> list[Hypothesis]:
    data = in_order(measured(effects, rows=ROWS, time=TIME, seed=seed))
    return scans.scan(Search(problem(data)).start)


def step(size: float) -> dict[str, Any]:
    return {"effect": "zero_step", "owner": "joint2", "at_s": 2000.0, "parameters": {"step_rad": size}}


def sorted_by_joint_1() -> Dataset:
    """Rows measured along joint 1, all but a few."""
    data = measured([], rows=ROWS, time=TIME)
    order = np.argsort(data.q[:, 0] + np.random.default_rng(1).normal(0, 0.3, ROWS))
    return in_order(replace(data.select(order), time=TIME))


@falls_with(ALPHA_SCAN=0.0)
@falls_with(SCANNED_NAMES=0)
def a_zero_that_jumped_is_found_at_its_row() -> None:
    names = [n for n in found([step(8e-4)]) if n.key == ("zero_step", "joint2")]
    assert [1980.0 < n.entry["at_s"] <= 2010.0 for n in names] == [True]


@falls_with(SCANNED_NAMES=0)
def a_jump_that_another_joint_decides_is_found_between_its_rows() -> None:
    entry = {"effect": "posture_backlash", "owner": "joint1<-joint3", "at_deg": 35.0, "parameters": {"gap_rad": 8e-4}}
    data = measured([entry], rows=ROWS)
    names = [n for n in found([entry]) if n.key == ("posture_backlash", "joint1<-joint3")]
    q = np.degrees(data.q[:, 2])
    assert [q[q <= 35.0].max() < n.entry["at_deg"] < q[q > 35.0].min() for n in names] == [True]


@falls_with(ALPHA_SCAN=1e4)
def nothing_is_found_in_noise() -> None:
    assert [found([], seed) for seed in (1, 2, 3)] == [[], [], []]


@falls_with(MAX_STEP_SHARE=1.0)
@falls_with(MAX_STEP_SHARE=-1.0)
def what_changes_with_the_payload_is_no_step() -> None:
    """Rows without a load, then rows with one."""
    data = in_order(measured([], rows=ROWS, time=TIME))
    later = np.arange(ROWS) >= 60
    at = Hypothesis({"effect": "zero_step", "owner": "joint2", "at_s": 1795.0})
    assert not is_a_condition(at, Search(problem(data)).start.fit, 1)
    assert is_a_condition(at, Search(problem(replace(data, payload=10.0 * later))).start.fit, 1)


@falls_with(PLACED=())
@falls_with(ALPHA_SCAN=0.0)
def a_tool_that_slipped_is_told_by_rows_that_break_the_order_of_positions() -> None:
    at, data = Hypothesis({"effect": "tool_step", "owner": "tool", "at_s": 1795.0}), sorted_by_joint_1()
    turned = arm().forward(data.q)[:, :3, :3]
    slipped = data.position + (np.arange(ROWS) >= 60)[:, np.newaxis] * (turned @ [4e-4, 3e-4, 0.0])
    assert not is_a_condition(at, Search(problem(replace(data, position=slipped))).start.fit, 1)


@falls_with(MAX_STEP_SHARE=1.0)
@falls_with(ALPHA_SCAN=1e9)
def a_tool_that_moves_with_a_joint_is_no_step() -> None:
    """It leans by a bump in the position of joint 1, along which the rows were measured."""
    at, data = Hypothesis({"effect": "tool_step", "owner": "tool", "at_s": 1795.0}), sorted_by_joint_1()
    turned = arm().forward(data.q)[:, :3, :3]
    leaning = data.position + np.exp(-((data.q[:, 0] / 0.5) ** 2))[:, np.newaxis] * (turned @ [4e-4, 3e-4, 0.0])
    assert is_a_condition(at, Search(problem(replace(data, position=leaning))).start.fit, 1)


@falls_with(SCANNED_SHARE=0.0)
def side_lobes_of_a_fine_wave_are_left_alone() -> None:
    wave = {"order": 73.0, "amplitude_rad": 4e-4, "phase_rad": 0.4}
    given = problem(measured([{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], rows=ROWS))
    names = periodic.scan(Search(given).start)
    fine = [n for n in names if n.entry["order"] > periodic.MAX_ORDER]
    assert [n.entry["order"] for n in fine if n.owner == "joint2"] == [73.0]


@falls_with(RANGE_CYCLES=3.0)
def a_wave_of_the_range_is_found_at_its_period() -> None:
    wave = {"sine_mm": 0.4, "cosine_mm": 0.2}
    names = found([{"effect": "range_wave", "owner": "instrument", "period_mm": 60.0, "parameters": wave}])
    assert [abs(n.entry["period_mm"] - 60.0) < 1.0 for n in names if n.effect == "range_wave"] == [True]


@falls_with(SETTLING_SHARES=(0.6,))
def a_base_that_comes_to_rest_is_found_with_its_time_constant() -> None:
    way = {"way_x_mm": 0.8, "way_z_mm": -0.5}
    entry = {"effect": "base_settling", "owner": "base", "begins_s": 0.0, "tau_s": 200.0, "parameters": way}
    names = found([entry])
    assert [150.0 < n.entry["tau_s"] < 260.0 for n in names if n.effect == "base_settling"] == [True]


@falls_with(FINEST_WAVE=60.0)
def an_order_of_73_is_found() -> None:
    wave = {"order": 73.0, "amplitude_rad": 4e-4, "phase_rad": 0.4}
    given = problem(measured([{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], rows=ROWS))
    assert "gear_harmonic@joint2:order=73" in [repr(n) for n in periodic.scan(Search(given).start)]
