# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How a controller counts its joints, where that is not as the chain of the robot file does.

    q_i = sign_i J_i + zero_i + sum of J_k over `plus` - sum of J_k over `minus`

q are the chain's joints, J what the controller shows and its programs hold. FANUC shows joint 3 from the horizontal
(plus: 2), arms whose joint 3 a parallelogram drives show it from the vertical (minus: 2). An arm with closed loops has
joints without a motor: of those with one, `axis` is the controller's number.
"""

from __future__ import annotations

from dataclasses import dataclass
from graphlib import TopologicalSorter

import numpy as np
from numpy.typing import ArrayLike

from fastcal.arrays import FloatArray
from fastcal.place import joint_position
from fastcal.robot.robot_spec import RobotSpec
from fastcal.units import from_si, to_si


@dataclass(frozen=True, eq=False)
class Pendant:
    """q = matrix J + zero.

    Attributes:
        matrix: (n, n), invertible; with axes (n, m), whose rows of joints without an axis are 0.
        zero: (n,) [rad or m].
        order: The joints, from 0, each after those that it is counted from.
        axes: The controller's axis of each joint, both from 0; None: it has none. Empty: those of the same numbers.
    """

    matrix: FloatArray
    zero: FloatArray
    order: tuple[int, ...]
    axes: tuple[int | None, ...] = ()

    @property
    def axis_count(self) -> int:
        """Axes that the controller counts, the last of the arm's included."""
        return int(self.matrix.shape[1])

    def axis(self, joint: int) -> int | None:
        """The controller's axis of a joint, both from 0; None: it has none."""
        return self.axes[joint] if self.axes else joint

    @property
    def is_chain(self) -> bool:
        """Does the controller count as the chain does?"""
        return not self.zero.any() and np.array_equal(self.matrix, np.eye(len(self.zero)))

    def chain(self, shown: ArrayLike) -> FloatArray:
        """The chain's q (..., n) [rad or m] at what the controller shows, J (..., m); 0 of joints without an axis."""
        return _product(self.matrix, np.asarray(shown, dtype=float)) + self.zero

    def shown(self, q: ArrayLike) -> FloatArray:
        """J (..., m) [rad or m], which the controller shows at the chain's q (..., n); 0 of axes that the arm lacks."""
        inverse = self.matrix.T if self.axes else np.linalg.inv(self.matrix)
        return _product(np.asarray(inverse), np.asarray(q, dtype=float) - self.zero)


def _product(matrix: FloatArray, values: FloatArray) -> FloatArray:
    """Matrix times values (..., n); a value that is not known spoils only what depends on it."""
    out = np.zeros((*values.shape[:-1], len(matrix)))
    for i, k in np.argwhere(matrix).tolist():
        out[..., i] += matrix[i, k] * values[..., k]
    return out


def pendant_of(spec: RobotSpec) -> Pendant:
    """The relation of a robot file; the chain's own joints where it has none."""
    n = len(spec.joints)
    if any(entry.axis is not None for entry in spec.pendant or ()):
        return _by_axes(spec)
    matrix, zero = np.eye(n), np.zeros(n)
    sources: dict[int, set[int]] = {joint: set() for joint in range(n)}
    for entry in spec.pendant or ():
        i = entry.joint - 1
        matrix[i, i], zero[i] = entry.sign, to_si(float(entry.zero), spec.joints[i].unit)
        for others, sign in ((entry.plus, 1.0), (entry.minus, -1.0)):
            for other in others:
                matrix[i, other - 1] += sign
                sources[i].add(other - 1)
    return Pendant(matrix, zero, tuple(TopologicalSorter(sources).static_order()))


def _by_axes(spec: RobotSpec) -> Pendant:
    """Of an arm with closed loops whose joints with a motor have axes of their own numbers."""
    entries = {entry.joint - 1: entry for entry in spec.pendant or ()}
    axes: list[int | None] = []
    for i, joint in enumerate(spec.joints):
        own = entries[i].axis if i in entries else None
        axes.append(None if joint.passive else i if own is None else own - 1)
    matrix = np.zeros((len(axes), 1 + max(axis for axis in axes if axis is not None)))
    zero = np.zeros(len(axes))
    for i, axis in enumerate(axes):
        if axis is not None:
            matrix[i, axis] = entries[i].sign if i in entries else 1.0
            zero[i] = to_si(float(entries[i].zero), spec.joints[i].unit) if i in entries else 0.0
    order = tuple(i for i, axis in enumerate(axes) if axis is not None)
    return Pendant(matrix, zero, order, tuple(axes))


def relations(spec: RobotSpec) -> list[str]:
    """What the file says, such as "q3 = J3 + J2"."""
    out = []
    for entry in spec.pendant or ():
        i, zero, unit = entry.joint, entry.zero, spec.joints[entry.joint - 1].unit
        text = f"{joint_position(i - 1)} = {'-' if entry.sign < 0 else ''}J{entry.axis or i}"
        text += "".join(f" + J{other}" for other in entry.plus) + "".join(f" - J{other}" for other in entry.minus)
        out.append(text + (f" {'-' if zero < 0 else '+'} {abs(zero):g} {unit}" if zero else ""))
    return out


def controller_columns(spec: RobotSpec, q: FloatArray) -> dict[str, FloatArray]:
    """Joint positions q (N, n) as columns that the controller understands: jN where it counts otherwise, else qN."""
    pendant = pendant_of(spec)
    return joint_columns(spec, q) if pendant.is_chain else axis_columns(spec, pendant.shown(q), "j")


def axis_columns(spec: RobotSpec, shown: FloatArray, prefix: str) -> dict[str, FloatArray]:
    """What the controller shows (N, m) [rad or m] by the names of a table's columns, j1_deg ..., in their units."""
    pendant = pendant_of(spec)
    axes = {pendant.axis(i): joint.unit for i, joint in enumerate(spec.joints) if not joint.passive}
    return {
        f"{prefix}{axis + 1}_{unit}": np.asarray(from_si(np.asarray(shown)[:, axis], unit))
        for axis, unit in sorted((axis, unit) for axis, unit in axes.items() if axis is not None)
    }


def joint_columns(spec: RobotSpec, values: FloatArray, prefix: str = "q") -> dict[str, FloatArray]:
    """Values of joints (N, n) [rad or m] by the names of a table's columns, q1_deg (q1_mm) ..., in their units.

    Passive joints have none: closed loops say where they are.
    """
    return {
        f"{prefix}{number}_{joint.unit}": np.asarray(from_si(column, joint.unit))
        for number, (joint, column) in enumerate(zip(spec.joints, np.asarray(values).T, strict=True), start=1)
        if not joint.passive
    }
