# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The kinds of residual models: each gives the displacement of the tool's point in the base's axes, (N, 3) [m]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.dense import DenseNet
from fastcal.correction.inputs import Inputs, Scaling
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.correction.trees import Trees
from fastcal.errors import InvalidInput

FloatArray = NDArray[np.float64]


class Expert(Protocol):
    """One member of an ensemble."""

    kind: ClassVar[str]

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m], what the measured point lies beyond the predicted one, in the base's axes."""

    def pack(self) -> Packed:
        """For a file."""


@dataclass(frozen=True, eq=False)
class AxisNetworks:
    """Networks whose outputs, side by side, are the three coordinates: d = unit [net_1(x), net_2(x), ...].

    Inputs are scaled joints and payload. One network with three outputs is the papers' plain regression (SR210D, 5.3;
    RX160L, 3), three with one each are SOMM-ANN (PMC, III.B).
    """

    scaling: Scaling
    nets: tuple[DenseNet, ...]
    unit: float
    kind: ClassVar[str] = "axes"

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m]."""
        x = self.scaling(inputs)
        return self.unit * np.hstack([net(x) for net in self.nets])

    def pack(self) -> Packed:
        """For a file."""
        packed = [net.pack() for net in self.nets]
        tensors = self.scaling.pack().under("scaling")
        for i, part in enumerate(packed):
            tensors |= part.under(f"net{i}")
        return Packed({"unit": self.unit, "nets": [part.settings for part in packed]}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> AxisNetworks:
        """From a file."""
        scaling = Scaling.unpack(tensors.part("scaling"))
        parts = setting(settings, "nets", list)
        nets = tuple(DenseNet.unpack(part, tensors.part(f"net{i}")) for i, part in enumerate(parts))
        if sum(net.outputs for net in nets) != 3 or any(net.inputs != len(scaling.mean) for net in nets):
            raise InvalidInput("the networks do not map joints and payload to three coordinates")
        return AxisNetworks(scaling, nets, float(setting(settings, "unit", float)))


@dataclass(frozen=True, eq=False)
class ClassifiedNetworks:
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

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m]."""
        second = self.classes(inputs)[:, np.newaxis]
        return np.where(second, self.second.displacement(inputs), self.first.displacement(inputs))

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
class BoostedTrees:
    """Gradient boosting, one set of trees a coordinate, over scaled joints and payload."""

    scaling: Scaling
    trees: tuple[Trees, Trees, Trees]
    unit: float
    kind: ClassVar[str] = "boosting"

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m]."""
        x = self.scaling(inputs)
        return self.unit * np.column_stack([trees(x) for trees in self.trees])

    def pack(self) -> Packed:
        """For a file."""
        tensors = self.scaling.pack().under("scaling")
        for axis, trees in zip("xyz", self.trees, strict=True):
            tensors |= trees.pack().under(axis)
        return Packed({"unit": self.unit}, tensors)

    @staticmethod
    def unpack(settings: Any, tensors: Tensors) -> BoostedTrees:
        """From a file."""
        scaling = Scaling.unpack(tensors.part("scaling"))
        x, y, z = (Trees.unpack(tensors.part(axis), len(scaling.mean)) for axis in "xyz")
        return BoostedTrees(scaling, (x, y, z), float(setting(settings, "unit", float)))


@dataclass(frozen=True, eq=False)
class Neighbours:
    """k nearest neighbours: the mean of their residuals, weighted by the inverse of their distance."""

    scaling: Scaling
    rows: FloatArray
    residuals: FloatArray
    count: int
    kind: ClassVar[str] = "knn"

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m]."""
        from scipy.spatial import KDTree

        distance, near = KDTree(self.rows).query(self.scaling(inputs), k=self.count)
        distance, near = distance.reshape(len(inputs), -1), near.reshape(len(inputs), -1)
        weight = 1 / np.maximum(distance, 1e-9)
        return np.asarray(np.einsum("nk,nkj->nj", weight / weight.sum(axis=1, keepdims=True), self.residuals[near]))

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
        return Neighbours(scaling, rows, tensors.take("residuals", (len(rows), 3)), count)
