# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Are the uncertainties honest? Many simulated sets of a known truth: do intervals cover it as often as they say?

Each set has its own truth (nominal plus normal errors of 0.5 mm and 0.5 mrad in the parameters that the gauge leaves
free, so that truth and estimate are in the same gauge), its own poses and its own noise. The full count (500 sets,
seeds 0 to 499) runs with FASTCAL_TEST_FULL=1, as `./test --full` sets it; the short form takes the first 60 of them.
"""

import os
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import factor

FULL = os.environ.get("FASTCAL_TEST_FULL") == "1"
SETS = 500 if FULL else 60
POSES = 60
NEW_POSES = 50
NOISE = 5e-5  # m, a tracker's and the arm's repeatability
ERROR_SIZE = 5e-4  # m and rad
GROSS_SHARE = 0.05
LEVEL = 0.95

Array = NDArray[np.float64]


@cache
def arm() -> Robot:
    return load_robot("staubli_rx160l")


def postures(rng: np.random.Generator, count: int) -> Array:
    low, high = arm().limits.T
    return rng.uniform(low, high, (count, arm().joint_count))


def points(theta: Array, q: Array) -> Array:
    return np.asarray(arm().error_model.predict(_core.Samples(q), theta))[:, :3, 3]


@cache
def free_parameters() -> tuple[str, ...]:
    """What the gauge leaves free for such data."""
    rng = np.random.default_rng(12345)
    q = postures(rng, POSES)
    position = points(arm().core.nominal, q) + rng.normal(0, NOISE, (POSES, 3))
    record = calibrate(arm(), Dataset.from_arrays(q, position=position)).model.record
    assert record is not None
    return tuple(record.parameters)


def in_the_table(theta: Array) -> Array:
    """Values (P,) of the free parameters as result.parameters has them: turns from nominal, edge units."""
    values = np.array(theta)
    nominal, moved = arm().core.base_and_tool(arm().core.nominal), arm().core.base_and_tool(theta)
    for first, T_0, T in zip((0, len(theta) - 6), nominal, moved, strict=True):
        values[first + 3 : first + 6] = _core.log_so3(T_0[:3, :3].T @ T[:3, :3])
    at = [arm().parameter_names.index(name) for name in free_parameters()]
    units = [factor("mm" if arm().error_model.parameters[i].unit == "m" else "deg") for i in at]
    return np.asarray(values[at] / units)


@dataclass
class Trial:
    """One simulated set: what was covered, and how far clean new points are predicted from the truth."""

    covered: NDArray[np.bool_]  # (P,)
    points_covered: NDArray[np.bool_]  # (3 NEW_POSES,)
    squares: float  # mean squared distance of predicted from true points, clean data
    squares_gross: float  # the same, a twentieth of the rows spoilt
    squares_plain: float  # plain least squares on the clean data
    found: float  # share of the spoilt rows among the outliers


def prediction_squares(result: CalibrationResult, q: Array, truth: Array) -> float:
    return float(np.mean(np.sum((result.model.forward(q)[:, :3, 3] - truth) ** 2, axis=1)))


def run(seed: int) -> Trial:
    rng = np.random.default_rng(seed)
    theta = np.array(arm().core.nominal)
    for name in free_parameters():
        theta[arm().parameter_names.index(name)] += rng.normal(0, ERROR_SIZE)
    q, q_new = postures(rng, POSES), postures(rng, NEW_POSES)
    position = points(theta, q) + rng.normal(0, NOISE, (POSES, 3))
    truth = points(theta, q_new)

    result = calibrate(arm(), Dataset.from_arrays(q, position=position))
    assert result.status == "converged"
    assert result.model.record is not None
    assert tuple(result.model.record.parameters) == free_parameters(), (
        "another gauge: truth and estimate can't be compared"
    )
    low, high = result.interval(LEVEL).T
    true_values = in_the_table(theta)
    t = stats.t.ppf(0.5 + LEVEL / 2, result.degrees_of_freedom)
    error = result.model.forward(q_new)[:, :3, 3] - truth
    points_covered = np.abs(error) <= t * result.model.position_deviation(q_new)

    spoilt = rng.choice(POSES, round(GROSS_SHARE * POSES), replace=False)
    gross = position.copy()
    direction = rng.normal(size=(len(spoilt), 3))
    gross[spoilt] += (
        rng.uniform(1e-3, 2e-2, (len(spoilt), 1)) * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    )
    with_gross = calibrate(arm(), Dataset.from_arrays(q, position=gross))
    plain = calibrate(arm(), Dataset.from_arrays(q, position=position), loss="none")
    return Trial(
        (low <= true_values) & (true_values <= high),
        points_covered.ravel(),
        prediction_squares(result, q_new, truth),
        prediction_squares(with_gross, q_new, truth),
        prediction_squares(plain, q_new, truth),
        float(np.mean(np.isin(spoilt, with_gross.outliers))),
    )


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return [run(seed) for seed in range(SETS)]


def band(low: float, high: float, spread: float) -> tuple[float, float]:
    """The band that is asked of 500 sets, wider by what fewer sets spread more: 4 deviations less those at 500."""
    more = 4 * spread * (SETS**-0.5 - 500**-0.5)
    return low - more, high + more


def test_intervals_of_all_parameters_cover_as_often_as_they_say(trials: list[Trial]) -> None:
    covered = np.array([trial.covered for trial in trials])
    # Parameters of one set are correlated, so the spread is that of the sets' means.
    low, high = band(0.94, 0.96, float(np.std(covered.mean(axis=1))))
    assert low <= covered.mean() <= high


def test_intervals_of_each_parameter_cover_as_often_as_they_say(trials: list[Trial]) -> None:
    covered = np.mean([trial.covered for trial in trials], axis=0)
    low, high = band(0.91, 0.99, (LEVEL * (1 - LEVEL)) ** 0.5)
    wrong = {
        name: round(float(share), 3)
        for name, share in zip(free_parameters(), covered, strict=True)
        if not low <= share <= high
    }
    assert wrong == {}


def test_intervals_of_predicted_points_cover_as_often_as_they_say(trials: list[Trial]) -> None:
    covered = np.array([trial.points_covered for trial in trials])
    low, high = band(0.93, 0.97, float(np.std(covered.mean(axis=1))))
    assert low <= covered.mean() <= high


def test_gross_points_hardly_move_the_default_loss(trials: list[Trial]) -> None:
    clean, gross, plain = (
        np.sqrt(np.mean([getattr(t, name) for t in trials])) for name in ("squares", "squares_gross", "squares_plain")
    )
    assert gross < 1.10 * clean
    assert gross < 1.10 * plain  # nor does the loss buy this with the clean data's accuracy


def test_gross_points_are_named(trials: list[Trial]) -> None:
    assert np.mean([trial.found for trial in trials]) > 0.99
