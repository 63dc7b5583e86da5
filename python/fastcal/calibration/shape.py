# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Uncertainty of the shape formed by the tool's points, independent of its position.

Lengths, touches, tilts and rotations do not determine where the arm stands: the standard deviation of a point includes
this, that of a distance between two points does not. With p_i the points, S_i (3, k) their independent shifts and u_ij
the direction from one to the other, the distance has the variance |u_ij^T (S_i - S_j)|^2. Planes, tilts and turns leave
a common scale of all lengths open too: it is what of each shift is in proportion to the distances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, kinds_in
from fastcal.robot.robot import Robot
from fastcal.said import chained, said
from fastcal.units import from_si

_MOST_ROWS = 400  # whose points are paired
_SCALE_IS_OPEN = 0.5  # of the deviation of distances without their common scale


@dataclass(frozen=True)
class Shape:
    """Standard deviations [m], RMS over rows: of a coordinate of a point, and of a distance between two points.

    `scaled` is the latter beside a common scale of all lengths.
    """

    point: float
    distance: float
    scaled: float
    note: str

    @property
    def scale_is_open(self) -> bool:
        """Whether most of the deviation of distances is that of a common scale of all of them."""
        return self.scaled < _SCALE_IS_OPEN * self.distance

    def to_json_dict(self) -> dict[str, float]:
        """The block `shape`."""
        sizes = {"point": self.point, "distance": self.distance, "scaled_distance": self.scaled}
        return {f"{name}_sigma_mm": from_si(size, "mm") for name, size in sizes.items()}


def shape_of(model: Robot, data: Dataset) -> Shape | None:
    """Of a model that was identified from `data`, at its postures; None where points show where the arm stands."""
    kinds = kinds_in(data)
    if model.record is None or not kinds or kinds[0].name == POINTS or len(data) < 2:
        return None
    rows = np.unique(np.linspace(0, len(data) - 1, min(len(data), _MOST_ROWS)).round().astype(int))
    some = data.select(rows)
    p = model.poses(some)[:, :3, 3]
    shifts = model.point_roots(model.samples(some))
    other = np.roll(np.arange(len(rows)), len(rows) // 2)
    between = p - p[other]
    apart = np.linalg.norm(between, axis=1)
    told = apart > 0
    u = between[told] / apart[told, np.newaxis]
    along = np.einsum("ni,nik->nk", u, (shifts - shifts[other])[told])
    point = float(np.sqrt(np.mean(np.sum(shifts**2, axis=2))))
    distance = _rms(along)
    scaled = _rms(along - np.outer(apart[told], apart[told] @ along) / max(float(apart @ apart), 1e-300))
    is_open = scaled < _SCALE_IS_OPEN * distance
    known = {
        "kinds": chained("{first} and {second}", [said(kind.plural) for kind in kinds]),
        "point": float(from_si(point, "mm")),
        "distance": float(from_si(scaled if is_open else distance, "mm")),
    }
    note = (
        said(
            "{kinds} do not determine where the arm stands as a whole: a coordinate of a point is known to {point:.2g} "
            "mm, and distances between points of the tool, the shape, but for a common scale of all lengths, which "
            "they do not determine either, to {distance:.2g} mm",
            **known,
        )
        if is_open
        else said(
            "{kinds} do not determine where the arm stands as a whole: a coordinate of a point is known to {point:.2g} "
            "mm, and distances between points of the tool, the shape, to {distance:.2g} mm",
            **known,
        )
    )
    return Shape(point, distance, scaled, note)


def _rms(shifts: FloatArray) -> float:
    """Root mean square over rows of the lengths of independent shifts (n, k)."""
    return float(np.sqrt(np.mean(np.sum(shifts**2, axis=1)))) if len(shifts) else 0.0
