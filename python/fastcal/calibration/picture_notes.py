# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is said of pictures in the wrong rows, of boards read from the wrong corner, and of pictures of no posture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.picture_outliers import rows_in_words

IntArray = NDArray[np.intp]

_LISTED = 12  # rows that a sentence names
_MOSTLY = 0.8  # of pictures that are of other rows: when so many are as many rows off, they slipped
_OTHER_END = "it was read from its other end, rotated by 180 degrees; its corners are renumbered"
_MIRRORED = "its corners are in mirrored order; they are renumbered"


def renumbered(shown: str, found: Sequence[tuple[int, int]]) -> Iterator[str]:
    """A sentence for boards read from the other end and for mirrored ones, of rows and the order of their corners."""
    for is_mirrored, what in ((False, _OTHER_END), (True, _MIRRORED)):
        if turned := [row for row, order in found if order and (order > 1) is is_mirrored]:
            yield f"{shown}: in {rows_in_words(turned)} {what}"


def stray_note(shown: str, rows: Sequence[int]) -> str:
    """The sentence for pictures that fit no posture."""
    return (
        f"{shown}: the pictures of {rows_in_words(rows)} fit no posture of the table by far: were they taken upright, "
        "and in this session? They are left out"
    )


def again_note(shown: str, row: int, fits: int) -> str:
    """The sentence for a picture of a posture that has its own."""
    return (
        f"{shown}: the picture of row {row} fits the posture of row {fits}, which has one of its own; it is left out: "
        f"is it a copy, and where is the picture of row {row}?"
    )


def of_other_rows(shown: str, rows: IntArray, fits: IntArray, *, mend: bool | None) -> str:
    """What is said of pictures that fit other rows: exchanged in pairs, slipped by as many rows, or of other rows.

    Args:
        shown: Of which board and camera.
        rows: (M,) where the table has them.
        fits: (M,) whose postures they fit.
        mend: Are they put there? None: neither that nor left out.
    """
    if mend is None:
        done = "--mend puts them where they fit"
    else:
        done = "they are put there" if mend else "they are left out; --mend moves them to the rows where they fit"
    pairs = dict(zip(rows.tolist(), fits.tolist(), strict=True))
    if all(pairs.get(j) == i for i, j in pairs.items()):
        told = " and ".join(f"{i} and {j}" for i, j in pairs.items() if i < j)
        return f"{shown}: the pictures of rows {told} are exchanged; {done}"
    if len(pairs) == 1:
        one = "it is put there" if mend else "it is left out; --mend moves it to the row that it fits"
        return f"{shown}: the picture of row {rows[0]} fits the posture of row {fits[0]}; {one}"
    steps, counts = np.unique(rows - fits, return_counts=True)
    if counts.max() > _MOSTLY * len(rows):  # the last of a table may have come round to its beginning
        step = steps[np.argmax(counts)]
        by = "to the next row" if step == 1 else f"by {step} rows"
        fitted = f"they fit the postures of {rows_in_words(fits)}"
        return f"{shown}: the pictures of {rows_in_words(rows)} slipped {by}: {fitted}; {done}"
    told = ", ".join(f"{i} the posture of {j}" for i, j in list(pairs.items())[:_LISTED])
    return f"{shown}: pictures are in the wrong rows: that of row {told}; {done}"
