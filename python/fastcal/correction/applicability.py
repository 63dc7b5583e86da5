# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a residual model applies: within the trained joints and loads, and near enough to trained rows.

    weight = prod_i fade(beyond_i / margin_i) fade((d - near) / (far - near)),  fade(s) = (1 + cos pi s) / 2 on [0, 1]

beyond_i is how far joint i (or the payload) lies outside the interval that was trained, or, within it, from the ends of
a gap between trained positions that is too wide for chance; d is the distance to the third nearest training row over
sines and cosines of the joints and the payload in shares of its interval. `near` and `far` are found on held-out rows.

Rows of a design on a grid share their joint positions, so rows that are held out say nothing of what lies between the
levels: there the gaps answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.correction.inputs import Inputs
from fastcal.correction.packing import Packed, Tensors
from fastcal.errors import InvalidInput

if TYPE_CHECKING:
    from scipy.spatial import KDTree


NEIGHBOUR = 3
LOAD_SHARE = 0.1  # of the largest trained load: how far beyond the trained ones the weight is 0
_ROUNDING = 1e-9  # rad: the lowest position is not a whole turn up
GAP_MARGINS = 4.0  # narrower gaps are bridged: 20 degrees of a turning joint, half a period of its ninth order
GAP_LOGARITHM = 5.0  # M positions drawn evenly leave a gap above (log M + 5) / M of their range in e^-5 of the draws


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
        beyond[:, :-1] = np.maximum(beyond[:, :-1], self._into_gaps(inputs.q))
        weight = fade(beyond / self.margin).prod(axis=1)
        return np.asarray(weight * fade((self.distance(inputs) - self.near) / (self.far - self.near)))

    @cached_property
    def gaps(self) -> list[FloatArray]:
        """For each joint (G, 2) the ends of gaps between neighbouring trained positions that chance does not leave."""
        count, found = len(self.turning), []
        for joint in range(count):
            span = self.high[joint] - self.low[joint]
            if self.turning[joint]:
                angle = np.arctan2(self.rows[:, joint], self.rows[:, count + joint])
                position = self.low[joint] + np.mod(angle - self.low[joint] + _ROUNDING, 2 * np.pi)
            else:
                position = self.low[joint] + span * self.rows[:, joint]
            position = np.sort(position)
            by_chance = span * (np.log(len(position)) + GAP_LOGARITHM) / len(position)
            narrowest = max(GAP_MARGINS * self.margin[joint], by_chance)
            wide = np.flatnonzero(np.diff(position) > narrowest)
            found.append(np.column_stack([position[wide], position[wide + 1]]))
        return found

    def _into_gaps(self, q: FloatArray) -> FloatArray:
        """(N, n) how far each joint is within a gap from its nearer end, else 0."""
        into = np.zeros_like(q)
        for joint, gaps in enumerate(self.gaps):
            at = q[:, joint]
            if self.turning[joint]:
                at = self.low[joint] + np.mod(at - self.low[joint], 2 * np.pi)
            for start, end in gaps:
                into[:, joint] = np.maximum(into[:, joint], np.minimum(at - start, end - at))
        return into

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
