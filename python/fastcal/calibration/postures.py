# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Are there enough different postures? Repeated measurements of one posture inform only about the noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import IndexArray
from fastcal.calibration.pose_folds import measuring_place
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.said import failure, said
from fastcal.units import to_si

_STILL = to_si(0.05, "deg")  # that a joint which is read back may differ by without having moved [rad; m: 0.9 mm]


def check_postures(data: Dataset, parameters: Sequence[str] | None = None) -> list[str]:
    """Refuses rows of one and the same posture, unless no `parameters` of the arm are asked for; no notes.

    Raises:
        InvalidInput: No joint moved in the rows where something was measured, and nothing else varies.
    """
    rows = data.measured
    asked = parameters is None or len(parameters) > 0
    if not (asked and rows.any()) or len(np.unique(states(data)[rows])) > 1:
        return []
    which = "the only measured row shows" if rows.sum() == 1 else f"all {rows.sum()} measured rows show"
    raise InvalidInput(
        f"{data.source}: no joint moved: {which} one and the same posture, from which nothing about the arm can be "
        f"identified; measure different postures (`fastcal design` plans them)"
    )


def states(data: Dataset) -> NDArray[np.int64]:
    """(N,) a number for each different posture and load, the same in all rows that repeat it."""
    parts = [np.round(data.q / _STILL), data.payload[:, np.newaxis]]
    parts += [] if data.wrench is None else [data.wrench]
    return np.asarray(np.unique(np.hstack(parts), axis=0, return_inverse=True)[1]).reshape(-1)


def stays(data: Dataset) -> IndexArray:
    """(N,) the stay that each row belongs to, 0, 1 ... in the order of measuring.

    A stay is all that was measured one after the other in one posture, under one load: several targets at the tool, or
    readings that were repeated before the arm moved on.
    """
    order = np.argsort(measuring_place(data), kind="stable")
    moved = (np.abs(np.diff(data.q[order], axis=0)) > _STILL).any(axis=1) | (np.diff(data.payload[order]) != 0)
    if data.wrench is not None:
        moved |= (np.diff(data.wrench[order], axis=0) != 0).any(axis=1)
    out = np.empty(len(data), dtype=np.intp)
    out[order] = np.cumsum(np.r_[False, moved][: len(data)])
    return out


def saturated(data: Dataset, found: _core.Identification) -> str | None:
    """Why a fit that converged says nothing about the arm; None where it does."""
    return too_few_postures(data, len(found.free)) if found.status == "converged" else None


def too_few_postures(data: Dataset, parameters: int) -> str | None:
    """Why a fit of so many parameters says nothing: repeats counted once, the rows hold no more numbers than that."""
    numbers, state = _numbers(data), states(data)
    most = np.zeros(state.max() + 1, dtype=np.int64)
    np.maximum.at(most, state, numbers)
    different, measured = int(most.sum()), int(np.sum(numbers > 0))
    if different > parameters:
        return None
    count = int(np.sum(most > 0))
    counts = {"rows": measured, "count": count, "numbers": different, "parameters": parameters}
    if different < numbers.sum():
        why = said(
            "{rows} rows show only {count} different postures: they hold {numbers} independent numbers, which the "
            "{parameters} parameters that are identified fit whatever they are, and repeats only say how large the "
            "noise is",
            **counts,
        )
    else:
        why = said(
            "{rows} rows show {count} different postures: they hold {numbers} independent numbers, which the "
            "{parameters} parameters that are identified fit whatever they are",
            **counts,
        )
    return failure(why, said("measure more postures (`fastcal design` plans them)"))


def _numbers(data: Dataset) -> NDArray[np.int64]:
    """(N,) how many independent numbers were measured in each row."""
    out = np.zeros(len(data), dtype=np.int64)
    labelled = {name: _core.observation_entry(kind).labelled for kind, own in data.kinds.items() for name in own}
    for field, count in labelled.items():
        values = data.table(field)
        if values is None:
            out += count * (data.label_codes(field)[0] >= 0)
        else:
            out += np.minimum(np.sum(~np.isnan(values), axis=1), 3)  # a quaternion holds three
    return out
