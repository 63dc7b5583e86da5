# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The kinds of residual models: each gives what the tool moves and turns by, in the base's axes, (N, 6) [m; rad]."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.correction.dense import DenseNet
from fastcal.correction.inputs import Inputs, Scaling
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.correction.trees import Trees
from fastcal.errors import InvalidInput

AXES = ("x", "y", "z", "rx", "ry", "rz")


class Expert(ABC):
    """One member of an ensemble."""

    kind: ClassVar[str]

    @abstractmethod
    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad], what the measured pose lies beyond the predicted one, in the base's axes."""

    @abstractmethod
    def pack(self) -> Packed:
        """For a file."""

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m], of the point alone."""
        return self.twist(inputs)[:, :3]


def widened(values: FloatArray, unit: float, turn_unit: float) -> FloatArray:
    """(N, 6) [m; rad] of outputs (N, 6) or (N, 3), points alone, which are along the axes and in units."""
    turns = values[:, 3:] if values.shape[1] == 6 else np.zeros_like(values)
    return np.hstack([unit * values[:, :3], turn_unit * turns])


def turn_unit_of(settings: Any) -> float:
    """Of a file's settings; 0 where they are of points alone."""
    return float(setting(settings, "turn_unit", float)) if "turn_unit" in settings else 0.0


