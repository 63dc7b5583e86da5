# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a residual model applies: within the trained joints and loads, and near enough to trained rows.

    weight = prod_i fade(beyond_i / margin_i) fade((d - near) / (far - near)),  fade(s) = (1 + cos pi s) / 2 on [0, 1]

beyond_i is how far joint i (or the payload) lies outside the interval that was trained, d the distance to the third
nearest training row over sines and cosines of the joints and the payload in shares of its interval. `near` and `far`
are found on held-out rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.inputs import Inputs
from fastcal.correction.packing import Packed, Tensors
from fastcal.errors import InvalidInput

if TYPE_CHECKING:
    from scipy.spatial import KDTree

FloatArray = NDArray[np.float64]

NEIGHBOUR = 3
LOAD_SHARE = 0.1  # of the largest trained load: how far beyond the trained ones the weight is 0


@dataclass(frozen=True, eq=False)
class Guard:
    """Trained intervals and rows.

    Attributes:
        low, high: (n + 1,) trained intervals of joints [rad or m] and payload [kg].
        margin: (n + 1,) distance beyond them at which the weight is 0.
        turning: (n,) 1 for a turning joint, 0 for a slide.
        rows: (M, 2 n + 1) coordinates of the trained rows.
        near, far: Distances to trained rows where the weight begins to fall and where it is 0.
    """

    low: FloatArray
    high: FloatArray
    margin: FloatArray
    turning: FloatArray
    rows: FloatArray
    near: float
    far: float

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree  # takes long to import, and few models have a network

        return KDTree(self.rows)

    def distance(self, inputs: Inputs) -> FloatArray:
        """(N,) distance to the third nearest trained row."""
        kth = min(NEIGHBOUR, len(self.rows))
        found, _ = self._tree.query(self.coordinates(inputs), k=[kth])
        return np.asarray(found[:, 0])

    def coordinates(self, inputs: Inputs) -> FloatArray:
        """(N, 2 n + 1)."""
        return coordinates(inputs, self.low, self.high, self.turning)

    def weight(self, inputs: Inputs) -> FloatArray:
        """(N,) 0 ... 1."""
        columns = inputs.columns
        beyond = np.maximum(np.maximum(self.low - columns, columns - self.high), 0.0)
        weight = fade(beyond / self.margin).prod(axis=1)
        return np.asarray(weight * fade((self.distance(inputs) - self.near) / (self.far - self.near)))

    def pack(self) -> Packed:
        """For a file."""
        names = ("low", "high", "margin", "turning", "rows")
        tensors = {name: getattr(self, name) for name in names}
        return Packed({}, tensors | {"distances": np.array([self.near, self.far])})

    @staticmethod
    def unpack(tensors: Tensors) -> Guard:
        """From a file."""
        turning = tensors.take("turning", (None,))
        columns = (len(turning) + 1,)
        low, high, margin = (tensors.take(name, columns) for name in ("low", "high", "margin"))
        near, far = tensors.take("distances", (2,)).tolist()
        if not (margin > 0).all() or not 0 <= near < far or not (low <= high).all():
            raise InvalidInput("the guard's intervals or distances are not in order")
        rows = tensors.take("rows", (None, 2 * len(turning) + 1))
        return Guard(low, high, margin, turning, rows, near, far)


def fade(share: FloatArray) -> FloatArray:
    """1 up to 0, 0 from 1 on, half a cosine between."""
    return np.asarray((1 + np.cos(np.pi * np.clip(share, 0.0, 1.0))) / 2)


def coordinates(inputs: Inputs, low: FloatArray, high: FloatArray, turning: FloatArray) -> FloatArray:
    """(N, 2 n + 1): sine and cosine of turning joints, slides and payload in shares of their trained intervals."""
    span = np.where(high > low, high - low, 1.0)
    share = (inputs.columns - low) / span
    first = np.where(turning > 0, np.sin(inputs.q), share[:, :-1])
    second = np.where(turning > 0, np.cos(inputs.q), 0.0)
    return np.hstack([first, second, share[:, -1:]])


def margins(low: FloatArray, high: FloatArray, turning: FloatArray, turn: float) -> FloatArray:
    """(n + 1,): `turn` [rad] for a turning joint, a fiftieth of its interval for a slide, a tenth of the load."""
    joints = np.where(turning > 0, turn, np.maximum((high - low)[:-1] / 50, 1e-3))
    return np.append(joints, max(LOAD_SHARE * high[-1], LOAD_SHARE))
