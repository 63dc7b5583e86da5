# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes that real laboratories have: weights that nobody knows, loaded friction, settling, instruments, late heat."""

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.last_moves import directions, last_moves
from fastcal.measurements.thermal_lag import lagged
from fastcal.robot.robot import Robot
from fastcal.units import to_si

NOISE = to_si(0.03, "mm")
FAR = 3.5  # standard deviations

CASES: dict[str, dict[str, float]] = {
    "friction@joint3": {"rad_nm": 2e-6},
    "settling@joint2": {"rad_rad": -3e-4},
    "tracker_angle@instrument": {"azimuth_sine_rad": 6e-5, "elevation_cosine_rad": 9e-5},
}


@pytest.mark.parametrize("asked", CASES)
def test_the_truth_is_found_within_its_deviations(asked: str, arm: Robot, poses: Dataset, with_effects: Any) -> None:
    effect, _, owner = asked.partition("@")
    if effect == "settling":
        poses = replace(poses, approach=None, move=last_moves(poses.q, None))
    truth = with_effects(perturbed(arm, seed=8), {"effect": effect, "owner": owner, "parameters": CASES[asked]})
    found = calibrate(arm, simulate(truth, poses, noise=NOISE, seed=21), effects=["geometry", asked])
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.1)
    (entry,) = found.model.spec["effects"]
    for key, got in entry["parameters"].items():
        assert abs(got["value"] - CASES[asked].get(key, 0.0)) < FAR * got["std"], (key, got)
        assert key not in CASES[asked] or abs(got["value"]) > 5 * got["std"]


def test_an_offset_of_the_trackers_lengths_is_found(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    truth = {"effect": "tracker_range", "owner": "instrument", "parameters": {"offset_mm": 0.8}}
    measured = simulate(with_effects(perturbed(arm, seed=8), truth), poses, noise=NOISE, seed=3)
    found = calibrate(arm, measured, effects=["geometry", "tracker_range"])
    plain = calibrate(arm, measured)
    assert found.sigma == pytest.approx(NOISE, rel=0.1)
    assert plain.sigma > 1.3 * NOISE
    offset = found.model.spec["effects"][0]["parameters"]["offset_mm"]
    assert abs(offset["value"] - 0.8) < FAR * offset["std"]
    assert offset["value"] > 5 * offset["std"]


def without_masses(robot: Robot) -> Robot:
    spec = copy.deepcopy(robot.spec)
    for joint in spec["joints"]:
        joint.pop("link", None)
    return Robot(spec)


def test_sag_under_unknown_weights_is_described_without_a_table_of_masses(
    arm: Robot, poses: Dataset, with_effects: Any
) -> None:
    """The truth yields by masses of its own, which the nominal arm's file has not: held-out poses say what remains."""
    soft = {"effect": "joint_compliance", "parameters": {"compliance_rad_nm": 3e-6}}
    truth = with_effects(perturbed(arm, seed=8), soft | {"owner": "joint2"}, soft | {"owner": "joint3"})
    measured = simulate(truth, poses, noise=NOISE, seed=5)
    train, test = measured.select(slice(0, None, 2)), measured.select(slice(1, None, 2))
    bare = without_masses(arm)
    yielding = ["geometry", "joint_compliance@joint2", "joint_compliance@joint3"]
    left = {
        name: calibrate(bare, train, test=test, effects=effects).test.after.rms
        for name, effects in {
            "plain": ["geometry"],
            "payload": yielding,
            "even": [*yielding, "gravity_sag@joint2:moments=even", "gravity_sag@joint3:moments=even"],
            "free": [*yielding, "gravity_sag@joint2", "gravity_sag@joint3"],
        }.items()
    }
    noise = NOISE * 3**0.5
    assert left["plain"] > 8 * noise
    assert left["even"] < 0.5 * left["payload"]
    assert left["free"] < 1.25 * noise


def test_moves_are_those_from_the_row_before() -> None:
    q = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 2.0], [0.7, 1.0]])
    expected = np.array([[0.0, 0.0], [1.0, 0.0], [-0.5, 2.0], [0.2, -1.0]])
    np.testing.assert_allclose(last_moves(q, None), expected)
    # The third row came from a pose that is not in the file: joint 1 went up.
    approach = np.array([[1.0, 1.0], [1.0, -1.0], [1.0, 1.0], [1.0, -1.0]])
    np.testing.assert_allclose(last_moves(q, approach)[2], 0)
    np.testing.assert_allclose(last_moves(q, approach)[3], expected[3])
    np.testing.assert_array_equal(directions(expected), [[0, 0], [1, 0], [-1, 1], [1, -1]])


