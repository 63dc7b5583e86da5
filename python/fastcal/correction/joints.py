# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Residual models that speak in errors of the joints: [d; w] = J_tool_q(q) e(q, load) + r(q, load), base's axes.

Most of what geometry leaves is turned into the tool's error by the arm itself, so that a curve over one joint explains
residuals all over the workspace; learnt as three coordinates, each place has to be learnt again. An error of a joint
turns the tool as it moves it: trained on poses, one curve answers for both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.correction.dense import DenseNet
from fastcal.correction.experts import Expert, turn_unit_of, widened
from fastcal.correction.inputs import Inputs
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class Phases:
    """Joint positions as angles: phase = rate q + offset; rate 1 for a turning joint, a slide's range is half a turn.

    The payload is scaled beside them: load = (payload - load_mean) load_gain.
    """

    rate: FloatArray
    offset: FloatArray
    load_mean: float
    load_gain: float

    def __call__(self, inputs: Inputs) -> FloatArray:
        """(N, n) phases [rad]."""
        return inputs.q * self.rate + self.offset

    def load(self, inputs: Inputs) -> FloatArray:
        """(N, 1) scaled payload."""
        return ((inputs.payload - self.load_mean) * self.load_gain)[:, np.newaxis]

    def features(self, inputs: Inputs) -> FloatArray:
        """(N, 2 n + 1): sine and cosine of every phase, and the load."""
        phase = self(inputs)
        return np.hstack([np.sin(phase), np.cos(phase), self.load(inputs)])

    def pack(self) -> Packed:
        """For a file."""
        load = np.array([self.load_mean, self.load_gain])
        return Packed({}, {"rate": self.rate, "offset": self.offset, "load": load})

    @staticmethod
    def unpack(tensors: Tensors) -> Phases:
        """From a file."""
        rate = tensors.take("rate", (None,))
        load = tensors.take("load", (2,))
        return Phases(rate, tensors.take("offset", rate.shape), float(load[0]), float(load[1]))


def harmonics(phase: FloatArray, count: int, corner: float) -> FloatArray:
    """(N, n, 2 count): a_k sin k phase, then a_k cos k phase, k = 1 ... count, a_k = 1 / (1 + (k / corner)^2).

    The amplitudes make a penalty on the coefficients one on the curve's roughness.
    """
    k = np.arange(1, count + 1)
    turns = phase[:, :, np.newaxis] * k
    return np.concatenate([np.sin(turns), np.cos(turns)], axis=2) * np.tile(1 / (1 + (k / corner) ** 2), 2)


