# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Two models of a cell by what its sensors and cameras see: where the second one has it, in the first one's parameters.

With x the points of all views in postures of both, d the change with which the first model has them where the second
does, found by least squares M that hold what no view shows (`held_inverse`, which leaves H), a step after the other:

    cov d = M (J_a C_a J_a^T + J_b C_b J_b^T) M^T + H H^T,

C the covariances that the models keep. So what their gauges hold differently is no difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.error_statistics import ErrorStatistics
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.design import approach_conditions, drawn_approaches, joint_limits, planned_cell
from fastcal.cells.picture_postures import showing_postures
from fastcal.cells.readings import Readings
from fastcal.cells.view_points import ViewPoints, all_views, deviation_of, view_points
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.monitoring.common_gauge import columns_that_read, held_inverse, zero_names
from fastcal.monitoring.differences import Difference, judged
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.rig import PLACEMENT, board_corners, corner_counts
from fastcal.said import said
from fastcal.units import from_si

_POSTURES = 200  # of each view
_PICTURES = 40  # the fewest that show a board
_SEED = 0
_NOISE = 1e-5  # [m] of a point: what moves it less is not shown
_STEPS = 3
_ANYWHERE = 1.0  # [m, rad] plausible size of how far a member may have moved


@dataclass(frozen=True, eq=False)
class SeenComparison:
    """How two models differ in what sensors and cameras see.

    Attributes:
        views: TARGET:SENSOR or BOARD:CAMERA, and the distances [m] between both models there: a board's at its corners.
        parameters: All that both can say of these views, those of cameras and boards as changes of the first model's.
        unexplained: RMS distance [m] that no change of them explains.
    """

    views: dict[str, ErrorStatistics]
    parameters: list[Difference]
    unexplained: float
    notes: list[str]

    @property
    def significant(self) -> list[Difference]:
        """Those that differ beyond noise."""
        return [each for each in self.parameters if each.significant]

    def to_json_dict(self) -> dict[str, Any]:
        """`seen` of compare.json."""
        sizes = {view: of.to_mm() for view, of in self.views.items()}
        return {
            "views": {view: {name: of[name] for name in ("mean", "rms", "max")} for view, of in sizes.items()},
            "parameters": [vars(each) for each in self.parameters],
            "unexplained_mm": from_si(self.unexplained, "mm"),
            "notes": self.notes,
        }


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of all views: x (M, 3), J (M, 3, P) by the parameters of `names`, and the view of each."""

    x: FloatArray
    J: FloatArray
    view: list[str]


def compare_seen(first: Cell, second: Cell, *, threads: int = 1) -> SeenComparison | None:
    """Compares two models of one cell in all that its sensors and cameras see.

    None where they see nothing of it, or where the two have other joints.
    """
    if first.joint_columns != second.joint_columns or first.joint_types != second.joint_types:
        return None
    views = [view for view in all_views(first) if view in all_views(second)]
    notes = list[str]()
    records = [CalibrationRecord.from_spec(cell.record) for cell in (first, second)]
    a, b = (planned_cell(cell)[0] for cell in (first, second))
    at = dict[str, Readings]()
    for view in views:
        try:
            postures = _postures(a, view, threads)
        except InvalidInput as error:
            notes.append(said("{view}: {text}", view=view, text=str(error)))
            continue
        if all(records) and not all(_is_known(cell, postures, view) for cell in (a, b)):
            continue  # what neither calibration looked at
        at[view] = postures
    if not at:
        return None
    parameters = _parameters(a)
    names, placed = [full_name(of) for of, _ in parameters], _placed(a)
    here, there = _points(a, at, names, threads), _points(b, at, names, threads)
    apart = there.x - here.x
    free = [k for k in range(len(names)) if np.abs(here.J[:, :, k]).max() > 0 and _is_open(names[k], records)]
    zeros = {f"{arm.name}.{owner} {name}" for arm in a.arms for owner, name in zero_names(arm.robot)}
    first_to_say = [[k for k in free if names[k] in of] for of in (placed, zeros)]
    free = columns_that_read(here.J.reshape(-1, len(names)), free, *first_to_say)
    size = np.array([_ANYWHERE if names[k] in placed else parameters[k][0].sigma for k in free])
    change, model, now = np.zeros(len(names)), a, here
    for _ in range(_STEPS):
        M, unseen = held_inverse(now.J[:, :, free].reshape(-1, len(free)), size, _NOISE)
        change[free] += M @ (there.x - now.x).ravel()
        model = _moved(a, names, change)
        now = _points(model, at, names, threads)
    deviation = None
    if all(records):
        roots = [_moves(of.J, names, record) for of, record in zip((here, there), records, strict=True) if record]
        deviation = np.sqrt(sum(np.sum(root**2, axis=1) for root in (*(M @ root for root in roots), unseen)))
    else:
        notes.append(said("a model without covariance has no standard deviations to judge by"))
    start = np.concatenate([np.asarray(a.model.start), np.zeros(len(names) - len(a.model.start))])
    freedom = min((record.degrees_of_freedom for record in records if record), default=1)
    distance = np.linalg.norm(apart, axis=1)
    sizes = {view: ErrorStatistics.of(distance[[of == view for of in here.view]]) for view in at}
    return SeenComparison(
        {view: of for view, of in sizes.items() if of is not None},
        judged([parameters[k] for k in free], start[free], (start + change)[free], deviation, freedom),
        float(np.sqrt(np.mean(np.sum((there.x - now.x) ** 2, axis=1)))),
        notes,
    )


def _postures(cell: Cell, view: str, threads: int) -> Readings:
    """Those of a view: anywhere within the joints' limits, or where the camera sees the board."""
    random, limits = np.random.default_rng(_SEED), joint_limits(cell)
    board, _, camera = view.partition(":")
    if camera in cell.cameras:
        q = showing_postures(cell, limits, [(board, camera)], _PICTURES, random, threads=threads)[0][:_POSTURES]
    else:
        q = random.uniform(limits[:, 0], limits[:, 1], (_POSTURES, len(limits)))
    return Readings(q, {}, "", arms=approach_conditions(cell, q, drawn_approaches(cell, len(q), random)))


