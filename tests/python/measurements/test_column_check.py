# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The guard names what was done to the columns, speaks only where it is sure, and costs one call where all is well."""

import math
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.measurements import column_check as guard
from fastcal.measurements.dataset import Dataset

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
ARM = SimpleNamespace(
    joint_types=["revolute"] * 6, limits=np.tile([-2 * math.pi, 2 * math.pi], (6, 1)), reach=1.2, joint_count=6
)


def tool_point(q: np.ndarray, rows: Rows = ROWS) -> np.ndarray:
    """The flange of T_i = Rz(q) Tz(d) Tx(a) Rx(alpha) in the base (N, 3)."""
    point = np.zeros((len(q), 3))
    for angle, (d, a, alpha) in reversed(list(zip(q.T, rows, strict=True))):
        point = Rotation.from_rotvec([alpha, 0.0, 0.0]).apply(point) + np.array([a, 0.0, d])
        point = Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0])).apply(point)
    return point


def misfit(q: np.ndarray, position: np.ndarray, rows: Rows = ROWS) -> float:
    """RMS distance after the best rigid fit (Kabsch 1976), without a tool."""
    mine, theirs = tool_point(q, rows), position - position.mean(axis=0)
    mine = mine - mine.mean(axis=0)
    u, _, vt = np.linalg.svd(mine.T @ theirs)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return math.sqrt(np.mean(np.sum((mine @ turn - theirs) ** 2, axis=1)))


def measured(rows: Rows = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """Poses and points of an arm whose sizes are off by about a millimetre, seen from somewhere."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.4, 1.4, (80, 6))
    rows = [(d + 1e-3 * rng.normal(), a + 1e-3 * rng.normal(), alpha) for d, a, alpha in rows]
    turn = Rotation.random(rng=rng)
    return q, turn.apply(tool_point(q, rows)) + np.array([2.0, -3.0, 0.5])


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
    "the sign of joint 2 turned and it shifted by -90 deg": shifted(2, -1.0, -math.pi / 2),
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
    found = guard.plausible(data, ARM, misfit)
    assert found is not None
    assert found.meant == meant
    assert found.others == ()
    assert found.rms_meant == pytest.approx(misfit(q, position), rel=0.3)
    assert found.rms_read > 10 * found.rms_meant
    assert f"misses them by {found.rms_read * 1000:.4g} mm RMS" in found.message
    assert f"with {meant} it would be {found.rms_meant * 1000:.4g} mm; nothing was changed" in found.message
    np.testing.assert_array_equal(data.q, before[0])
    np.testing.assert_array_equal(data.position, before[1])


def test_where_all_is_well_it_costs_one_call() -> None:
    q, position = measured()
    calls = []

    def counted(q: np.ndarray, position: np.ndarray) -> float:
        calls.append(len(q))
        return misfit(q, position)

    assert guard.plausible(Dataset.from_arrays(q, position=position), ARM, counted) is None
    assert calls == [60]


def test_it_is_silent_where_nothing_fits() -> None:
    q, position = measured()
    noise = np.random.default_rng(1).normal(scale=0.4, size=position.shape)
    assert misfit(q, position + noise) > 0.2
    assert guard.plausible(Dataset.from_arrays(q, position=position + noise), ARM, misfit) is None


def test_it_is_silent_where_there_is_too_little_to_judge_by() -> None:
    q, position = measured()
    swapped = q[:, [0, 2, 1, 3, 4, 5]]
    assert guard.plausible(Dataset.from_arrays(swapped[:7], position=position[:7]), ARM, misfit) is None
    assert guard.plausible(Dataset.from_arrays(swapped), ARM, misfit) is None
    holes = position.copy()
    holes[7:, 1] = np.nan
    assert guard.plausible(Dataset.from_arrays(swapped, position=holes), ARM, misfit) is None
    holes[:20] = position[:20]
    assert guard.plausible(Dataset.from_arrays(swapped, position=holes), ARM, misfit) is not None


def test_readings_that_cannot_be_told_apart_are_all_named() -> None:
    rows = [ROWS[0], (0.0, 0.0, 0.0), *ROWS[2:]]  # joints 2 and 3 turn about one axis, so that either may be shifted
    q, position = measured(rows=rows)
    data = Dataset.from_arrays(shifted(2, 1.0, math.pi / 2)(q, position)[0], position=position)
    found = guard.plausible(data, ARM, partial(misfit, rows=rows))
    assert found is not None
    assert {found.meant, *found.others} == {"joint 2 shifted by 90 deg", "joint 3 shifted by 90 deg"}
    assert f"mm (or: {found.others[0]}); nothing was changed" in found.message


def test_a_sliding_joint_is_judged_in_lengths() -> None:
    rng = np.random.default_rng(0)
    q = np.column_stack([rng.uniform(-1.5, 1.5, 40), rng.uniform(0.1, 0.6, 40)])
    position = np.column_stack([q[:, 1] * np.cos(q[:, 0]), q[:, 1] * np.sin(q[:, 0]), np.zeros(40)])
    arm = SimpleNamespace(joint_types=["revolute", "prismatic"], limits=np.tile([-9.0, 9.0], (2, 1)), reach=0.6)

    def planar(q: np.ndarray, position: np.ndarray) -> float:
        mine = np.column_stack([q[:, 1] * np.cos(q[:, 0]), q[:, 1] * np.sin(q[:, 0]), np.zeros(len(q))])
        return math.sqrt(np.mean(np.sum((mine - position) ** 2, axis=1))) + 1e-4

    found = guard.plausible(Dataset.from_arrays(q * [1.0, 0.001], position=position), arm, planar)
    assert found is not None
    assert found.meant == "joint 2 in m where they were read in mm"
