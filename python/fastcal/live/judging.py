# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is wrong with a row that has just come, in a sentence; empty where nothing is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from fastcal.arrays import FloatArray
from fastcal.live.belief import Belief
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.said import Said, said
from fastcal.units import from_si, to_si

LEVEL = 1e-4  # of a row that is right
GROSS = 1e-2  # of the reach: no arm is built that badly
SAME_POSTURE = to_si(0.02, "deg")  # [rad or m]
_MOVED = 10.0  # times the noise: two points that are not one


@dataclass(frozen=True)
class Judgement:
    """Of one row.

    Attributes:
        kind: ok, dropped_beam, wrong_pose, slip or early (nothing to judge it by yet).
        text: What is wrong, and what to do; empty where nothing is.
        off: Distance from where the point was expected [m]; None where nothing was.
        expected: How far off 95 of 100 right rows are at most [m].
    """

    kind: str = "ok"
    text: str = ""
    off: float | None = None
    expected: float | None = None


def dropped_beam(row: Dataset, before: Dataset | None, names: list[int], robot: Robot) -> Judgement | None:
    """Is there no point, or one that the instrument did not measure in this posture? Needs no model."""
    point = _point(row)
    if not np.isfinite(point).all():
        return Judgement("dropped_beam", said("dropped beam: no point was measured; measure this pose again"))
    if not point.any():
        return Judgement("dropped_beam", said("dropped beam: the point is 0 0 0; measure this pose again"))
    if before is not None:
        same = np.flatnonzero((before.points == point).all(axis=1))
        if len(same):
            was = names[int(same[-1])]
            if _near(before.q[same[-1]], row.q[0]):
                text = said("dropped beam: the row is a copy of row {row}; measure this pose again", row=was)
            else:
                text = said("dropped beam: the point is still that of row {row}; measure this pose again", row=was)
            return Judgement("dropped_beam", text)
        far = float(np.median(np.linalg.norm(before.points - point, axis=1)))
        if len(before) > 1 and far > 3 * robot.reach:
            text = said(
                "dropped beam: the point is {far} away from the others, farther than the arm reaches", far=_mm(far)
            )
            return Judgement("dropped_beam", text, far)
    return None


def stale_joints(row: Dataset, before: Dataset | None, names: list[int], noise: float) -> Judgement | None:
    """Are the joints those of the row before, while the point has moved?"""
    if before is None or before.position is None or not _near(before.q[-1], row.q[0]):
        return None
    away = float(np.linalg.norm(_point(row) - before.position[-1]))
    if away <= _MOVED * noise:
        return None
    text = said(
        "wrong pose: the joints are those of row {row}, and the point is {away} away from its point; "
        "read the joints again",
        row=names[-1],
        away=_mm(away),
    )
    return Judgement("wrong_pose", text, away)


def against(belief: Belief, row: Dataset, others: FloatArray, of: Sequence[str]) -> Judgement:
    """A row against what the rows before say.

    Args:
        belief: These.
        row: The new one.
        others: (K, n) other postures that it may have been measured in: those measured, those planned.
        of: What each of them is called.
    """
    point = _point(row)
    at, covariance = belief.predicted(row)
    off = float(np.linalg.norm(point - at[0]))
    expected = 2.0 * float(np.sqrt(np.trace(covariance[0])))
    statistic = float((point - at[0]) @ np.linalg.solve(covariance[0], point - at[0])) / 3
    if float(fdtrc(3, belief.degrees, statistic)) >= LEVEL:
        return Judgement("ok", "", off, expected)
    if (other := _other_posture(belief, point, row, others, off)) is not None:
        text = said(
            "wrong pose: the point lies where {other} is, {off} from where these joints bring the tool",
            other=of[other],
            off=_mm(off),
        )
        return Judgement("wrong_pose", text, off, expected)
    if off > GROSS * belief.robot.reach:
        text = said(
            "wrong pose: the point is {off} from where these joints bring the tool; read the joints again", off=_mm(off)
        )
        return Judgement("wrong_pose", text, off, expected)
    text = said(
        "slip: {off} off where {expected} is expected at most; seat the target and measure again",
        off=_mm(off),
        expected=_mm(expected),
    )
    return Judgement("slip", text, off, expected)


def _other_posture(belief: Belief, point: FloatArray, row: Dataset, others: FloatArray, off: float) -> int | None:
    """The posture of `others` in which the tool is where the point was measured; None where there is none."""
    if len(others) == 0:
        return None
    tried = Dataset.from_arrays(others, payload=float(row.payload[0]))
    at, covariance = belief.predicted(tried)
    away = point - at
    distance = np.linalg.norm(away, axis=1)
    gate = 3.0 * np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    fits = (distance < np.minimum(gate, off / 3)) & ~np.array([_near(q, row.q[0]) for q in others])
    return int(np.argmin(np.where(fits, distance, np.inf))) if fits.any() else None


def _point(row: Dataset) -> FloatArray:
    point: FloatArray = row.points[0]
    return point


def _near(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.abs(a - b).max() < SAME_POSTURE)


def _mm(metres: float) -> Said:
    if metres < 1:
        return said("{size:.3g} mm", size=float(from_si(metres, "mm")))
    return said("{size:.3g} m", size=float(metres))
