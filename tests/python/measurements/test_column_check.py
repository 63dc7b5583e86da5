# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The guard names what was done to the columns, speaks only where it is sure, and fits few readings of good data."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.measurements import plausibility as guard
from fastcal.measurements.dataset import Dataset
from fastcal.robot.given import as_robot
from fastcal.robot.robot import Robot

# An arm like the UR5: (d, a, alpha) a joint [m, rad]; the sizes of its link drawings, the wrist's made unequal.
Rows = list[tuple[float, float, float]]
ROWS: Rows = [
    (0.089, 0.0, math.pi / 2),
    (0.0, -0.425, 0.0),
    (0.0, -0.392, 0.0),
    (0.109, 0.0, math.pi / 2),
    (0.095, 0.0, -math.pi / 2),
    (0.082, 0.06, 0.0),
]


@cache
def arm(rows: tuple[tuple[float, float, float], ...] = tuple(ROWS)) -> Robot:
    """The arm of T_i = Rz(q) Tz(d) Tx(a) Rx(alpha)."""
    joints = [
        {"type": "revolute", "theta_deg": 0, "d_mm": 1000 * d, "a_mm": 1000 * a, "alpha_deg": math.degrees(alpha)}
        | {"min_deg": -360, "max_deg": 360}
        for d, a, alpha in rows
    ]
    return as_robot({"name": "arm", "kinematics": "dh", "joints": joints})


ARM = arm()
BASE = Rotation.random(rng=np.random.default_rng(9))


def poses(q: np.ndarray, rows: Rows = ROWS) -> np.ndarray:
    """The flange in the base (N, 4, 4)."""
    return arm(tuple(rows)).forward(q)


def tool_point(q: np.ndarray, rows: Rows = ROWS) -> np.ndarray:
    """The flange in the base (N, 3)."""
    return poses(q, rows)[:, :3, 3]


def misfit(q: np.ndarray, position: np.ndarray, rows: Rows = ROWS) -> float:
    """RMS distance after the best rigid fit (Kabsch 1976), without a tool."""
    mine, theirs = tool_point(q, rows), position - position.mean(axis=0)
    mine = mine - mine.mean(axis=0)
    u, _, vt = np.linalg.svd(mine.T @ theirs)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return math.sqrt(np.mean(np.sum((mine @ turn - theirs) ** 2, axis=1)))


