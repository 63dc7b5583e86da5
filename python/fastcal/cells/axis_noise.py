# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise of positions axis by axis: what a camera says of a distance is coarser than what it says across its view.

Of the residuals r (N, 3) [m] in the sensor's axes of a first fit the standard deviation of axis k is

    sigma_k = 1.4826 median |r_k|,

which gross rows hardly change. With N residuals of normal noise of one size, log(sigma_i / sigma_k) has a standard
deviation of 1.17 sqrt(2 / N); where the coarsest and the finest axis differ by more than _SURE of these, each axis
weighs by its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.kind_errors import KindErrors
from fastcal.cells.readings import Readings
from fastcal.measurements.kinds import POINTS, KindNoise
from fastcal.units import from_si

_SURE = 2.5
_FEWEST = 12  # rows: the deviations of fewer are known too coarsely to weigh by
_NORMAL = 1.4826  # standard deviation over the median of |r|
_SPREAD = 1.17  # standard deviation of log sigma times sqrt(N): 1 / (4 u phi(u)) at u = 1 / _NORMAL


def axis_noise(numbers: FloatArray) -> FloatArray | None:
    """(3,) standard deviation of each axis [m] of residuals (N, 3); None where they may be alike."""
    known = numbers[np.isfinite(numbers).all(axis=1)]
    if len(known) < _FEWEST:
        return None
    sigma: FloatArray = _NORMAL * np.median(np.abs(known), axis=0)
    if not (sigma > 0).all():
        return None
    apart = float(np.log(sigma.max() / sigma.min()))
    return sigma if apart > _SURE * _SPREAD * np.sqrt(2 / len(known)) else None


def with_axis_noise(readings: Readings, views: dict[str, KindErrors]) -> tuple[Readings, list[str]]:
    """Readings with the noise of each axis where it differs, and the views in which it does.

    Args:
        readings: Positions whose table has a sigma keep it.
        views: What the first fit leaves of each view.
    """
    tables, found = dict(readings.tables), []
    for name in readings.tables:
        field, _, view = name.partition("@")
        sigma_name = f"sigma_{name}"
        if field != "position" or ":" not in view or sigma_name in tables or name not in views:
            continue
        sigma = axis_noise(views[name].numbers.reshape(-1, 3))
        if sigma is not None:
            tables[sigma_name] = np.tile(sigma, (len(readings), 1))
            found.append(view)
    return replace(readings, tables=tables), found


def noise_of_axes(noise: dict[str, KindNoise], weighed: Readings, views: list[str]) -> dict[str, KindNoise]:
    """The noise of each kind, of which that of positions says that axes differ, and by how much."""
    apart = ", ".join(
        f"{view} " + " ".join(f"{from_si(float(s), 'mm'):.3g}" for s in weighed.tables[f"sigma_position@{view}"][0])
        for view in views
    )
    note = f"estimated from the residuals, axis by axis: {apart} mm along x y z of the sensor"
    return {name: replace(of, note=note) if name == POINTS else of for name, of in noise.items()}
