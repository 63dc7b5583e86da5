# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures assigned to the wrong row, and boards read from the wrong corner.

Each picture is held against every row's posture, in all orders of its corners, with cameras and boards where a start
that does not mind such pictures puts them. One that fits another way JUDGED times better, and about as well as pictures
do, is one. Where half of the pictures are far off whatever the start, they are asked what else may have been meant
(`picture_readings`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.inspection import ACCEPT
from fastcal.calibration.lens_or_size import other_sizes
from fastcal.calibration.picture_arm import arm_of
from fastcal.calibration.picture_knocks import knock_note
from fastcal.calibration.picture_notes import again_note, of_other_rows, renumbered, stray_note
from fastcal.calibration.picture_outliers import rows_in_words
from fastcal.calibration.picture_readings import (
    FAR,
    Arm,
    View,
    drawn_by_poses,
    meant_with_arm,
    mirrored,
    other_numbering,
)
from fastcal.calibration.picture_rows import ABOUT, FEWEST, JUDGED, Picture, of_rows_with_their_own, placed, rms_to
from fastcal.calibration.unknowns import CORNERS, given_rig, unknowns_by_owner
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import SQUARES, Seeing, board_corners, pictures
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

SECOND = "corner_again"  # of a data set: second pictures of a camera and board in their rows
_LISTED = 12  # pictures that another start is tried on
_STRAY = 50.0  # times the median picture, and _ASTRAY of a picture's width: what misses by more fits no posture at all
_ASTRAY = 0.05
_TAIL = 3  # last pictures, from which something may have been moved before them


@dataclass(frozen=True, eq=False)
class Pictures:
    """The data as they were meant, and what was found, in sentences.

    Attributes:
        data: Boards that were read from the other end renumbered; pictures of other rows left out, or moved there.
        notes: A sentence a camera, board and slip.
        meant: What was probably meant otherwise, where pictures are far off.
    """

    data: Dataset
    notes: tuple[str, ...] = ()
    meant: tuple[str, ...] = ()


def judged_pictures(
    robot: Robot,
    data: Dataset,
    *,
    unknowns: Mapping[str, FloatArray] | None = None,
    mend: bool = False,
    threads: int = 1,
) -> Pictures:
    """Looks for pictures of other rows and boards read from the other end.

    Args:
        robot: With its cameras and boards.
        data: What was measured.
        unknowns: Changes of cameras and boards by their owner, where they are known; None: found by the start.
        mend: Put pictures into the rows that they fit, instead of leaving them out.
        threads: Cores.
    """
    if CORNERS not in data.kinds:
        return Pictures(data)
    # Half of the boards may be read from the other end: then only the file's own places tell which half is right.
    starts = [given_rig(robot, data), None] if unknowns is None else [unknowns]
    ways = [drawn for start in starts if (drawn := _drawn(robot, data, start, threads)) is not None]
    if not ways:
        return Pictures(data)
    arm = arm_of(robot, data) if unknowns is None else None
    found = judged(robot.description, data.observed, ways, mend=mend, arm=arm, first=unknowns is None)
    if found.notes:
        data = replace(data, observed={**data.observed, CORNERS: found.uv})
    other = None if arm is None else other_sizes(robot, data, threads)
    if other is None or (found.meant and not other.several):
        return Pictures(data, found.notes, found.meant)
    if other.mistaken:
        return Pictures(data, found.notes, (other.text,))
    return Pictures(data, (*found.notes, other.text), found.meant)


@dataclass(frozen=True, eq=False)
class Judged:
    """The corners as they were meant.

    Attributes:
        uv: (N, 2 K) [px], of one camera and board (N, K, 2).
        notes: What was found, a sentence each.
        meant: What was probably meant otherwise, a sentence each; the corners are then as they were read.
    """

    uv: FloatArray
    notes: tuple[str, ...]
    meant: tuple[str, ...]


def judged(
    rig: Seeing,
    tables: Mapping[str, FloatArray],
    ways: Sequence[FloatArray],
    *,
    mend: bool,
    arm: Arm | None = None,
    first: bool = False,
) -> Judged:
    """The corners as they were meant.

    Args:
        rig: What has the cameras and boards.
        tables: CORNERS as the table has them and, where there are any, second pictures under SECOND.
        ways: (N, K, 2) where each row's posture draws each corner [px], for each place that cameras and boards may
            have; that which the pictures fit best counts.
        mend: Put pictures into the rows that they fit, instead of leaving them out.
        arm: What carries cameras and boards, to ask what was meant where pictures are far off; None: that is not asked.
        first: They are to be fitted: leave out what fits no posture. What a model is tried on keeps it.
    """
    drawn = min(ways, key=lambda drawn: _misfit(rig, tables[CORNERS], drawn))
    count = len(drawn)
    uv = tables[CORNERS].reshape(drawn.shape).copy()
    again = tables[SECOND].reshape(uv.shape) if SECOND in tables else np.full_like(uv, np.nan)
    notes = list(_of_other_cameras(rig, uv, drawn, mend=mend))
    meant: list[str] = []
    for (camera, board), part in pictures(rig).items():
        own = uv[:, part].copy()
        view = View(rig.cameras[camera], rig.boards[board], own, f"board {board} in camera {camera}", (camera, board))
        there = [(i, of[i]) for of in (own, again[:, part]) for i in range(count)]
        found = [Picture(i, seen) for i, seen in there if np.isfinite(seen).any()]
        others = {name: entry for name, entry in rig.cameras.items() if name != camera}
        of_view = _judged_view(view, found, drawn[:, part], others, arm, mend=mend, first=first)
        uv[:, part] = of_view.uv
        notes += of_view.notes
        meant += of_view.meant
    return Judged(uv.reshape(count, -1), tuple(notes), tuple(meant))


def _judged_view(
    view: View,
    found: Sequence[Picture],
    drawn: FloatArray,
    others: Mapping[str, Mapping[str, Any]],
    arm: Arm | None,
    *,
    mend: bool,
    first: bool,
) -> Judged:
    """The corners (N, K, 2) of one camera and board as they were meant; `drawn` likewise."""
    order, notes = orders(view.board), []
    if arm is not None and len(found) >= FEWEST:
        drawn, said = _far_off(view, arm, found, drawn, order, others)
        if said is not None:
            return Judged(view.uv, (), (said,))
        if view.board["kind"] in ("checkerboard", "circles") and mirrored(view):
            notes.append(
                f"{view.shown}: its corners are counted from right to left, or its rows from the bottom: the board's z "
                "points to the camera, whose place does not depend on it"
            )
    fitted = placed(found, drawn, order)
    moved = [picture for picture in fitted if picture.fits != picture.row]
    rows, fits = (np.array([getattr(picture, key) for picture in moved]) for key in ("row", "fits"))
    if arm is not None and not mend and 2 * len(moved) > len(found):
        return Judged(view.uv, (), (of_other_rows(view.shown, rows, fits, mend=None),))
    again = of_rows_with_their_own(fitted)
    uv = np.full_like(view.uv, np.nan)
    for picture in sorted(fitted, key=lambda picture: picture.fits != picture.row, reverse=True):
        if picture.fits == picture.row or mend:
            uv[picture.fits] = picture.uv[order[picture.order]]
    notes += renumbered(view.shown, [(of.row, of.order) for of in fitted])
    notes += [again_note(view.shown, picture.row, picture.fits) for picture in again]
    if moved := [picture for picture in moved if picture not in again]:
        rows, fits = (np.array([getattr(picture, key) for picture in moved]) for key in ("row", "fits"))
        notes.append(of_other_rows(view.shown, rows, fits, mend=mend))
    if arm is not None and (knocked := knock_note(replace(view, uv=uv), arm)) is not None:
        return Judged(uv, (*notes, knocked), ())
    if first and (strays := _strays(view, uv, drawn, order)):
        uv[strays] = np.nan
        notes.append(stray_note(view.shown, strays))
    return Judged(uv, tuple(notes), ())


def _strays(view: View, uv: FloatArray, drawn: FloatArray, order: Sequence[IntArray]) -> list[int]:
    """Rows whose pictures (N, K, 2) fit no posture: so far off, they would carry a fit of few pictures away.

    Empty where they are more than a third, or the last ones: something was moved.
    """
    rows = np.flatnonzero(np.isfinite(uv).any(axis=(1, 2)))
    miss = np.array([min(float(rms_to(uv[i], drawn[i : i + 1, way])[0]) for way in order) for i in rows])
    if len(rows) < FEWEST:
        return []
    far = miss > max(_STRAY * float(np.median(miss)), _ASTRAY * float(view.camera["size_px"][0]))
    count = int(far.sum())
    is_tail = count >= _TAIL and bool(far[-count:].all())
    return [] if 3 * count > len(rows) or is_tail else rows[far].tolist()


def _of_other_cameras(rig: Seeing, uv: FloatArray, drawn: FloatArray, *, mend: bool) -> Iterator[str]:
    """Rows in which two cameras have each other's pictures, a sentence each; uv (N, K, 2) is put right in place."""
    where = pictures(rig)
    for a, b in combinations(rig.cameras, 2):
        for board in rig.boards:
            parts = where[a, board], where[b, board]
            both = np.flatnonzero(
                np.isfinite(uv[:, parts[0], 0]).any(axis=1) & np.isfinite(uv[:, parts[1], 0]).any(axis=1)
            )
            own, other = (
                np.array(
                    [
                        sum(rms_to(uv[i, p], drawn[i : i + 1, q])[0] for p, q in zip(parts, ends, strict=True))
                        for i in both
                    ]
                )
                for ends in (parts, parts[::-1])
            )
            if len(both) < FEWEST:
                continue
            rows = both[(other * JUDGED < own) & (other < ABOUT * np.median(own))]
            if not len(rows):
                continue
            first = uv[rows, parts[0]].copy()
            uv[rows, parts[0]] = uv[rows, parts[1]] if mend else np.nan
            uv[rows, parts[1]] = first if mend else np.nan
            done = "they are put right" if mend else "they are left out; --mend exchanges them"
            yield f"cameras {a} and {b} have each other's pictures of board {board} in {rows_in_words(rows)}; {done}"


def orders(board: Mapping[str, Any]) -> list[IntArray]:
    """Orders in which the corners of a board may have been read: as they are, from the other end, mirrored."""
    if board["kind"] == "points":
        return [np.arange(len(board["points_mm"]))]
    own = np.arange(len(board_corners(board)))
    if board["kind"] == "april_grid":
        return [own, own[::-1]]
    squares = int(board["kind"] in SQUARES)
    grid = own.reshape(int(board["rows"]) - squares, -1)
    return [own, own[::-1], grid[:, ::-1].ravel(), grid[::-1].ravel()]


def check_pictures(looked: Pictures, *, as_read: bool = False) -> list[str]:
    """Refuses pictures that were probably meant otherwise; with `as_read`, a note says so instead.

    Raises:
        InvalidInput: What was meant.
    """
    if looked.meant and not as_read:
        raise InvalidInput(f"{looked.data.source}: {looked.meant[0]}; {ACCEPT}")
    return list(looked.meant)


def _far_off(
    view: View,
    arm: Arm,
    found: Sequence[Picture],
    drawn: FloatArray,
    order: Sequence[IntArray],
    others: Mapping[str, Mapping[str, Any]],
) -> tuple[FloatArray, str | None]:
    """Where the postures draw the board (N, K, 2), by another start where half of the pictures are far off.

    And what was meant otherwise, where no start brings them near.
    """
    ways = [drawn[:, own] for own in order]
    usual = float(np.median([min(rms_to(of.uv, way[of.row : of.row + 1])[0] for way in ways) for of in found]))
    limit = FAR * float(view.camera["size_px"][0])
    if usual < limit:
        return drawn, None
    if said := other_numbering(view):
        return drawn, said
    some = found[:: max(1, len(found) // _LISTED)]

    def fits(other: FloatArray) -> float:
        return float(np.median([min(float(rms_to(of.uv, other[:, own]).min()) for own in order) for of in some]))

    other = drawn_by_poses(view, arm, fits, limit)
    if other is not None and fits(other) < limit:
        # From which end a camera's pictures are counted is free here, and must be the same for all cameras.
        return min((other[:, own] for own in order[:2]), key=lambda way: _apart(way, drawn)), None
    return drawn, meant_with_arm(view, arm, others)


def _apart(a: FloatArray, b: FloatArray) -> float:
    """Median distance of corners (N, K, 2) from those of another drawing [px]."""
    return float(np.median(np.linalg.norm(a - b, axis=2)))


def seen_by_model(model: Robot, data: Dataset, threads: int = 1, *, mend: bool = False) -> Pictures:
    """`judged_pictures` where a model knows where its cameras and boards are."""
    return judged_pictures(model, data, unknowns=given_rig(model, data), mend=mend, threads=threads)


def _drawn(robot: Robot, data: Dataset, unknowns: Mapping[str, FloatArray] | None, threads: int) -> FloatArray | None:
    """(N, K, 2) where each row's posture draws each corner [px]; None where cameras and boards cannot be placed."""
    model, samples = robot.error_model, robot.samples(data)
    if unknowns is None:
        measured = measurements(data, robot)
        start = _core.align(model, samples, measured, threads)
        if not start.found:
            return None
        unknowns = unknowns_by_owner(measured, np.asarray(start.unknowns))
        base, tool = np.asarray(start.T_world_base), np.asarray(start.T_flange_tool)
        model = model.with_robot(robot.core.with_base_and_tool(base, tool))
    # Where all is seen at (0, 0), what is left is where it is drawn.
    observed = {CORNERS: np.zeros_like(data.observed[CORNERS])}
    everywhere = measurements(replace(data, position=None, rotation=None, distance=None, observed=observed), robot)
    own = {owner: iter(values.tolist()) for owner, values in unknowns.items()}
    theta = [float(next(own[p.owner], 0.0)) if p.owner in own else 0.0 for p in everywhere.parameters]
    first = next(of.first_number for of in everywhere.observations if of.field == CORNERS)
    r = np.asarray(_core.residuals(model, samples, everywhere, np.array([*model.start, *theta]), threads))
    return r[:, first : first + observed[CORNERS].shape[1]].reshape(len(data), -1, 2)


def _misfit(rig: Seeing, corners: FloatArray, drawn: FloatArray) -> float:
    """Median over pictures of how far their corners are from where they are drawn, from the end that fits [px]."""
    uv = corners.reshape(drawn.shape)
    found = []
    for (_, board), part in pictures(rig).items():
        order = orders(rig.boards[board])
        for i in np.flatnonzero(np.isfinite(uv[:, part]).any(axis=(1, 2))):
            own = drawn[i : i + 1, part]
            found.append(min(float(rms_to(uv[i, part], own[:, of])[0]) for of in order))
    return float(np.median(found)) if found else np.inf