@dataclass(frozen=True, eq=False)
class AxisNetworks(Expert):
    """Networks whose outputs, side by side, are the coordinates: d = unit [net_1(x), net_2(x), ...].

    Inputs are scaled joints and payload. One network with three outputs is the papers' plain regression (SR210D, 5.3;
    RX160L, 3), three with one each are SOMM-ANN (PMC, III.B). Trained on poses, three outputs more are the turn.
    """

    scaling: Scaling
    nets: tuple[DenseNet, ...]
    unit: float
    turn_unit: float = 0.0
    kind: ClassVar[str] = "axes"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        x = self.scaling(inputs)
        return widened(np.hstack([net(x) for net in self.nets]), self.unit, self.turn_unit)

    def pack(self) -> Packed:
        """For a file."""
        packed = [net.pack() for net in self.nets]
        tensors = self.scaling.pack().under("scaling")
        for i, part in enumerate(packed):
            tensors |= part.under(f"net{i}")
        nets = [part.settings for part in packed]
        return Packed({"unit": self.unit, "turn_unit": self.turn_unit, "nets": nets}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> AxisNetworks:
        """From a file."""
        scaling = Scaling.unpack(tensors.part("scaling"))
        parts = setting(settings, "nets", list)
        nets = tuple(DenseNet.unpack(part, tensors.part(f"net{i}")) for i, part in enumerate(parts))
        if sum(net.outputs for net in nets) not in (3, 6) or any(net.inputs != len(scaling.mean) for net in nets):
            raise InvalidInput("the networks do not map joints and payload to three coordinates or six")
        return AxisNetworks(scaling, nets, float(setting(settings, "unit", float)), turn_unit_of(settings))


@dataclass(frozen=True, eq=False)
class ClassifiedNetworks(Expert):
    """CA-SOMM-ANN (PMC, figure 23): boosted trees choose which of two sets of networks speaks.

    The second set speaks where the trees' log odds are above 0.
    """

    classifier: Trees
    first: AxisNetworks
    second: AxisNetworks
    kind: ClassVar[str] = "classified"

    def classes(self, inputs: Inputs) -> NDArray[np.bool_]:
        """(N,) true where the second set speaks."""
        return self.classifier(self.first.scaling(inputs)) > 0

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        second = self.classes(inputs)[:, np.newaxis]
        return np.where(second, self.second.twist(inputs), self.first.twist(inputs))

    def pack(self) -> Packed:
        """For a file."""
        first, second = self.first.pack(), self.second.pack()
        tensors = self.classifier.pack().under("classifier") | first.under("first") | second.under("second")
        return Packed({"first": first.settings, "second": second.settings}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> ClassifiedNetworks:
        """From a file."""
        first, second = (
            AxisNetworks.unpack(setting(settings, name, dict), tensors.part(name)) for name in ("first", "second")
        )
        return ClassifiedNetworks(Trees.unpack(tensors.part("classifier"), len(first.scaling.mean)), first, second)


@dataclass(frozen=True, eq=False)
class Shifted(Expert):
    """What was trained on another arm, and what this one differs by: twist = prior + difference.

    `turning` is 1 where the difference was trained on poses; 0: it moves the point alone.
    """

    prior: Expert
    difference: Expert
    turning: float
    kind: ClassVar[str] = "shifted"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        return np.asarray(self.prior.twist(inputs) + self.difference.twist(inputs) * np.repeat([1.0, self.turning], 3))

    def pack(self) -> Packed:
        """For a file; which kinds the two are is known to `serialize`."""
        prior, difference = self.prior.pack(), self.difference.pack()
        settings = {
            "prior": {"kind": self.prior.kind, **prior.settings},
            "difference": {"kind": self.difference.kind, **difference.settings},
            "turning": self.turning,
        }
        return Packed(settings, prior.under("prior") | difference.under("difference"))


@dataclass(frozen=True, eq=False)
class BoostedTrees(Expert):
    """Gradient boosting, one set of trees a coordinate, over scaled joints and payload."""

    scaling: Scaling
    trees: tuple[Trees, ...]
    unit: float
    turn_unit: float = 0.0
    kind: ClassVar[str] = "boosting"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        x = self.scaling(inputs)
        return widened(np.column_stack([trees(x) for trees in self.trees]), self.unit, self.turn_unit)

    def pack(self) -> Packed:
        """For a file."""
        tensors = self.scaling.pack().under("scaling")
        for axis, trees in zip(AXES, self.trees, strict=False):
            tensors |= trees.pack().under(axis)
        return Packed({"unit": self.unit, "turn_unit": self.turn_unit}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> BoostedTrees:
        """From a file."""
        scaling = Scaling.unpack(tensors.part("scaling"))
        turn_unit = turn_unit_of(settings)
        axes = AXES if turn_unit else AXES[:3]
        trees = tuple(Trees.unpack(tensors.part(axis), len(scaling.mean)) for axis in axes)
        return BoostedTrees(scaling, trees, float(setting(settings, "unit", float)), turn_unit)


@dataclass(frozen=True, eq=False)
class Neighbours(Expert):
    """k nearest neighbours: the mean of their residuals, weighted by the inverse of their distance."""

    scaling: Scaling
    rows: FloatArray
    residuals: FloatArray
    count: int
    kind: ClassVar[str] = "knn"

    def twist(self, inputs: Inputs) -> FloatArray:
        """(N, 6) [m; rad]."""
        from scipy.spatial import KDTree

        distance, near = KDTree(self.rows).query(self.scaling(inputs), k=self.count)
        distance, near = distance.reshape(len(inputs), -1), near.reshape(len(inputs), -1)
        weight = 1 / np.maximum(distance, 1e-9)
        mean = np.einsum("nk,nkj->nj", weight / weight.sum(axis=1, keepdims=True), self.residuals[near])
        return widened(mean, 1.0, 1.0)

    def pack(self) -> Packed:
        """For a file."""
        tensors = self.scaling.pack().under("scaling") | {"rows": self.rows, "residuals": self.residuals}
        return Packed({"count": self.count}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> Neighbours:
        """From a file."""
        scaling = Scaling.unpack(tensors.part("scaling"))
        rows = tensors.take("rows", (None, len(scaling.mean)))
        count = int(setting(settings, "count", int))
        if not 1 <= count <= len(rows):
            raise InvalidInput(f"expected 1 to {len(rows)} neighbours, got {count}")
        return Neighbours(scaling, rows, tensors.take_wide("residuals", len(rows)), count)