def _is_known(cell: Cell, postures: Readings, view: str) -> bool:
    few = postures.pick(np.arange(1))
    return bool(np.isfinite(deviation_of(cell, view_points(cell, few, view))).all())


def _is_open(name: str, records: Sequence[CalibrationRecord | None]) -> bool:
    """Did a calibration identify it, or does none say what it did?"""
    return any(record is None or name in record.roots for record in records)


def _parameters(cell: Cell) -> list[tuple[_core.Parameter, bool]]:
    """Those of the tree and its effects, then of cameras and boards; whether each belongs to a geometry or place."""
    own = list(cell.model.parameters)
    out = [(of, i < len(cell.core.parameters)) for i, of in enumerate(own)]
    if cell.cameras and cell.boards:
        anything = np.zeros((1, 2 * len(cell.cameras) * sum(corner_counts(cell))))
        seen = Readings(np.zeros((1, len(cell.joint_columns))), {CORNERS: anything}, "")
        out += [(of, True) for of in seen.measured(replace(cell, distances=())).parameters]
    return out


def _placed(cell: Cell) -> set[str]:
    """Names of the numbers that say where members stand."""
    arms = {arm.name for arm in cell.arms}
    owners = [f"{of.name}.base" if of.name in arms else of.name for of in cell.core.branches]
    owners += [*(f"camera {name}" for name in cell.cameras), *(f"board {name}" for name in cell.boards)]
    return {f"{owner} {axis}" for owner in owners for axis in PLACEMENT}


def _points(cell: Cell, at: dict[str, Readings], names: list[str], threads: int) -> _Points:
    x, J, view = list[FloatArray](), list[FloatArray](), list[str]()
    for name, postures in at.items():
        for point in _of_target(cell, name):
            found = view_points(cell, postures, name, point, threads)
            x.append(found.position)
            J.append(_by_names(found, names))
            view += [name] * len(found.position)
    return _Points(np.concatenate(x), np.concatenate(J), view)


def _of_target(cell: Cell, view: str) -> FloatArray:
    """(K, 3) where on a target it is looked at [m]: its origin, the outermost corners of a board."""
    board = cell.boards.get(view.partition(":")[0])
    if board is None:
        return np.zeros((1, 3))
    at = board_corners(board)
    low, high = at.min(axis=0), at.max(axis=0)
    return np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])


def _by_names(found: ViewPoints, names: list[str]) -> FloatArray:
    out, own = np.zeros((*found.position.shape, len(names))), {name: k for k, name in enumerate(found.names)}
    here = [k for k, name in enumerate(names) if name in own]
    out[:, :, here] = found.J[:, :, [own[names[k]] for k in here]]
    return out


def _moves(J: FloatArray, names: list[str], record: CalibrationRecord) -> FloatArray:
    """(3 M, r) how the points move with each column of the root of a record's covariance."""
    known = [k for k, name in enumerate(names) if name in record.roots]
    return np.asarray((J[:, :, known] @ np.array([record.roots[names[k]] for k in known])).reshape(J.shape[0] * 3, -1))


def _moved(cell: Cell, names: list[str], change: FloatArray) -> Cell:
    """The cell with its parameters, and its cameras and boards, changed."""
    own = len(cell.model.start)
    moved = cell.with_values(np.asarray(cell.model.start) + change[:own])
    unknowns = [of for of, _ in _parameters(cell)[own:]]
    return moved.with_rig(unknowns, change[own:], np.full(len(unknowns), np.nan)) if unknowns else moved
