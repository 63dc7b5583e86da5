# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A parameter that ends on its bound: no symmetric uncertainty, an interval that covers, and a sentence."""

import numpy as np
import pytest

from fastcal import Robot, load_robot, simulate
from fastcal.calibration.bounds import Bound, bounds_reached
from fastcal.calibration.calibrate import CalibrationResult, IdentifiedParameter, calibrate
from fastcal.calibration.geometry_anchoring import pulls
from fastcal.calibration.problem import prepare
from fastcal.calibration.simulation import random_poses

ARM = load_robot("staubli_rx160l")
EFFECT = "joint_compliance@joint3"
TRUTH = 8e-8  # [rad/(N m)], about one standard deviation


def compliance(result: CalibrationResult) -> IdentifiedParameter:
    return next(p for p in result.parameters if p.name == "compliance_rad_nm")


def calibrated(seed: int, truth: float, *, priors: bool | None = None) -> CalibrationResult:
    entry = {"effect": "joint_compliance", "owner": "joint3", "parameters": {"compliance_rad_nm": truth}}
    true = Robot(ARM.spec | {"effects": [entry]})
    data = simulate(true, random_poses(ARM, 30, seed=seed), noise=5e-5, seed=seed)
    return calibrate(ARM, data, effects=f"geometry,{EFFECT}", loss="none", priors=priors, as_read=True)


@pytest.fixture(scope="module")
def results() -> list[CalibrationResult]:
    return [calibrated(seed, TRUTH) for seed in range(40)]


def test_intervals_cover_whether_or_not_the_bound_is_reached(results: list[CalibrationResult]) -> None:
    inside = 0
    for result in results:
        low, high = result.interval()[result.parameters.index(compliance(result))]
        inside += low <= TRUTH <= high
    reached = sum(compliance(r).bound is not None for r in results)
    assert 2 <= reached <= 20  # the case occurs, and so does the other
    assert inside >= 0.95 * len(results) - 2 * (0.05 * 0.95 * len(results)) ** 0.5


def test_the_estimate_without_the_bound_is_that_of_a_fit_without_it(results: list[CalibrationResult]) -> None:
    seed = next(seed for seed, r in enumerate(results) if compliance(r).bound is not None)
    result = calibrated(seed, TRUTH, priors=False)  # what holds a geometry of few poses moves the compliance as well
    found = compliance(result)
    assert (found.value, found.std) == (0.0, None)
    assert found.bound is not None
    problem = prepare(ARM, result.train.data, effects=f"geometry,{EFFECT}", loss="none")
    free = problem.identify(lower=np.array([]), upper=np.array([]))
    k = next(i for i, p in enumerate(free.parameters) if p.name == "compliance")
    deviation = float(np.sqrt(np.diag(np.asarray(free.covariance))[list(free.free).index(k)]))
    assert found.bound.side == "lower"
    assert found.bound.unbounded < 0
    assert found.bound.unbounded == pytest.approx(free.theta[k], abs=0.02 * deviation)
    assert found.bound.std == pytest.approx(deviation, rel=0.05)
    assert any("joint3 compliance_rad_nm is held at its lower bound 0; unconstrained" in note for note in result.notes)
    (entry,) = result.model.spec["effects"]
    assert entry["parameters"] == {"compliance_rad_nm": {"value": 0.0, "std": None}}
    written = next(p for p in result.to_json_dict()["parameters"] if p["name"] == "compliance_rad_nm")
    assert written["std"] is None
    assert written["bound"] == {"side": "lower", "unbounded": found.bound.unbounded, "std": found.bound.std}
    assert all("bound" not in p for p in result.to_json_dict()["parameters"] if p["std"] is not None)


def test_what_noise_does_not_explain_gets_no_interval() -> None:
    far = Bound("lower", -3e-6, 1e-7)
    assert far.interval(0.0, 2.0) == (0.0, np.inf)
    assert "which noise cannot explain" in far.note("joint6 compliance", 0.0, "rad_nm")
    near = Bound("upper", 5.5, 0.5)
    assert near.interval(5.0, 2.0) == (4.5, 5.0)
    assert "1.0 standard deviations beyond it" in near.note("spring", 5.0, "n_m")
    assert Bound("upper", 9.0, 0.5).interval(5.0, 2.0) == (-np.inf, 5.0)


def test_an_estimate_inside_the_bound_is_not_called_beyond_it() -> None:
    note = Bound("lower", 3e-6, 6e-6).note("joint3 compliance", 0.0, "rad_nm")
    assert "beyond" not in note
    assert "within its bound" in note
    assert "beyond" not in Bound("upper", 4.0, 0.5).note("spring", 5.0, "n_m")


def test_the_estimate_without_the_bound_knows_the_pull_of_the_geometry() -> None:
    """Beside a curve the fit holds the geometry near its fit without: alone, lengths would take what the pull forbids.

    What is held against it is the fit with the pull and no bounds.
    """
    entry = {"effect": "joint_profile", "owner": "joint3", "knots": 8}
    wave = {"effect": "gear_harmonic", "owner": "joint3", "order": 1, "parameters": {"amplitude_rad": 2e-3}}
    q = 0.5 * random_poses(ARM, 60, seed=3)
    data = simulate(Robot(ARM.spec | {"effects": [wave]}), q, noise=5e-5, seed=3)
    problem = prepare(Robot(ARM.spec | {"effects": [entry]}), data, effects=f"geometry,{EFFECT}", loss="none")
    pulled = pulls(problem)
    assert pulled
    limits = problem.limits()
    k = next(i for i, p in enumerate(problem.model.parameters) if p.name == "compliance")
    free = problem.identify(**pulled, lower=np.array([]), upper=np.array([]))
    deviation = float(np.sqrt(np.diag(np.asarray(free.covariance))[list(free.free).index(k)]))
    limits["lower"][k] = free.theta[k] + deviation
    found = problem.identify(**limits, **pulled)
    side, unbounded = bounds_reached(problem, found, {**limits, **pulled})[k]
    assert side == "lower"
    assert unbounded == pytest.approx(free.theta[k], abs=0.05 * deviation)
    without = bounds_reached(problem, found, limits)[k][1]
    assert abs(without - free.theta[k]) > 0.5 * deviation
