# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An ensemble of residual models with its guard, its limit and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.correction.applicability import Guard
from fastcal.correction.experts import Expert
from fastcal.correction.inputs import Inputs
from fastcal.correction.uncertainty import Uncertainty


class Corrected(NamedTuple):
    """A correction evaluated at N rows.

    Attributes:
        displacement: (N, 3) to be added to the predicted point [m].
        weight: (N,) of the guard: 1 as trained, 0 nothing is added.
        sigma: (N, 3) standard deviation of a measured coordinate about the corrected one [m].
        turn: (N, 3) rotation vector by which the predicted frame is turned [rad].
        sigma_turn: (N, 3) standard deviation of a measured turn about the corrected one [rad]; NaN where the
            correction was trained on points alone.
    """

    displacement: FloatArray
    weight: FloatArray
    sigma: FloatArray
    turn: FloatArray
    sigma_turn: FloatArray


@dataclass(frozen=True, eq=False)
class Correction:
    """What `fastcal train` adds to a model.

    Attributes:
        network: mlp, bso-mlp, somm, ca-somm, ga-dnn, gp, knn or boosting.
        members: The ensemble; its mean is added.
        guard: Where it applies.
        limit, turn_limit: No displacement is longer [m], no turn larger [rad].
        uncertainty: What held-out rows show of its errors.
        record: How it came about, for people: plain data.
        any_load: The load is not looked at: the model's compliances answer for it (RX160L, 14).
    """

    network: str
    members: tuple[Expert, ...]
    guard: Guard
    limit: float
    turn_limit: float
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
        """Displacement and turn in the base's axes; sigmas as well."""
        if self.any_load:
            inputs = inputs.without_load()
        each = np.array([member.twist(inputs) for member in self.members])
        weight = self.guard.weight(inputs)
        mean = weight[:, np.newaxis] * limited_twist(each.mean(axis=0), self.limit, self.turn_limit)
        sigma = self.uncertainty.sigma(spread(each), weight)
        return Corrected(mean[:, :3], weight, sigma[:, :3], mean[:, 3:], sigma[:, 3:])


def limited(vectors: FloatArray, limit: float) -> FloatArray:
    """Vectors (N, 3) longer than the limit are cut to it, their direction kept."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors * np.minimum(1.0, limit / np.maximum(length, 1e-300)))


def limited_twist(twist: FloatArray, limit: float, turn_limit: float) -> FloatArray:
    """(N, 6): displacement [m] and turn [rad], each cut to its limit."""
    return np.hstack([limited(twist[:, :3], limit), limited(twist[:, 3:], turn_limit)])


def spread(twists: FloatArray) -> FloatArray:
    """(N, 6) standard deviation over the members of (M, N, 6); 0 for a single one."""
    return np.asarray(twists.std(axis=0, ddof=1)) if len(twists) > 1 else np.zeros(twists.shape[1:])
