# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes that these rows can't tell from the one that is named: another order of a wave, a joint whose zero moved."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import Robot, diagnose, load_measurements, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import grading
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.diagnosis.search import Family, Search, SearchNode
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Spec

ARM = load_robot("pmc6va030")
SIGMA = 3e-5  # [m]
ROWS = 120
TIME = 60.0 * np.arange(ROWS)  # [s]
HALF = TIME[ROWS // 2] - 30.0  # [s], between two rows
LATER = (TIME > HALF).astype(float)


def diagnosed(q: np.ndarray, effects: list[Spec], off: np.ndarray | None = None, **columns: Any) -> Diagnosis:
    """Rows of an arm with effects, its joints where they are said to be plus `off`."""
    true = Robot(dict(perturbed(ARM, seed=7).spec) | {"effects": effects})
    there = q if off is None else q + off
    seen = simulate(true, Dataset.from_arrays(there, robot=ARM, **columns), noise=SIGMA, seed=7)
    return diagnose(ARM, Dataset.from_arrays(q, robot=ARM, position=seen.position, **columns), sigma=SIGMA)


def the_one(found: Diagnosis) -> tuple[Finding, dict[Reason, Because]]:
    (effect,) = found.effects
    return effect, {because.reason: because for because in effect.limits}


def zero_of(joint: int, course: np.ndarray) -> np.ndarray:
    """(N, 6) a joint off by a course [rad]."""
    return np.outer(course, np.eye(6)[joint - 1])


def wave(order: float) -> list[Spec]:
    parameters = {"order": order, "amplitude_rad": 4e-4, "phase_rad": 0.7}
    return [{"effect": "gear_harmonic", "owner": "joint2", "parameters": parameters}]


def test_a_wave_over_a_grid_of_positions_has_many_orders() -> None:
    """Order 100.5, measured in steps of 12 degrees, was named as one of 10.5 and sure."""
    q = random_poses(ARM, ROWS, seed=7)
    q[:, 1] = np.radians(12.0) * np.round(q[:, 1] / np.radians(12.0))
    effect, limits = the_one(diagnosed(q, wave(100.5)))
    assert effect.label == "gear_harmonic@joint2"
    assert effect.grade == "B"
    assert 1 <= effect.parameters["order"].value <= 40
    found = (*limits[Reason.ORDERS_ALIKE].orders, effect.parameters["order"].value)
    assert min(abs(order - 100.5) for order in found) < 0.1
    (sentence,) = (text for text in effect.reasons if "look the same" in text)
    assert sentence.startswith("orders ")
    assert sentence.endswith(" and others look the same at these positions of the joint: measure between them")


@pytest.mark.parametrize("order", [2.0, 6.0, 31.0])
def test_random_positions_tell_all_orders_apart(order: float) -> None:
    effect, limits = the_one(diagnosed(random_poses(ARM, ROWS, seed=7), wave(order)))
    assert (effect.label, effect.grade, limits) == ("gear_harmonic@joint2", "A", {})
    assert effect.parameters["order"].value == pytest.approx(order, abs=0.04)


def test_a_zero_of_joint_1_that_jumped_is_no_sure_step_of_the_base() -> None:
    """What follows a crash; a turn of the base about joint 1's axis is five numbers more."""
    effect, _limits = the_one(diagnosed(random_poses(ARM, ROWS, seed=7), [], zero_of(1, 8e-4 * LATER), time=TIME))
    assert (effect.label, effect.grade) == ("zero_step@joint1", "B")
    assert effect.parameters["step_rad"].value == pytest.approx(8e-4, rel=0.05)


def test_a_zero_of_joint_1_that_creeps_is_no_sure_drift_of_the_base() -> None:
    course = 8e-4 * TIME / TIME[-1]
    effect, limits = the_one(diagnosed(random_poses(ARM, ROWS, seed=7), [], zero_of(1, course), time=TIME))
    assert (effect.label, effect.grade) == ("base_drift@base", "B")
    assert Reason.ZERO_CREEPS in limits
    assert "a drifting zero of joint 1 looks the same: check its mastering" in effect.reasons


def test_a_base_that_was_knocked_askew_is_sure() -> None:
    knocked = {"step_x_mm": 0.1, "step_rx_rad": 1e-4, "step_ry_rad": 2e-4, "step_rz_rad": 3e-4}
    step = {"effect": "base_step", "owner": "base", "at_s": HALF, "parameters": knocked}
    effect, limits = the_one(diagnosed(random_poses(ARM, ROWS, seed=7), [step], time=TIME))
    assert (effect.label, effect.grade, limits) == ("base_step@base", "A", {})


def test_a_zero_of_the_last_joint_that_jumped_between_mounts_is_no_sure_shift_of_the_target() -> None:
    mount = np.where(np.random.default_rng(1).random(ROWS) < 0.5, "first", "second")
    q = random_poses(ARM, ROWS, seed=7)
    effect, limits = the_one(diagnosed(q, [], zero_of(6, 2e-3 * (mount == "second")), mount=mount))
    assert (effect.label, effect.grade) == ("tool_shift@tool", "B")
    assert [label.owner for label in limits[Reason.ZERO_JUMPED].subjects] == ["joint6"]


def moved(robot: Robot, off: np.ndarray) -> list[str]:
    """Joints whose zero would do in place of a step of the base, by the fit with one."""
    q = random_poses(robot, ROWS, seed=5)
    seen = simulate(perturbed(robot, seed=5), Dataset.from_arrays(q + off, robot=robot), noise=SIGMA, seed=5)
    data = Dataset.from_arrays(q, robot=robot, position=seen.position, time=TIME)
    step = Hypothesis({"effect": "base_step", "owner": "base", "at_s": float(HALF)})
    problem = prepared_problem(robot, data, [step], Noise((SIGMA, 1e-4, SIGMA)), 1)
    state = SearchNode(fit(problem, [step]), Family(1.0, 1.0))
    return [label.owner for because in grading.moved_zeros(state, step) for label in because.subjects]


def test_the_first_axis_may_lie_anywhere_and_slide() -> None:
    """The measuring frame lies askew to the arm; on a track the base slides along joint 1."""
    askew = {"xyz_mm": [700.0, -300.0, 200.0], "rpy_deg": [40.0, -70.0, 25.0]}
    arm = Robot(dict(ARM.spec) | {"base": askew})
    assert moved(arm, zero_of(1, 8e-4 * LATER)) == ["joint1"]
    assert moved(arm, zero_of(1, 8e-4 * LATER) + zero_of(2, 8e-4 * LATER)) == []
    rail = {"type": "prismatic", "theta_deg": 0.0, "d_mm": 0.0, "a_mm": 0.0, "alpha_deg": 90.0, "beta_deg": 0.0}
    joints = [rail | {"min_mm": -500.0, "max_mm": 500.0}, *ARM.spec["joints"][1:]]
    track = Robot(dict(arm.spec) | {"joints": joints})
    assert moved(track, zero_of(1, 3e-4 * LATER)) == ["joint1"]


def test_a_gap_that_the_load_closes_keeps_a_compliance_from_being_sure(shared_data: Path) -> None:
    """Joint 2 has two gaps: a compliance that stops at its corner was sure, and a gap by load was never tried."""
    folder = shared_data / "hidden_effects_3" / "two_gaps_grade_a"
    nominal = load_robot(folder / "robot.yaml")
    found = diagnose(nominal, load_measurements(folder / "measurements.csv", nominal))
    bent = next(f for f in found.effects if f.effect == "joint_compliance_nonlinear")
    assert [f.grade for f in found.effects] == ["B", "B"]
    (because,) = (limit for limit in bent.limits if limit.reason is Reason.OTHER_FORM)
    assert any(str(subject).startswith("backlash@joint2:side=load") for subject in because.subjects)
    assert any("backlash@joint2:side=load" in reason for reason in bent.reasons)


def test_a_name_that_another_form_of_its_effect_does_as_well_as_is_not_sure() -> None:
    """Two laws of a compliance, over loads that hardly leave its first piece."""
    data = simulate(perturbed(ARM, seed=7), random_poses(ARM, ROWS, seed=7), noise=SIGMA, seed=7)
    names = build_library(ARM, data).names
    search = Search(prepared_problem(ARM, data, names, Noise((SIGMA, 1e-4, SIGMA)), 1))
    bent = next(n for n in names if n.key == ("joint_compliance_nonlinear", "joint2"))
    state = search.state([bent], search.start)  # of rows without any: every law does as well
    (because,) = grading.other_forms_that_do(search, state, bent)
    assert because.reason is Reason.OTHER_FORM
    subjects = [str(subject) for subject in because.subjects]
    assert subjects[:2] == [f"joint_compliance_nonlinear@joint2:{law}" for law in ("form=cubic", "torque=payload")]
    assert subjects[2].startswith("backlash@joint2:side=load:width_nm=")
