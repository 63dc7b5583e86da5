# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the report draws of one measured set: the SI arrays of an evaluation in the units of the page.

Residuals are predicted less measured, as in Evaluation, of one kind of reading: of points x, y, z in the measuring
frame, else the turns, lengths, heights or tilts. The error of a row is the size of its reading, of several the largest.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fastcal import units
from fastcal.measurements.kinds import POINTS
from fastcal.place import joint_position
from fastcal.report.figures import COMPONENT_COLOURS
from fastcal.report.language import _, language
from fastcal.report.tables import unit_text
from fastcal.report.trends import Trend, judged_rows, trends

if TYPE_CHECKING:
    from fastcal.calibration.error_statistics import ErrorStatistics
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.calibration.kind_errors import KindErrors
    from fastcal.measurements.dataset import Dataset
    from fastcal.measurements.kinds import Kind

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variable:
    """Something a residual may depend on: values (N,) in `unit`, called `title` in a sentence."""

    name: str
    title: str
    unit: str
    values: Array

    @property
    def label(self) -> str:
        """Title and unit, as an axis has them."""
        return f"{self.title} ({self.unit})" if self.unit else self.title


@dataclass(frozen=True)
class Statistics:
    """Of the errors of `count` readings, in the unit of their kind."""

    count: int
    mean: float
    std: float
    max: float
    rms: float


@dataclass(frozen=True)
class Rows:
    """One kind of reading in a measured set of N rows, in its unit and those of the variables.

    Attributes:
        kind: The kind of reading.
        name: Training or Test.
        source: Where the data came from.
        position: (N, 3) measured points in mm, NaN where not measured.
        components: Names of the m columns of `residual`.
        residual: (N, m) after calibration, NaN where not measured.
        point_before, point_after: (N, 3) residual of the point in mm.
        error_before, error_after: (N,) error of each row, NaN where there is none.
        before, after: Their statistics, as the evaluation gives them.
        joints, conditions: What the residual may depend on.
        numbers: (N,) which rows of the file these are.
    """

    kind: Kind
    name: str
    source: str
    position: Array
    components: tuple[str, ...]
    residual: Array
    point_before: Array
    point_after: Array
    error_before: Array
    error_after: Array
    before: Statistics
    after: Statistics
    joints: list[Variable]
    conditions: list[Variable]
    numbers: NDArray[np.intp]

    @property
    def unit(self) -> str:
        """Of errors and residuals, as it is printed."""
        return unit_text(self.kind.unit)

    @property
    def row_count(self) -> int:
        """N."""
        return len(self.residual)

    @property
    def judged_count(self) -> int:
        """Rows with an error: of very many all, of several instruments each row once."""
        rows = int(np.isfinite(self.error_after).sum())
        return max(rows, self.after.count if self.kind.name == POINTS else 0)

    @cached_property
    def variables(self) -> list[Variable]:
        """Joints and conditions that differ between the rows."""
        joints = [joint for joint in self.joints if _varies(joint.values, _STILL)]
        return [*joints, *(condition for condition in self.conditions if _varies(condition.values))]

    @cached_property
    def trends(self) -> dict[str, Trend]:
        """How much of the residual each variable explains, by its name; of very many rows, in some of them."""
        rows = judged_rows(self.row_count)
        return trends({variable.name: variable.values[rows] for variable in self.variables}, self.residual[rows])

    def spread_without(self, outliers: Collection[int]) -> tuple[Statistics, Statistics] | None:
        """Before and after of the rows that are not among these places; None where not every error is at hand."""
        kept = np.setdiff1d(np.flatnonzero(np.isfinite(self.error_after)), list(outliers))
        if len(kept) == 0 or int(np.isfinite(self.error_after).sum()) != self.after.count:
            return None
        return _spread(self.error_before[kept]), _spread(self.error_after[kept])

    @property
    def with_arrows(self) -> NDArray[np.bool_]:
        """Rows with a whole point before and after: those an arrow can be drawn for (N,)."""
        parts = np.hstack([self.position, self.point_before, self.point_after])
        return np.asarray(np.isfinite(parts).all(axis=1))


_STILL = 1e-6  # [deg or mm] passive joints of closed loops move by rounding
_OF_A_POSE = ("x", "y", "z", "rz", "ry", "rx")  # what the joints of an arm of poses are, in their order

# Of each evaluation, as long as it is there: the page and the line about what to do next look for the same trends.
_SEEN: WeakKeyDictionary[Evaluation, tuple[str, Rows]] = WeakKeyDictionary()  # with the language of their titles


