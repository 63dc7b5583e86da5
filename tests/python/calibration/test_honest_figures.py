# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Numbers that look sure must be sure: few poses, joints that never moved, gross points up to the breakdown point."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special

from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.prediction import predict
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

NOISE = 5e-5
Array = NDArray[np.float64]


@cache
def arm() -> Robot:
    return load_robot("staubli_rx160l")


class Truth:
    """An arm off by 0.5 mm and 0.5 mrad, and what is measured of it."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        start = arm().error_model.start
        self.theta = start + self.rng.normal(0, 5e-4, len(start))

    def postures(self, count: int) -> Array:
        low, high = arm().limits.T
        return self.rng.uniform(low, high, (count, arm().joint_count))

    def points(self, q: Array, noise: float = 0.0) -> Array:
        exact = np.asarray(arm().error_model.predict(_core.Samples(q), self.theta))[:, :3, 3]
        return np.asarray(exact + self.rng.normal(0, noise, exact.shape))

    def error(self, result: CalibrationResult, q: Array) -> Array:
        return np.asarray(result.model.forward(q)[:, :3, 3] - self.points(q))


@pytest.mark.parametrize("poses", [10, 11, 13])
def test_few_poses_have_deviations_that_cover(poses: int) -> None:
    inside = []
    for seed in range(8):
        truth = Truth(seed)
        q = truth.postures(poses)
        result = calibrate(arm(), Dataset.from_arrays(q, position=truth.points(q, NOISE)))
        assert result.degrees_of_freedom >= 3 * poses - len(result.parameters)  # fewer are spent where geometry is held
        assert result.outliers == []
        assert result.sigma > 1e-5
        assert any("degrees of freedom" in note for note in result.notes)
        new = truth.postures(40)
        t = special.stdtrit(result.degrees_of_freedom, 0.975)
        inside.append(np.mean(np.abs(truth.error(result, new)) <= t * result.model.position_deviation(new)))
    assert np.mean(inside) > 0.88
    assert min(inside) > 0.4


@pytest.mark.parametrize("share", [0.3, 0.4, 0.45])
def test_gross_points_up_to_the_breakdown_point_do_no_more_harm_than_if_they_were_missing(share: float) -> None:
    truth = Truth(5)
    q, new = truth.postures(120), truth.postures(100)
    position = truth.points(q, NOISE)
    bad = truth.rng.choice(120, int(share * 120), replace=False)
    direction = truth.rng.normal(size=(len(bad), 3))
    size = truth.rng.uniform(1e-3, 2e-2, (len(bad), 1))
    good = np.setdiff1d(np.arange(120), bad)
    clean = calibrate(arm(), Dataset.from_arrays(q[good], position=position[good]), loss="none")
    position[bad] += size * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    result = calibrate(arm(), Dataset.from_arrays(q, position=position))
    assert result.outliers == sorted(bad.tolist())
    assert result.degrees_of_freedom == clean.degrees_of_freedom
    assert result.sigma == pytest.approx(clean.sigma, rel=0.05)
    assert np.sqrt(np.mean(truth.error(result, new) ** 2)) < 1.3 * np.sqrt(np.mean(truth.error(clean, new) ** 2))


def test_rows_mixed_up_are_set_apart() -> None:
    """Points of 30 % of the rows are those of other rows: off by a metre."""
    truth = Truth(6)
    q = truth.postures(100)
    position = truth.points(q, NOISE)
    bad = truth.rng.choice(100, 30, replace=False)
    position[bad] = position[np.roll(bad, 1)]
    result = calibrate(arm(), Dataset.from_arrays(q, position=position))
    assert result.status == "converged"
    assert result.outliers == sorted(bad.tolist())
    assert result.sigma < 2 * NOISE


@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_the_noise_is_that_of_the_rows_that_are_no_outliers_under_every_loss(loss: str) -> None:
    truth = Truth(7)
    q = truth.postures(100)
    position = truth.points(q, NOISE)
    position[::12] += 0.3
    result = calibrate(arm(), Dataset.from_arrays(q, position=position), loss=loss)
    assert result.outliers == list(range(0, 100, 12))
    assert result.sigma == pytest.approx(NOISE, rel=0.2)


def test_a_joint_that_never_moved_counts_with_a_plausible_size(tmp_path: Path) -> None:
    truth = Truth(8)
    q, new = truth.postures(60), truth.postures(100)
    q[:, 2] = 0.3
    result = calibrate(arm(), Dataset.from_arrays(q, position=truth.points(q, NOISE)))
    error = truth.error(result, new)
    assert np.sqrt(np.mean(error**2)) > 5e-4  # it does matter
    said = predict(result.model, Dataset.from_arrays(new))
    assert np.mean(np.abs(error) < 1.96 * said.sigma_position) > 0.9
    assert sum("joint 3 stood still" in note for note in said.notes) == 1
    assert len(said.notes) == 1
    still = q[:10]
    assert np.median(result.model.position_deviation(still)) < 1e-4  # where it stood, all is known
    assert predict(result.model, Dataset.from_arrays(still)).notes == ()

    result.model.save(tmp_path / "model.yaml")
    again = load_robot(tmp_path / "model.yaml")
    np.testing.assert_array_equal(again.position_deviation(new), result.model.position_deviation(new))
    spec = dict(result.model.spec)
    spec["calibration"] = {k: v for k, v in spec["calibration"].items() if k not in ("held", "covered")}
    old = Robot(spec)  # a file of an older version
    assert np.all(old.position_deviation(new) < result.model.position_deviation(new))
    assert predict(old, Dataset.from_arrays(new)).notes == ()


def test_gauge_directions_that_move_nothing_carry_no_deviation() -> None:
    truth = Truth(9)
    q = truth.postures(60)
    result = calibrate(arm(), Dataset.from_arrays(q, position=truth.points(q, NOISE)))
    record = result.model.record
    assert record is not None
    assert record.directions.shape[1] == len(result.unidentifiable) > 0
    J = result.model.parameter_jacobian(truth.postures(50))
    names = result.model.parameter_names
    moved = J[:, :, [names.index(name) for name in record.moved]] @ record.directions
    assert np.abs(moved).max() < 1e-6  # of a millimetre that is held


def test_a_robot_refuses_a_frame_of_gravity_that_there_is_not() -> None:
    with pytest.raises(InvalidInput, match="gravity_frame must be one of base, measuring, got 'nonsense'"):
        Robot(arm().spec | {"gravity_frame": "nonsense"})


def with_covariance_root(value: float) -> Robot:
    record = {"parameters": ["joint1 d", "tool x"], "covariance_root": [[1e-5], [2e-6, value]], "sigma_mm": 0.03}
    return load_robot(dict(load_robot("ur5").spec) | {"calibration": record | {"degrees_of_freedom": 12}})


@pytest.mark.parametrize("value", [1e308, 1e200])
def test_a_spoilt_covariance_is_refused(value: float) -> None:
    with pytest.raises(ParseError, match=r"covariance_root\[1\]\[1\]"):
        with_covariance_root(value)


@pytest.mark.parametrize("value", [1e99, 1e-99, 0.0, -1.0])
def test_a_covariance_that_is_read_gives_finite_deviations(value: float) -> None:
    q = np.array([[0.1, -0.7, 0.9, 0.3, 0.8, -0.2]])
    assert np.isfinite(with_covariance_root(value).position_deviation(q)).all()
