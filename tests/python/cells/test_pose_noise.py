# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses of an arm that turn a little otherwise than its controller says: a camera's place weighed by that."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.cells import calibrate, fit
from fastcal.cells.cell import Arm, Cell, Known, Point
from fastcal.cells.pose_arm import pose_arm, pose_joints, turned_joints
from fastcal.cells.readings import Readings
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose

FloatArray = NDArray[np.float64]

ROWS, DISTANCE = 30, 0.8  # [m] from camera to board
NOISE_M, NOISE_RAD = (1e-3, 1e-3, 3e-3), 2e-3
X = pose({"xyz_mm": [30.0, -60.0, 50.0], "rpy_deg": [5.0, -8.0, 20.0]})  # T_flange_camera
NOWHERE = {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}


def turned(T: FloatArray, by: FloatArray) -> FloatArray:
    """Poses (N, 4, 4) turned by rotation vectors (N, 3) in their own axes."""
    out = T.copy()
    out[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(by).as_matrix()
    return out


def readings(seed: int, turns_rad: float, noise: float = 1.0) -> Readings:
    """Of a board that a camera on the flange looks at from all sides, the flange's poses off by turns."""
    random = np.random.default_rng(seed)
    S = np.tile(np.eye(4), (ROWS, 1, 1))
    S[:, :3, :3] = Rotation.from_rotvec(random.uniform(-0.5, 0.5, (ROWS, 3))).as_matrix()
    S[:, :3, 3] = random.uniform(-0.1, 0.1, (ROWS, 3)) + np.array([0.0, 0.0, DISTANCE])
    A: FloatArray = np.linalg.inv(X @ S).astype(np.float64)  # the board stands at the origin
    A = turned(A, turns_rad * random.standard_normal((ROWS, 3)))
    S[:, :3, 3] += noise * random.standard_normal((ROWS, 3)) * NOISE_M
    S = turned(S, noise * NOISE_RAD * random.standard_normal((ROWS, 3)))

    def wxyz(T: FloatArray) -> FloatArray:
        return np.ascontiguousarray(Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]])

    q = pose_joints(np.ascontiguousarray(A[:, :3, 3]), wxyz(A))
    seen = {"position@board:camera": np.ascontiguousarray(S[:, :3, 3]), "rotation@board:camera": wxyz(S)}
    return Readings(q, seen, "test")


def result(given: Readings) -> calibrate.CellResult:
    arm = Arm("arm", load_robot(pose_arm("arm")), of_poses=True)
    points = (Point("board", "target", "world", NOWHERE), Point("camera", "sensor", arm.flange, NOWHERE))
    return calibrate.calibrate_cell(Cell("test", (arm,), points), given)


def off(found: calibrate.CellResult) -> FloatArray:
    """(6,) shift [m] and turn [rad] of the camera from where it is."""
    D = np.linalg.inv(X) @ pose(next(of.place for of in found.cell.points if of.name == "camera"))
    return np.append(D[:3, 3], Rotation.from_matrix(D[:3, :3]).as_rotvec())


def test_turned_joints_turn_the_flange_about_itself() -> None:
    q = np.array([[0.1, 0.2, 0.3, 0.4, -0.5, 0.6], [0.0, 0.0, 0.0, 1.0, np.pi / 2, 0.0]])  # z, then y, then x
    by = np.array([0.02, -0.01, 0.03])
    found = turned_joints(q, by)
    np.testing.assert_array_equal(found[:, :3], q[:, :3])
    expected = Rotation.from_euler("ZYX", q[:, 3:]) * Rotation.from_rotvec(by)
    np.testing.assert_allclose(Rotation.from_euler("ZYX", found[:, 3:]).as_matrix(), expected.as_matrix(), atol=1e-12)


def test_a_camera_is_found_better_where_the_arm_turns_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    given = [readings(seed, turns_rad=4e-3) for seed in range(8)]
    weighed = np.array([off(result(of)) for of in given])
    monkeypatch.setattr(fit, "settled_poses", lambda *given: None)
    alone = np.array([off(result(of)) for of in given])
    rms = np.sqrt(np.mean(weighed**2, axis=0) / np.mean(alone**2, axis=0))
    assert np.sqrt(np.mean(rms[:3] ** 2)) < 0.85, rms  # turns of 4 mrad move the board by 3.2 mm
    assert np.sqrt(np.mean(rms[3:] ** 2)) < 1.05, rms


def test_joints_are_those_of_the_tree_and_not_in_the_order_of_the_file() -> None:
    """The arm of poses stands on a table that its file has behind it, and that never turns."""
    given = readings(1, turns_rad=4e-3)
    joint = {"type": "revolute", "omega": [0.0, 0.0, 1.0], "point_mm": [0.0, 0.0, 0.0], "min_deg": -90, "max_deg": 90}
    robot = load_robot({"name": "table", "kinematics": "poe", "joints": [joint], "home": NOWHERE})
    table = Arm("table", robot, known=Known(fixed=True))
    arm = Arm("arm", load_robot(pose_arm("arm")), on=table.flange, known=Known(fixed=True), of_poses=True)
    points = (Point("board", "target", "world", NOWHERE), Point("camera", "sensor", arm.flange, NOWHERE))
    cell = Cell("test", (arm, table), points)
    assert [of.name for of in cell.core.branches if of.joint_count] == ["table", "arm"]
    still = replace(given, q=np.column_stack([np.zeros(ROWS), given.q]))
    alone, found = result(given), calibrate.calibrate_cell(cell, still, arms=["arm"])
    assert found.status == "converged"
    np.testing.assert_allclose(off(found), off(alone), atol=1e-6)


def test_nothing_is_lost_where_the_arm_is_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    given = [readings(seed, turns_rad=0.0) for seed in range(20, 28)]
    weighed = np.array([off(result(of)) for of in given])
    monkeypatch.setattr(fit, "settled_poses", lambda *given: None)
    alone = np.array([off(result(of)) for of in given])
    assert np.sqrt(np.mean(weighed**2)) < 1.05 * np.sqrt(np.mean(alone**2))


def test_standard_deviations_are_those_of_what_was_drawn() -> None:
    z = []
    for seed in range(40, 60):
        found = result(readings(seed, turns_rad=2e-3))
        std = [p.std for p in found.parameters if p.owner == "camera" and p.unit == "mm"]
        z += (1e3 * off(found)[:3] / np.array(std, dtype=float)).tolist()
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25  # of 60, each 1 in the mean: 0.82 to 1.18 at two deviations


def test_exact_poses_and_few_rows_go_through() -> None:
    np.testing.assert_allclose(off(result(readings(3, 0.0, noise=0.0))), 0.0, atol=1e-7)
    few = readings(4, turns_rad=1e-3)
    assert result(few.pick(np.arange(6))).status == "converged"


def test_a_pose_that_is_wrong_stays_an_outlier(tmp_path: Path) -> None:
    given = readings(5, turns_rad=2e-3)
    given.tables["position@board:camera"][7] += [0.2, -0.1, 0.0]
    found = result(given)
    assert 7 in found.outliers
    assert np.linalg.norm(off(found)[:3]) < 3e-3
