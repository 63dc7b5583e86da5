# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which joint of a redundant arm to hold: the inertia-load index, after section 6 of the spray paper (docs/papers.md).

    load_i(x)  mean over all other joints of the inertia about the revolute joints, sum of M_jj, while q_i = x  [kg m^2]
    slope_i    mean of |d load_i / d x| over the range of joint i                                  [kg m^2 a rad or m]
    S_i        mean over the workspace of the length of column i of the Jacobian, the tool's point     [m a rad or m]
    index_i    slope_i / S_i: change of inertia where joint i alone makes up for a unit of the tool's error     [kg m]

Means are taken over scrambled Sobol points; what they scatter by from scramble to scramble is their stated error
(A. Owen, "Scrambling Sobol' and Niederreiter-Xing points", 1998).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot

_POSITIONS = 13  # Chebyshev points of a load's curve, whose interpolant is differentiated
_FINE = 101  # points at which the slope is taken


@dataclass(frozen=True, eq=False)
class InertiaLoad:
    """The index of every joint with what it is made of; errors are standard errors of the means.

    Attributes:
        position: (n, K) positions of each joint [rad or m].
        load: (n, K) mean inertia about the revolute joints with the joint there [kg m^2].
        slope: (n,) mean size of the load's change by the joint [kg m^2 a rad or m].
        sensitivity: (n,) S, mean motion of the tool's point by the joint [m a rad or m].
        index: (n,) slope over sensitivity [kg m].
        slope_error: (n,)
        sensitivity_error: (n,)
        index_error: (n,)
    """

    position: FloatArray
    load: FloatArray
    slope: FloatArray
    sensitivity: FloatArray
    index: FloatArray
    slope_error: FloatArray
    sensitivity_error: FloatArray
    index_error: FloatArray

    @property
    def joint(self) -> int:
        """The joint with the largest index, counted from 1: the one to hold."""
        return int(np.argmax(self.index)) + 1

    @property
    def is_singled_out(self) -> bool:
        """Does the largest index exceed the next by more than three standard errors of their difference?"""
        second, first = np.argsort(self.index)[-2:]
        gap = self.index[first] - self.index[second]
        return bool(gap > 3 * np.hypot(self.index_error[first], self.index_error[second]))


def inertia_load(robot: Robot, *, points: int = 512, scrambles: int = 8, seed: int = 0) -> InertiaLoad:
    """The inertia-load index of every joint over the workspace that the limits leave.

    Args:
        robot: Its links' masses count, and no effect.
        points: Sobol points of each mean, a power of 2.
        scrambles: Independent means, from which the errors come.
        seed: The same seed gives the same numbers.

    Raises:
        InvalidInput: A joint has no limits, no link has a mass, or a count is invalid.
    """
    if not np.isfinite(robot.limits).all():
        joint = int(np.argmin(np.isfinite(robot.limits).all(axis=1))) + 1
        raise InvalidInput(f"the inertia load is a mean within the limits, and joint {joint} has none")
    if points < 2 or points & (points - 1):
        raise InvalidInput(f"points must be a power of 2, got {points}")
    if scrambles < 2:
        raise InvalidInput(f"scrambles must be at least 2, to estimate an error, got {scrambles}")
    low, high = robot.limits.T
    turns = np.array([kind == "revolute" for kind in robot.joint_types])
    bare = robot.with_(effects=[])
    nodes = (1 - np.cos(np.pi * (np.arange(_POSITIONS) + 0.5) / _POSITIONS)) / 2
    from scipy.stats import qmc  # takes long to import

    position = low[:, None] + nodes * (high - low)[:, None]
    loads, slopes, sensitivities = [], [], []
    for generator in np.random.default_rng(seed).spawn(scrambles):
        q = low + (high - low) * qmc.Sobol(robot.joint_count, seed=generator).random(points)
        load = np.array([_loads(bare, q, i, position[i], turns) for i in range(robot.joint_count)])
        loads.append(load)
        slopes.append(_slopes(nodes, load) / (high - low))
        sensitivities.append(np.linalg.norm(bare.joint_jacobian(q)[:, :3], axis=1).mean(axis=0))
    if not np.any(loads):
        raise InvalidInput(f"{robot.name} has no link with a mass, so nothing loads its joints")
    slope, slope_error = _mean(np.array(slopes))
    sensitivity, sensitivity_error = _mean(np.array(sensitivities))
    index, index_error = _mean(np.array(slopes) / np.array(sensitivities))
    return InertiaLoad(
        position, np.mean(loads, axis=0), slope, sensitivity, index, slope_error, sensitivity_error, index_error
    )


def _loads(robot: Robot, q: FloatArray, joint: int, at: FloatArray, turns: NDArray[np.bool_]) -> FloatArray:
    """(K,) mean inertia about the revolute joints with one joint at each of K positions."""
    out = np.empty(len(at))
    here = q.copy()
    for k, x in enumerate(at):
        here[:, joint] = x
        M = np.asarray(_core.mass_matrix(robot.core, here))
        out[k] = np.einsum("nii->ni", M)[:, turns].sum(axis=1).mean()
    return out


def _slopes(nodes: FloatArray, load: FloatArray) -> FloatArray:
    """(n,) mean size of d load / d u over u in [0, 1], from the interpolants through the nodes (K,) of load (n, K)."""
    x = 2 * nodes - 1
    coefficients = chebyshev.chebfit(x, load.T, len(nodes) - 1)
    fine = (np.arange(_FINE) + 0.5) / _FINE
    return np.asarray(np.abs(2 * chebyshev.chebval(2 * fine - 1, chebyshev.chebder(coefficients))).mean(axis=1))


def _mean(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean over the scrambles and its standard error."""
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))
