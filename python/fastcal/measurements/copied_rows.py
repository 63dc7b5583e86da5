# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that are exact copies of others: no instrument measures the same twice to the last digit."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset

_MAY_DIFFER = ("move", "time")  # a move follows from the row before


def row_bytes(rows: NDArray[np.float64]) -> list[bytes]:
    """Each row (N, k) as bytes: equal, and so of one hash, where all its numbers are the same to the last bit."""
    return [row.tobytes() for row in rows]


def copied_row_notes(data: Dataset) -> list[str]:
    """A sentence where measured rows agree with an earlier one in joints, conditions and all that was measured."""
    own = (getattr(data, f.name) for f in fields(data) if f.name not in _MAY_DIFFER)
    tables = [x for x in (*own, *data.observed.values()) if isinstance(x, np.ndarray)]
    rows = np.hstack([x.reshape(len(data), -1).astype(np.float64) for x in tables])[data.measured]
    count = len(rows) - len(set(row_bytes(rows)))
    if not count:
        return []
    which = "1 row is an exact copy of another" if count == 1 else f"{count} rows are exact copies of others"
    return [f"{which}; a copy counts as a measurement of its own and lets noise look like a cause: leave copies out"]
