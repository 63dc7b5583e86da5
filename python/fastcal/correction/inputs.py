# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a residual model may look at, and how it is scaled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.correction.packing import Packed, Tensors


@dataclass(frozen=True, eq=False)
class Inputs:
    """N rows.

    Attributes:
        q: (N, n) commanded joint positions [rad or m].
        payload: (N,) [kg].
        J_tool_q: (N, 6, n) motion [v; w] of the tool's point and frame by the joints, in the base's axes.
    """

    q: FloatArray
    payload: FloatArray
    J_tool_q: FloatArray

    def __len__(self) -> int:
        return len(self.q)

    @property
    def columns(self) -> FloatArray:
        """(N, n + 1) joints and payload side by side."""
        return np.column_stack([self.q, self.payload])

    def without_load(self) -> Inputs:
        """The same with payload 0."""
        return Inputs(self.q, np.zeros(len(self)), self.J_tool_q)

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Inputs:
        """The given rows."""
        return Inputs(self.q[rows], self.payload[rows], self.J_tool_q[rows])


@dataclass(frozen=True, eq=False)
class Scaling:
    """x = (column - mean) gain, gain = 1 / standard deviation, and 0 for a column that never varied."""

    mean: FloatArray
    gain: FloatArray

    @staticmethod
    def of(inputs: Inputs) -> Scaling:
        """The scaling that gives these rows mean 0 and deviation 1."""
        columns = inputs.columns
        mean, deviation = columns.mean(axis=0), columns.std(axis=0)
        varies = deviation > 1e-9 * np.maximum(1.0, np.abs(mean))
        return Scaling(mean, np.where(varies, 1 / np.where(varies, deviation, 1.0), 0.0))

    def __call__(self, inputs: Inputs) -> FloatArray:
        """(N, n + 1) scaled joints and payload."""
        return (inputs.columns - self.mean) * self.gain

    def pack(self) -> Packed:
        """For a file."""
        return Packed({}, {"mean": self.mean, "gain": self.gain})

    @staticmethod
    def unpack(tensors: Tensors) -> Scaling:
        """From a file."""
        mean = tensors.take("mean", (None,))
        return Scaling(mean, tensors.take("gain", mean.shape))