def test_backlash_takes_the_order_of_rows_where_there_is_no_approach_and_says_so(
    arm: Robot, poses: Dataset, with_effects: Any
) -> None:
    play = {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": 4e-4}}
    by_order = replace(poses, approach=None, move=last_moves(poses.q, None))
    measured = simulate(with_effects(perturbed(arm, seed=8), play), by_order, noise=NOISE, seed=21)
    found = calibrate(arm, measured, effects=["geometry", "backlash@joint3"])
    gap = found.model.spec["effects"][0]["parameters"]["gap_rad"]
    assert abs(gap["value"] - 4e-4) < FAR * gap["std"] < 1e-4
    assert any("no approach column" in note for note in found.notes)


def test_the_filter_is_that_of_its_differential_equation() -> None:
    """Against fine Euler steps of lag dT_f/dt = T - T_f."""
    time = np.array([0.0, 100.0, 250.0, 700.0, 1500.0])
    temperature = np.array([20.0, 22.0, 21.0, 27.0, 26.0])
    fine = np.linspace(0, 1500, 300_001)
    T = np.interp(fine, time, temperature)
    state, seen = T[0], []
    for value in T:
        seen.append(state)
        state += (value - state) * (fine[1] / 400.0)
    order = np.array([3, 0, 4, 1, 2])
    expected = np.interp(time, fine, seen)[order]
    np.testing.assert_allclose(lagged(temperature[order], time[order], 400.0), expected, atol=2e-4)


@pytest.mark.parametrize("lag", [0.3, 40.0, 1e5])
def test_a_steady_rise_is_followed_to_the_last_digits(lag: float) -> None:
    """T = t / 50 from 0: T_f = (t + lag (exp(-t / lag) - 1)) / 50, however near in time the readings lie."""
    time = np.sort(np.random.default_rng(4).uniform(0, 1e3, 2000))
    time[0] = 0.0
    expected = (time + lag * np.expm1(-time / lag)) / 50
    np.testing.assert_allclose(lagged(time / 50, time, lag), expected, rtol=0, atol=1e-12)  # of 20 K


def test_a_lag_that_is_given_is_applied(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    late = {"effect": "thermal_offset", "owner": "joint3", "t0_c": 25.0, "lag_s": 1800.0}
    model = with_effects(arm, late | {"parameters": {"rad_k": 1e-5}})
    T = lagged(np.asarray(poses.temperature), np.asarray(poses.time), 1800.0)
    at_once = with_effects(arm, {**late, "lag_s": 0.0, "parameters": {"rad_k": 1e-5}})
    np.testing.assert_allclose(model.poses(poses), at_once.poses(replace(poses, temperature=T)), atol=1e-13)
    found = calibrate(
        arm, simulate(model, poses, noise=NOISE, seed=2), effects=["thermal_offset@joint3:lag_s=1800:t0_c=25"]
    )
    got = found.model.spec["effects"][0]["parameters"]
    assert abs(got["rad_k"]["value"] - 1e-5) < FAR * got["rad_k"]["std"]
    assert got["lag_s"]["value"] == 1800.0


def test_a_lag_is_found_where_there_is_one(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    late = {"effect": "thermal_expansion", "owner": "robot", "t0_c": 25.0, "parameters": {"coefficient_1_k": 2e-5}}
    for lag in (0.0, 2500.0):
        truth = with_effects(perturbed(arm, seed=4), late | {"lag_s": lag})
        found = calibrate(
            arm, simulate(truth, poses, noise=NOISE, seed=2), effects=["geometry", "thermal_expansion@robot"]
        )
        got = found.model.spec["effects"][0]["parameters"]
        assert abs(got["coefficient_1_k"]["value"] - 2e-5) < FAR * got["coefficient_1_k"]["std"] + 0.03 * 2e-5
        assert found.sigma == pytest.approx(NOISE, rel=0.1)
        if lag == 0:
            assert "lag_s" not in got
        else:
            assert abs(got["lag_s"]["value"] - lag) < FAR * got["lag_s"]["std"] < lag


def test_the_new_names_are_the_cores() -> None:
    names = _core.effect_names()
    assert {"friction", "gravity_sag", "settling", "surrogate", "tracker_angle", "tracker_range"} <= set(names)
