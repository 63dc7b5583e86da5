# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An instrument that is surer along its beam than across it, such as a laser tracker: where it stood, how sure it is.

The errors of a point x that was seen from c are independent along the beam u = (x - c) / d, d = |x - c|, across it
level (z x u, made unit; y where the beam is upright) and across it upright. With these as rows of A its covariance is

    S = A^T diag(s_r^2, (s_a d)^2, (s_a d)^2) A

of standard deviations s_r [m] of a length and s_a [rad] of an angle. The measured point stands for the true one in u
and d: an error of 0.1 mm at 1 m turns the beam by 0.1 mrad.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.measurements.checks import check_values

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset


_UPRIGHT = 1e-9  # sine of the beam to the vertical below which it has no level direction of its own


def beam_axes(position: FloatArray, instrument: FloatArray) -> FloatArray:
    """(N, 3, 3) A of points seen from `instrument`, both (N, 3) [m]; 1 where one of them is NaN."""
    beam = position - instrument
    known = ~np.isnan(beam).any(axis=1)
    out = np.tile(np.eye(3), (len(beam), 1, 1))
    u = beam[known] / np.linalg.norm(beam[known], axis=1, keepdims=True)
    level = np.cross([0.0, 0.0, 1.0], u)
    sine = np.linalg.norm(level, axis=1, keepdims=True)
    level = np.where(sine > _UPRIGHT, level / np.maximum(sine, _UPRIGHT), [0.0, 1.0, 0.0])
    out[known] = np.stack([u, level, np.cross(u, level)], axis=1)
    return out


def along_and_across(
    position: FloatArray, instrument: FloatArray, sigma_range: FloatArray, sigma_angle: FloatArray
) -> FloatArray:
    """(N, 3) [m] standard deviations along the beam, and twice across it, of those of lengths (N,) and angles (N,)."""
    with np.errstate(over="ignore", invalid="ignore"):  # what is infinite is refused where all numbers are looked at
        across = sigma_angle * np.linalg.norm(position - instrument, axis=1)
    return np.column_stack([sigma_range, across, across])


def range_and_angle(data: Dataset) -> tuple[FloatArray, FloatArray] | None:
    """(N,) [m] and (N,) [rad] of the instrument's lengths and angles; None where not every row was seen from one.

    A row whose standard deviations are those of x, y and z, and equal, may as well have been seen from the origin.
    """
    if data.instrument is None or data.sigma_position is None or data.position is None:
        return None
    sigma, seen = data.sigma_position, np.asarray(~np.isnan(data.instrument).any(axis=1))
    if not np.array_equal(sigma[:, 1], sigma[:, 2], equal_nan=True) or np.any(sigma[~seen, 0] != sigma[~seen, 1]):
        return None
    place = np.where(seen[:, np.newaxis], data.instrument, 0.0)
    return sigma[:, 0], sigma[:, 1] / np.linalg.norm(data.position - place, axis=1)


def with_tracker(data: Dataset, sigma_range: float, sigma_angle: float, instrument: ArrayLike) -> Dataset:
    """See `Dataset.with_tracker`."""
    for name, size in (("sigma_range", sigma_range), ("sigma_angle", sigma_angle)):
        if not (np.isfinite(size) and size > 0):
            raise InvalidInput(f"{name} must be a standard deviation above 0, got {size}")
    if data.position is None:
        raise InvalidInput(f"{data.source}: expected measured points (x_mm, y_mm, z_mm), which a tracker's sigma is of")
    place = np.asarray(instrument, dtype=float)
    if place.shape not in ((3,), (len(data), 3)):
        raise InvalidInput(f"instrument must have shape (3,) or ({len(data)}, 3), got {place.shape}")
    places = np.array(np.broadcast_to(place, (len(data), 3)))
    lengths, angles = (np.full(len(data), size) for size in (sigma_range, sigma_angle))
    sigma = along_and_across(data.position, places, lengths, angles)
    found = replace(data, instrument=places, sigma_position=sigma)
    check_values(found, None)
    return found
