# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Forward and backward passes of many networks: a = f(h W + b), and from dL/da, with dz = f'(z) dL/da, as below.

    dW = h^T dz,   db = sum over rows of dz,   dh = dz W^T.

Automatic differentiation gives the same numbers; written out, nothing is computed for an activation or a layer that a
network does not have, which is what makes many cost less than as many alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

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


class Kept(NamedTuple):
    """What a layer read, and of a hidden one its output and the negative parts that prelu met."""

    h: torch.Tensor
    a: torch.Tensor | None = None
    negative: torch.Tensor | None = None


def forward(
    theta: torch.Tensor, x: torch.Tensor, places: list[Place], layers: list[Hidden]
) -> tuple[torch.Tensor, list[Kept]]:
    """(P, B, outputs), and what each layer keeps for the way back; the last one a list of what each depth gives it."""
    slopes = theta[:, places[-1].stop :]
    h, kept, last = x, [], []
    for k, layer in enumerate(layers):
        if layer.count < len(h):
            last.append(_as_wide(h[layer.count :], places[-1].fan_in))
            h = h[: layer.count]
        own = theta[: layer.count]
        a = torch.baddbmm(places[k].biases(own), h, places[k].weights(own))
        negative = _activate(a, layer, slopes[:, k, None, None])
        if layer.mask is not None:
            a *= layer.mask
        kept.append(Kept(h, a, negative))
        h = a
    h = torch.cat([_as_wide(h, places[-1].fan_in), *reversed(last)])
    return torch.baddbmm(places[-1].biases(theta), h, places[-1].weights(theta)), [*kept, Kept(h)]


def _activate(z: torch.Tensor, layer: Hidden, slope: torch.Tensor) -> torch.Tensor | None:
    """f(z) in place; min(z, 0) where a network has prelu."""
    negative = None
    for name, first, last in layer.runs:
        part = z[first:last]
        if name == "tanh":
            part.mul_(2).sigmoid_().mul_(2).sub_(1)  # a quarter of the time of torch.tanh
        elif name == "relu":
            part.relu_()
        elif name == "sigmoid":
            part.sigmoid_()
        else:
            negative = torch.zeros_like(z) if negative is None else negative
            torch.clamp(part, max=0, out=negative[first:last])
            part.addcmul_(slope[first:last] - 1, negative[first:last])
    return negative


def backward(
    d: torch.Tensor,
    theta: torch.Tensor,
    places: list[Place],
    layers: list[Hidden],
    kept: list[Kept],
) -> torch.Tensor:
    """(P, size) dL/dtheta for d = dL/doutput (P, B, outputs)."""
    slopes = theta[:, places[-1].stop :]
    found = torch.zeros_like(theta)
    _give(found, places[-1], kept[-1].h, d)
    above = torch.bmm(d, places[-1].weights(theta).transpose(1, 2))  # dL/da of each network's last layer
    d = _as_wide(above[:0], places[-2].fan_out)
    for k in reversed(range(len(layers))):
        layer, (h, a, negative) = layers[k], kept[k]
        if layer.count > len(d):
            d = torch.cat([d, _as_wide(above[len(d) : layer.count], places[k].fan_out)])
        if layer.mask is not None:
            d *= layer.mask
        found[: layer.count, places[-1].stop + k] = _through(d, a, negative, layer, slopes[:, k, None, None])
        _give(found[: layer.count], places[k], h, d)
        if k > 0:
            d = torch.bmm(d, places[k].weights(theta[: layer.count]).transpose(1, 2))
    return found


def _as_wide(h: torch.Tensor, width: int) -> torch.Tensor:
    """(P, B, width): padding of zeros is added or taken away."""
    return h if h.shape[2] == width else torch.nn.functional.pad(h, (0, width - h.shape[2]))


def _give(found: torch.Tensor, place: Place, h: torch.Tensor, d: torch.Tensor) -> None:
    """Puts dW and db of a layer where they are in the gradient."""
    place.weights(found).copy_(torch.bmm(h.transpose(1, 2), d))
    torch.sum(d, dim=1, keepdim=True, out=place.biases(found))


def _through(
    d: torch.Tensor, a: torch.Tensor | None, negative: torch.Tensor | None, layer: Hidden, slope: torch.Tensor
) -> torch.Tensor:
    """dL/dz in the place of dL/da, and dL/dslope (count,)."""
    found = torch.zeros_like(slope[: layer.count, 0, 0])
    assert a is not None  # noqa: S101 - a hidden layer keeps its output
    for name, first, last in layer.runs:
        own, output = d[first:last], a[first:last]
        if name == "tanh":
            own.addcmul_(own * output, output, value=-1)
        elif name == "relu":
            own *= output > 0
        elif name == "sigmoid":
            own *= output - output * output
        elif negative is not None:
            below = negative[first:last]
            found[first:last] = (own * below).sum(dim=(1, 2))
            own.addcmul_(own * (1 - slope[first:last]), below.sign())
    return found


def outputs(theta: torch.Tensor, x: torch.Tensor, places: list[Place], layers: list[Hidden]) -> torch.Tensor:
    """(P, B, outputs) of x (P, B, inputs); it can be differentiated once, in theta."""
    found: torch.Tensor = Passes.apply(theta, x, places, layers)  # type: ignore[no-untyped-call]
    return found


class Passes(torch.autograd.Function):
    """The two passes as one step of automatic differentiation, in theta alone."""

    @staticmethod
    def forward(ctx: Any, theta: torch.Tensor, x: torch.Tensor, places: list[Place], layers: list[Hidden]) -> Any:
        """(P, B, outputs)."""
        out, kept = forward(theta, x, places, layers)
        ctx.saved = places, layers, kept
        ctx.save_for_backward(theta)
        return out

    @staticmethod
    def backward(ctx: Any, d: torch.Tensor) -> tuple[torch.Tensor, None, None, None]:
        """dL/dtheta."""
        (theta,) = ctx.saved_tensors
        return backward(d, theta, *ctx.saved), None, None, None
