# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches of unknown places, held out whole: what their touches share says nothing of other places.

A light arm whose joints err by waves of a centimetre at the hand, brought to two sockets: its tables can be fitted to
what these touches leave, and miss a third socket by more than the file's own numbers do.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.alignment import measurements
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.touched_places import beside_own, touched_places
from fastcal.diagnosis import diagnose
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.held_out import PLACES, HeldOut
from fastcal.diagnosis.plain_models import Judged, no_worse_elsewhere
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.rivals import Model
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

from .bench_arm import ROWS, TOOL, robot
from .test_known_lengths import SOCKETS, reaching

FloatArray = NDArray[np.float64]

ELSEWHERE = np.array([[0.35, 0.45, 0.5], [0.5, -0.35, 0.05]])


def touches(seed: int, off: float, waves: float, count: int, at: FloatArray) -> Dataset:
    """`count` touches of each point by an arm off by `off` [m, rad] in its tables; its joints err by `waves` [rad]."""
    random = np.random.default_rng([seed, 47])
    rows = ROWS + off * random.standard_normal(ROWS.shape)
    phase = random.uniform(0, 2 * np.pi, 6)
    q = np.concatenate([reaching(rows, TOOL, point, count, random) for point in at])
    q = q - waves * np.sin(3 * q + phase)  # commanded: the arm stands at q, which reaches the point
    labels = [f"{k}" for k in range(len(at)) for _ in range(count)]
    return Dataset(q=q, payload=np.zeros(len(q)), observed_labels={"socket": labels})


def spread(arm: Robot, data: Dataset) -> float:
    """How far touches are from the mean of their socket, RMS [m]."""
    p = arm.forward(data.q)[:, :3, 3]
    labels = np.array(data.observed_labels["socket"])
    own = np.concatenate([p[labels == k] - p[labels == k].mean(axis=0) for k in np.unique(labels)])
    return float(np.sqrt(np.mean(np.sum(own**2, axis=1))))


def test_what_a_place_says_of_itself_is_left_out() -> None:
    values, own = np.array([1.0, 3.0, 8.0]), np.ones((3, 1))
    np.testing.assert_allclose(beside_own(values, own), [-3.0, -1.0, 4.0])
    np.testing.assert_allclose(beside_own(values, own[:, :0]), values)


def test_places_are_held_out_where_touches_are_all_there_is() -> None:
    data = touches(0, 1e-3, 0.0, 6, SOCKETS)
    found = touched_places(data, measurements(data, robot()))
    assert found is not None
    np.testing.assert_array_equal(found, np.repeat([0, 1], 6))
    few = data.select(np.arange(10))  # four of the second
    assert touched_places(few, measurements(few, robot())) is None
    one = data.select(np.arange(6))
    assert touched_places(one, measurements(one, robot())) is None
    points = Dataset(q=data.q, payload=data.payload, position=robot().forward(data.q)[:, :3, 3])
    assert touched_places(points, measurements(points, robot())) is None


def test_a_place_held_out_is_predicted_by_the_others_alone() -> None:
    """By a least-squares fit of the other place's touches, and their spread about their own mean."""
    data = touches(1, 1e-3, 3e-3, 12, SOCKETS)
    problem = prepared_problem(robot(), data, [], Noise((1e-3, 1e-3, 1e-3)), 1)
    at = fit(problem, [])
    found = HeldOut(at, owner=PLACES).squares()
    A, r, row = at.whitened
    first = np.searchsorted(row[row >= 0], 12)
    numbers, prior = len(row[row >= 0]), np.diag(A[row < 0]) ** 2
    of_places = A[:numbers, np.array(at.free) >= len(at.model.parameters)]  # by the place, in axes of the tool
    turned = -1e-3 * of_places.reshape(-1, 3, 2, 3).sum(axis=2)
    for held, others in ((slice(0, first), slice(first, numbers)), (slice(first, numbers), slice(0, first))):
        B = A[others]
        step = np.linalg.solve(B.T @ B + np.diag(prior), B.T @ r[others] + A[row < 0].T @ r[row < 0])
        e = np.einsum("nji,nj->ni", turned[held.start // 3 : held.stop // 3], (r[held] - A[held] @ step).reshape(-1, 3))
        expected = np.sum((e - e.mean(axis=0)) ** 2, axis=1)
        np.testing.assert_allclose(found[np.unique(row[held])], expected, rtol=1e-5)


def test_touches_that_share_what_no_table_holds_are_not_followed() -> None:
    """Nearer to the arm with its tool fitted, which is the best here, than the free fit is, on average of six arms."""
    errors = []
    for seed in range(6):
        data, test = (touches(seed, 3e-4, 8e-3, 20, at) for at in (SOCKETS, ELSEWHERE))
        ways: list[dict[str, Any]] = [{}, {"priors": False}, {"parameters": []}]
        errors.append([spread(calibrate(robot(), data, checks=False, **way).model, test) for way in ways])
    held, free, tool = np.sqrt(np.mean(np.square(errors), axis=0))
    assert tool < free
    assert held < 0.95 * free


def test_an_arm_held_near_nominal_that_meets_other_places_better_is_written() -> None:
    at = SimpleNamespace(problem=SimpleNamespace(arm_size=0.5), added=[])
    held = Judged(Model(SimpleNamespace(names=()), [], at, None, None), np.ones(40), is_plain=True)  # type: ignore[arg-type]
    free = replace(held, model=replace(held.model, fit=SimpleNamespace(problem=SimpleNamespace(arm_size=None))))  # type: ignore[arg-type]
    there, worse = np.full(40, 4.0), np.full(40, 5.0)
    assert no_worse_elsewhere(free, [held]) is free  # of points nothing is asked
    held, better = replace(held, elsewhere=there), replace(free, elsewhere=np.full(40, 3.9))
    assert no_worse_elsewhere(better, [held]) is better
    assert no_worse_elsewhere(replace(free, elsewhere=worse), [held, better]) is held


def test_an_arm_that_is_off_is_calibrated_by_its_touches() -> None:
    data, test = (touches(1, 3e-3, 1e-4, 20, at) for at in (SOCKETS, ELSEWHERE))
    before = spread(robot(), test)
    assert spread(calibrate(robot(), data, checks=False).model, test) < 0.3 * before
    assert spread(diagnose(robot(), data).model, test) < 0.3 * before


def test_touches_that_fix_the_arm_are_fitted_as_before() -> None:
    data = touches(2, 3e-3, 0.0, 20, np.vstack([SOCKETS, ELSEWHERE]))
    assert calibrate(robot(), data, checks=False).held == ""
