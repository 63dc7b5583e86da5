# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The order in which rows without a time were measured: what jumped at a row is there from that row on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset


def in_order(data: Dataset) -> Dataset:
    """The rows that a model is fitted to, numbered as they come, unless they are already."""
    return data if data.row is not None else replace(data, row=np.arange(len(data)))


def of_unknown_order(data: Dataset) -> Dataset:
    """Rows of which nobody knows between which of the others they were measured."""
    return replace(data, row=np.full(len(data), -1))


def since(row: NDArray[np.int64] | None, first: float, count: float, rows: int) -> FloatArray:
    """(N,) what each of `rows` rows has of what is there from the row `first` on: 0 or 1.

    Rows that are numbered -1 have the mean of the `count` rows of that order; rows without a number, as those of a
    program, come after all of them.
    """
    if row is None:
        return np.ones(rows)
    mean = 1.0 if count <= 0 else 1.0 - first / count
    return np.where(row < 0, mean, (row >= first).astype(float))
