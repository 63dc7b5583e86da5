# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cause of outlying pictures: their corners, or the posture in which they were taken.

A board's own pose, found from one picture alone, leaves of it what its corners miss each other by. Where that is far
more than usual, the picture is blurred, clipped or misread; where it is not, the arm was elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.picture_readings import View
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

WORSE = 8.0  # times what is usual: such pictures stand out, and such corners do not agree with one another
_PLAINLY = 0.4  # pixels by which corners of a sharp picture do not miss each other
_FEWEST = 5  # pictures that say what is usual
_LISTED = 12  # rows that a sentence names


def outlier_notes(model: Robot, data: Dataset, outliers: Sequence[int], errors: KindErrors) -> list[str]:
    """A sentence for each camera and board with pictures among the outliers that stand out of all pictures.

    Args:
        model: With cameras, lenses and boards as they were identified.
        data: What was fitted.
        outliers: Rows.
        errors: Of the corners.
    """
    if CORNERS not in data.kinds or not outliers:
        return []
    spec, uv = model.description, data.observed[CORNERS].reshape(len(data), -1, 2)
    out = []
    for (camera, board), part in pictures(spec).items():
        view = View(
            spec.cameras[camera],
            spec.boards[board],
            uv[:, part],
            f"board {board} in camera {camera}",
            (camera, board),
        )
        left = view.left()
        if len(left) < _FEWEST:
            continue
        typical = float(np.median(list(left.values())))
        far = _standing_out(errors.after[:, part])
        # A fit that hardly misses the others makes much of little, but for corners that plainly disagree.
        plain = np.zeros(len(far), dtype=bool) if errors.before is None else ~_standing_out(errors.before[:, part])
        far &= ~plain | np.isin(np.arange(len(far)), [row for row, of in left.items() if of > _PLAINLY])
        own = {row: left[row] for row in outliers if row in left and far[row]}
        if bad := [row for row, of in own.items() if of > WORSE * typical]:
            worst = max(own[row] for row in bad)
            out.append(
                f"{view.shown}: the corners of {rows_in_words(bad)} do not agree with one another, by up to "
                f"{worst:.2g} px ({typical:.2g} usually): blurred, clipped or misread; less weight is given to them"
            )
        if bad := [row for row, of in own.items() if of <= WORSE * typical and not plain[row]]:
            out.append(
                f"{view.shown}: the corners of {rows_in_words(bad)} agree with one another and not with their posture: "
                "did the arm still move, or is it another posture's picture? Less weight is given to them"
            )
    return out


def _standing_out(errors: FloatArray) -> NDArray[np.bool_]:
    """(N,) pictures of which half of the corners (N, K) miss by WORSE times as much as in half of the pictures."""
    seen = np.isfinite(errors).any(axis=1)
    out = np.zeros(len(errors), dtype=bool)
    miss = np.nanmedian(errors[seen], axis=1)
    out[seen] = miss > WORSE * np.median(miss)
    return out


def rows_in_words(rows: Sequence[int] | NDArray[np.intp]) -> str:
    """Such as: rows 1, 4."""
    listed = [str(int(row)) for row in rows[:_LISTED]]
    more = f" and {len(rows) - _LISTED} others" if len(rows) > _LISTED else ""
    return ("row " if len(rows) == 1 else "rows ") + ", ".join(listed) + more
