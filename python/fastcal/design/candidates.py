# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What could be measured: postures by grid or at random, each with a payload and a direction of approach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.robot.loops import closed_within
from fastcal.robot.robot import Robot

MOST = 80_000  # candidates of a grid or a draw: 5^7 = 78,125 of seven joints, 6^6 of six


@dataclass(frozen=True, eq=False)
class Candidates:
    """N postures with their conditions, SI.

    Attributes:
        q: (N, n) joint positions [rad or m].
        payload: (N,) [kg].
        approach: (N, n) +1 or -1, 0 where the direction does not matter; None: nowhere.
        plane: (N,) label of the plane that the tool touches, "" where it touches none; None: nowhere.
    """

    q: FloatArray
    payload: FloatArray
    approach: FloatArray | None = None
    plane: NDArray[Any] | None = None

    def __len__(self) -> int:
        return len(self.q)

    @property
    def touching(self) -> NDArray[np.bool_]:
        """(N,) where the tool touches a plane."""
        return np.zeros(len(self), dtype=bool) if self.plane is None else np.asarray(self.plane != "", dtype=bool)

    def select(self, rows: Any) -> Candidates:
        """Those rows alone."""
        return Candidates(
            self.q[rows],
            self.payload[rows],
            None if self.approach is None else np.ascontiguousarray(self.approach[rows]),
            None if self.plane is None else self.plane[rows],
        )

    def conditions(self) -> dict[str, FloatArray]:
        """As `Robot.conditions` takes them."""
        return {"payload": self.payload} | ({} if self.approach is None else {"approach": self.approach})


def joined(parts: Sequence[Candidates]) -> Candidates:
    """All of them, one part after the other; each has the same conditions."""
    approaches = [part.approach for part in parts if part.approach is not None]
    planes = [part.plane for part in parts if part.plane is not None]
    return Candidates(
        np.concatenate([part.q for part in parts]),
        np.concatenate([part.payload for part in parts]),
        np.concatenate(approaches) if approaches else None,
        np.concatenate(planes) if planes else None,
    )


def joint_ranges(robot: Robot) -> FloatArray:
    """(n, 2) limits, a whole turn where a revolute joint has none."""
    ranges = robot.limits.copy()
    for joint, kind in enumerate(robot.joint_types):
        if not np.isfinite(ranges[joint]).all():
            if kind == "prismatic":
                raise InvalidInput(f"a design needs limits, and the prismatic joint {joint + 1} has none")
            ranges[joint] = -np.pi, np.pi
    return ranges


def postures(robot: Robot, how: str | ArrayLike, count: int, seed: int) -> FloatArray:
    """(N, n) joint positions within the limits.

    Args:
        robot: Its limits.
        how: grid: as many even steps of each joint, both limits among them, as `count` has room for (5 of seven
            joints, as the paper of the spray robot has); random: `count` of a Sobol sequence; or postures (N, n).
        count: At most so many.
        seed: Of the sequence.
    """
    ranges = joint_ranges(robot)
    n = robot.joint_count
    moved = [joint for joint in range(n) if joint not in robot.passive]
    if not isinstance(how, str):
        q = np.ascontiguousarray(np.asarray(how, dtype=float))
        if q.ndim != 2 or q.shape[1] != n or not np.isfinite(q).all():
            raise InvalidInput(f"candidates must be grid, random, or finite postures (N, {n}), got shape {q.shape}")
        within = ((q >= ranges[:, 0] - 1e-9) & (q <= ranges[:, 1] + 1e-9)).all(axis=1)
        if not within.all():
            raise InvalidInput(f"candidate {int(np.argmin(within))} lies beyond the joints' limits")
        return robot.follow(q)
    if how == "grid":
        levels = int(count ** (1 / len(moved)) + 1e-9)
        if levels < 2:
            raise InvalidInput(
                f"a grid of two steps of {len(moved)} joints has {2 ** len(moved)} postures, and at most {count} are "
                "allowed"
            )
        steps = [np.linspace(low, high, levels if joint in moved else 1) for joint, (low, high) in enumerate(ranges)]
        return _that_close(robot, np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, n))
    if how == "random":
        from scipy.stats import qmc

        power = int(np.ceil(np.log2(max(count, 2))))
        unit = np.zeros((count, n))
        unit[:, moved] = qmc.Sobol(len(moved), rng=np.random.default_rng(seed)).random_base2(power)[:count]
        return _that_close(robot, np.asarray(ranges[:, 0] + unit * (ranges[:, 1] - ranges[:, 0])))
    raise InvalidInput(f"candidates must be grid, random, or postures (N, {n}), got '{how}'")


def _that_close(robot: Robot, q: FloatArray) -> FloatArray:
    """Postures (M, n) of q (N, n) in which all joints are, within their limits; of an arm with loops, those closed."""
    if not robot.passive:
        return robot.follow(q)
    closed = closed_within(robot.core, q, joint_ranges(robot))
    if not len(closed):
        raise InvalidInput("no candidate closes the loops within the limits of all joints; narrow the motors' limits")
    return closed


def with_conditions(
    q: FloatArray, payloads: Sequence[float], approached: Sequence[int], count: int, seed: int
) -> Candidates:
    """Postures with a payload and, for the joints `approached` (from 0), a direction.

    Every combination where these are at most `count`, else one of each drawn for every posture.
    """
    levels = np.asarray(payloads, dtype=float)
    if levels.ndim != 1 or len(levels) == 0 or not (np.isfinite(levels) & (levels >= 0)).all():
        raise InvalidInput(f"payloads must be masses of at least 0 kg, got {payloads}")
    directions = 2 ** len(approached)
    combinations = len(levels) * directions
    if len(q) * combinations <= count:
        q = np.repeat(q, combinations, axis=0)
        code = np.tile(np.arange(combinations), len(q) // combinations)
    else:
        code = np.random.default_rng(seed).integers(combinations, size=len(q))
    approach = None
    if approached:
        approach = np.zeros(q.shape)
        for bit, joint in enumerate(approached):
            approach[:, joint] = np.where((code // len(levels)) >> bit & 1, 1.0, -1.0)
    return Candidates(np.ascontiguousarray(q), levels[code % len(levels)], approach)
