# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera or board as its entry says it on one frame of a cell, and on another that is fixed to that.

Its frame F may itself be out of place, by a twist in its axes: S g by a mount that gives, g being the unit vector of
gravity, xi before it was knocked. On F_0, where F = F_0 T, the same member stands at T X, its mount gives by
Ad(T) S R^T, it was knocked by Ad(T) xi.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.robot.se3 import skew
from fastcal.units import from_si, to_si

_UNITS = ("mm", "deg")
_NONE = [[0.0] * 3] * 3


def seen_from(entry: Spec, T: FloatArray) -> Spec:
    """The entry of a camera or board on F as it is on F_0, T (4, 4) being F in F_0."""
    out: Spec = {**entry, **frame_spec(T @ pose(entry))}
    if any(f"sag_{unit}" in entry for unit in _UNITS):
        S = np.vstack([to_si(np.array(entry.get(f"sag_{unit}", _NONE)), unit) for unit in _UNITS])
        out |= _halves("sag", _adjoint(T) @ S @ T[:3, :3].T)
    if "knocked" in entry:
        step = entry["knocked"]
        xi = np.concatenate([to_si(np.array(step[f"before_{unit}"]), unit) for unit in _UNITS])
        out["knocked"] = {**step, **_halves("before", _adjoint(T) @ xi)}
    return out


def _adjoint(T: FloatArray) -> FloatArray:
    """(6, 6) that takes a twist [v; w] from F to F_0."""
    R = T[:3, :3]
    return np.block([[R, skew(T[:3, 3]) @ R], [np.zeros((3, 3)), R]])


def _halves(name: str, twists: FloatArray) -> Spec:
    """Shifts and turns of twists (6, ...) as a file has them."""
    halves = zip(_UNITS, (twists[:3], twists[3:]), strict=True)
    return {f"{name}_{unit}": from_si(half, unit).tolist() for unit, half in halves}
