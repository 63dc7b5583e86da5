# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The fits of a diagnosis: what the data do not show, what is written as a model, and lengths in place of points."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis, diagnose, fits, priors
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import lower_root

SIGMA = 4e-5  # [m]
ROWS = 150


@cache
def cobot() -> Robot:
    """Axes 2, 3, 4 are parallel: shifts of these joints along them are one."""
    return load_robot("ur10")


def rows(effects: list[dict[str, Any]], seed: int = 1, **more: Any) -> Dataset:
    true = perturbed(cobot(), seed=seed)
    true = Robot(dict(true.spec) | {"effects": effects})
    poses = Dataset.from_arrays(random_poses(cobot(), ROWS, seed=seed), robot=cobot(), **more)
    return simulate(true, poses, noise=SIGMA, seed=seed)


@cache
def thermal_pair() -> Diagnosis:
    growth = {"effect": "thermal_expansion", "owner": "robot", "parameters": {"coefficient_1_k": 2.2e-5}}
    offset = {"effect": "thermal_offset", "owner": "joint2", "parameters": {"rad_k": 1.5e-5}}
    return diagnose(cobot(), rows([growth, offset], temperature=np.linspace(20.0, 32.0, ROWS)), sigma=SIGMA)


def test_tests_see_what_the_fit_leaves_along_parallel_axes() -> None:
    """A score test that projects out more than the fit can follow calls a gross misfit enough (findings D1)."""
    found = thermal_pair()
    assert {f.label for f in found.effects} == {"thermal_expansion@robot", "thermal_offset@joint2"}
    fit = found.state.fit
    assert fit.remaining == pytest.approx(fit.freedom, abs=5 * np.sqrt(2 * fit.freedom))


def test_what_the_steps_left_is_that_of_the_rows() -> None:
    fit = thermal_pair().state.fit
    A, r, _row = fit.whitened
    assert fit.squares is not None
    np.testing.assert_allclose(fit.normal, A.T @ A, rtol=1e-9, atol=1e-9 * np.max(A.T @ A))
    np.testing.assert_allclose(fit.beyond(r[:, np.newaxis])[:, 0], r - fit.basis @ (fit.basis.T @ r), atol=1e-7)
    inverse = np.linalg.inv(fit.normal)
    assert fit.freedom == pytest.approx(
        len(fit.near.r) - len(inverse) + np.trace(inverse / held_squares(fit)), rel=1e-9
    )


def test_a_fit_goes_on_from_where_one_of_the_same_rows_ended() -> None:
    begun = thermal_pair().state.fit
    noise = replace(begun.problem.noise, factor=2 * begun.problem.noise.factor)
    again = fits.fit(begun.problem.with_noise(noise), begun.added, begun)
    assert again.near is begun.near  # the whitening but for the factor is the same: nothing was evaluated
    other = fits.fit(begun.problem.with_noise(replace(noise, memory=0.3)), begun.added, begun)
    assert other.near is not begun.near


def held_squares(fit: fits.Fit) -> NDArray[np.float64]:
    return np.asarray(priors.held(fit.prior, fit.pull)[fit.free] ** 2)


def test_the_model_is_the_fit_that_was_judged() -> None:
    found = thermal_pair()
    fit = found.state.fit
    data = fit.problem.kept
    error = found.model.poses(data)[:, :3, 3] - data.position
    by_fit = np.asarray(fit.near.r).reshape(-1, 3) * fit.problem.noise.common[0]
    np.testing.assert_allclose(error, by_fit, atol=1e-9)
    record = found.model.spec["calibration"]
    assert record["degrees_of_freedom"] == int(fit.freedom)


def test_a_parameter_of_another_unit_gives_the_same_model() -> None:
    """A column in rad or in mrad is the same measurement."""
    tilt = np.random.default_rng(0).normal(0.0, 1e-3, ROWS)
    answers = []
    for scale in (1.0, 1e3):
        data = rows([], extra={"tilt": tilt * scale})
        entry = {"effect": "regressor", "owner": "base", "column": "tilt"}
        robot = Robot(dict(cobot().spec) | {"effects": [entry]})
        found = diagnose(robot, data, sigma=SIGMA)
        answers.append(found.model.poses(data)[:, :3, 3])
    np.testing.assert_allclose(answers[0], answers[1], atol=1e-3 * SIGMA)


@pytest.mark.parametrize("gap", [0.0, 8e-4])
def test_lengths_are_diagnosed_and_written(gap: float, tmp_path: Path) -> None:
    slack = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": gap}}
    approach = np.random.default_rng(1).choice([-1.0, 1.0], (ROWS, 6))
    points = rows([slack], approach=approach)
    anchors = np.array([[2.0, 0.5, 0.1], [-1.5, 1.0, 0.4], [0.3, -2.0, 1.2]])
    which = np.arange(ROWS) % 3
    assert points.position is not None
    lengths = np.linalg.norm(points.position - anchors[which], axis=1)
    data = Dataset.from_arrays(
        points.q, robot=cobot(), approach=approach, distance=lengths, anchor=[str(k) for k in which]
    )
    found = diagnose(cobot(), data, test=data)
    found.save(tmp_path / "out")
    written = json.loads((tmp_path / "out" / "diagnosis.json").read_text(), parse_constant=pytest.fail)
    assert [f["effect"] for f in written["effects"]] == (["backlash"] if gap else [])
    assert written["gap"][-1]["kinds"]["length"]["test_rms"] < 1.2 * 1e3 * SIGMA
    assert f"noise alone accounts for {found.floor:.3f} mm" in written["sentence"] or not gap


def test_a_covariance_with_a_lost_direction_has_a_root() -> None:
    """Rounding makes its smallest eigenvalue negative, which ends a Cholesky factorization (findings T3)."""
    covariance = np.diag([1e-8, 1.0, 4.0])
    covariance[1, 2] = covariance[2, 1] = 2.0 * (1 + 1e-12)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(covariance)
    L = lower_root(covariance)
    np.testing.assert_allclose(L, np.tril(L))
    np.testing.assert_allclose(L @ L.T, covariance, rtol=1e-9, atol=1e-18)
