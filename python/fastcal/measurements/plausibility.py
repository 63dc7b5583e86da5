# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurements beside the nominal arm: were their columns meant otherwise?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.column_check import Points, Suspicion, in_mm
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.frame_fit import Poses
from fastcal.measurements.orientation_check import Turns
from fastcal.measurements.row_order import MOST_ROWS, Rows
from fastcal.said import Said, said

PART = 20  # rows that are looked at by themselves
MOST_PARTS = 6


def plausible(dataset: Dataset, robot: RobotFacts, poses: Poses) -> Suspicion | None:
    """Holds measurements against the nominal robot; None where they fit it, or where no other reading fits better.

    Args:
        dataset: Up to 60 of its rows with a whole point, or else with an orientation, are looked at.
        robot: The nominal arm's joint types and reach.
        poses: Poses (N, 4, 4) of the nominal robot at q (N, n), in any base and with any tool.
    """
    points = Points(dataset, robot, poses)
    rows = _rows_of(points)
    found = points.suspicion() or points.by_rows_off() or _order(points, rows)
    found = found or _moved(points, rows)
    if found is None and points.far_off and (rows is None or rows.block is None):  # else the columns are right in parts
        found = points.suspicion(several=True) or _in_parts(points)
    if found is not None and found.refused:
        return found
    return Turns(points).suspicion() or found


def _moved(points: Points, rows: Rows | None) -> Suspicion | None:
    """Rows of several set-ups."""
    found = None if rows is None else rows.moved()
    if rows is None or found is None:
        return None
    firsts = _listed([str(rows.numbers[first]) for first in found.firsts])
    back = said(", once back to where it had been,") if found.again else ""
    meant = said(
        "the tracker, the base or the target moved before {rows}{back} and each part placed by itself",
        rows=firsts,
        back=back,
    )
    label = said("give the parts different `station` labels, or `mount` labels if it was the target")
    read, better = (in_mm(rms) for rms in (found.as_read, found.better))
    return Suspicion(meant, (), read, better, points.robot.reach, refused=not found.few, advice=label)


def _listed(numbers: list[str]) -> Said:
    *most, last = numbers
    if not most:
        return said("row {number}", number=last)
    return said("rows {most} and {last}", most=", ".join(most), last=last)


def _in_parts(points: Points) -> Suspicion | None:
    """What explains a run of neighbouring rows, where the tracker moved or rows slipped as well."""
    starts = range(0, len(points.rows) - PART + 1, PART // 2)
    for first in list(starts)[:: max(1, len(starts) // MOST_PARTS)]:
        rows = np.arange(first, first + PART)
        found = Points(points.dataset.select(rows), points.robot, points.poses).suspicion()
        if found is not None:
            return replace(
                found,
                where=said("rows {first} to {last}", first=int(points.rows[first]), last=int(points.rows[rows[-1]])),
            )
    return None


def _rows_of(points: Points) -> Rows | None:
    position = points.dataset.position
    if position is None or points.as_read is None:
        return None
    whole = np.flatnonzero(~np.isnan(position).any(axis=1))[:MOST_ROWS]
    q, reach = points.dataset.q[whole], points.robot.reach
    return Rows(points.poses, q, position[whole], points.as_read, reach, points.rows[whole])


def _order(points: Points, rows: Rows | None) -> Suspicion | None:
    """Points in rows of other poses."""
    found = None if rows is None else rows.other_order()
    if found is None:
        return None
    read, better = (in_mm(rms) for rms in (found.as_read, found.better))
    return Suspicion(found.words, (), read, better, points.robot.reach, refused=not found.few)
