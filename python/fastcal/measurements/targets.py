# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses that the tool is to take, and under which conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray
from fastcal.display.shown import Shown
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import TABLES


@dataclass(frozen=True, eq=False, repr=False)
class Targets(Shown):
    """N poses of the tool in the measuring frame.

    Attributes:
        poses: (N, 4, 4); a row that holds no pose (a number missing, no rotation) becomes a `bad_target`.
        seed: (N, n) joint positions [rad or m] near which the command is sought, NaN in rows without; None: no row has.
        conditions: As `Robot.forward` takes them: payload [kg], approach (N, n) ...
        notes: What a reader should know, a sentence each.
    """

    poses: FloatArray
    seed: FloatArray | None = None
    conditions: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def seeded(self) -> NDArray[np.bool_]:
        """(N,) rows that have a seed of their own."""
        if self.seed is None:
            return np.zeros(len(self), dtype=bool)
        return np.asarray(np.isfinite(self.seed).all(axis=1))

    def conditions_of(self, rows: NDArray[np.int64] | slice) -> dict[str, Any]:
        """The conditions of some rows."""
        return {name: _rows(name, value, rows, len(self)) for name, value in self.conditions.items()}


def targets_of(poses: ArrayLike, seed: ArrayLike | None, joint_count: int, conditions: Mapping[str, Any]) -> Targets:
    """Targets from arrays; seed (n,) is that of the first row.

    Raises:
        InvalidInput: A shape does not fit.
    """
    T = np.asarray(poses, dtype=float)
    T = T[np.newaxis] if T.shape == (4, 4) else T
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise InvalidInput(f"targets must have shape (N, 4, 4), got {np.shape(poses)}")
    if seed is None:
        return Targets(T, None, dict(conditions))
    q = np.asarray(seed, dtype=float)
    if q.shape == (joint_count,):
        q = np.vstack([q, np.full((len(T) - 1, joint_count), np.nan)])
    if q.shape != (len(T), joint_count):
        raise InvalidInput(f"seed must have shape ({joint_count},) or ({len(T)}, {joint_count}), got {np.shape(seed)}")
    return Targets(T, q, dict(conditions))


def _rows(name: str, value: Any, rows: NDArray[np.int64] | slice, count: int) -> Any:
    """One condition of some rows; what stands for all stays: a number, a label, one row (6,) or (n,) of a table."""
    if isinstance(value, Mapping):
        return {key: _rows(key, part, rows, count) for key, part in value.items()}
    each = 2 if name in (*TABLES, "move") else 1
    array = np.asarray(value)
    return array[rows] if value is not None and array.ndim == each and len(array) == count else value
