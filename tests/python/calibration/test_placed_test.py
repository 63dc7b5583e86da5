# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A test without stations, beside data of several: it is judged where its own points put the instrument."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import best_motion

NOISE = 3e-5
MOVES = [np.eye(4) for _ in range(3)]
for _k, _move in enumerate(MOVES[1:], start=1):
    _move[:3, :3] = Rotation.from_euler("z", 40 * _k, degrees=True).as_matrix()
    _move[:3, 3] = [0.3 * _k, -0.2, 0.05]


@pytest.fixture(scope="module")
def stations() -> tuple[fastcal.Robot, Dataset, Dataset]:
    """Forty poses at each of two stations, and twenty of a third that the file does not name."""
    robot = fastcal.load_robot("ur5")
    true = fastcal.perturbed(robot, seed=3)
    q = fastcal.random_poses(robot, 100, seed=4)
    found = fastcal.simulate(true, q, noise=NOISE, seed=5)
    assert found.position is not None
    at = np.repeat([0, 1, 2], [40, 40, 20])
    points = np.array([MOVES[k][:3, :3] @ p + MOVES[k][:3, 3] for k, p in zip(at, found.position, strict=True)])
    labels = [f"S{k}" for k in at[:80]]
    data = Dataset.from_arrays(q[:80], position=points[:80], station=labels, robot=robot)
    return robot, data, Dataset.from_arrays(q[80:], position=points[80:], robot=robot, source="test.csv")


def test_a_test_without_stations_is_judged_where_its_points_are(
    stations: tuple[fastcal.Robot, Dataset, Dataset],
) -> None:
    robot, data, test = stations
    found = fastcal.calibrate(robot, data, test=test)
    assert found.test is not None
    assert found.test.after is not None
    # Noise of three coordinates, less the six numbers of sixty that the base takes.
    assert found.test.after.rms == pytest.approx(NOISE * np.sqrt(3 * 54 / 60), rel=0.35)
    assert (
        "test.csv: has no column station: its base is fitted to its own points, where its errors are judged"
        in found.notes
    )
    without = fastcal.calibrate(robot, data)
    np.testing.assert_array_equal(
        [p.value for p in found.parameters], [p.value for p in without.parameters]
    )  # the test decides nothing


def test_diagnose_does_the_same(stations: tuple[fastcal.Robot, Dataset, Dataset]) -> None:
    robot, data, test = stations
    found = fastcal.diagnose(robot, data, test=test)
    assert found.gap[-1].test_rms_mm == pytest.approx(1000 * NOISE * np.sqrt(3 * 54 / 60), rel=0.5)
    assert any("test.csv: has no column station" in note for note in found.notes)


def test_what_cannot_be_placed_is_refused(stations: tuple[fastcal.Robot, Dataset, Dataset]) -> None:
    robot, data, test = stations
    with pytest.raises(InvalidInput, match=r"test.csv: has no column station, and fewer than 6 points"):
        fastcal.calibrate(robot, data, test=test.select(np.arange(5)))
    shifted = replace(data, mount=np.arange(80) % 2, mount_names=("A", "B"))
    assert shifted.position is not None
    shifted.position[1::2, 2] += 0.05
    model = fastcal.calibrate(robot, shifted, effects=["geometry", "tool_shift"], as_read=True, loss="none").model
    from fastcal.calibration.placed_test import placed

    with pytest.raises(InvalidInput, match=r"test.csv: has no column mount"):
        placed(model, test)


def test_the_best_motion_is_the_motion() -> None:
    points = np.random.default_rng(0).normal(size=(12, 3))
    moved = points @ MOVES[2][:3, :3].T + MOVES[2][:3, 3]
    np.testing.assert_allclose(best_motion(points, moved), MOVES[2], atol=1e-12)


@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_a_test_from_elsewhere_says_whether_its_target_sits_turned(turn: float) -> None:
    robot = fastcal.load_robot("ur5")
    true = fastcal.perturbed(robot, seed=3)
    q = fastcal.random_poses(robot, 100, seed=4)
    data = fastcal.simulate(true, q[:60], noise=NOISE, noise_rotation=1e-4, seed=5)
    tool = true.spec["tool"]
    turned = Rotation.from_euler("xyz", tool["rpy_deg"], degrees=True) * Rotation.from_euler("z", turn, degrees=True)
    there = true.with_(
        base={"xyz_mm": [400, 100, 0], "rpy_deg": [0, 0, 20]},
        tool={**tool, "rpy_deg": turned.as_euler("xyz", degrees=True).tolist()},
    )
    test = fastcal.simulate(there, q[60:], noise=NOISE, noise_rotation=1e-4, seed=6)
    (note,) = [n for n in fastcal.calibrate(robot, data, test=test).notes if "stands elsewhere" in n]
    assert ("the target sits turned on the flange" in note) == (turn > 0)
