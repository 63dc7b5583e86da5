# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the targets of a program share of their error, so that it can be held beside the error of a calibration."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.said import Said, said
from fastcal.units import from_si

_FEWEST = 3  # targets of which a part can be called shared


def shared_shift(shift: FloatArray) -> tuple[float, float]:
    """The size [m] of the mean of shifts (N, 3 or 6), m along the base's axes first, and the RMS [m] about it."""
    along = np.asarray(shift, float)[:, :3]
    mean = along.mean(axis=0)
    return float(np.linalg.norm(mean)), float(np.sqrt(np.mean(np.sum((along - mean) ** 2, axis=1))))


def shared_in_words(shift: FloatArray) -> Said | None:
    """How the error at the targets compares with that of the calibration; None where little of it is shared.

    Before calibration base and tool are fitted to the measurements, which takes up what all poses have in common; a
    program's targets are in the robot's own base, where nothing does.
    """
    if len(shift) < _FEWEST:
        return None
    shared, about = shared_shift(shift)
    if not shared > about:
        return None
    return said(
        "{shared:.2f} mm of this is one shift that all targets share; about it they are off by {about:.2f} mm RMS. "
        "Only the latter compares with the report's error before calibration: there base and tool are fitted to the "
        "measurements, which takes up a shared shift",
        shared=float(from_si(shared, "mm")),
        about=float(from_si(about, "mm")),
    )
