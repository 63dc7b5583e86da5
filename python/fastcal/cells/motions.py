# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell whose instrument was set up again: all that stands on the world stands elsewhere in its frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cells.cell import Arm, Cell, Point
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import view_poses
from fastcal.monitoring.setups import rigid
from fastcal.robot.core_model import pose
from fastcal.robot.rig import PLACEMENT
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.robot.se3 import pose_of_six

FloatArray = NDArray[np.float64]

_STEP = 1e-5  # [m, rad] of differences


def stands_at(cell: Cell, readings: Readings) -> FloatArray:
    """(4, 4) the cell's world in the frame of the instrument, by all points that were read from it.

    Raises:
        Undetermined: Fewer than three, or on a line.
    """
    views = [view for view in readings.views if ":" not in view and f"position@{view}" in readings.tables]
    predicted = [view_poses(cell, readings, view)[:, :3, 3] for view in views]
    none = np.zeros((0, 3))
    measured = [none, *(readings.tables[f"position@{view}"] for view in views)]
    return rigid(np.concatenate([none, *predicted]), np.concatenate(measured), readings.source)


def carried(cell: Cell, X: FloatArray) -> Cell:
    """The cell with all that stands on the world moved by X (4, 4)."""

    def there(place: Spec) -> Spec:
        return frame_spec(X @ pose(place))

    def rig(members: dict[str, Spec]) -> dict[str, Spec]:
        return {name: {**of, **there(of)} if of["on"] == "world" else of for name, of in members.items()}

    return replace(
        cell,
        arms=tuple(
            replace(arm, robot=arm.robot.with_(base=there(vars(arm.robot.description.base))))
            if arm.on == "world"
            else arm
            for arm in cell.arms
        ),
        points=tuple(replace(of, place=there(of.place)) if of.on == "world" else of for of in cell.points),
        cameras=rig(dict(cell.cameras)),
        boards=rig(dict(cell.boards)),
    )


def turned(cell: Cell, X: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (T, k) of a cell's parameters as they are of the cell that is `carried` by X.

    With what stands on the world moved by the twist t = B dtheta, X t X^-1 = B' dtheta'.
    """
    out = columns.copy()
    adjoint = np.column_stack([_twist(X @ pose_of_six(_STEP * step) @ np.linalg.inv(X)) for step in np.eye(6)]) / _STEP
    before, after = _twists(cell), _twists(carried(cell, X))
    for first, B in before.items():
        own = slice(first, first + len(PLACEMENT))
        out[own] = np.linalg.solve(after[first], adjoint @ B @ columns[own])
    return out


def motions_of_world(cell: Cell, unknowns: Sequence[_core.Parameter]) -> FloatArray:
    """(T, 6) how the parameters and unknowns of a cell change as the world moves along and turns about x, y, z."""
    own = len(cell.model.start)
    out = np.zeros((own + len(unknowns), 6))
    for first, B in _twists(cell).items():
        out[first : first + len(PLACEMENT)] = np.linalg.inv(B)
    where = {(of.owner, of.name): own + k for k, of in enumerate(unknowns)}
    for kind, members in (("camera", cell.cameras), ("board", cell.boards)):
        for name, of in members.items():
            if of["on"] == "world" and (f"{kind} {name}", PLACEMENT[0]) in where:
                T, at = pose(of), [where[f"{kind} {name}", axis] for axis in PLACEMENT]
                for k, step in enumerate(_STEP * np.eye(6)):
                    out[at, k] = _twist(np.linalg.inv(T) @ pose_of_six(step) @ T) / _STEP
    return out


def to_written(before: Cell, theta: FloatArray, after: Cell) -> FloatArray:
    """(P, P) by which small changes of a cell's parameters at theta are those of the same cell as it is written.

    Turns of a place count from where the cell stands, and in `after` that is where theta has it.
    """
    count = len(before.core.nominal)
    out = np.eye(len(before.model.start))
    here, there = (
        _of_branches(cell, at) for cell, at in ((before, theta[:count]), (after, np.asarray(after.core.nominal)))
    )
    for branch, A, B in zip(before.core.branches, here, there, strict=True):
        own = slice(branch.first_parameter, branch.first_parameter + len(PLACEMENT))
        out[own, own] = np.linalg.solve(B, A)
    return out


def _of_branches(cell: Cell, theta: FloatArray) -> list[FloatArray]:
    """(6, 6) of each branch the motion on its frame per parameter of its place, at theta."""
    out = []
    for k, branch in enumerate(cell.core.branches):
        steps = _STEP * np.eye(len(theta))[branch.first_parameter : branch.first_parameter + len(PLACEMENT)]
        ends = [[cell.core.placements(theta + sign * step)[k] for sign in (1, -1)] for step in steps]
        out.append(np.column_stack([_twist(there @ np.linalg.inv(back)) for there, back in ends]) / (2 * _STEP))
    return out


def _twists(cell: Cell) -> dict[int, FloatArray]:
    """(6, 6) the motion in the world per parameter of the place of each branch on it, by its first parameter."""
    members: list[Arm | Point] = [*cell.arms, *cell.frames]
    on_world = {of.name for of in members if of.on == "world"}
    twists = _of_branches(cell, np.asarray(cell.core.nominal))
    branches = zip(cell.core.branches, twists, strict=True)
    return {branch.first_parameter: B for branch, B in branches if branch.name in on_world}


def _twist(X: FloatArray) -> FloatArray:
    """(6,) of a small motion (4, 4): `_motion` of it is X."""
    return np.array([*X[:3, 3], *np.asarray(_core.log_so3(X[:3, :3]))])
