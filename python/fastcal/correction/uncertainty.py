# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How wrong a correction is: its members' disagreement, made to cover what held-out rows showed.

    sigma = w factor sqrt(floor^2 + spread^2) + (1 - w) outside

floor is what the members do not disagree about (noise, what none of them learns), `factor` makes nine of ten held-out
errors smaller than 1.645 sigma, and outside is the size of what is left without a correction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.packing import Packed, Tensors

FloatArray = NDArray[np.float64]

LEVEL = 0.9
DEVIATIONS = 1.6448536269514722  # of the two-sided interval of LEVEL, normal


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """floor, factor, outside: (3,) each, base's axes [m, 1, m]."""

    floor: FloatArray
    factor: FloatArray
    outside: FloatArray

    @staticmethod
    def fitted(errors: FloatArray, spread: FloatArray, before: FloatArray) -> Uncertainty:
        """From held-out rows: errors (N, 3) of the correction, its members' spread, and the residuals before it."""
        floor = np.sqrt(np.maximum(np.mean(errors**2, axis=0) - np.mean(spread**2, axis=0), 0.0))
        floor = np.maximum(floor, 1e-9)
        ratio = np.abs(errors) / np.sqrt(floor**2 + spread**2)
        factor = np.quantile(ratio, LEVEL, axis=0) / DEVIATIONS
        return Uncertainty(floor, factor, np.sqrt(np.mean(before**2, axis=0)))

    def sigma(self, spread: FloatArray, weight: FloatArray) -> FloatArray:
        """(N, 3) for the members' spread (N, 3) and the guard's weight (N,)."""
        w = weight[:, np.newaxis]
        return np.asarray(w * self.factor * np.sqrt(self.floor**2 + spread**2) + (1 - w) * self.outside)

    def pack(self) -> Packed:
        """For a file."""
        return Packed({}, {name: getattr(self, name) for name in ("floor", "factor", "outside")})

    @staticmethod
    def unpack(tensors: Tensors) -> Uncertainty:
        """From a file."""
        floor, factor, outside = (tensors.take(name, (3,)) for name in ("floor", "factor", "outside"))
        return Uncertainty(floor, factor, outside)
