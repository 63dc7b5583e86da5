# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches of sockets alone: what they leave falls with the size of the arm, which nothing measured shows.

A real arm of a light build, whose touches miss by millimetres, was once made a hundredth of its size, so that they
missed by micrometres, and nothing was said to be missing.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.postures import too_few_postures
from fastcal.diagnosis import diagnose
from fastcal.diagnosis.doubts import is_another_arm
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.effects.entries import traits_of
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

from .bench_arm import ROWS, TOOL, robot
from .test_known_lengths import SOCKETS, reaching

FloatArray = NDArray[np.float64]


def touches(seed: int, noise: float, off: float, count: int) -> Dataset:
    """`count` touches of each of two sockets by an arm that is off by `off` [m, rad] in its tables."""
    random = np.random.default_rng([seed, 43])
    rows = ROWS.copy()
    rows += off * random.standard_normal(rows.shape)
    at = np.repeat(SOCKETS, count, axis=0) + noise * random.standard_normal((2 * count, 3))
    q = np.concatenate([reaching(rows, TOOL, each, 1, random) for each in at])
    labels = ["a"] * count + ["b"] * count
    return Dataset(q=q, payload=np.zeros(2 * count), observed_labels={"socket": labels})


def moves(arm: Robot, q: FloatArray) -> float:
    """How far the flange is from its mean place, RMS [m]."""
    p = (arm.forward(q) @ np.linalg.inv(arm.T_flange_tool))[:, :3, 3]
    return float(np.sqrt(np.mean(np.sum((p - p.mean(axis=0)) ** 2, axis=1))))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_coarse_arm_keeps_its_size(seed: int) -> None:
    data = touches(seed, 2e-3, 8e-3, 20)
    found = diagnose(robot(), data)
    assert moves(found.model, data.q) == pytest.approx(moves(robot(), data.q), rel=0.1)


def test_a_fit_whose_arm_stands_still_is_another_arm() -> None:
    data = touches(0, 1e-4, 1e-3, 20)
    problem = prepared_problem(robot(), data, [], Noise((1e-4, 1e-4, 1e-4)), 1)
    same = fit(problem, [])
    assert not is_another_arm(same)
    still = same.theta.copy()
    lengths = [i for i, p in enumerate(problem.start.model.robot.parameters) if p.unit == "m" and p.owner != "base"]
    still[lengths] *= 0.5
    assert is_another_arm(replace(same, theta=still))


def test_no_scale_of_an_instrument_is_looked_for_where_there_is_none() -> None:
    library = build_library(robot(), touches(0, 1e-4, 1e-3, 10))
    assert not [name for name in library.names if traits_of(name.entry["effect"]).place == "instrument"]
    assert [lacking for lacking in library.untestable if lacking.effect == "measurement_scale"]


def test_a_touch_of_a_socket_is_three_numbers() -> None:
    data = touches(0, 1e-4, 1e-3, 10)
    assert too_few_postures(data, 59) is None
    assert "60 independent numbers" in str(too_few_postures(data, 60))


def test_sockets_of_a_test_that_no_fit_has_seen_are_judged_where_the_test_puts_them() -> None:
    data = touches(3, 5e-5, 1e-3, 25)
    of_a, of_b = data.select(np.arange(25)), data.select(np.arange(25, 50))
    found = calibrate(robot(), of_a, test=of_b, priors=True)
    assert found.test is not None
    errors = found.test.kinds["socket"].after
    p = found.model.forward(of_b.q)[:, :3, 3]
    np.testing.assert_allclose(errors[:, 0], np.linalg.norm(p - p.mean(axis=0), axis=1), atol=2e-5)
    assert any("socket b: not fitted, so the test itself says where that is" in note for note in found.notes)
    again = calibrate(robot(), data, test=of_a, priors=True)
    assert not any("not fitted" in note for note in again.notes)
