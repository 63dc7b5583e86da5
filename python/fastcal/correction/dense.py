# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Multilayer perceptrons: x_(l+1) = f_l(x_l W_l + b_l)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.errors import InvalidInput

ACTIVATIONS: dict[str, Callable[[FloatArray, float], FloatArray]] = {
    "linear": lambda x, slope: x,
    "tanh": lambda x, slope: np.tanh(x),
    "relu": lambda x, slope: np.maximum(x, 0.0),
    "sigmoid": lambda x, slope: 0.5 * (1 + np.tanh(x / 2)),
    "prelu": lambda x, slope: np.where(x > 0, x, slope * x),
}


@dataclass(frozen=True, eq=False)
class DenseNet:
    """One network.

    Attributes:
        weights: W_l (in, out), one a layer.
        biases: b_l (out,).
        activations: Names of f_l; the last layer's is linear in every network that fastcal trains.
        slopes: Of prelu on negative values, one a layer; unused by the others.
    """

    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]
    activations: tuple[str, ...]
    slopes: tuple[float, ...]

    def __call__(self, x: FloatArray) -> FloatArray:
        """(N, outputs) for x (N, inputs)."""
        for W, b, name, slope in zip(self.weights, self.biases, self.activations, self.slopes, strict=True):
            x = ACTIVATIONS[name](x @ W + b, slope)
        return x

    @property
    def inputs(self) -> int:
        """Numbers that the network reads."""
        return int(self.weights[0].shape[0])

    @property
    def outputs(self) -> int:
        """Numbers that it gives."""
        return int(self.weights[-1].shape[1])

    @property
    def hidden(self) -> list[int]:
        """Neurons of the hidden layers."""
        return [W.shape[1] for W in self.weights[:-1]]

    def pack(self) -> Packed:
        """For a file."""
        tensors: dict[str, NDArray[Any]] = {"slopes": np.asarray(self.slopes)}
        for i, (W, b) in enumerate(zip(self.weights, self.biases, strict=True)):
            tensors |= {f"weight{i}": W, f"bias{i}": b}
        return Packed({"activations": list(self.activations)}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> DenseNet:
        """From a file."""
        names = setting(settings, "activations", list)
        if not names or any(name not in ACTIVATIONS for name in names):
            raise InvalidInput(f"expected activations of {', '.join(ACTIVATIONS)}, got {str(names)[:60]}")
        weights, biases = [], []
        width: int | None = None
        for i in range(len(names)):
            W = tensors.take(f"weight{i}", (width, None))
            width = W.shape[1]
            weights.append(W)
            biases.append(tensors.take(f"bias{i}", (width,)))
        slopes = tensors.take("slopes", (len(names),))
        return DenseNet(tuple(weights), tuple(biases), tuple(names), tuple(slopes.tolist()))
