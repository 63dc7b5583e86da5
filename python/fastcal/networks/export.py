# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A trained correction for other programs: TorchScript or ONNX, inputs joints, payload and Jacobian.

The graph is the correction before its guard: the mean of the members, cut to the limit. Networks (mlp, bso-mlp, somm,
ga-dnn) are graphs; trees, neighbours and processes are not.
"""

from __future__ import annotations

import io
import warnings

import numpy as np
import torch
from torch import nn

from fastcal.correction import Correction
from fastcal.correction.dense import DenseNet
from fastcal.correction.experts import AxisNetworks, Expert
from fastcal.correction.joints import JointNetwork
from fastcal.errors import InvalidInput

_INPUTS = ("q", "payload", "J_tool_q")


def export(correction: Correction, form: str = "onnx") -> bytes:
    """The correction as a graph of float64, the content of a file.

    Inputs: q (N, n) [rad or m], payload (N,) [kg], J_tool_q (N, 6, n), the tool's motion [v; w] by the joints; output:
    twist (N, 6), displacement [m] and turn [rad], to be multiplied by the guard's weight. Both are along the base's
    axes.

    Args:
        correction: Of a trained model.
        form: onnx (needs the package onnx) or torchscript.

    Raises:
        InvalidInput: Another form, or a member is no network.
    """
    if form not in ("onnx", "torchscript"):
        raise InvalidInput(f"expected the form onnx or torchscript, got {form!r}")
    module = graph(correction)
    n = correction.joint_count
    example = (torch.zeros(2, n).double(), torch.zeros(2).double(), torch.zeros(2, 6, n).double())
    content = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # torch warns of its own ways of tracing
        if form == "torchscript":
            torch.jit.save(torch.jit.trace(module, example), content)  # type: ignore[no-untyped-call]
        else:
            torch.onnx.export(
                module,
                example,
                content,  # type: ignore[arg-type]
                input_names=list(_INPUTS),
                output_names=["twist"],
                dynamic_axes={name: {0: "rows"} for name in (*_INPUTS, "twist")},
                dynamo=False,
            )
    return content.getvalue()


def graph(correction: Correction) -> nn.Module:
    """The correction before its guard as a torch module."""
    return _Ensemble(correction).double().eval()


class _Ensemble(nn.Module):
    def __init__(self, correction: Correction) -> None:
        super().__init__()
        self.members = nn.ModuleList(_module(member) for member in correction.members)
        self.limit, self.turn_limit, self.any_load = correction.limit, correction.turn_limit, correction.any_load

    def forward(self, q: torch.Tensor, payload: torch.Tensor, J: torch.Tensor) -> torch.Tensor:
        load = payload * 0 if self.any_load else payload
        mean = torch.stack([member(q, load, J) for member in self.members]).mean(dim=0)
        return torch.cat([_limited(mean[:, :3], self.limit), _limited(mean[:, 3:], self.turn_limit)], dim=1)


def _limited(vectors: torch.Tensor, limit: float) -> torch.Tensor:
    length = torch.linalg.vector_norm(vectors, dim=1, keepdim=True)
    return vectors * torch.clamp(limit / torch.clamp(length, min=1e-300), max=1.0)


def _widened(values: torch.Tensor, unit: float, turn_unit: float) -> torch.Tensor:
    turns = values[:, 3:] if values.shape[1] == 6 else 0 * values
    return torch.cat([unit * values[:, :3], turn_unit * turns], dim=1)


def _module(member: Expert) -> nn.Module:
    if isinstance(member, JointNetwork):
        return _Joints(member)
    if isinstance(member, AxisNetworks):
        return _Axes(member)
    raise InvalidInput(f"a correction of kind {member.kind} is no network and has no graph to export")


def _layers(net: DenseNet) -> nn.Sequential:
    layers: list[nn.Module] = []
    for W, b, name, slope in zip(net.weights, net.biases, net.activations, net.slopes, strict=True):
        linear = nn.Linear(W.shape[0], W.shape[1], dtype=torch.float64)
        linear.weight.data, linear.bias.data = torch.tensor(W.T.copy()), torch.tensor(b)
        layers.append(linear)
        if name != "linear":
            kinds = {"tanh": nn.Tanh, "relu": nn.ReLU, "sigmoid": nn.Sigmoid}
            layers.append(_PReLU(slope) if name == "prelu" else kinds[name]())
    return nn.Sequential(*layers)


class _PReLU(nn.Module):
    """Of plain operations: ONNX runtimes have their own PReLU in float32 alone."""

    def __init__(self, slope: float) -> None:
        super().__init__()
        self.slope = slope

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.clamp(x, min=0.0) + self.slope * torch.clamp(x, max=0.0)


class _Axes(nn.Module):
    mean: torch.Tensor
    gain: torch.Tensor

    def __init__(self, member: AxisNetworks) -> None:
        super().__init__()
        self.nets = nn.ModuleList(_layers(net) for net in member.nets)
        self.register_buffer("mean", torch.tensor(member.scaling.mean))
        self.register_buffer("gain", torch.tensor(member.scaling.gain))
        self.unit, self.turn_unit = member.unit, member.turn_unit

    def forward(self, q: torch.Tensor, payload: torch.Tensor, J: torch.Tensor) -> torch.Tensor:
        x = (torch.cat([q, payload[:, None]], dim=1) - self.mean) * self.gain
        out = torch.cat([net(x) for net in self.nets], dim=1)
        return _widened(out, self.unit, self.turn_unit) + 0 * J.sum()


class _Joints(nn.Module):
    rate: torch.Tensor
    offset: torch.Tensor
    order: torch.Tensor
    curves: torch.Tensor

    def __init__(self, member: JointNetwork) -> None:
        super().__init__()
        self.net = _layers(member.net)
        order = np.arange(1, member.curves.shape[1] // 2 + 1)
        damping = 1 / (1 + (order / member.corner) ** 2)
        for name, value in (
            ("rate", member.phases.rate),
            ("offset", member.phases.offset),
            ("order", order.astype(float)),
            ("curves", member.curves * np.tile(damping, 2)),
        ):
            self.register_buffer(name, torch.tensor(value))
        self.load_mean, self.load_gain, self.unit = member.phases.load_mean, member.phases.load_gain, member.unit
        self.turn_unit = member.turn_unit

    def forward(self, q: torch.Tensor, payload: torch.Tensor, J: torch.Tensor) -> torch.Tensor:
        phase = q * self.rate + self.offset
        load = (payload[:, None] - self.load_mean) * self.load_gain
        out = self.net(torch.cat([torch.sin(phase), torch.cos(phase), load], dim=1))
        turns = phase[:, :, None] * self.order
        errors = (torch.cat([torch.sin(turns), torch.cos(turns)], dim=2) * self.curves).sum(dim=2)
        joints = phase.shape[1]
        moved = torch.matmul(J, (out[:, :joints] + errors)[:, :, None]).squeeze(2)
        twist: torch.Tensor = self.unit * moved + _widened(out[:, joints:], self.unit, self.turn_unit)
        return twist
