# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an attack on the diagnosis found and no other test holds: findings D5, D8, D9, D10, R5 and R6."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from fastcal import Robot, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis, diagnosis
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.reasons import Reason
from fastcal.measurements.dataset import Dataset

SIGMA = 3e-5  # [m]
ROWS = 120


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


@cache
def slack_rows() -> Dataset:
    """Backlash of joint 4, rows in the order of measuring."""
    q = random_poses(arm(), ROWS, seed=5)
    approach = np.where(np.diff(q, axis=0, prepend=q[:1]) < 0, -1.0, 1.0)
    gap = {"effect": "backlash", "owner": "joint4", "parameters": {"gap_rad": 1e-3}}
    true = Robot(dict(perturbed(arm(), seed=5).spec) | {"effects": [gap]})
    return simulate(true, Dataset.from_arrays(q, robot=arm(), approach=approach), noise=SIGMA, seed=5)


@cache
def slack() -> Diagnosis:
    return diagnose(arm(), slack_rows())


def test_grade_a_is_not_given_where_the_own_model_leaves_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """D5: the diagnosis of its own model found more in 6 of 11 bad answers, nothing in 4 of 4 good ones."""
    (found,) = slack().effects
    assert found.grade == "A"
    library = build_library(arm(), slack_rows())
    this = SimpleNamespace(offered=library, data=slack_rows(), search=slack().search, sigma=None, threads=1)
    assert diagnosis._Found._stands(this, slack().steps[-1].model)  # type: ignore[arg-type]
    assert not diagnosis._Found._stands(this, slack().steps[0].model)  # type: ignore[arg-type]
    monkeypatch.setattr(diagnosis._Found, "_stands", lambda *_: False)
    (found,) = diagnose(arm(), slack_rows()).effects
    assert found.grade == "B"
    assert Reason.OWN_MODEL in {because.reason for because in found.limits}


def test_without_directions_of_approach_nothing_else_is_named_for_lost_motion() -> None:
    """D8: a harmonic was."""
    found = diagnose(arm(), replace(slack_rows(), approach=None, time=None))
    assert not any(f.grade in "AB" for f in found.effects)


def test_p_values_of_an_estimated_noise_are_those_of_f() -> None:
    """D9: they were chi square's, 1e4 times too small with few degrees of freedom."""
    found = diagnose(arm(), slack_rows().select(np.arange(60)))
    (effect,) = found.effects
    freedom = found.search.problem.noise.freedom
    assert np.isfinite(freedom)
    expected = stats.f.sf(effect.snr**2, 1, freedom) * found.search.start.family.named
    assert effect.p_value == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("name", "joint"), [("pmc6va030", 2), ("kuka_kr6_r900", 1)])
def test_a_wave_of_two_and_a_half_cycles_a_turn_is_one_wave(name: str, joint: int) -> None:
    """D9: orders were never refined: 2.5 ended as the orders 2 and 3, both at grade A, or as a curve without a name."""
    wave = {"order": 2.5, "amplitude_rad": 4e-4, "phase_rad": 0.7}
    robot = load_robot(name)
    true = dict(perturbed(robot, seed=7).spec)
    true["effects"] = [{"effect": "gear_harmonic", "owner": f"joint{joint}", "parameters": wave}]
    poses = Dataset.from_arrays(random_poses(robot, ROWS, seed=7), robot=robot)
    (found,) = diagnose(robot, simulate(Robot(true), poses, noise=SIGMA, seed=7)).effects
    assert found.label == f"gear_harmonic@joint{joint}"
    assert found.parameters["order"].value == pytest.approx(2.5, abs=0.04)
    assert found.parameters["amplitude_rad"].value == pytest.approx(4e-4, rel=0.1)


def test_measuring_the_poses_that_are_asked_for_tells_the_names_apart() -> None:
    """D10: the loop of asking, measuring and asking again ends where it promised to."""
    effect = {"effect": "joint_compliance", "owner": "joint3", "parameters": {"compliance_rad_nm": 4e-7}}
    true = Robot(dict(perturbed(arm(), seed=2).spec) | {"effects": [effect]})
    payload = np.random.default_rng(2).choice([0.0, 15.0, 30.0], 100)
    data = simulate(true, random_poses(arm(), 100, seed=3), noise=4e-5, seed=4, payload=payload)
    first = diagnose(arm(), data)
    assert first.verdict == "one_of"
    assert ("joint_compliance", "joint3") in {(first.effects[0].effect, first.effects[0].owner)}
    plan = first.plan
    assert plan is not None
    assert plan.power_after > max(0.8, plan.power_before + 0.1)
    more = simulate(true, plan.poses.q, noise=4e-5, seed=12, payload=plan.poses.payload)
    second = diagnose(arm(), Dataset.concatenate([data, more]))
    assert second.verdict == "named"
    assert [f.label for f in second.effects] == ["joint_compliance@joint3"]


def test_a_posture_that_fits_badly_is_no_crowd_of_outliers() -> None:
    """R5: the rows that called for an effect were thrown out until the rest fitted."""
    q = random_poses(arm(), ROWS, seed=6)
    bent = q.copy()
    bent[:, 2] += 2e-3 * np.exp(-(((q[:, 2] - np.quantile(q[:, 2], 0.15)) / 0.15) ** 2))
    seen = simulate(perturbed(arm(), seed=6), Dataset.from_arrays(bent, robot=arm()), noise=SIGMA, seed=6)
    found = diagnose(arm(), Dataset.from_arrays(q, robot=arm(), position=seen.position))
    assert found.verdict != "none"
    assert len(found.outliers) <= 2
    assert found.search.problem.used.sum() >= ROWS - 2


def test_a_column_may_end_in_a_digit() -> None:
    """R6: `tilt2` was looked for as column 2 of a table `tilt`."""
    poses = Dataset.from_arrays(random_poses(arm(), 60, seed=8), robot=arm())
    rows = simulate(perturbed(arm(), seed=8), poses, noise=SIGMA, seed=8)
    tilt = np.random.default_rng(1).normal(size=60)
    moved = np.asarray(rows.position) + np.outer(tilt, [5e-4, 0.0, 0.0])
    data = replace(rows, position=moved, extra={"tilt2": tilt})
    entry = {"effect": "regressor", "owner": "base", "column": "tilt2"}
    robot = Robot(dict(arm().spec) | {"effects": [entry]})
    assert diagnose(robot, data, sigma=SIGMA).verdict == "none"
    assert diagnose(arm(), data, sigma=SIGMA).verdict != "none"
