# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints that repeat badly: noise that grows with reach, no missing effect, and none passes for it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fastcal import Robot, diagnose, load_robot, perturbed, random_poses
from fastcal.diagnosis.decorrelation import decorrelated, joint_noise, joint_share
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.noise import repeats
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.measurements.dataset import Dataset

SIGMA = 3e-5  # [m]
BACKLASH = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": 2e-3}}


def rows(
    repeatability: float, effects: list[dict[str, Any]] | None = None, seed: int = 1, count: int = 160, visits: int = 1
) -> Dataset:
    """A UR10e off by 0.5 mm and 0.5 mrad whose joints stop off by `repeatability` [rad]; visits come one by one."""
    rng = np.random.default_rng(seed)
    true = Robot(dict(perturbed(load_robot("ur10e"), seed=seed).spec) | {"effects": effects or []})
    q = np.tile(random_poses(true, count // visits, seed=seed), (visits, 1))
    asked = Dataset.from_arrays(q, approach=np.tile(rng.choice([-1.0, 1.0], (count // visits, 6)), (visits, 1)))
    stopped = replace(asked, q=q + repeatability * rng.standard_normal(q.shape))
    points = true.poses(stopped)[:, :3, 3] + SIGMA * rng.standard_normal((len(q), 3))
    return replace(asked, position=points, source="simulated")


@pytest.mark.parametrize("visits", [1, 2])
def test_an_arm_that_repeats_badly_lacks_nothing(visits: int) -> None:
    found = diagnose("ur10e", rows(2e-4, visits=visits))
    assert found.verdict == "none"
    noise = found.search.problem.noise
    assert 1.6e-4 < noise.repeatability * noise.factor < 2.5e-4
    assert "the joints repeat to about 0." in found.sigma_note
    assert "errors grow with reach" in found.sigma_note
    (kind,) = found.noise.values()
    assert kind.value == pytest.approx(np.hypot(noise.factor * 1e-4, joint_share(found.search.problem)), rel=1e-3)
    assert kind.value > 1.2e-4  # of a coordinate: what the joints make of it is noise as well


def test_an_effect_is_found_beside_it() -> None:
    said = diagnose("ur10e", rows(2e-4, [BACKLASH]))
    assert [(one.label, one.grade) for one in said.effects] == [("backlash@joint2", "A")]
    size = said.effects[0].parameters["gap_rad"]
    assert size.std is not None
    assert abs(size.value - 2e-3) < 4 * size.std
    assert said.search.problem.noise.repeatability > 0


def test_fits_are_generalized_least_squares() -> None:
    """Beside the dense matrix sigma^2 + k^2 J J^T, J by differences of the nominal arm; some rows without a number."""
    data, arm, k = rows(2e-4), load_robot("ur10e"), 2e-4
    assert data.position is not None
    points = data.position.copy()
    points[5, 1] = points[9] = np.nan
    noise = Noise((SIGMA, 1e-4, SIGMA), factor=1.5, repeatability=k / 1.5)
    problem = prepared_problem(arm, replace(data, position=points), [], noise, 1)
    used = problem.used.copy()
    used[[3, 4, 70]] = False
    problem = problem.with_rows(used)
    at = fit(problem, [])
    J = np.zeros((len(data), 3, 6))
    for i, step in enumerate(1e-6 * np.eye(6)):
        J[:, :, i] = (arm.forward(data.q + step)[:, :3, 3] - arm.forward(data.q - step)[:, :3, 3]) / 2e-6
    seen = np.flatnonzero(~np.isnan(points[used]))
    lever = J[used].reshape(-1, 6)[seen]
    row = seen // 3
    np.testing.assert_array_equal(at.near.row, np.unique(row, return_inverse=True)[1])
    C = (1.5 * SIGMA) ** 2 * np.eye(len(row)) + k**2 * np.equal.outer(row, row) * (lever @ lever.T)
    r = SIGMA * at.near.r
    white = decorrelated(problem, at.near.r / 1.5, at.near.row)
    assert white @ white == pytest.approx(r @ np.linalg.solve(C, r), rel=5e-3)
    logs = joint_noise(problem, at.near.row).log_determinant(noise.repeatability)
    assert logs == pytest.approx(np.linalg.slogdet(C / (1.5 * SIGMA) ** 2)[1], rel=5e-3)


def test_visits_scatter_by_what_joints_make_of_them() -> None:
    """Without it pure error is that of the instrument."""
    data = rows(2e-4, visits=4)
    problem = prepared_problem(load_robot("ur10e"), data, [], Noise((SIGMA, 1e-4, SIGMA), repeatability=2e-4), 1)
    raw, white = repeats(data), repeats(data, problem)
    assert raw is not None
    assert white is not None
    assert raw[0] > 1.2e-4
    assert white[0] == pytest.approx(SIGMA, rel=0.15)
    assert raw[1] == white[1] == 3 * 120


def test_what_comes_again_at_each_visit_is_no_noise() -> None:
    """Joints that are off alike whenever they are sent to a posture: an error of the arm without a name."""
    once = rows(0.0, count=80)
    true, rng = perturbed(load_robot("ur10e"), seed=1), np.random.default_rng(2)
    move = true.forward(once.q + 2e-4 * rng.standard_normal(once.q.shape)) - true.forward(once.q)
    assert once.position is not None
    assert once.approach is not None
    again = once.position + move[:, :3, 3] + SIGMA * rng.standard_normal((80, 3))
    position = np.vstack([once.position + move[:, :3, 3], again])
    q, approach = np.tile(once.q, (2, 1)), np.tile(once.approach, (2, 1))
    found = diagnose("ur10e", Dataset.from_arrays(q, position=position, approach=approach))
    assert found.search.problem.noise.repeatability == 0
