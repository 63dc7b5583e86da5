# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Many small networks as one: their numbers are the rows of a matrix, their layers batched matrix products.

Networks may differ in depth, widths and activations. Narrow layers are padded, shallow networks pass through, so that
each gives what it would alone, and a step of all costs little more than a step of one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.correction.dense import DenseNet

FloatArray = NDArray[np.float64]

PRELU_START = 0.25


@dataclass(frozen=True)
class Architecture:
    """Neurons and activations of the hidden layers; the output is linear."""

    hidden: tuple[int, ...]
    activations: tuple[str, ...]

    @staticmethod
    def plain(hidden: Sequence[int], activation: str = "tanh") -> Architecture:
        """The same activation everywhere."""
        return Architecture(tuple(hidden), (activation,) * len(hidden))


class Population:
    """P networks with the same inputs and outputs.

    Attributes:
        size: Numbers of one network, a row of theta (P, size).
    """

    def __init__(
        self, inputs: int, outputs: int, members: Sequence[Architecture], device: torch.device | str = "cpu"
    ) -> None:
        self.inputs, self.outputs, self.members = inputs, outputs, tuple(members)
        self.depth = max(len(member.hidden) for member in members)
        self.width = max(max(member.hidden) for member in members)
        fans = [inputs] + [self.width] * self.depth
        self._places: list[tuple[int, int, int]] = []  # (start, in, out) of each layer
        at = 0
        for fan_in, fan_out in zip(fans, [self.width] * self.depth + [outputs], strict=True):
            self._places.append((at, fan_in, fan_out))
            at += (fan_in + 1) * fan_out
        self._slopes = at
        self.size = at + self.depth
        self._masks, self._active, self._kinds = [], [], []
        self._all_active: list[bool] = []
        for layer in range(self.depth):
            widths = [member.hidden[layer] if layer < len(member.hidden) else 0 for member in members]
            mask = np.arange(self.width) < np.array(widths)[:, np.newaxis]
            self._masks.append(torch.tensor(mask[:, np.newaxis], dtype=torch.float32, device=device))
            self._active.append(torch.tensor(np.array(widths)[:, np.newaxis, np.newaxis] > 0, device=device))
            self._all_active.append(min(widths) > 0)
            names = [member.activations[layer] if layer < len(member.hidden) else "" for member in members]
            kinds = {name: [name == other for other in names] for name in sorted(set(names) - {""})}
            shares = {name: torch.tensor(where, dtype=torch.float32, device=device) for name, where in kinds.items()}
            self._kinds.append({name: share[:, None, None] for name, share in shares.items()})

    def __len__(self) -> int:
        return len(self.members)

    def start(self, seeds: Sequence[int], last: float = 1.0) -> torch.Tensor:
        """(P, size) random networks, each from its own seed: normal, variance gain / fan in, output times `last`."""
        rows = [
            self._start_of(member, np.random.default_rng(seed), last)
            for member, seed in zip(self.members, seeds, strict=True)
        ]
        return torch.tensor(np.array(rows), dtype=torch.float32)

    def _start_of(self, member: Architecture, random: np.random.Generator, last: float) -> FloatArray:
        theta = np.zeros(self.size)
        fan_in = self.inputs
        for layer, (width, kind) in enumerate(zip(member.hidden, member.activations, strict=True)):
            gain = 2.0 if kind in ("relu", "prelu") else 1.0
            self._put(theta, layer, random.standard_normal((fan_in, width)) * math.sqrt(gain / fan_in))
            theta[self._slopes + layer] = PRELU_START
            fan_in = width
        self._put(theta, self.depth, last * random.standard_normal((fan_in, self.outputs)) * math.sqrt(1 / fan_in))
        return theta

    def _put(self, theta: FloatArray, layer: int, W: FloatArray) -> None:
        start, fan_in, fan_out = self._places[layer]
        block = theta[start : start + fan_in * fan_out].reshape(fan_in, fan_out)
        block[: W.shape[0], : W.shape[1]] = W

    def __call__(self, theta: torch.Tensor, x: torch.Tensor) -> torch.Tensor:
        """(P, B, outputs) of x (P, B, inputs), or of x (B, inputs) that all read."""
        count = len(theta)
        h = x.expand(count, *x.shape) if x.ndim == 2 else x
        for layer, (start, fan_in, fan_out) in enumerate(self._places):
            middle = start + fan_in * fan_out
            W = theta[:, start:middle].view(count, fan_in, fan_out)
            z = torch.baddbmm(theta[:, middle : middle + fan_out].unsqueeze(1), h, W)
            if layer == self.depth:
                return z
            a = self._activated(z, layer, theta)
            # What pads has numbers of 0, and all functions but the sigmoid leave a 0 as it is: it learns nothing.
            if "sigmoid" in self._kinds[layer]:
                a = a * self._masks[layer]
            h = a if self._all_active[layer] else torch.where(self._active[layer], a, h)
        raise AssertionError

    def _activated(self, z: torch.Tensor, layer: int, theta: torch.Tensor) -> torch.Tensor:
        kinds = self._kinds[layer]
        slope = theta[:, self._slopes + layer].view(-1, 1, 1)
        if len(kinds) == 1:
            return _FUNCTIONS[next(iter(kinds))](z, slope)
        parts = [share * _FUNCTIONS[name](z, slope) for name, share in kinds.items()]
        return torch.stack(parts).sum(dim=0) if len(parts) > 2 else parts[0] + parts[1]

    def networks(self, theta: torch.Tensor) -> list[DenseNet]:
        """Each network without its padding."""
        rows = theta.detach().cpu().numpy().astype(float)
        return [self._network(row, member) for row, member in zip(rows, self.members, strict=True)]

    def _network(self, row: FloatArray, member: Architecture) -> DenseNet:
        weights, biases = [], []
        fan_in = self.inputs
        layers = [*range(len(member.hidden)), self.depth]
        for layer, width in zip(layers, [*member.hidden, self.outputs], strict=True):
            start, padded_in, padded_out = self._places[layer]
            middle = start + padded_in * padded_out
            weights.append(row[start:middle].reshape(padded_in, padded_out)[:fan_in, :width].copy())
            biases.append(row[middle : middle + width].copy())
            fan_in = width
        slopes = (*row[self._slopes : self._slopes + len(member.hidden)].tolist(), 0.0)
        return DenseNet(tuple(weights), tuple(biases), (*member.activations, "linear"), slopes)


_FUNCTIONS: dict[str, Callable[[torch.Tensor, torch.Tensor], torch.Tensor]] = {
    "tanh": lambda z, slope: torch.tanh(z),
    "relu": lambda z, slope: torch.relu(z),
    "sigmoid": lambda z, slope: torch.sigmoid(z),
    "prelu": lambda z, slope: slope * z + (1 - slope) * torch.relu(z),  # several times faster than torch.where
}
