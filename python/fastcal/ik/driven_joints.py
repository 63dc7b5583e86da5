# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Inverse kinematics of arms with mimic joints, which follow the joints that drive them.

Only the joints with a motor are unknown. Levenberg-Marquardt on e = [position error / reach; rotation vector],

    dx = (J^T J + |e|^2 / 2)^-1 J^T e

with J the derivative by the motors, followers included (T. Sugihara, "Solvability-unconcerned inverse kinematics by the
Levenberg-Marquardt method", 2011). Motors at a limit that the step would leave take no part in it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import BoolArray, FloatArray
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot

_MOST_STEPS = 200
_NO_MOVE = 1e-14  # rad or m: a step this small ends the search
_FLOOR = 1e-12  # of the damping, so that a singular posture has a step
_SINGULAR = 1e-6  # of the largest singular value
_TRIES_BEYOND = 8  # attempts without limits, which separate "limit" from "unreachable"
_NO_GAIN = 1e-12  # of the squared error: a step that gains less ends the search
_SAME = 1e-3  # of the error: attempts that end this near to the best end at the same nearest pose
_ENOUGH = 3  # of them; an arm with few motors reaches hardly any pose, and all attempts end alike


class Solution(NamedTuple):
    """Of each row: q (n,), whether it is there, steps, and the errors that remain [m, rad]."""

    q: FloatArray
    reached: BoolArray
    steps: NDArray[np.int32]
    position: FloatArray
    rotation: FloatArray


def motor_limits(model: Robot, box: FloatArray) -> FloatArray:
    """(n, 2) limits of every joint, those of a driver narrowed to what its followers allow.

    Raises:
        InvalidInput: The limits of a joint and of one that follows it exclude each other.
    """
    narrowed = box.copy()
    for joint, driver, multiplier, offset in model.mimics:
        if multiplier:
            low, high = sorted((box[joint] - offset) / multiplier)
            narrowed[driver] = max(narrowed[driver, 0], low), min(narrowed[driver, 1], high)
        if narrowed[driver, 0] > narrowed[driver, 1]:
            raise InvalidInput(
                f"joint {joint + 1} of {model.name} follows joint {driver + 1}, and no position of joint {driver + 1} "
                "keeps both within their limits"
            )
    return narrowed


class DrivenArm:
    """Inverse kinematics of a model with mimic joints, row by row conditions included."""

    def __init__(self, model: Robot, options: dict[str, Any], conditions: dict[str, Any], count: int) -> None:
        self.model = model
        self.box = motor_limits(model, options["limits"])
        self.tolerance = options["tolerance_position"], options["tolerance_rotation"]
        followers = {joint for joint, *_ in model.mimics}
        held = options["held"]
        self.motors = [joint for joint in range(model.joint_count) if joint not in followers and not held[joint]]
        self.conditions = {key: value for key, value in conditions.items() if value is not None}
        self.count = count

    def solve(self, T: FloatArray, q: FloatArray, rows: NDArray[np.intp], box: FloatArray | None = None) -> Solution:
        """From postures q (k, n) towards poses T (k, 4, 4), which are these rows of the conditions."""
        box = self.box if box is None else box
        low, high = box[self.motors].T
        q = q.copy()
        q[:, self.motors] = np.clip(q[:, self.motors], low, high)
        q = self.model.follow(q)
        steps = np.zeros(len(q), dtype=np.int32)
        error = self._error(T, q, rows)
        moving = ~self._there(error)
        for _ in range(_MOST_STEPS):
            if not moving.any():
                break
            at = np.flatnonzero(moving)
            J = self._jacobian(q[at], rows[at])
            g = np.einsum("kij,ki->kj", J, error[at])
            x = q[at][:, self.motors]
            stopped = ((x <= low) & (g < 0)) | ((x >= high) & (g > 0))
            J = np.where(stopped[:, None, :], 0.0, J)
            damping = np.sum(error[at] ** 2, axis=1) / 2 + _FLOOR
            normal = np.einsum("kij,kil->kjl", J, J) + damping[:, None, None] * np.eye(len(self.motors))
            step = np.linalg.solve(normal, np.where(stopped, 0.0, g)[:, :, None])[:, :, 0]
            new = np.clip(x + step, low, high)
            q[at[:, None], self.motors] = new
            q[at] = self.model.follow(q[at])
            before = np.sum(error[at] ** 2, axis=1)
            error[at] = self._error(T[at], q[at], rows[at])
            steps[at] += 1
            gains = np.abs(before - np.sum(error[at] ** 2, axis=1)) > _NO_GAIN * before
            moving[at] = gains & (np.abs(new - x).max(axis=1) > _NO_MOVE) & ~self._there(error[at])
        position, rotation = self._sizes(error)
        return Solution(q, self._there(error), steps, position, rotation)

    def singular(self, q: FloatArray, rows: NDArray[np.intp]) -> BoolArray:
        """(k,) has the Jacobian by the motors less than its full rank?"""
        sizes = np.linalg.svd(self._jacobian(q, rows), compute_uv=False)
        return np.asarray(sizes[:, -1] < _SINGULAR * sizes[:, 0])

    def _jacobian(self, q: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        J = self.model.joint_jacobian(q, **self._of(rows))[:, :, self.motors]
        J[:, :3] /= self.model.reach
        return J

    def _error(self, T: FloatArray, q: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        from scipy.spatial.transform import Rotation

        there = self.model.forward(q, **self._of(rows))
        turn = Rotation.from_matrix(T[:, :3, :3] @ there[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
        return np.hstack([(T[:, :3, 3] - there[:, :3, 3]) / self.model.reach, turn])

    def _sizes(self, error: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.linalg.norm(error[:, :3], axis=1) * self.model.reach, np.linalg.norm(error[:, 3:], axis=1)

    def _there(self, error: FloatArray) -> BoolArray:
        position, rotation = self._sizes(error)
        return np.asarray((position <= self.tolerance[0]) & (rotation <= self.tolerance[1]))

    def _of(self, rows: NDArray[np.intp]) -> dict[str, Any]:
        def taken(value: Any) -> Any:
            if isinstance(value, dict):
                return {key: taken(one) for key, one in value.items()}
            return np.asarray(value)[rows] if np.ndim(value) and len(value) == self.count else value

        return {key: taken(value) for key, value in self.conditions.items()}


def solve_driven(
    model: Robot, T: FloatArray, q: FloatArray, *, restarts: int, options: dict[str, Any], **conditions: Any
) -> tuple[FloatArray, NDArray[np.str_], NDArray[np.int32], FloatArray, FloatArray]:
    """Joint positions (N, n), statuses, steps, remaining errors [m, rad] of poses (N, 4, 4), from postures q (N, n)."""
    arm = DrivenArm(model, options, conditions, len(T))
    valid = np.flatnonzero(_are_poses(T))
    along_path = options["along_path"]
    blocks = [np.array([row]) for row in valid] if along_path else [valid]
    none = np.full(len(q), np.nan)
    out = Solution(q.copy(), np.zeros(len(q), dtype=bool), np.zeros(len(q), dtype=np.int32), none, none.copy())
    status = np.full(len(q), "bad_target", dtype=object)
    before: FloatArray | None = None
    for block in blocks:
        start = q[block] if before is None or not along_path else before
        more = restarts if before is None else 0
        found = _searched(arm, T[block], start, block, more, options["random_seed"], arm.box)
        status[block] = _statuses(arm, T[block], found, block)
        _put(out, block, found, np.ones(len(block), dtype=bool))
        before = found.q
    return out.q, status.astype("U13"), out.steps, out.position, out.rotation


def _put(into: Solution, rows: NDArray[np.intp], found: Solution, chosen: BoolArray) -> None:
    """The chosen rows of `found` into these rows."""
    into.q[rows] = found.q[chosen]
    into.reached[rows] = found.reached[chosen]
    into.steps[rows] = found.steps[chosen]
    into.position[rows] = found.position[chosen]
    into.rotation[rows] = found.rotation[chosen]


def _are_poses(T: FloatArray) -> BoolArray:
    """(N,) finite, and a rotation."""
    finite = np.asarray(np.isfinite(T).all(axis=(1, 2)))
    R = np.where(finite[:, None, None], T, 0.0)[:, :3, :3]
    square = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < 1e-6
    return np.asarray(square & (np.linalg.det(R) > 0))


def _searched(
    arm: DrivenArm, T: FloatArray, q: FloatArray, rows: NDArray[np.intp], restarts: int, seed: int, box: FloatArray
) -> Solution:
    """From the seeds, then from random postures for the rows that are not there: the nearest pose that is found."""
    best = arm.solve(T, q, rows, box)
    low, high = np.where(np.isfinite(arm.box), arm.box, [-np.pi, np.pi]).T
    rng = np.random.default_rng(seed)
    alike = np.zeros(len(q), dtype=int)
    for _ in range(restarts):
        left = np.flatnonzero(~best.reached & (alike < _ENOUGH))
        # A posture is drawn for every row, so that none depends on which others are left.
        start = rng.uniform(low, high, (len(q), len(low)))[left]
        if not len(left):
            break
        start = np.where(np.isin(np.arange(len(low)), arm.motors), start, q[left])
        again = arm.solve(T[left], start, rows[left], box)
        scale = arm.model.reach
        new = np.hypot(again.position / scale, again.rotation)
        old = np.hypot(best.position[left] / scale, best.rotation[left])
        better = np.asarray(new < old)
        same = np.asarray(np.abs(new - old) < _SAME * old)
        alike[left] = np.where(same, alike[left] + 1, np.where(better, 0, alike[left]))
        _put(best, left[better], again, better)
    return best


def _statuses(arm: DrivenArm, T: FloatArray, found: Solution, rows: NDArray[np.intp]) -> NDArray[np.object_]:
    status = np.full(len(T), "reached", dtype=object)
    there = np.flatnonzero(found.reached)
    if len(there):
        status[there[arm.singular(found.q[there], rows[there])]] = "singular"
    lost = np.flatnonzero(~found.reached)
    if len(lost):
        free = np.tile([-np.inf, np.inf], (arm.model.joint_count, 1))
        beyond = _searched(arm, T[lost], found.q[lost], rows[lost], _TRIES_BEYOND, 0, free)
        status[lost] = np.where(beyond.reached, "limit", "unreachable")
    return status
