# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Errors of each kind of reading: how far points, turns, lengths, heights and tilts are from what a model predicts.

A reading is what one instrument says of one row: a whole point, an orientation, a length, a touch, the two tilts of a
level. Its error is the length of predicted minus measured [m or rad].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.error_statistics import ErrorStatistics
from fastcal.measurements.kinds import POINTS, Kind, in_order


@dataclass(frozen=True, eq=False)
class KindErrors:
    """What one kind of reading is off, before and after a calibration.

    Attributes:
        numbers, numbers_before: (N, k, c) predicted less measured, k instruments of the kind with c numbers a reading,
            NaN where not read; the second is None where only one model is judged, or no nominal arm could be fitted.
        of_all: Statistics before and after over all rows, where these N are some of very many.
    """

    kind: Kind
    numbers: FloatArray
    numbers_before: FloatArray | None = None
    of_all: tuple[ErrorStatistics | None, ErrorStatistics | None] | None = None

    @cached_property
    def after(self) -> FloatArray:
        """(N, k) error of each reading [m or rad]."""
        return whole_sizes(self.kind, self.numbers)

    @cached_property
    def before(self) -> FloatArray | None:
        """(N, k) the same before; None where `numbers_before` is."""
        return None if self.numbers_before is None else whole_sizes(self.kind, self.numbers_before)

    @property
    def rms(self) -> float | None:
        """After, in the kind's unit; None where nothing is known."""
        after = self.statistics[1]
        return None if after is None else self.kind.shown(after.rms)

    @property
    def width(self) -> int:
        """Numbers of a reading: 3 of a point, 1 of a length."""
        return int(self.numbers.shape[2])

    @property
    def statistics(self) -> tuple[ErrorStatistics | None, ErrorStatistics | None]:
        """Before and after; None where nothing is known."""
        if self.of_all is not None:
            return self.of_all
        before = None if self.before is None else ErrorStatistics.of(self.before.ravel())
        return before, ErrorStatistics.of(self.after.ravel())

    def without(self, places: IndexArray) -> tuple[ErrorStatistics | None, ErrorStatistics | None]:
        """`statistics` of the rows that are not at these places; None where not all rows are here, or none is left."""
        if self.of_all is not None:
            return None, None
        kept = (None if sizes is None else np.delete(sizes, places, axis=0) for sizes in (self.before, self.after))
        before, after = (None if k is None or not np.isfinite(k).any() else ErrorStatistics.of(k.ravel()) for k in kept)
        return before, after

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `kinds`: unit, count, before, after."""
        before, after = self.statistics
        out: dict[str, Any] = {"unit": self.kind.unit, "count": 0 if after is None else after.count}
        if self.before is not None:
            out["before"] = None if before is None else before.to_unit(self.kind.unit)
        return {**out, "after": None if after is None else after.to_unit(self.kind.unit)}


KindTable = Mapping[str, KindErrors]


def table(after: Mapping[Kind, FloatArray], before: Mapping[Kind, FloatArray] | None) -> dict[str, KindErrors]:
    """The errors of each kind that was read, by its name, positions first."""
    return {
        kind.name: KindErrors(kind, after[kind], None if before is None else before.get(kind))
        for kind in in_order(after)
        if not np.isnan(after[kind]).all()
    }


def sizes_of(numbers: FloatArray) -> FloatArray:
    """(N, ...) length of the numbers (N, ..., c) of a reading that are there; NaN where none is."""
    return np.where(np.isnan(numbers).all(axis=-1), np.nan, np.sqrt(np.nansum(numbers**2, axis=-1)))


def whole_sizes(kind: Kind, numbers: FloatArray) -> FloatArray:
    """`sizes_of`, of points only where they are whole: a distance has three coordinates."""
    return np.linalg.norm(numbers, axis=-1) if kind.name == POINTS else sizes_of(numbers)


def judged_on(
    kinds: KindTable,
    before: Mapping[str, ErrorStatistics | None],
    after: Mapping[str, ErrorStatistics | None],
) -> dict[str, KindErrors]:
    """The errors of some rows with the statistics of all, where these are known."""
    return {
        name: replace(of, of_all=(before.get(name), after[name])) if name in after else of for name, of in kinds.items()
    }
