# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Curves of joints get closer knots where the rows show what coarser ones cannot: ripples of motors and gears."""

from functools import cache

import numpy as np
import pytest

from fastcal import _core, calibrate, diagnose, load_robot, perturbed, random_poses
from fastcal.diagnosis import curves, rules
from fastcal.diagnosis.curves import with_curvatures, with_finer_knots
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.problem import Noise, Problem, prepared_problem
from fastcal.effects.entries import build_effects
from fastcal.io import yaml_file
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec

SIGMA = 3e-5  # [m]
RIPPLED = (0, 1, 2)


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


def measured(q: np.ndarray, seed: int) -> Dataset:
    """Points (N, 3) of the arm at q, joints 1 to 3 off by a few slow waves and many about one in 4 degrees."""
    there = q.copy()
    for joint in RIPPLED:
        random = np.random.default_rng((7, joint))
        for order, size in [*((k, 2e-4) for k in (3.3, 5.1, 8.2)), *((k, 3e-5) for k in random.uniform(70, 100, 6))]:
            there[:, joint] += size * np.sin(order * q[:, joint] + random.uniform(0, 2 * np.pi))
    point = perturbed(arm(), seed=5).forward(there)[:, :3, 3]
    noise = SIGMA * np.random.default_rng(seed).standard_normal(point.shape)
    return Dataset.from_arrays(q, robot=arm(), position=point + noise)


def poses(count: int, seed: int) -> np.ndarray:
    """Joints within 115 degrees, where a thousand rows fill each degree."""
    random = np.random.default_rng(seed)
    return np.asarray(random_poses(arm(), 1, seed=1)[0] + random.uniform(-1.0, 1.0, (count, 6)))


def problem(data: Dataset) -> Problem:
    return prepared_problem(arm(), data, [], Noise((SIGMA, 1e-4, SIGMA)), 1)


def profiles(count: int = 6) -> list[Spec]:
    return [{"effect": "joint_profile", "owner": f"joint{k}"} for k in range(1, count + 1)]


def knots(data: Dataset, curves: list[Spec]) -> list[int | None]:
    at = fit(problem(data), [])
    entries = with_finer_knots(at, with_curvatures(at, curves))
    return [None] * len(curves) if entries is None else [entry.get("knots") for entry in entries]


def test_knots_are_as_close_as_the_finest_wave_asks_and_the_rows_allow() -> None:
    """Two a wave of one motor turn; no more than positions, and one in NUMBERS_PER_KNOT numbers."""
    most = int(2.0 * rules.FINEST_ORDER / np.pi)
    found = knots(measured(poses(1000, 2), 3), profiles(2))
    assert all(k is not None and 0.85 * most <= k <= most for k in found)
    few = knots(measured(poses(120, 2), 3), profiles())
    assert sum(k or 0 for k in few) <= 3 * 120 / curves.NUMBERS_PER_KNOT
    q = poses(1000, 2)
    q[:, 0] = np.linspace(-1.0, 1.0, 12)[np.random.default_rng(0).integers(0, 12, 1000)]
    assert knots(measured(q, 3), profiles(2))[0] is None


def test_a_joint_of_more_than_a_turn_has_one_curve_for_all_turns() -> None:
    q = poses(1000, 2)
    q[:, 5] = np.random.default_rng(1).uniform(-4, 4, 1000)
    at = fit(problem(measured(q, 3)), [])
    coarse = with_curvatures(at, profiles()[5:])
    entries = with_finer_knots(at, coarse)
    assert entries is not None
    (effect,) = build_effects(entries, at.model.robot)
    (before,) = build_effects(coarse, at.model.robot)
    assert entries[0]["periodic"] == 1
    assert len(effect.parameters) > 2 * len(before.parameters)


def test_curvatures_from_a_start_predict_as_well_as_those_that_are_searched_for() -> None:
    at = fit(problem(measured(poses(300, 2), 3)), [])
    searched = [entry["curvature"] for entry in with_curvatures(at, profiles(3))]
    begun = [entry["curvature"] for entry in with_curvatures(at, profiles(3), searched)]
    np.testing.assert_allclose(np.log10(begun), np.log10(searched), atol=0.51)


def test_ripples_are_taken_into_the_curves_of_their_joints() -> None:
    """Waves of 4 degrees are lost between the knots that a curve has of itself."""
    data, test = measured(poses(1000, 2), 3), measured(poses(300, 4), 5)
    found = diagnose(arm(), data, test=test)
    left = found.gap[-1].test_rms_mm
    curves = [e for e in found.model.spec["effects"] if e["effect"] == "joint_profile"]
    assert {f"joint{k + 1}" for k in RIPPLED} <= {e["owner"] for e in curves if "knots" in e}
    assert found.effects == () or all(f.grade == "C" for f in found.effects)
    coarse = calibrate(arm(), data, test=test, effects="geometry,joint_profile").test
    assert left is not None
    assert coarse is not None
    assert coarse.after is not None
    assert left < 0.75e3 * coarse.after.rms
    assert found.sigma_mm == pytest.approx(SIGMA * 1e3, rel=0.25)  # what coarser curves leave was taken for noise


def test_a_model_of_as_many_knots_as_there_may_be_can_be_read_again() -> None:
    """Its file holds the covariance of all its parameters; one of 640 was once written and then refused."""
    parameters = curves.MAX_KNOTS + 100
    assert parameters * (parameters + 1) // 2 + 4 * parameters < yaml_file.MAX_VALUES
    assert 24 * parameters * (parameters + 1) // 2 < yaml_file.MAX_BYTES


def test_the_linear_problem_is_the_same_from_memory() -> None:
    """Effects that follow loads are computed anew; others are taken as they were, to the last bit."""
    data = measured(poses(70, 2), 3)
    for effects in ("geometry,joint_profile", "geometry,joint_profile,joint_compliance"):
        model = calibrate(arm(), data, effects=effects).model
        core, samples = model.error_model, model.samples(data)
        given = problem(data).measured
        memory = _core.TwistMemory()
        theta = np.asarray(core.start)
        for scale in (1.0, 1.1, 0.0):
            args = (core, samples, given, scale * theta, [SIGMA, 1e-4, SIGMA])
            fresh, kept = _core.linearize(*args), _core.linearize(*args, memory=memory)
            np.testing.assert_array_equal(fresh.J, kept.J)
            np.testing.assert_array_equal(fresh.r, kept.r)