def measured(rows: Rows = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """Poses and points of an arm whose sizes are off by about a millimetre, seen from somewhere."""
    q = np.random.default_rng(0).uniform(-1.4, 1.4, (80, 6))
    return q, measured_at(q, rows)


def measured_at(q: np.ndarray, rows: Rows = ROWS) -> np.ndarray:
    """Points (N, 3) of that arm at q (N, 6)."""
    rng = np.random.default_rng(1)
    rows = [(d + 1e-3 * rng.normal(), a + 1e-3 * rng.normal(), alpha) for d, a, alpha in rows]
    return BASE.apply(tool_point(q, rows)) + np.array([2.0, -3.0, 0.5])


def shifted(joint: int, sign: float, shift: float) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    def slip(q: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = q.copy()
        q[:, joint - 1] = sign * (q[:, joint - 1] - shift)
        return q, p

    return slip


SLIPS = {
    "the points in m where they were read in mm": lambda q, p: (q, p / 1000),
    "the points in mm where they were read in m": lambda q, p: (q, p * 1000),
    "the points in in where they were read in mm": lambda q, p: (q, p / 25.4),
    "the points in mm where they were read in in": lambda q, p: (q, p * 25.4),
    "all revolute joints in deg where they were read in rad": lambda q, p: (np.degrees(q), p),
    "all revolute joints in rad where they were read in deg": lambda q, p: (np.radians(q), p),
    "joint 2 in rad where they were read in deg": lambda q, p: (q * [1, math.pi / 180, 1, 1, 1, 1], p),
    "the columns of joints 2 and 3 swapped": lambda q, p: (q[:, [0, 2, 1, 3, 4, 5]], p),
    "the columns of joints 1 and 5 swapped": lambda q, p: (q[:, [4, 1, 2, 3, 0, 5]], p),
    "the sign of joint 3 turned": shifted(3, -1.0, 0.0),
    "joint 2 shifted by 90 deg": shifted(2, 1.0, math.pi / 2),
    "joint 3 shifted by -90 deg": shifted(3, 1.0, -math.pi / 2),
    "joint 5 shifted by 180 deg": shifted(5, 1.0, math.pi),
    "the sign of joint 2 turned and joint 2 shifted by -90 deg": shifted(2, -1.0, -math.pi / 2),
    "one axis of the points turned round or two of them swapped (they are left-handed)": lambda q, p: (
        q,
        p[:, [1, 0, 2]],
    ),
}


@pytest.mark.parametrize("meant", SLIPS)
def test_a_slip_is_named_with_its_evidence(meant: str) -> None:
    q, position = measured()
    data = Dataset.from_arrays(*SLIPS[meant](q, position)[:1], position=SLIPS[meant](q, position)[1])
    before = data.q.copy(), data.position.copy()
    found = guard.plausible(data, ARM, poses)
    assert found is not None
    assert meant in (found.meant, *found.others)  # with a free tool, joint 6 turned is joint 5 at 180 deg
    read, better = (float(text.removesuffix(" mm")) for text in (found.read, found.better))
    assert better == pytest.approx(1000 * misfit(q, position), rel=0.3)
    assert read > 10 * better
    assert f"misses them by {found.read} RMS" in found.message
    assert f"with {found.meant} it would be {found.better}" in found.message
    np.testing.assert_array_equal(data.q, before[0])
    np.testing.assert_array_equal(data.position, before[1])


def one_joint_after_the_other() -> np.ndarray:
    """(36, 6) six positions of each joint, the others where they are, as of a circle-point analysis."""
    q = np.tile([0.8, 0.0, 0.0, 0.0, 0.0, 0.0], (36, 1))
    for joint in range(6):
        q[6 * joint : 6 * joint + 6, joint] = np.linspace(-1.0, 1.1, 6)
    return q


SHOWN_BY_A_PART = {  # by the sweep of joint 2 alone, or of joint 4 alone
    "q3 + q2 for joint 3": (2, 1, -1.0),
    "the sign of joint 4 turned": (3, 3, -2.0),
}


@pytest.mark.parametrize("meant", SHOWN_BY_A_PART)
def test_a_slip_that_a_part_of_the_rows_shows_is_named(meant: str) -> None:
    """A robust fit left those out as gross, and said nothing: 12 of 36 rows of a FANUC, by 413 mm."""
    q = one_joint_after_the_other()
    position = measured_at(q)
    joint, source, factor = SHOWN_BY_A_PART[meant]
    written = q.copy()
    written[:, joint] += factor * q[:, source]
    found = guard.plausible(Dataset.from_arrays(written, position=position), ARM, poses)
    assert found is not None
    assert meant in (found.meant, *found.others)
    assert guard.plausible(Dataset.from_arrays(q, position=position), ARM, poses) is None


def test_gross_rows_are_no_slip() -> None:
    """Seven points of 36 that are off by a tenth of the reach, by no reading of the joints."""
    q = one_joint_after_the_other()
    position = measured_at(q)
    random = np.random.default_rng(4)
    position[random.choice(36, 7, replace=False)] += random.normal(0, 0.1, (7, 3))
    assert guard.plausible(Dataset.from_arrays(q, position=position), ARM, poses) is None


def test_where_all_is_well_little_is_computed() -> None:
    q, _ = measured()
    position = tool_point(q) + np.random.default_rng(1).normal(scale=2e-4, size=(len(q), 3))
    rows = []

    def counted(q: np.ndarray) -> np.ndarray:
        rows.append(len(q))
        return poses(q)

    assert guard.plausible(Dataset.from_arrays(q, position=position), ARM, counted) is None
    assert sum(rows) < 20_000


def test_it_is_silent_where_nothing_fits() -> None:
    q, position = measured()
    noise = np.random.default_rng(1).normal(scale=0.4, size=position.shape)
    assert misfit(q, position + noise) > 0.2
    assert guard.plausible(Dataset.from_arrays(q, position=position + noise), ARM, poses) is None


def test_it_is_silent_where_there_is_too_little_to_judge_by() -> None:
    q, position = measured()
    swapped = q[:, [0, 2, 1, 3, 4, 5]]
    assert guard.plausible(Dataset.from_arrays(swapped[:7], position=position[:7]), ARM, poses) is None
    assert guard.plausible(Dataset.from_arrays(swapped), ARM, poses) is None
    holes = position.copy()
    holes[7:, 1] = np.nan
    assert guard.plausible(Dataset.from_arrays(swapped, position=holes), ARM, poses) is None
    holes[:20] = position[:20]
    assert guard.plausible(Dataset.from_arrays(swapped, position=holes), ARM, poses) is not None


def test_readings_that_cannot_be_distinguished_are_all_named() -> None:
    rows = [ROWS[0], (0.0, 0.0, 0.0), *ROWS[2:]]  # joints 2 and 3 turn about one axis, so that either may be shifted
    q, position = measured(rows=rows)
    data = Dataset.from_arrays(shifted(2, 1.0, math.pi / 2)(q, position)[0], position=position)
    found = guard.plausible(data, ARM, partial(poses, rows=rows))
    assert found is not None
    assert {found.meant, found.others[0]} == {"joint 2 shifted by 90 deg", "joint 3 shifted by 90 deg"}
    assert f"mm (or: {found.others[0]}" in found.message


def test_a_sliding_joint_is_judged_in_lengths() -> None:
    rng = np.random.default_rng(0)
    q = np.column_stack([rng.uniform(-1.5, 1.5, 40), rng.uniform(0.1, 0.6, 40)])
    position = np.column_stack([q[:, 1] * np.cos(q[:, 0]), q[:, 1] * np.sin(q[:, 0]), np.zeros(40)])
    slide = SimpleNamespace(
        joint_types=["revolute", "prismatic"],
        limits=np.tile([-9.0, 9.0], (2, 1)),
        reach=0.6,
        mimics=(),
        passive=(),
        follow=lambda q: q,
    )

    def plane_poses(q: np.ndarray) -> np.ndarray:
        T = np.tile(np.eye(4), (len(q), 1, 1))
        T[:, :3, :3] = Rotation.from_rotvec(np.outer(q[:, 0], [0.0, 0.0, 1.0])).as_matrix()
        T[:, :3, 3] = np.column_stack([q[:, 1] * np.cos(q[:, 0]), q[:, 1] * np.sin(q[:, 0]), np.zeros(len(q))])
        return T

    found = guard.plausible(Dataset.from_arrays(q * [1.0, 0.001], position=position), slide, plane_poses)
    assert found is not None
    # Or the points: the arm has no other size.
    assert "joint 2 in m where they were read in mm" in (found.meant, *found.others)


def test_an_error_far_below_a_hundredth_of_the_reach_is_asked_too() -> None:
    """A short lever: the wrist's sign costs 3 mm of 1,200, and the right reading fits to a tenth of that."""
    rows = [*ROWS[:5], (0.01, 0.0015, 0.0)]
    q, position = measured(rows=rows)
    position = tool_point(q, rows)
    turned = q * [1.0, 1.0, 1.0, 1.0, 1.0, -1.0]
    assert misfit(turned, position, rows) < 0.003
    data = Dataset.from_arrays(turned, position=position + np.random.default_rng(2).normal(scale=2e-5, size=(80, 3)))
    found = guard.plausible(data, ARM, partial(poses, rows=rows))
    assert found is not None
    assert found.meant == "the sign of joint 6 turned"


def test_read_back_joints_and_a_slip_of_a_row_are_tried() -> None:
    q, position = measured()
    commanded = q + np.random.default_rng(4).normal(scale=0.1, size=q.shape)
    found = guard.plausible(Dataset.from_arrays(commanded, q_read=q, position=position), ARM, poses)
    assert found is not None
    assert found.meant == "the joint positions read back in place of those commanded"
    slipped = Dataset.from_arrays(q, position=np.roll(position, 1, axis=0))
    found = guard.plausible(slipped, ARM, poses)
    assert found is not None
    assert found.meant == "the points one row lower than the joints"


def turned(q: np.ndarray, base: Rotation | None = None) -> Rotation:
    """Orientations of the arm as measured in a frame, with a target put on somehow and 0.02 deg of noise."""
    rng = np.random.default_rng(3)
    noise = Rotation.from_rotvec(rng.normal(scale=math.radians(0.02), size=(len(q), 3)))
    return (base or BASE) * Rotation.from_matrix(poses(q)[:, :3, :3]) * Rotation.random(rng=rng) * noise


def as_angles(angles: np.ndarray) -> dict[str, np.ndarray]:
    """What a reader makes of the columns rx, ry, rz [rad]: fixed axes X, Y, Z."""
    x, y, z, w = Rotation.from_euler("xyz", angles).as_quat().T
    return {"rotation": np.column_stack([w, x, y, z]), "rotation_angles": angles}


def as_quaternion(columns: np.ndarray) -> dict[str, np.ndarray]:
    return {"rotation": columns}


WRITTEN: dict[str, tuple[Callable[[Rotation], dict[str, np.ndarray]], str]] = {
    "xyzw": (lambda R: as_quaternion(R.as_quat()), "the quaternion as qx qy qz qw under qw qx qy qz"),
    "conjugate": (lambda R: as_quaternion(R.inv().as_quat()[:, [3, 0, 1, 2]]), "inverted"),
    "intrinsic XYZ": (lambda R: as_angles(R.as_euler("XYZ")), "intrinsic XYZ Euler angles"),
    "ABC": (lambda R: as_angles(R.as_euler("ZYX")), "KUKA's A, B, C"),
    "ZYZ": (lambda R: as_angles(R.as_euler("ZYZ")), "ZYZ Euler angles"),
    "extrinsic YXZ": (lambda R: as_angles(R.as_euler("yxz")), "extrinsic YXZ Euler angles"),
    "rotation vector": (lambda R: as_angles(R.as_rotvec()), "a rotation vector"),
    "rad read as deg": (lambda R: as_angles(R.as_euler("xyz") * math.pi / 180), "in rad where they were read in deg"),
    "deg read as rad": (lambda R: as_angles(R.as_euler("xyz") * 180 / math.pi), "in deg where they were read in rad"),
    "ZXZ": (lambda R: as_angles(R.as_euler("ZXZ")), "ZXZ Euler angles"),
    "inverse": (lambda R: as_angles(R.inv().as_euler("xyz")), "inverted"),
    "a vector in rad read as deg": (lambda R: as_angles(R.as_rotvec() * math.pi / 180), "vector, in rad where"),
}


@pytest.mark.parametrize("written", WRITTEN)
@pytest.mark.parametrize("with_points", [True, False])
def test_another_convention_of_orientation_is_named(written: str, with_points: bool) -> None:
    q, position = measured()
    columns, words = WRITTEN[written][0](turned(q)), WRITTEN[written][1]
    angles = columns.pop("rotation_angles", None)
    data = Dataset.from_arrays(q, position=position if with_points else None, **columns)
    found = guard.plausible(replace(data, rotation_angles=angles), ARM, poses)
    assert found is not None
    assert words in " ".join([found.meant, *found.others])
    assert found.what == "orientations"
    assert float(found.read.removesuffix(" deg")) > 20.0
    assert float(found.better.removesuffix(" deg")) < 0.05


@pytest.mark.parametrize("noise_deg", [0.0, 0.5, 20.0])
def test_right_orientations_are_left_alone(noise_deg: float) -> None:
    q, position = measured()
    noise = Rotation.from_rotvec(np.random.default_rng(5).normal(scale=math.radians(noise_deg), size=(80, 3)))
    R = turned(q) * noise
    for columns in (as_quaternion(R.as_quat()[:, [3, 0, 1, 2]]), as_angles(R.as_euler("xyz"))):
        angles = columns.pop("rotation_angles", None)
        data = replace(Dataset.from_arrays(q, position=position, **columns), rotation_angles=angles)
        assert guard.plausible(data, ARM, poses) is None


def test_a_joint_that_only_the_orientation_shows_is_named() -> None:
    """The point lies on the last axis."""
    rows = [*ROWS[:5], (0.082, 0.0, 0.0)]
    q, _ = measured()
    R = Rotation.from_matrix(poses(q, rows)[:, :3, :3])
    data = Dataset.from_arrays(
        q * [1.0, 1.0, 1.0, 1.0, 1.0, -1.0], position=tool_point(q, rows), rotation=R.as_quat()[:, [3, 0, 1, 2]]
    )
    found = guard.plausible(data, ARM, partial(poses, rows=rows))
    assert found is not None
    assert found.meant == "the sign of joint 6 turned"
    assert found.what == "orientations"