@dataclass(frozen=True, eq=False)
class JointNetwork(Expert):
    """e_i = c_i . h(phase_i) + net_i(features), r = net_(n+1 ...): a curve a joint, and a network for what joins them.

    Attributes:
        phases: Of joints and load.
        curves: (n, 2 H) coefficients c of the harmonics.
        corner: Order from which on harmonics are damped.
        net: From `Phases.features` to n joint errors and three coordinates, or six.
        unit, turn_unit: Sizes of the residuals that it was trained on [m, rad]; turn_unit 0: of points alone.
    """

    phases: Phases
    curves: FloatArray
    corner: float
    net: DenseNet
    unit: float
    turn_unit: float = 0.0
    kind: ClassVar[str] = "joints"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        out = self.net(self.phases.features(inputs))
        joints = self.curves.shape[0]
        h = harmonics(self.phases(inputs), self.curves.shape[1] // 2, self.corner)
        errors = out[:, :joints] + np.einsum("njk,jk->nj", h, self.curves)
        moved = np.einsum("nij,nj->ni", inputs.J_tool_q, errors)
        return np.asarray(self.unit * moved + widened(out[:, joints:], self.unit, self.turn_unit))

    def pack(self) -> Packed:
        """For a file."""
        net = self.net.pack()
        tensors = self.phases.pack().under("phases") | net.under("net") | {"curves": self.curves}
        settings = {"unit": self.unit, "turn_unit": self.turn_unit, "corner": self.corner, "net": net.settings}
        return Packed(settings, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> JointNetwork:
        """From a file."""
        phases = Phases.unpack(tensors.part("phases"))
        joints = len(phases.rate)
        curves = tensors.take("curves", (joints, None))
        net = DenseNet.unpack(setting(settings, "net", dict), tensors.part("net"))
        if curves.shape[1] % 2 or net.inputs != 2 * joints + 1 or net.outputs - joints not in (3, 6):
            raise InvalidInput("the network does not map these joints to their errors")
        corner, unit = (float(setting(settings, name, float)) for name in ("corner", "unit"))
        if not corner > 0:
            raise InvalidInput(f"expected a corner above 0, got {corner}")
        return JointNetwork(phases, curves, corner, net, unit, turn_unit_of(settings))


@dataclass(frozen=True, eq=False)
class GaussianProcess(Expert):
    """Posterior mean of r = sum_i J_i e_i + h, e_i = f_i(q_i) + g_i(q, load), all f, g, h Gaussian processes.

    cov e_i = a^2 exp(-2 sin^2(dq_i / 2) / l^2) + b^2 k, cov h = c^2 k on each axis, with k = exp(-D) and D = the sum of
    2 sin^2(dq_j / 2) over the joints and of dload^2 / 2, divided by L^2.

    Attributes:
        phases: Of joints and load.
        rows: (M, n) phases and load of the training rows, (M, n + 1).
        joint_weights: (M, n) J_m^T alpha_m. axis_weights: (M, 3) alpha_m, (M, 6) where orientations were measured.
        variances: a^2, b^2, c^2 in units of the residuals.
        lengths: l, L [rad].
    """

    phases: Phases
    rows: FloatArray
    joint_weights: FloatArray
    axis_weights: FloatArray
    variances: tuple[float, float, float]
    lengths: tuple[float, float]
    kind: ClassVar[str] = "gp"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        blocks = [
            self._block(inputs.select(rows)) for rows in np.array_split(np.arange(len(inputs)), len(inputs) // 256 + 1)
        ]
        return np.concatenate(blocks) if blocks else np.zeros((0, 6))

    def _block(self, inputs: Inputs) -> FloatArray:
        phase, load = self.phases(inputs), self.phases.load(inputs)
        apart = self.lengths
        squares = 2 * np.sin((phase[:, np.newaxis] - self.rows[:, :-1]) / 2) ** 2
        joint = np.exp(-((load - self.rows[:, -1]) ** 2 / 2 + squares.sum(axis=2)) / apart[1] ** 2)
        alone = np.exp(-squares / apart[0] ** 2)
        own, shared, free = self.variances
        errors = own * np.einsum("nmj,mj->nj", alone, self.joint_weights) + shared * joint @ self.joint_weights
        along = widened(free * joint @ self.axis_weights, 1.0, 1.0)
        return np.asarray(np.einsum("nij,nj->ni", inputs.J_tool_q, errors) + along)

    def pack(self) -> Packed:
        """For a file."""
        tensors = self.phases.pack().under("phases") | {
            "rows": self.rows,
            "joint_weights": self.joint_weights,
            "axis_weights": self.axis_weights,
            "variances": np.asarray(self.variances),
            "lengths": np.asarray(self.lengths),
        }
        return Packed({}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> GaussianProcess:
        """From a file."""
        phases = Phases.unpack(tensors.part("phases"))
        joints = len(phases.rate)
        rows = tensors.take("rows", (None, joints + 1))
        own, shared, free = tensors.take("variances", (3,)).tolist()
        alone, together = tensors.take("lengths", (2,)).tolist()
        if not min(alone, together) > 0:
            raise InvalidInput("expected lengths above 0")
        weights = tensors.take("joint_weights", (len(rows), joints)), tensors.take_wide("axis_weights", len(rows))
        return GaussianProcess(phases, rows, *weights, (own, shared, free), (alone, together))
