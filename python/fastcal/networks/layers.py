# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Forward and backward passes of many networks: a = f(h W + b), and from dL/da, with dz = f'(z) dL/da, as below.

    dW = h^T dz,   db = sum over rows of dz,   dh = dz W^T.

Automatic differentiation gives the same numbers; written out, nothing is computed for an activation or a layer that a
network does not have, which is what makes many cost less than as many alone. Where a layer's numbers lie is looked up
once, for steps of small networks cost more in calls than in sums.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch


class Place(NamedTuple):
    """Where a layer's numbers are in a row of theta: W from `start`, (fan_in, fan_out), then b."""

    start: int
    fan_in: int
    fan_out: int

    @property
    def stop(self) -> int:
        """Where the next layer's begin, or the slopes of prelu after the last."""
        return self.start + (self.fan_in + 1) * self.fan_out

    def weights(self, theta: torch.Tensor) -> torch.Tensor:
        """(P, in, out)."""
        stop = self.start + self.fan_in * self.fan_out
        return theta[:, self.start : stop].view(len(theta), self.fan_in, self.fan_out)

    def biases(self, theta: torch.Tensor) -> torch.Tensor:
        """(P, 1, out)."""
        start = self.start + self.fan_in * self.fan_out
        return theta[:, start : start + self.fan_out].unsqueeze(1)


@dataclass(frozen=True)
class Hidden:
    """A hidden layer of those networks that are so deep: the first `count` of P, deepest first.

    Attributes:
        count: How many they are.
        runs: (activation, first, last + 1) of neighbours with the same one.
        mask: (count, 1, width) 1 where a network has a neuron; None where padding gives 0 by itself.
    """

    count: int
    runs: tuple[tuple[str, int, int], ...]
    mask: torch.Tensor | None

    def repeated(self, count: int) -> Hidden:
        """The layer of a single network for so many with its architecture."""
        return Hidden(count, ((self.runs[0][0], 0, count),), self.mask)


class Numbers:
    """The layers' parts of theta (P, size), or of a gradient by it: views, which follow what changes in place.

    Attributes:
        weights, biases: (count, in, out) and (count, 1, out) of each layer, the output's last.
        slopes: (count, 1, 1) of each hidden layer's prelu.
    """

    def __init__(self, theta: torch.Tensor, places: list[Place], layers: list[Hidden]) -> None:
        counts = [*(layer.count for layer in layers), len(theta)]
        self.weights = [place.weights(theta[:count]) for place, count in zip(places, counts, strict=True)]
        self.biases = [place.biases(theta[:count]) for place, count in zip(places, counts, strict=True)]
        slopes = theta[:, places[-1].stop :]
        self.slopes = [slopes[: layer.count, k, None, None] for k, layer in enumerate(layers)]


class Kept(NamedTuple):
    """What a layer read, and of a hidden one its output and the negative parts that prelu met."""

    h: torch.Tensor
    a: torch.Tensor | None = None
    negative: torch.Tensor | None = None


def forward(theta: Numbers, x: torch.Tensor, layers: list[Hidden]) -> tuple[torch.Tensor, list[Kept]]:
    """(P, B, outputs), and what each layer keeps for the way back; the last one a list of what each depth gives it."""
    h, kept, last = x, [], []
    widest = theta.weights[-1].shape[1]
    for W, b, slope, layer in zip(theta.weights, theta.biases, theta.slopes, layers, strict=False):
        if layer.count < len(h):
            last.append(_as_wide(h[layer.count :], widest))
            h = h[: layer.count]
        a = torch.baddbmm(b, h, W)
        negative = _activate(a, layer, slope)
        if layer.mask is not None:
            a *= layer.mask
        kept.append(Kept(h, a, negative))
        h = a
    h = _as_wide(h, widest)
    if last:
        h = torch.cat([h, *reversed(last)])
    return torch.baddbmm(theta.biases[-1], h, theta.weights[-1]), [*kept, Kept(h)]


def _activate(z: torch.Tensor, layer: Hidden, slope: torch.Tensor) -> torch.Tensor | None:
    """f(z) in place; min(z, 0) where a network has prelu."""
    negative = None
    for name, first, last in layer.runs:
        part = _rows(z, first, last)
        if name == "tanh":
            part.add_(part).sigmoid_()  # 2 sigmoid(2 z) - 1: a quarter of the time of torch.tanh
            part.add_(part).sub_(1)
        elif name == "relu":
            part.relu_()
        elif name == "sigmoid":
            part.sigmoid_()
        else:
            negative = torch.empty_like(z) if negative is None else negative  # read where a network has prelu
            below = _rows(negative, first, last)
            torch.clamp(part, max=0, out=below)
            part.addcmul_(_rows(slope, first, last) - 1, below)
    return negative


def _rows(z: torch.Tensor, first: int, last: int) -> torch.Tensor:
    """z[first:last], for nothing where that is all."""
    return z if last - first == len(z) else z[first:last]


def backward(d: torch.Tensor, theta: Numbers, gradient: Numbers, layers: list[Hidden], kept: list[Kept]) -> None:
    """Writes dL/dtheta for d = dL/doutput (P, B, outputs); what no network has is left as it is."""
    _give(gradient, -1, kept[-1].h, d)
    above = torch.bmm(d, theta.weights[-1].transpose(1, 2))  # dL/da of each network's last layer
    d = above[:0]
    for k in reversed(range(len(layers))):
        layer, (h, a, negative) = layers[k], kept[k]
        if layer.count > len(d):
            ends = _as_wide(above[len(d) : layer.count], theta.weights[k].shape[2])
            d = torch.cat([d, ends]) if len(d) else ends
        if layer.mask is not None:
            d *= layer.mask
        _through(d, a, negative, layer, theta.slopes[k], gradient.slopes[k])
        _give(gradient, k, h, d)
        if k > 0:
            d = torch.bmm(d, theta.weights[k].transpose(1, 2))


def _as_wide(h: torch.Tensor, width: int) -> torch.Tensor:
    """(P, B, width): padding of zeros is added or taken away."""
    return h if h.shape[2] == width else torch.nn.functional.pad(h, (0, width - h.shape[2]))


def _give(gradient: Numbers, k: int, h: torch.Tensor, d: torch.Tensor) -> None:
    """Puts dW and db of a layer where they are in the gradient."""
    gradient.weights[k].copy_(torch.bmm(h.transpose(1, 2), d))
    torch.sum(d, dim=1, keepdim=True, out=gradient.biases[k])


def _through(
    d: torch.Tensor,
    a: torch.Tensor | None,
    negative: torch.Tensor | None,
    layer: Hidden,
    slope: torch.Tensor,
    by_slope: torch.Tensor,
) -> None:
    """dL/dz in the place of dL/da, and dL/dslope (count, 1, 1) where a network has one."""
    assert a is not None  # noqa: S101 - a hidden layer keeps its output
    for name, first, last in layer.runs:
        own, output = _rows(d, first, last), _rows(a, first, last)
        if name == "tanh":
            own.addcmul_(own * output, output, value=-1)
        elif name == "relu":
            own *= output > 0
        elif name == "sigmoid":
            own *= output - output * output
        elif negative is not None:
            below = _rows(negative, first, last)
            _rows(by_slope, first, last).copy_((own * below).sum(dim=(1, 2), keepdim=True))
            own.addcmul_(own * (1 - _rows(slope, first, last)), below.sign())
