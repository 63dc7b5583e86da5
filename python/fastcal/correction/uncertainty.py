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

from fastcal.arrays import FloatArray
from fastcal.correction.packing import Packed, Tensors
from fastcal.errors import InvalidInput

LEVEL = 0.9
DEVIATIONS = 1.6448536269514722  # of the two-sided interval of LEVEL, normal


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """floor, factor, outside: (6,) each, base's axes [m; rad], 1, [m; rad]; NaN for turns that were not measured."""

    floor: FloatArray
    factor: FloatArray
    outside: FloatArray

    @staticmethod
    def fitted(errors: FloatArray, spread: FloatArray, before: FloatArray) -> Uncertainty:
        """From held-out rows; k = 3: points alone.

        Args:
            errors: (N, k) of the correction, NaN where not measured.
            spread: (N, 6) of its members.
            before: (N, k) the residuals without it.
        """
        own = spread[:, : errors.shape[1]]
        floor = np.sqrt(np.maximum(np.nanmean(errors**2, axis=0) - np.mean(own**2, axis=0), 0.0))
        floor = np.maximum(floor, 1e-9)
        ratio = np.abs(errors) / np.sqrt(floor**2 + own**2)
        factor = np.nanquantile(ratio, LEVEL, axis=0) / DEVIATIONS
        return Uncertainty(*map(_padded, (floor, factor, np.sqrt(np.nanmean(before**2, axis=0)))))

    def sigma(self, spread: FloatArray, weight: FloatArray) -> FloatArray:
        """(N, 6) for the members' spread (N, 6) and the guard's weight (N,)."""
        w = weight[:, np.newaxis]
        return np.asarray(w * self.factor * np.sqrt(self.floor**2 + spread**2) + (1 - w) * self.outside)

    def pack(self) -> Packed:
        """For a file."""
        known = 6 if np.isfinite(self.floor).all() else 3
        return Packed({}, {name: getattr(self, name)[:known] for name in ("floor", "factor", "outside")})

    @staticmethod
    def unpack(tensors: Tensors) -> Uncertainty:
        """From a file."""
        floor = tensors.take("floor", (None,))
        if len(floor) not in (3, 6):
            raise InvalidInput(f"the uncertainty's floor must have 3 or 6 numbers, got {len(floor)}")
        return Uncertainty(*map(_padded, (floor, *(tensors.take(name, floor.shape) for name in ("factor", "outside")))))


def _padded(values: FloatArray) -> FloatArray:
    """(6,), NaN for turns of which (3,) say nothing."""
    return np.append(values, np.full(6 - len(values), np.nan))
