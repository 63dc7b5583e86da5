# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Many small networks as one: their numbers are the rows of a matrix, their layers batched matrix products.

Networks may differ in depth, widths and activations. Narrow layers are padded, shallow networks pass through, so that
each gives what it would alone, and a step of all costs little more than a step of one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from fastcal.arrays import FloatArray
from fastcal.correction.dense import DenseNet
from fastcal.networks.layers import Hidden, Kept, Numbers, Place, backward, forward

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
        depths = np.array([len(member.hidden) for member in members])
        order = np.argsort(-depths, kind="stable")
        self._deepest_first = tuple(members[k] for k in order)
        sorted_already = bool(np.all(np.diff(depths) <= 0))
        self._order = None if sorted_already else torch.tensor(order, device=device)
        self._back = None if sorted_already else torch.tensor(np.argsort(order), device=device)
        self.depth = max(len(member.hidden) for member in members)
        # Each layer is as wide as its widest network, the output reads as many as the widest last layer has.
        widths = [max(m.hidden[k] for m in members if k < len(m.hidden)) for k in range(self.depth)]
        self._places: list[Place] = []
        at = 0
        fans = zip([inputs, *widths[:-1]], widths, strict=True)
        for fan_in, fan_out in (*fans, (max(m.hidden[-1] for m in members), outputs)):
            self._places.append(Place(at, fan_in, fan_out))
            at = self._places[-1].stop
        self._slopes = at
        self.size = at + self.depth
        self._layers = [self._layer(k, device) for k in range(self.depth)]

    def _layer(self, k: int, device: torch.device | str) -> Hidden:
        own = [member for member in self._deepest_first if k < len(member.hidden)]
        names = [member.activations[k] for member in own]
        runs, at = [], 0
        for name, equal in itertools.groupby(names):
            first, at = at, at + len(list(equal))
            runs.append((name, first, at))
        # What pads has numbers of 0, and all functions but the sigmoid leave a 0 as it is: it learns nothing.
        there = np.arange(self._places[k].fan_out) < np.array([[[member.hidden[k]]] for member in own])
        mask = torch.tensor(there, dtype=torch.float32, device=device) if "sigmoid" in names else None
        return Hidden(len(own), tuple(runs), mask)

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
        """(P, B, outputs) of x (P, B, inputs), or of x (B, inputs) that all read.

        A population of one network takes any number of rows of theta.
        """
        each = x.expand(len(theta), *x.shape) if x.ndim == 2 else x
        layers = self._layers if len(theta) == len(self) else [layer.repeated(len(theta)) for layer in self._layers]
        if self._order is None:
            return forward(Numbers(theta, self._places, layers), each, layers)[0]
        return forward(Numbers(theta[self._order], self._places, layers), each[self._order], layers)[0][self._back]

    def at(self, theta: torch.Tensor) -> Steps:
        """Passes there and back at theta (P, size), which follow as it changes in place."""
        return Steps(theta, self._places, self._layers, self._order, self._back)

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


class Steps:
    """Passes of a population at numbers that change in place: what `fit` takes its steps by.

    Args:
        theta: (P, size), as it is at each pass.
        places, layers: Of the population.
        order, back: Which network is where among the deepest first, and the way back; None where they are so already.
    """

    def __init__(
        self,
        theta: torch.Tensor,
        places: list[Place],
        layers: list[Hidden],
        order: torch.Tensor | None,
        back: torch.Tensor | None,
    ) -> None:
        self.theta, self._layers, self._order, self._back = theta, layers, order, back
        self._sorted = theta if order is None else theta[order]
        self._gradient = torch.zeros_like(theta)
        self._numbers, self._slopes = (Numbers(each, places, layers) for each in (self._sorted, self._gradient))
        self._kept: list[Kept] = []

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(P, B, outputs) of x (P, B, inputs), whose layers are kept for the way back."""
        if self._order is not None:
            torch.index_select(self.theta, 0, self._order, out=self._sorted)
            x = x[self._order]
        out, self._kept = forward(self._numbers, x, self._layers)
        return out if self._back is None else out[self._back]

    def backward(self, d: torch.Tensor) -> torch.Tensor:
        """(P, size) dL/dtheta for d = dL/doutput of the last forward pass; the next one writes over it."""
        own = d if self._order is None else d[self._order]
        backward(own, self._numbers, self._slopes, self._layers, self._kept)
        return self._gradient if self._back is None else self._gradient[self._back]