def rows_of(name: str, evaluation: Evaluation | None, joint_types: list[str], *, of_poses: bool = False) -> Rows | None:
    """The rows of the kind that an evaluation speaks of; None where it has nothing to judge before and after.

    `of_poses`: the joints stand for the pose of a flange.
    """
    if evaluation is None or evaluation.main is None:
        return None
    before, after = evaluation.main.statistics
    if before is None or after is None:
        return None
    tongue, rows = _SEEN.get(evaluation, ("", None))
    if rows is None or (tongue, rows.name) != (language.get(), name):
        joints = _joints(evaluation.data, joint_types, of_poses=of_poses)
        rows = _rows(name, evaluation, evaluation.main, before, after, joints)
        _SEEN[evaluation] = language.get(), rows
    return rows


def _rows(
    name: str,
    evaluation: Evaluation,
    main: KindErrors,
    before: ErrorStatistics,
    after: ErrorStatistics,
    joints: list[Variable],
) -> Rows:
    data, kind = evaluation.data, main.kind
    point_after = _millimetres(evaluation.error_after)
    point_before = np.full_like(point_after, np.nan)
    if evaluation.error_before is not None:
        point_before = _millimetres(evaluation.error_before)
    columns = dict(zip(_parts(main), main.numbers.reshape(len(data), -1).T, strict=True))
    shown = [part for part, column in columns.items() if np.isfinite(column).any()][: len(COMPONENT_COLOURS)]
    measured = {part: np.asarray(units.from_si(columns[part], kind.unit)) for part in shown}
    numbers = np.arange(len(data)) if evaluation.rows is None else evaluation.rows
    return Rows(
        kind=kind,
        name=name,
        source=str(data.source),
        position=_millimetres(data.points),
        components=tuple(measured),
        residual=np.column_stack(list(measured.values())),
        point_before=point_before,
        point_after=point_after,
        error_before=_largest(main.before, kind),
        error_after=_largest(main.after, kind),
        before=_statistics(before, kind),
        after=_statistics(after, kind),
        joints=joints,
        conditions=_conditions(data, numbers),
        numbers=numbers,
    )


def _parts(main: KindErrors) -> list[str]:
    """Names of the numbers of a row, instrument by instrument."""
    names: tuple[str, ...] = {"position": ("x", "y", "z"), "orientation": ("rx", "ry", "rz")}.get(main.kind.name, ())
    if len(names) != main.width:
        axes, kind = "xyz"[: main.width], _(main.kind.name)
        names = (kind,) if main.width == 1 else tuple(f"{kind} {axis}" for axis in axes)
    several = main.numbers.shape[1]
    return [f"{name} {k + 1}" if several > 1 else name for k in range(several) for name in names]


def _largest(sizes: Array | None, kind: Kind) -> Array:
    """(N,) the largest error of a row's readings (N, k) in the kind's unit; NaN where nothing was read."""
    if sizes is None:
        return np.zeros(0)
    known = np.isfinite(sizes).any(axis=1)
    largest = np.where(known, np.max(np.nan_to_num(sizes, nan=-1.0), axis=1), np.nan)
    return np.asarray(units.from_si(largest, kind.unit))


def _millimetres(metres: Array) -> Array:
    return np.asarray(units.from_si(np.asarray(metres, float), "mm"))


def _statistics(statistics: ErrorStatistics, kind: Kind) -> Statistics:
    return Statistics(statistics.count, **statistics.to_unit(kind.unit))


def _spread(errors: Array) -> Statistics:
    std = float(np.std(errors, ddof=1)) if len(errors) > 1 else 0.0
    rms = float(np.sqrt(np.mean(errors**2)))
    return Statistics(len(errors), float(errors.mean()), std, float(errors.max()), rms)


def _joints(data: Dataset, joint_types: list[str], *, of_poses: bool) -> list[Variable]:
    found = []
    for k, kind in enumerate(joint_types):
        unit, text = ("mm", "mm") if kind == "prismatic" else ("deg", "°")
        title = f"{_('flange')} {_OF_A_POSE[k]}" if of_poses else f"{_('joint')} {k + 1}"
        found.append(Variable(joint_position(k), title, text, np.asarray(units.from_si(data.q[:, k], unit))))
    return found


def _conditions(data: Dataset, numbers: NDArray[np.intp]) -> list[Variable]:
    order = np.asarray(data.extra.get("order", numbers), float)
    found = [Variable("order", _("order of measurement"), _("row"), order)]
    if data.time is not None and not np.array_equal(np.argsort(data.time), np.argsort(order)):
        found.append(Variable("time", _("time"), _("s since the first"), data.time - np.nanmin(data.time)))
    if data.temperature is not None:
        found.append(Variable("temperature", _("temperature"), "°C", np.asarray(units.from_si(data.temperature, "c"))))
    found.append(Variable("payload", _("payload"), "kg", data.payload))
    return found


def _varies(values: Array, least: float = 0.0) -> bool:
    """Do they differ by more than that?"""
    known = values[np.isfinite(values)]
    return len(known) > 1 and bool(np.ptp(known) > least)
