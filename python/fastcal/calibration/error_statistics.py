# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Mean, deviation, maximum and root mean square of errors, at once or part by part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.units import from_si


@dataclass(frozen=True)
class ErrorStatistics:
    """Sizes of errors over all rows [m or rad], such as distances of points. std is with n - 1."""

    count: int
    mean: float
    std: float
    max: float
    rms: float

    @staticmethod
    def of(distances: FloatArray) -> ErrorStatistics | None:
        """Statistics of (N,) sizes, NaN left out; None where nothing is left."""
        sums = ErrorSums()
        sums.add(distances)
        return sums.statistics()

    def to_mm(self) -> dict[str, float]:
        """mean, std, max, rms in mm, as result.json holds them."""
        return self.to_unit("mm")

    def to_unit(self, unit: str) -> dict[str, float]:
        """mean, std, max, rms in a unit."""
        return {name: from_si(getattr(self, name), unit) for name in ("mean", "std", "max", "rms")}


class ErrorSums:
    """Statistics of errors that come part by part (T. Chan, G. Golub, R. LeVeque 1983)."""

    def __init__(self) -> None:
        self._count, self._mean, self._squares, self._largest = 0, 0.0, 0.0, 0.0  # squares: about the mean

    def add(self, distances: FloatArray) -> None:
        """Adds (N,) sizes, NaN left out."""
        known = distances[~np.isnan(distances)]
        if not len(known):
            return
        mean, whole = float(known.mean()), self._count + len(known)
        apart = mean - self._mean
        self._squares += float(((known - mean) ** 2).sum()) + apart**2 * self._count * len(known) / whole
        self._mean += apart * len(known) / whole
        self._count, self._largest = whole, max(self._largest, float(known.max()))

    def statistics(self) -> ErrorStatistics | None:
        """Of all that was added; None where nothing was."""
        if not self._count:
            return None
        std = float(np.sqrt(self._squares / (self._count - 1))) if self._count > 1 else 0.0
        rms = float(np.sqrt(self._squares / self._count + self._mean**2))
        return ErrorStatistics(self._count, self._mean, std, self._largest, rms)
