# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sides of a slack that nobody has recorded: one joint's position divides the rows, where all joints may jump."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot
from fastcal_studies.simulated import FloatArray, left

FEWEST = 5  # different positions of the dividing joint on either side
LEAST = 1e-6  # singular value of a combination of parameters that is still one, over the largest


@dataclass(frozen=True)
class Sides:
    """Which side each row is on: +1 where a joint lies beyond a position, else -1.

    Attributes:
        joint: From 1.
        position: [rad or m].
    """

    joint: int
    position: float

    def __call__(self, q: FloatArray) -> FloatArray:
        """(N,) +1 or -1 at q (N, n)."""
        return np.where(q[:, self.joint - 1] > self.position, 1.0, -1.0)

    def marked(self, data: Dataset) -> Dataset:
        """The rows with every joint approached from the side that they are on, which is what `backlash` takes."""
        return replace(data, approach=np.repeat(self(data.q)[:, np.newaxis], data.q.shape[1], axis=1))


def found_sides(model: Robot, data: Dataset) -> Sides:
    """The division that explains most of what a model leaves when its parameters may move with it.

        min over joint, position, g, x  |r - A x - s(q_joint > position) J g|^2

    r the residuals, A their derivatives by all parameters, J those by the joints, s the side. Positions are tried half
    way between neighbouring rows.
    """
    core = model.error_model
    count = len(data)
    A = np.asarray(core.parameter_jacobian(model.samples(data), core.start))[:, :3].reshape(3 * count, -1)
    U, size, _ = np.linalg.svd(_scaled(A), full_matrices=False)
    U = U[:, size > LEAST * size[0]]
    R = pose(model.spec["base"])[:3, :3]
    J = R @ model.inputs(data.q, data.payload).J_tool_q[:, :3]
    r = (left(model, data) @ R.T).ravel()
    r = r - U @ (U.T @ r)
    best, most = Sides(1, float("inf")), 0.0
    for sides in _candidates(data.q):
        B = (sides(data.q)[:, np.newaxis, np.newaxis] * J).reshape(3 * count, -1)
        B = B - U @ (U.T @ B)
        explained = float(r @ B @ np.linalg.lstsq(B, r, rcond=None)[0])
        if explained > most:
            best, most = sides, explained
    return best


def _candidates(q: FloatArray) -> list[Sides]:
    """Half way between neighbouring positions of each joint, FEWEST of them on either side."""
    found = []
    for joint, column in enumerate(q.T, start=1):
        values = np.unique(column)
        middles = (values[1:] + values[:-1])[FEWEST - 1 : len(values) - FEWEST] / 2
        found += [Sides(joint, float(middle)) for middle in middles]
    return found


def _scaled(A: FloatArray) -> FloatArray:
    """Columns of length 1, those of length 0 left out."""
    length = np.linalg.norm(A, axis=0)
    return np.asarray(A[:, length > 0] / length[length > 0])
