# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Targets and sensors that stood elsewhere before a row: each is then two frames of the tree, and a fit places both.

What was read in the rows before is of the one, what was read since of the other. Rows of unknown order come after.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.robot.robot_spec import Entry, Spec
from fastcal.units import from_si, to_si

_BEFORE = " before row "  # no name of a file has a blank


def name_before(name: str, at_row: int) -> str:
    """What the frame of a point is called as it stood before a row."""
    return f"{name}{_BEFORE}{at_row}"


def name_since(view: str) -> str:
    """TARGET or TARGET:SENSOR as a file has it, of one that may be of frames before a row."""
    return ":".join(end.partition(_BEFORE)[0] for end in view.split(":"))


def pose_before(knocked: Spec) -> FloatArray:
    """(4, 4) where it stood, relative to where it stands since."""
    out = np.eye(4)
    out[:3, :3] = _core.exp_so3(to_si(np.asarray(knocked["before_deg"], dtype=np.float64), "deg"))
    out[:3, 3] = to_si(np.asarray(knocked["before_mm"], dtype=np.float64), "mm")
    return out


def relative_before(T: FloatArray) -> Spec:
    """`pose_before` as a file has it."""
    turn = from_si(np.asarray(_core.log_so3(T[:3, :3])), "deg")
    return {"before_mm": from_si(T[:3, 3], "mm").tolist(), "before_deg": turn.tolist()}


def views_apart(view: str, rows: Mapping[str, int], row: IntArray) -> dict[str, IntArray]:
    """Of a view the views that it is between frames of the tree, each with its rows.

    Args:
        view: TARGET or TARGET:SENSOR.
        rows: From which row on a point stands where it does, of those that were knocked.
        row: (N,) place of each row in the order of measuring, -1 where unknown.
    """
    ends = view.split(":")
    before = [(row >= 0) & (row < rows.get(end, 0)) for end in ends]
    out = {}
    for early in product((False, True), repeat=len(ends)):
        own = np.flatnonzero(np.all([of == is_early for of, is_early in zip(before, early, strict=True)], axis=0))
        if len(own):
            each = zip(ends, early, strict=True)
            out[":".join(name_before(end, rows[end]) if is_early else end for end, is_early in each)] = own
    return out


def turned_step(entry: Entry, R: FloatArray) -> Entry:
    """A step of a base, its shift and its turn in other axes, of which R (3, 3) are the old."""
    values = {name: dict(of) for name, of in entry["parameters"].items()}
    axes = [name for name in values if name.startswith("step_")]
    for half in (axes[:3], axes[3:]):
        turned = R @ np.array([values[name]["value"] for name in half])
        for name, value in zip(half, turned.tolist(), strict=True):
            values[name]["value"] = value
    return {**entry, "parameters": values}
