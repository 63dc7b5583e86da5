# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches of sockets, balls or planes that stand at unknown places, which are held out whole.

All touches of one place are near each other, and where it is they say themselves. A model that follows what they share
predicts further touches of the same place, and no others: so the touches of a place are predicted by those of the other
places, the unknowns of the place itself (u, with the derivatives U of its touches) excepted, which its own touches fix:
    e - U (U^T U)^-1 U^T e.
"""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.measurements.dataset import Dataset

FEWEST = 5  # touches of a place that is held out: two numbers at least are left of each to say how well it is met


def touched_places(data: Dataset, measured: _core.Measurements) -> IndexArray | None:
    """(N,) the place that a row touches, 0 ... places - 1, -1 where none; None where whole places can't be held out.

    These are readings of which each has a label and nothing shows a scale, at two places or more of FEWEST touches.
    """
    fields = [f.name for kind in data.kinds for f in _core.observation_entry(kind).fields if f.role == "label"]
    if measured.shows_scale or len(fields) != 1 or len(data.kinds) != 1:
        return None
    codes, names = data.label_codes(fields[0])
    counts = np.bincount(codes[codes >= 0], minlength=len(names))
    if len(names) < 2 or counts.min() < FEWEST:
        return None
    return np.asarray(codes, dtype=np.intp)


def beside_own(values: FloatArray, own: FloatArray) -> FloatArray:
    """(m, ...) what columns (m, k), the unknowns of a place, cannot do of values over its touches."""
    if own.shape[1] == 0:
        return values
    return np.asarray(values - own @ np.linalg.lstsq(own, values, rcond=None)[0])


__all__ = ["beside_own", "touched_places"]
