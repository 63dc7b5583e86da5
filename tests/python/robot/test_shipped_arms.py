# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Shipped arms against other people's descriptions of them: public URDFs joint by joint, and reaches on data sheets."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal import load_robot, robots

# Joint origins xyz [m], rpy [rad] and axes of public URDFs, the flange last: ROS-Industrial (abb, kuka_experimental,
# fanuc), Universal_Robots_ROS2_Description, franka_description.
# fmt: off
CHAINS = {
    "abb_irb1200_5_90": [
        ((0, 0, 0.3991), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.448), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.042), (0, 0, 0), (1, 0, 0)),
        ((0.451, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.082, 0, 0), (0, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (0, 1.570796327, 0), None),
    ],
    "abb_irb1200_7_70": [
        ((0, 0, 0.3991), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.35), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.042), (0, 0, 0), (1, 0, 0)),
        ((0.351, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.082, 0, 0), (0, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (0, 1.570796327, 0), None),
    ],
    "abb_irb6700_200_260": [
        ((0, 0, 0.78), (0, 0, 0), (0, 0, 1)),
        ((0.32, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 1.125), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.2), (0, 0, 0), (1, 0, 0)),
        ((1.1425, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.2, 0, 0), (0, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (0, 1.570796327, 0), None),
    ],
    "fanuc_lrmate200id": [
        ((0, 0, 0.33), (0, 0, 0), (0, 0, 1)),
        ((0.05, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.33), (0, 0, 0), (0, -1, 0)),
        ((0, 0, 0.035), (0, 0, 0), (-1, 0, 0)),
        ((0.335, 0, 0), (0, 0, 0), (0, -1, 0)),
        ((0.08, 0, 0), (0, 0, 0), (-1, 0, 0)),
        ((0, 0, 0), (3.141592654, -1.570796327, 0), None),
    ],
    "fanuc_m20ia": [
        ((0, 0, 0.525), (0, 0, 0), (0, 0, 1)),
        ((0.15, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.79), (0, 0, 0), (0, -1, 0)),
        ((0, 0, 0.25), (0, 0, 0), (-1, 0, 0)),
        ((0.835, 0, 0), (0, 0, 0), (0, -1, 0)),
        ((0.1, 0, 0), (0, 0, 0), (-1, 0, 0)),
        ((0, 0, 0), (3.141592654, -1.570796327, 0), None),
    ],
    "franka_fr3": [
        ((0, 0, 0.333), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (-1.570796327, 0, 0), (0, 0, 1)),
        ((0, -0.316, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0.0825, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.0825, 0.384, 0), (-1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0.088, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0, 0.107), (0, 0, 0), None),
    ],
    "franka_panda": [
        ((0, 0, 0.333), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (-1.570796327, 0, 0), (0, 0, 1)),
        ((0, -0.316, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0.0825, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.0825, 0.384, 0), (-1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0.088, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0, 0.107), (0, 0, 0), None),
    ],
    "kuka_kr210_r2700": [
        ((0, 0, 0.675), (0, 0, 0), (0, 0, -1)),
        ((0.35, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((1.15, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, -0.041), (0, 0, 0), (-1, 0, 0)),
        ((1.2, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.215, 0, 0), (0, 0, 0), (-1, 0, 0)),
        ((0, 0, 0), (0, 1.570796327, 0), None),
    ],
    "kuka_kr6_r900": [
        ((0, 0, 0.4), (0, 0, 0), (0, 0, -1)),
        ((0.025, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.455, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0, 0, 0.035), (0, 0, 0), (-1, 0, 0)),
        ((0.42, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((0.08, 0, 0), (0, 0, 0), (-1, 0, 0)),
        ((0, 0, 0), (0, 1.570796327, 0), None),
    ],
    "ur10e": [
        ((0, 0, 0.1807), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.6127, 0, 0), (0, 0, 0), (0, 0, 1)),
        ((-0.57155, 0, 0.17415), (0, 0, 0), (0, 0, 1)),
        ((0, -0.11985, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0.11655, 0), (1.570796327, 3.141592654, 3.141592654), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), None),
    ],
    "ur16e": [
        ((0, 0, 0.1807), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.4784, 0, 0), (0, 0, 0), (0, 0, 1)),
        ((-0.36, 0, 0.17415), (0, 0, 0), (0, 0, 1)),
        ((0, -0.11985, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0.11655, 0), (1.570796327, 3.141592654, 3.141592654), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), None),
    ],
    "ur20": [
        ((0, 0, 0.2363), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.862, 0, 0), (0, 0, 0), (0, 0, 1)),
        ((-0.7287, 0, 0.201), (0, 0, 0), (0, 0, 1)),
        ((0, -0.1593, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0.1543, 0), (1.570796327, 3.141592654, 3.141592654), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), None),
    ],
    "ur3e": [
        ((0, 0, 0.15185), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.24355, 0, 0), (0, 0, 0), (0, 0, 1)),
        ((-0.2132, 0, 0.13105), (0, 0, 0), (0, 0, 1)),
        ((0, -0.08535, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0.0921, 0), (1.570796327, 3.141592654, 3.141592654), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), None),
    ],
    "ur5e": [
        ((0, 0, 0.1625), (0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((-0.425, 0, 0), (0, 0, 0), (0, 0, 1)),
        ((-0.3922, 0, 0.1333), (0, 0, 0), (0, 0, 1)),
        ((0, -0.0997, 0), (1.570796327, 0, 0), (0, 0, 1)),
        ((0, 0.0996, 0), (1.570796327, 3.141592654, 3.141592654), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 0), None),
    ],
}
# fmt: on

