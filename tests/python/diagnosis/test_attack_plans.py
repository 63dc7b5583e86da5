# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an attack on the diagnosis found of its grades and its plans: findings D5 and D10."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from fastcal import Robot, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.found import Found
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
    asked = SimpleNamespace(library=library, data=slack_rows(), sigma=None, threads=1)
    this = SimpleNamespace(asked=asked, search=slack().search)
    assert Found._stands(this, slack().steps[-1].model)  # type: ignore[arg-type]
    assert not Found._stands(this, slack().steps[0].model)  # type: ignore[arg-type]
    monkeypatch.setattr(Found, "_stands", lambda *_: False)
    (found,) = diagnose(arm(), slack_rows()).effects
    assert found.grade == "B"
    assert Reason.OWN_MODEL in {because.reason for because in found.limits}


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
