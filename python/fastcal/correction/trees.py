# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Boosted decision trees as arrays: value = baseline + sum over trees of the leaf that a row falls into."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.correction.packing import Packed, Tensors
from fastcal.errors import InvalidInput

DEEPEST = 64  # steps from root to leaf; guards against arrays that run in a circle


@dataclass(frozen=True, eq=False)
class Trees:
    """All nodes of all trees, one after another.

    Attributes:
        nodes: (M, 5) feature, threshold, left child, right child, value; a leaf's children are itself. A row goes left
            where its feature is at most the threshold.
        roots: (trees,) where each tree begins.
        baseline: What is added.
    """

    nodes: FloatArray
    roots: NDArray[np.intp]
    baseline: float

    def __call__(self, x: FloatArray) -> FloatArray:
        """(N,) for rows x (N, features)."""
        feature, left, right = (self.nodes[:, i].astype(np.intp) for i in (0, 2, 3))
        threshold, value = self.nodes[:, 1], self.nodes[:, 4]
        rows = np.arange(len(x))
        out = np.full(len(x), self.baseline)
        for root in self.roots:
            at = np.full(len(x), root)
            for _ in range(DEEPEST):
                down = np.where(x[rows, feature[at]] <= threshold[at], left[at], right[at])
                if (down == at).all():
                    break
                at = down
            out += value[at]
        return out

    def pack(self) -> Packed:
        """For a file."""
        return Packed(
            {}, {"nodes": self.nodes, "roots": self.roots.astype(float), "baseline": np.array([self.baseline])}
        )

    @staticmethod
    def unpack(tensors: Tensors, features: int) -> Trees:
        """From a file; every index is checked."""
        nodes = tensors.take("nodes", (None, 5))
        roots = tensors.take("roots", (None,))
        for indices, below in ((nodes[:, 0], features), (nodes[:, 2:4], len(nodes)), (roots, len(nodes))):
            if not ((indices >= 0) & (indices < below) & (indices == np.floor(indices))).all():
                raise InvalidInput("the trees hold an index that points nowhere")
        return Trees(nodes, roots.astype(np.intp), float(tensors.take("baseline", (1,))[0]))
