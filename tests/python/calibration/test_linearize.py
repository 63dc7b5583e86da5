# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The linear problem near a parameter vector: its rows are those that were measured, its columns their derivatives."""

import numpy as np
import pytest

import fastcal
from fastcal import _core
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

ROWS = 300  # three chunks, the last not full
NOISE = (3e-5, 2e-4, 5e-5)  # of points, of turns, of lengths
EFFECTS = [
    {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": {"value": 2e-6}}},
    {"effect": "gear_harmonic", "owner": "joint3", "order": 2},
    {"effect": "backlash", "owner": "joint1", "parameters": {"gap_rad": {"value": 1e-4}}},
]


@pytest.fixture(scope="module")
def gappy() -> tuple[Robot, Dataset]:
    """Poses with lengths beside them, claims of their own in some rows, and gaps in every kind of number."""
    nominal = fastcal.load_robot("ur10")
    robot = Robot(nominal.spec | {"effects": EFFECTS})
    random = np.random.default_rng(4)
    q = random.uniform(-2, 2, (ROWS, 6))
    T = nominal.forward(q)
    position = T[:, :3, 3] + random.normal(0, 1e-4, (ROWS, 3))
    rotation = np.array([[1.0, 0, 0, 0]] * ROWS)
    distance = np.linalg.norm(position - [1.0, 2.0, 0.5], axis=1)
    position[random.random(ROWS) < 0.3] = np.nan
    position[128:256] = np.nan  # a whole chunk without points
    rotation[random.random(ROWS) < 0.5] = np.nan
    distance[random.random(ROWS) < 0.4] = np.nan
    return robot, Dataset.from_arrays(
        q,
        position=position,
        rotation=rotation,
        distance=distance,
        payload=random.uniform(0, 8, ROWS),
        approach=random.choice([-1.0, 1.0], (ROWS, 6)),
        robot=robot,
    )


def start(robot: Robot) -> np.ndarray:
    """Parameters, and a place of the anchor near its own."""
    return np.append(robot.error_model.start, [1.01, 2.02, 0.49])


def near(robot: Robot, data: Dataset, noise: tuple[float, float, float], threads: int = 1) -> _core.Linearization:
    measured = measurements(data, robot)
    each = noise_by_observation(measured, noise)
    return _core.linearize(robot.error_model, robot.samples(data), measured, start(robot), each, threads)


def test_rows_are_the_measured_numbers_and_columns_their_derivatives(gappy: tuple[Robot, Dataset]) -> None:
    robot, data = gappy
    measured = measurements(data, robot)
    theta = start(robot)
    found = near(robot, data, NOISE)
    left = _core.residuals(robot.error_model, robot.samples(data), measured, theta)
    row, number = np.nonzero(np.isfinite(left))
    np.testing.assert_array_equal(found.row, row)
    np.testing.assert_array_equal(found.number, number)
    counts = [len(of.components) for of in measured.observations]
    deviation = np.repeat(noise_by_observation(measured, NOISE), counts)[number]
    np.testing.assert_allclose(found.r, left[row, number] / deviation, atol=1e-9)
    # J is at the loads as they are: of these parameters, which change none, it is the derivative.
    own = len(robot.core.parameters)
    steady = [k for k, p in enumerate(robot.error_model.parameters) if p.owner == "tool" or k >= own]
    for k in [*steady, *range(len(theta) - 3, len(theta))]:
        step = np.zeros(len(theta))
        step[k] = 1e-6
        ahead, behind = (
            _core.residuals(robot.error_model, robot.samples(data), measured, at) for at in (theta + step, theta - step)
        )
        slope = (ahead - behind)[row, number] / 2e-6 / deviation
        np.testing.assert_allclose(np.asarray(found.J)[:, k], slope, rtol=1e-3, atol=1e-4 * np.abs(slope).max())


def test_bits_do_not_depend_on_the_threads(gappy: tuple[Robot, Dataset]) -> None:
    robot, data = gappy
    one, three = (near(robot, data, NOISE, threads) for threads in (1, 3))
    for part in ("J", "r", "row", "number"):
        assert np.array_equal(getattr(one, part), getattr(three, part)), part


def test_a_number_without_a_standard_deviation_is_refused(gappy: tuple[Robot, Dataset]) -> None:
    robot, data = gappy
    first = int(np.flatnonzero(np.isfinite(data.distance))[0])
    with pytest.raises(InvalidInput, match=f"row {first} has a number without a standard deviation"):
        near(robot, data, (3e-5, 2e-4, 0.0))
