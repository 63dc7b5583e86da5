# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cross-validation with touches of sockets, balls or planes at unknown places: whole places are held out.

All touches of one place are near each other, and where it is they say themselves. A model that follows what they share
predicts further touches of the same place, and no others: so the touches of a place are predicted by those of the other
places, the unknowns of the place itself (u, with the derivatives U of its touches) excepted, which its own touches fix:
    e - U (U^T U)^-1 U^T e.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.measurements.dataset import Dataset

FEWEST = 2  # times the unknowns of a place: numbers of its touches that say how well it is met, beside where it is


def touched_places(data: Dataset, measured: _core.Measurements) -> IndexArray | None:
    """(N,) the place that a row touches, 0 ... places - 1, -1 where none; None where whole places can't be held out.

    They can where touches with a label are all that was measured, nothing shows a scale, and two places or more, as
    many as there are unknowns of (the faces of a block share theirs), have FEWEST numbers each.
    """
    fields = [f.name for kind in data.kinds for f in _core.observation_entry(kind).fields if f.role == "label"]
    if measured.shows_scale or len(fields) != 1 or len(measured.observations) != 1:
        return None
    codes, names = data.label_codes(fields[0])
    unknowns = Counter(p.owner for p in measured.parameters)
    owners = list(unknowns)
    of_label = [_place(f"{fields[0]} {name}", owners) for name in names]
    if len(owners) < 2 or None in of_label:
        return None
    place = np.where(codes < 0, -1, np.array(of_label, dtype=np.intp)[codes])
    numbers = len(measured.observations[0].components) * np.bincount(place[place >= 0], minlength=len(owners))
    return place if (numbers >= FEWEST * np.array(list(unknowns.values()))).all() else None


def _place(label: str, owners: list[str]) -> int | None:
    """Which of the owners of unknowns is behind a label: "plane a", or "cube a" of the face "cube a/x"."""
    return next((k for k, owner in enumerate(owners) if label == owner or label.startswith(f"{owner}/")), None)


def beside_own(values: FloatArray, own: FloatArray) -> FloatArray:
    """(m, ...) what columns (m, k), the unknowns of a place, cannot do of values over its touches."""
    if own.shape[1] == 0:
        return values
    return np.asarray(values - own @ np.linalg.lstsq(own, values, rcond=None)[0])


__all__ = ["beside_own", "touched_places"]
