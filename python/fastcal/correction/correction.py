# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An ensemble of residual models with its guard, its limit and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.applicability import Guard
from fastcal.correction.experts import Expert
from fastcal.correction.inputs import Inputs
from fastcal.correction.uncertainty import Uncertainty

FloatArray = NDArray[np.float64]


class Corrected(NamedTuple):
    """A correction evaluated at N rows.

    Attributes:
        displacement: (N, 3) to be added to the predicted point [m].
        weight: (N,) of the guard: 1 as trained, 0 nothing is added.
        sigma: (N, 3) standard deviation of a measured coordinate about the corrected one [m].
    """

    displacement: FloatArray
    weight: FloatArray
    sigma: FloatArray


@dataclass(frozen=True, eq=False)
class Correction:
    """What `fastcal train` adds to a model.

    Attributes:
        network: mlp, bso-mlp, somm, ca-somm, ga-dnn, gp, knn or boosting.
        members: The ensemble; its mean is added.
        guard: Where it applies.
        limit: No displacement is longer [m].
        uncertainty: What held-out rows show of its errors.
        record: How it came about, for people: plain data.
        any_load: The load is not looked at: the model's compliances answer for it (RX160L, 14).
    """

    network: str
    members: tuple[Expert, ...]
    guard: Guard
    limit: float
    uncertainty: Uncertainty
    record: dict[str, Any] = field(default_factory=dict)
    any_load: bool = False

    def __deepcopy__(self, memo: dict[int, Any]) -> Correction:
        return self  # it never changes, and robots copy their spec

    @property
    def joint_count(self) -> int:
        """Joints of the arm that it was trained for."""
        return len(self.guard.turning)

    def __call__(self, inputs: Inputs) -> Corrected:
        """Displacement in the base's axes; sigma as well."""
        if self.any_load:
            inputs = inputs.without_load()
        each = np.array([member.displacement(inputs) for member in self.members])
        weight = self.guard.weight(inputs)
        mean = limited(each.mean(axis=0), self.limit)
        sigma = self.uncertainty.sigma(spread(each), weight)
        return Corrected(weight[:, np.newaxis] * mean, weight, sigma)


def limited(displacement: FloatArray, limit: float) -> FloatArray:
    """Vectors (N, 3) longer than the limit are cut to it, their direction kept."""
    length = np.linalg.norm(displacement, axis=1, keepdims=True)
    return np.asarray(displacement * np.minimum(1.0, limit / np.maximum(length, 1e-300)))


def spread(displacements: FloatArray) -> FloatArray:
    """(N, 3) standard deviation over the members of (M, N, 3); 0 for a single one."""
    return (
        np.asarray(displacements.std(axis=0, ddof=1)) if len(displacements) > 1 else np.zeros(displacements.shape[1:])
    )
