# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where targets of a cell are from its sensors, and what instruments would read of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell
from fastcal.cells.knocked import views_apart
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import quaternions
from fastcal.robot import se3
from fastcal.robot.se3 import rotations_by

_KINDS = ("position", "rotation", "distance")


def known_views(cell: Cell, views: Sequence[str]) -> list[str]:
    """The views that were asked for, all targets from the world where none was.

    Raises:
        InvalidInput: One is of a frame that the cell does not have, or the cell has no target.
    """
    targets = [of.name for of in cell.points if of.role == "target"]
    asked = list(views) or targets
    if not asked:
        raise InvalidInput(f"the cell {cell.name} has no target to read")
    names = {of.name for of in cell.points}
    for view in asked:
        for name in view.split(":", 1):
            if name not in names | {"world"}:
                listed = ", ".join(sorted(names)) or "none"
                raise InvalidInput(f"'{name}' is no target or sensor of the cell; there are {listed}")
    return [view.removesuffix(":world") for view in asked]


def view_poses(cell: Cell, postures: Readings, view: str, threads: int = 1) -> FloatArray:
    """(N, 4, 4) T_sensor_target in postures of the tree. InvalidInput where an effect needs a condition of them."""
    model, samples = cell.model, postures.samples(cell)
    target, _, sensor = view.partition(":")
    T = np.asarray(model.predict(samples, model.start, threads, of=target))
    if not sensor:
        return T
    S = np.asarray(model.predict(samples, model.start, threads, of=sensor))
    return np.asarray(se3.inverses(S) @ T)


def simulate_cell(
    cell: Cell,
    postures: Readings,
    views: Sequence[str] = (),
    *,
    noise: float = 0.0,
    noise_rotation: float | None = None,
    repeatability: float = 0.0,
    seed: int = 0,
    threads: int = 1,
) -> Readings:
    """Reads the targets of a cell: T_sensor_target(q + e) and noise, e ~ N(0, repeatability^2) of each turning joint.

    Args:
        cell: As it is, with the effects of its arms.
        postures: Where it is sent; where their order is known, what the cell says was knocked stands elsewhere before.
        views: What is read, VIEW or KIND@VIEW, such as `distance@smr:tag`; none: what `postures` has columns of, else
            all targets from the world.
        noise: Standard deviation of each coordinate, and of a length [m].
        noise_rotation: Of the orientation about each axis [rad]; None: none is read.
        repeatability: Of each joint that turns about where it is sent [rad].
        seed: The same seed gives the same numbers.
        threads: Cores; the result does not depend on it.
    """
    random = np.random.default_rng(seed)
    turning = np.array([kind == "revolute" for kind in cell.joint_types])
    q = postures.q + repeatability * turning * random.standard_normal(postures.q.shape)
    tables = {}
    for field, view in _asked(cell, views, postures):
        T = _as_it_stood(cell, replace(postures, q=q), view, threads)
        if field == "distance":
            length = np.linalg.norm(T[:, :3, 3], axis=1, keepdims=True)
            tables[f"distance@{view}"] = length + noise * random.standard_normal(length.shape)
            continue
        tables[f"position@{view}"] = T[:, :3, 3] + noise * random.standard_normal((len(q), 3))
        if noise_rotation is not None:
            turned = T[:, :3, :3] @ rotations_by(noise_rotation * random.standard_normal((len(q), 3)))
            tables[f"rotation@{view}"] = quaternions(turned)
    return replace(postures, tables=tables, source="simulated", speed=None, row=None)


def _as_it_stood(cell: Cell, postures: Readings, view: str, threads: int) -> FloatArray:
    """`view_poses`, in rows before one of its ends was knocked from where that stood then."""
    T = view_poses(cell, postures, view, threads)
    if postures.row is not None:
        for there, own in views_apart(view, cell.knocked_rows, postures.row).items():
            if there != view:
                T[own] = view_poses(cell, postures.pick(own), there, threads)
    return T


def _asked(cell: Cell, views: Sequence[str], postures: Readings) -> list[tuple[str, str]]:
    """What is read, (position or distance, view) each; a position comes with the orientation if that is read."""
    given = [view if "@" in view else f"position@{view}" for view in views]
    read = given or [name for name in postures.tables if "@" in name and not name.startswith("sigma")]
    out = dict[tuple[str, str], None]()
    for name in read or [f"position@{view}" for view in known_views(cell, ())]:
        field, _, view = name.partition("@")
        if field not in _KINDS:
            raise InvalidInput(f"'{field:.60}' is no kind of reading that is simulated; expected {', '.join(_KINDS)}")
        out["distance" if field == "distance" else "position", known_views(cell, [view])[0]] = None
    return list(out)
