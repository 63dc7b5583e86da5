# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Forward and inverse kinematics of one pose at a time, for a loop that has no batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects.registered import find
from fastcal.ik.inverse_kinematics import STATUSES, checked_limits, inverse_kinematics, solver_options
from fastcal.robot.robot import Robot


class PoseSolver:
    """A model made ready for single poses: some microseconds a call, where the batch functions take a hundred.

    What does not change from call to call (model, conditions, limits, tolerances) is given and checked once. Results
    are those of `inverse_kinematics` and `Robot.forward`. Not for several threads at a time.

    Args:
        model: A robot with its effects, nominal or identified. One with a trained correction, an effect written in
            Python or mimic joints goes the way of the batch functions, and takes as long.
        limits, tolerance_m, tolerance_rad, restarts, hold, random_seed: As `inverse_kinematics` has them.
        **conditions: payload [kg], approach ... of every call, as `Robot.forward` takes them.

    Raises:
        InvalidInput: As `inverse_kinematics`.
    """

    def __init__(
        self,
        model: Robot,
        *,
        limits: ArrayLike | None = None,
        tolerance_m: float = 1e-9,
        tolerance_rad: float = 1e-9,
        restarts: int = 100,
        hold: Sequence[int] = (),
        random_seed: int = 0,
        **conditions: Any,
    ) -> None:
        self.model = model
        box = checked_limits(model, limits)
        options = solver_options(model, box, tolerance_m, tolerance_rad, restarts, hold, random_seed)
        asked = {"limits": box, "tolerance_m": tolerance_m, "tolerance_rad": tolerance_rad, "restarts": restarts}
        self._asked: dict[str, Any] = {**asked, "hold": hold, "random_seed": random_seed, **conditions}
        self._conditions = conditions
        home = np.asarray(model.core.home)
        rows = model.conditions(home if len(home) else np.zeros(model.joint_count), **conditions)
        follows = model.correction is not None or any(find(e["effect"]) for e in model.entries)
        follows = follows or bool(model.mimics)
        self._core = None if follows else _core.PoseSolver(model.error_model, rows, reach=model.reach, **options)

    def inverse(self, target: ArrayLike, seed: ArrayLike) -> tuple[FloatArray, str]:
        """Joint positions q (n,) with forward(q) = target (4, 4), from a seed (n,), and the status of that row.

        The status is one of `inverse_kinematics`: "reached", "limit", "unreachable", "singular" or "bad_target", with
        which q is the seed.

        Raises:
            InvalidInput: A shape does not fit.
        """
        if self._core is None:
            found = inverse_kinematics(self.model, target, seed, **self._asked)
            return found.q[0], str(found.status[0])
        q, status, _, _ = self._core.inverse(target, seed)
        return q, STATUSES[status]

    def forward(self, q: ArrayLike) -> FloatArray:
        """(4, 4) pose of the tool in the measuring frame at joint positions q (n,) [rad or m].

        Raises:
            InvalidInput: The shape does not fit.
        """
        if self._core is None:
            return np.asarray(self.model.forward(q, **self._conditions)[0])
        return np.asarray(self._core.forward(q))
