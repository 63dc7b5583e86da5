# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which label has too few rows, where some socket, ball, plane, block, anchor or gauge cannot be placed.

A label that is misspelt once is a thing of its own with one row: only its name tells the user which row to mend.
"""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of

_FACES = ("x", "y", "z")  # of a block: one that no row touches has no label of its own


def with_rarest(message: str, data: Dataset) -> str:
    """A core's reason why nothing was placed, with the labels of the fewest rows if it is about labelled things.

    Args:
        message: Such as "each socket needs at least two touches".
        data: The rows that were to be placed.
    """
    if not message.startswith("each "):
        return message
    entries = [_core.observation_entry(kind) for kind in kinds_of(data)]
    known = sorted({field.name for entry in entries for field in entry.fields if field.role == "label"})
    told = ", ".join(f"{field} '{name}' ({count})" for field in known for name, count in rarest(data, field))
    return f"{message}; the fewest rows are of {told}" if told else message


def rarest(data: Dataset, field: str) -> list[tuple[str, int]]:
    """The labels of a column that have the fewest rows, and how many."""
    codes, names = data.label_codes(field)
    if not len(codes):
        return []
    count = dict(zip(names, np.bincount(codes[codes >= 0], minlength=len(names)).tolist(), strict=True))
    if field == "cube":
        blocks = {name.rpartition("/")[0] for name in names}
        count = {f"{block}/{face}": 0 for block in sorted(blocks) for face in _FACES} | count
    least = min(count.values(), default=0)
    return [(name, of) for name, of in count.items() if of == least][:3]
