# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Readings that do not belong to a cell: even when calibrated it misses half of a view's by far, and what was meant.

Two of the commonest mistakes are looked for: columns of two targets exchanged, and those of two arms' joints. A way
from the world to a target, with its own arms, is then fitted in closed form to what it would have been read with.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from fastcal.calibration.alignment import align
from fastcal.calibration.inspection import ACCEPT, BAD_PICTURE
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.asked import arms_between
from fastcal.cells.cell import Cell
from fastcal.cells.paths import Way, serial_ways
from fastcal.cells.readings import Readings
from fastcal.errors import FastcalError, InvalidInput
from fastcal.measurements.kinds import POINTS
from fastcal.said import Said, joined, said
from fastcal.units import from_si

_BAD_SHARE = 0.03  # of the reach: humanoids miss by a hundredth
_BETTER = 5.0  # times: as of columns of one arm


def check_cell_fit(cell: Cell, readings: Readings, views: Mapping[str, KindErrors], *, as_read: bool) -> list[Said]:
    """A sentence on each view of which half is missed by far; refused unless they are taken as they are.

    Args:
        cell: As its file says.
        readings: What was read.
        views: Errors of the calibrated cell.
        as_read: Tell instead of refusing.

    Raises:
        InvalidInput: A view is missed by far: how far, and what would fit where that is found.
    """
    far = [found for name, of in views.items() if (found := _far(cell, name, of)) is not None]
    if not far:
        return []
    asked = said(
        "is each arm's file the right one, are its joints in order, is each target on the arm that carries it, and "
        "every reading in the row of its posture?"
    )
    if any(name.startswith(CORNERS) for name in views):
        asked = said("{text} Are the boards as large as the file says?", text=asked)
    hint = _meant(cell.without_effects, readings) or asked
    out = [joined("; ", [text, hint]) if moves else text for text, moves in far]
    if not as_read:
        raise InvalidInput(joined("", [f"{readings.source}: ", joined("; ", [out[0], ACCEPT])]))
    return out


def _far(cell: Cell, name: str, of: KindErrors) -> tuple[Said, bool] | None:
    """A sentence, and does an arm move it; None where the view is not missed by far."""
    field, _, view = name.partition("@")
    known = of.after[np.isfinite(of.after)]
    median = float(np.median(known)) if len(known) else 0.0
    arms = arms_between(cell, view)
    if field == CORNERS:
        width = max(float(camera["size_px"][0]) for camera in cell.cameras.values())
        if median <= BAD_PICTURE * width:
            return None
        text = said(
            "the pictures of {view} do not fit this cell: even when calibrated it misses half of the corners by more "
            "than {miss:.3g} px in pictures {width:.0f} px wide",
            view=view,
            miss=median,
            width=width,
        )
        return text, True
    reach = max((cell.arm(arm).robot.reach for arm in arms or [each.name for each in cell.arms]), default=0.0)
    if field != POINTS or all(arm.of_poses for arm in cell.arms) or median <= _BAD_SHARE * reach:
        return None
    text = said(
        "the points of {view} do not fit this cell: even when calibrated it misses half of them by more than "
        "{miss:.4g} mm, with a reach of {reach:.4g} mm",
        view=view,
        miss=float(from_si(median, "mm")),
        reach=float(from_si(reach, "mm")),
    )
    if arms:
        return text, True
    return said("{text}, and no arm of the file moves it: what is it `on`?", text=text), False


def _meant(cell: Cell, readings: Readings) -> Said | None:
    """What fits better than what was read by far, of all exchanges of two columns; None where nothing does."""
    ways = [way for way in serial_ways(cell, readings.views) if f"{POINTS}@{way.name}" in readings.tables]
    before = _miss(cell, ways, readings)
    best = min(_exchanged(cell, ways, readings), key=lambda of: of[0], default=None)
    if best is None or not best[0] * _BETTER < before:
        return None
    return best[1]


def _exchanged(cell: Cell, ways: list[Way], readings: Readings) -> Iterator[tuple[float, Said]]:
    for one, other in combinations(ways, 2):
        names = {one.name: other.name, other.name: one.name}

        def renamed(name: str, names: dict[str, str] = names) -> str:
            field, _, view = name.partition("@")
            return f"{field}@{names.get(view, view)}"

        tables = {renamed(name): of for name, of in readings.tables.items()}
        miss = _miss(cell, ways, replace(readings, tables=tables))
        yield (
            miss,
            said(
                "with the readings of {one} and {other} exchanged it would be {miss:.4g} mm",
                one=one.name,
                other=other.name,
                miss=float(from_si(miss, "mm")),
            ),
        )
    joints = {of.name: slice(of.first_joint, of.first_joint + of.joint_count) for of in cell.core.branches}
    for first, second in combinations([arm for arm in cell.arms if not arm.of_poses], 2):
        if first.robot.joint_types != second.robot.joint_types:
            continue
        q = readings.q.copy()
        q[:, joints[first.name]], q[:, joints[second.name]] = (
            readings.q[:, joints[second.name]],
            readings.q[:, joints[first.name]],
        )
        miss = _miss(cell, ways, replace(readings, q=q))
        yield (
            miss,
            said(
                "with the joints of {one} and {other} exchanged it would be {miss:.4g} mm",
                one=first.name,
                other=second.name,
                miss=float(from_si(miss, "mm")),
            ),
        )


def _miss(cell: Cell, ways: list[Way], readings: Readings) -> float:
    """The largest RMS distance [m] of points of a way from the best fit of its base and target; infinite: none."""
    out = 0.0
    for way in ways:
        data = replace(way.rows(cell, readings), rotation=None, observed={}, observed_labels={})
        data = data.select(np.isfinite(data.points).all(axis=1))
        try:
            found = align(way.robot, data)
        except FastcalError:
            return np.inf
        if not found.found:
            return np.inf
        out = max(out, float(found.rms))
    return out
