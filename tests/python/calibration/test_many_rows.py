# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where rows abound the fit begins on some of them; it ends where that of all rows does."""

from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.alignment import align
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.some_rows import SHOWN_ROWS

ROWS = 12_000  # more than the core's kThinFrom


def measured(robot: fastcal.Robot, rows: int = ROWS, gross: float = 0.0) -> fastcal.Dataset:
    """Rows of an arm off by its tolerances, noise 0.05 mm, a share of them off by centimetres."""
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (rows, robot.joint_count))
    true = fastcal.perturbed(robot, seed=1)
    random = np.random.default_rng(4)
    position = true.forward(q)[:, :3, 3] + random.normal(0, 5e-5, (rows, 3))
    off = random.random(rows) < gross
    position[off] += random.normal(0, 0.02, (int(off.sum()), 3))
    return fastcal.Dataset.from_arrays(q, position=position)


def step_left(problem: CalibrationProblem, found: Any) -> float:
    """Length, in standard deviations, of the Gauss-Newton step that numpy would still take from the solution."""
    near = problem.linearize(np.asarray(found.theta), found.common_noise)
    J, r, row = np.asarray(near.J)[:, found.free], np.asarray(near.r), np.asarray(near.row)
    root = np.sqrt(np.asarray(found.weights)[row])
    J, r = J * root[:, None], r * root
    scale = np.linalg.norm(J, axis=0)
    step = np.linalg.lstsq(J / scale, -r, rcond=None)[0]
    return float(np.linalg.norm(J / scale @ step))


@pytest.mark.parametrize(("loss", "gross"), [("none", 0.0), ("tukey", 0.0), ("tukey", 0.3), ("huber", 0.1)])
def test_nothing_is_left_to_move(loss: str, gross: float) -> None:
    robot = fastcal.load_robot("staubli_rx160l")
    problem = prepare(robot, measured(robot, gross=gross), effects="geometry")
    found = problem.identify(loss=loss)
    assert found.status == "converged"
    assert step_left(problem, found) < 1e-3
    assert found.sigma[0] == pytest.approx(5e-5, rel=0.03)
    assert abs(len(found.outliers) - gross * ROWS) < 0.01 * ROWS + 5


def test_what_few_rows_alone_show_is_found() -> None:
    # Six rows of another station: of every third row two are among those that the fit begins on, too few for its six.
    robot = fastcal.load_robot("staubli_rx160l")
    data = measured(robot)
    assert data.position is not None
    position = data.position.copy()
    position[600:606] += [0.01, -0.02, 0.005]
    station = np.array(["a"] * ROWS)
    station[600:606] = "b"
    labelled = fastcal.Dataset.from_arrays(data.q, position=position, station=station.tolist())
    problem = prepare(robot, labelled, effects="geometry,station_offset")
    found = problem.identify()
    assert step_left(problem, found) < 1e-3
    assert not set(range(600, 606)) & set(found.outliers)
    own = len(problem.model.robot.parameters)
    free = [i for i in found.free if i >= own]
    assert len(free) == 6


def test_base_and_tool_of_very_many_rows_are_those_that_all_rows_would_give() -> None:
    robot = fastcal.load_robot("ur5")
    data = measured(robot, 2 * SHOWN_ROWS)
    found, of_all = prepare(robot, data, effects="geometry").alignment, align(robot, data)
    # what the nominal arm is off by, over the root of so many rows, times a few for the worst direction
    tolerance = 5 * of_all.rms / np.sqrt(SHOWN_ROWS)
    np.testing.assert_allclose(found.T_world_base[:3, 3], of_all.T_world_base[:3, 3], atol=tolerance)
    np.testing.assert_allclose(found.T_flange_tool[:3, 3], of_all.T_flange_tool[:3, 3], atol=tolerance)
    assert not np.array_equal(found.T_world_base, of_all.T_world_base)

    assert data.position is not None
    position = data.position.copy()
    position[1:] = np.nan  # but for the first rows, too few points to find among some
    position[:200] = data.position[:200]
    few = fastcal.Dataset.from_arrays(data.q, position=position)
    np.testing.assert_array_equal(
        prepare(robot, few, effects="geometry").alignment.T_world_base, align(robot, few).T_world_base
    )


def test_threads_change_no_bit() -> None:
    robot = fastcal.load_robot("ur5")
    problem = prepare(robot, measured(robot), effects="geometry")
    first, *others = [problem.with_(threads=threads).identify() for threads in (1, 2, 3, 8)]
    for other in others:
        np.testing.assert_array_equal(other.theta, first.theta)
        np.testing.assert_array_equal(other.covariance, first.covariance)
