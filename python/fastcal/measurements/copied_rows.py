# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that are exact copies of others: no instrument measures the same twice to the last digit."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.observations import without_measured

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset

_MAY_DIFFER = ("move", "row", "time")  # a move follows from the row before


def row_bytes(rows: NDArray[np.float64]) -> list[bytes]:
    """Each row (N, k) as bytes: equal, and so of one hash, where all its numbers are the same to the last bit."""
    return [row.tobytes() for row in rows]


def copied_rows(data: Dataset) -> NDArray[np.intp]:
    """Measured rows that agree with an earlier one in joints, conditions and all that was measured."""
    own = (getattr(data, f.name) for f in fields(data) if f.name not in _MAY_DIFFER)
    labels = (data.label_codes(field)[0] for field in data.observed_labels)
    tables = [x for x in (*own, *data.observed.values(), *labels) if isinstance(x, np.ndarray)]
    measured = np.flatnonzero(data.measured)
    rows = row_bytes(np.hstack([x.reshape(len(data), -1).astype(np.float64) for x in tables])[measured])
    first = dict(zip(reversed(rows), reversed(measured.tolist()), strict=True))
    return np.array([i for i, row in zip(measured.tolist(), rows, strict=True) if first[row] != i], dtype=np.intp)


def copied_row_notes(data: Dataset) -> list[str]:
    """A sentence where measured rows are copies of others."""
    count = len(copied_rows(data))
    if not count:
        return []
    why = "a copy counts as a measurement of its own and lets noise look like a cause: leave copies out"
    return [f"{_which(count)}; {why}"]


def counted_once(data: Dataset) -> Dataset:
    """The same rows, as if nothing had been measured in points that are copies; its notes say so.

    A length or an angle alone may be read twice alike, by rounding: these stay.
    """
    if data.position is None:
        return data
    copied = copied_rows(data)
    copied = copied[np.isfinite(data.position[copied]).all(axis=1)]
    if len(copied) == 0:
        return data
    told = copied_row_notes(data)
    notes = [note for note in data.notes if note not in told]
    return replace(without_measured(data, copied), notes=(*notes, f"{_which(len(copied))}; each counts once"))


def _which(count: int) -> str:
    return "1 row is an exact copy of another" if count == 1 else f"{count} rows are exact copies of others"
