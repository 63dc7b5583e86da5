# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a fit leaves, linearized, and the data without some of the rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.problem import CalibrationProblem
from fastcal.measurements.dataset import Dataset

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Residuals:
    """The problem near a fit.

    Attributes:
        J: (m, P) whitened columns of all parameters.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row that each number belongs to, ascending.
        free: Columns of the identified parameters.
        kept: (m,) is its row no outlier?
        number: (m,) which number of its row; 0 to 2 are the point where points were measured.
        scale: [m] what a whitened 1 stands for.
        theta, noise: Where, and the noise common to all rows by observation.
    """

    J: FloatArray
    residual: FloatArray
    row: NDArray[np.int64]
    number: NDArray[np.int64]
    free: list[int]
    kept: NDArray[np.bool_]
    scale: float
    theta: FloatArray
    noise: list[float]


def near_fit(problem: CalibrationProblem, found: _core.Identification) -> Residuals | None:
    """The linearized problem; None where nothing was identified or no points were measured."""
    if not found.free or problem.data.position is None or not found.sigma[0] > 0:
        return None
    theta, noise = np.asarray(found.theta), list(found.common_noise)
    near = problem.linearize(theta, noise)
    row = np.asarray(near.row, dtype=np.int64)
    number = np.asarray(near.number, dtype=np.int64)
    kept = ~np.isin(row, found.outliers)
    J, r = np.asarray(near.J), np.asarray(near.r)
    return Residuals(J, r, row, number, list(found.free), kept, float(found.sigma[0]), theta, noise)


def without_rows(data: Dataset, rows: NDArray[np.int64]) -> Dataset:
    """The data with nothing measured in some rows."""

    def blank(values: FloatArray | None) -> FloatArray | None:
        if values is None:
            return None
        out = np.array(values)
        out[rows] = np.nan
        return out

    gone = set(rows.tolist())
    texts = {name: [t if i not in gone else "" for i, t in enumerate(v)] for name, v in data.observed_labels.items()}
    return replace(
        data,
        position=blank(data.position),
        rotation=blank(data.rotation),
        distance=blank(data.distance),
        observed={name: blanked for name, values in data.observed.items() if (blanked := blank(values)) is not None},
        observed_labels=texts,
    )