# Greatest distance of the wrist's centre from the first axis on the makers' data sheets [m], and how exactly it is
# meant. Of UR's arms they say where the tool works well, which is less than the arm can reach.
REACH = {
    "abb_irb1200_5_90": (0.901, 0.001),
    "abb_irb1200_7_70": (0.703, 0.001),
    "abb_irb6700_200_260": (2.60, 0.006),
    "fanuc_lrmate200id": (0.717, 0.001),
    "fanuc_m20ia": (1.811, 0.001),
    "kuka_kr210_r2700": (2.696, 0.006),
    "kuka_kr6_r900": (0.901, 0.001),
}


def by_urdf(chain: list, q: np.ndarray) -> np.ndarray:
    """(4, 4) by the definition of a URDF: origin, then the turn about the axis."""
    T = np.eye(4)
    for (xyz, rpy, axis), angle in zip(chain, [*q, 0.0], strict=True):
        step = np.eye(4)
        turn = Rotation.identity() if axis is None else Rotation.from_rotvec(angle * np.array(axis, float))
        step[:3, :3] = (Rotation.from_euler("xyz", rpy) * turn).as_matrix()
        step[:3, 3] = xyz
        T = T @ step
    return T


@pytest.mark.parametrize("name", CHAINS)
def test_an_arm_is_where_its_public_urdf_puts_it(name: str) -> None:
    robot = load_robot(name)
    q = np.random.default_rng(1).uniform(-3, 3, (25, robot.joint_count))
    expected = np.array([by_urdf(CHAINS[name], row) for row in q])
    np.testing.assert_allclose(robot.forward(q), expected, atol=2e-9)  # their right angles have nine decimals


@pytest.mark.parametrize("name", REACH)
def test_an_arm_reaches_as_far_as_its_data_sheet_says(name: str) -> None:
    """Joints 2 and 3 stretch the arm; the wrist's centre is where the axes of joints 4 to 6 meet."""
    robot = load_robot(name)
    q2, q3 = np.meshgrid(*(np.linspace(*np.deg2rad([-180, 180]), 721),) * 2)
    q = np.zeros((q2.size, 6))
    q[:, 1], q[:, 2] = q2.ravel(), q3.ravel()
    last = robot.spec["joints"][-1]["d_mm"] / 1e3
    T = robot.forward(q)
    towards = 1.0 if name.startswith(("abb", "kuka", "fanuc")) else -1.0
    wrist = T[:, :3, 3] - towards * abs(last) * T[:, :3, 2]
    reach, exact = REACH[name]
    assert np.linalg.norm(wrist[:, :2], axis=1).max() == pytest.approx(reach, abs=exact)


def test_an_iiwa_is_as_high_as_in_its_drawing() -> None:
    for name, height in (("lbr_iiwa7", 1.266), ("lbr_iiwa14", 1.306 + 0.026)):
        flange = load_robot(load_robot(name).spec | {"tool": {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}})
        np.testing.assert_allclose(flange.forward(np.zeros(7))[0, :3, 3], [0, 0, height], atol=1e-12)


@pytest.mark.parametrize("name", robots.available())
def test_a_shipped_arm_is_described_in_one_line(name: str) -> None:
    said = robots.about(name)
    assert 10 < len(said) < 110
    assert "R" in said or name not in robots.serial()
