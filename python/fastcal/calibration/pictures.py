# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures that cannot be what the table says: of another row's posture, or of a board read from its other end.

Each picture is held against every row's posture, in both orders of its corners, with cameras and boards where a start
that does not mind such pictures puts them. One that fits another way JUDGED times better, and about as well as pictures
do, is one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.unknowns import CORNERS, given_rig, unknowns_by_owner
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import Seeing, pictures
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

JUDGED = 5.0  # times better than as it is, in px
ABOUT = 4.0  # times the median picture: an arm as it is drawn misses some pictures by more than others
SECOND = "corner_again"  # of a data set: second pictures of a camera and board in their rows
FEWEST = 4  # pictures of a camera and a board, from which a few can be told from the many
_LISTED = 12  # rows that a sentence names


@dataclass(frozen=True, eq=False)
class Picture:
    """What one camera saw of one board.

    Attributes:
        row: Where the table has it.
        uv: (K, 2) its corners [px], NaN where not seen.
        fits: The row whose posture it fits; its own unless another does far better.
        turned: Was the board read from its other end?
    """

    row: int
    uv: FloatArray
    fits: int = -1
    turned: bool = False

    def __post_init__(self) -> None:
        if self.fits < 0:
            object.__setattr__(self, "fits", self.row)


@dataclass(frozen=True, eq=False)
class Pictures:
    """The data as they were meant, and what was found, in sentences.

    Attributes:
        data: Boards that were read from the other end renumbered; pictures of other rows left out, or moved there.
        notes: A sentence a camera, board and slip.
    """

    data: Dataset
    notes: tuple[str, ...] = ()


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
    uv, notes = judged(robot.description, data.observed, ways, mend=mend)
    return Pictures(replace(data, observed={**data.observed, CORNERS: uv}), notes) if notes else Pictures(data)


def judged(
    rig: Seeing, tables: Mapping[str, FloatArray], ways: Sequence[FloatArray], *, mend: bool
) -> tuple[FloatArray, tuple[str, ...]]:
    """(N, 2 K) the corners as they were meant, and what was found, in sentences.

    Args:
        rig: What has the cameras and boards.
        tables: CORNERS as the table has them and, where there are any, second pictures under SECOND.
        ways: (N, K, 2) where each row's posture draws each corner [px], for each place that cameras and boards may
            have; that which the pictures fit best counts.
        mend: Put pictures into the rows that they fit, instead of leaving them out.
    """
    drawn = min(ways, key=lambda drawn: _misfit(rig, tables[CORNERS], drawn))
    count = len(drawn)
    uv = tables[CORNERS].reshape(drawn.shape).copy()
    again = tables[SECOND].reshape(uv.shape) if SECOND in tables else np.full_like(uv, np.nan)
    notes: list[str] = []
    for (camera, board), part in pictures(rig).items():
        shown = f"board {board} in camera {camera}"
        there = [(i, of[i, part].copy()) for of in (uv, again) for i in range(count)]
        found = [Picture(i, seen) for i, seen in there if np.isfinite(seen).any()]
        turnable = rig.boards[board]["kind"] != "points"
        placed = _placed(found, drawn[:, part], turnable=turnable)
        uv[:, part] = np.nan
        for picture in sorted(placed, key=lambda picture: picture.fits != picture.row, reverse=True):
            if picture.fits == picture.row or mend:
                uv[picture.fits, part] = picture.uv[::-1] if picture.turned else picture.uv
        if turned := [picture.row for picture in placed if picture.turned]:
            notes.append(
                f"{shown}: in {_rows(turned)} it was read from its other end, turned by 180 degrees; its corners are "
                "renumbered there"
            )
        if moved := [picture for picture in placed if picture.fits != picture.row]:
            rows, fits = ([getattr(picture, key) for picture in moved] for key in ("row", "fits"))
            notes.append(_of_other_rows(shown, np.array(rows), np.array(fits), mend))
    return uv.reshape(count, -1), tuple(notes)


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
        turnable = rig.boards[board]["kind"] != "points"
        for i in np.flatnonzero(np.isfinite(uv[:, part]).any(axis=(1, 2))):
            own = drawn[i : i + 1, part]
            ways = (own, own[:, ::-1]) if turnable else (own,)
            found.append(min(float(_rms(uv[i, part], way)[0]) for way in ways))
    return float(np.median(found)) if found else np.inf


def _placed(found: Sequence[Picture], drawn: FloatArray, *, turnable: bool) -> list[Picture]:
    """The pictures of one camera and board, each with the row whose posture it fits; `drawn` is (N, K, 2) [px]."""
    if len(found) < FEWEST:
        return list(found)
    ways = (drawn, drawn[:, ::-1]) if turnable else (drawn,)
    rms = np.array([[_rms(picture.uv, way) for way in ways] for picture in found])  # (pictures, ways, postures)
    usual = float(np.median([of[:, picture.row].min() for of, picture in zip(rms, found, strict=True)]))
    out = []
    for of, picture in zip(rms, found, strict=True):
        own, best = of[:, picture.row], float(of.min())
        if best * JUDGED > own[0] or best > ABOUT * usual:
            out.append(picture)
            continue
        way, posture = divmod(int(np.argmin(of)), len(drawn))
        if own.min() <= 2 * best:  # its own posture does as well
            way, posture = int(np.argmin(own)), picture.row
        out.append(replace(picture, fits=posture, turned=way == 1))
    return out


def _rms(seen: FloatArray, drawn: FloatArray) -> FloatArray:
    """(N,) root mean square distance of a picture's corners (K, 2) from those (N, K, 2) that each posture draws."""
    known = np.isfinite(seen).all(axis=1)
    seen, drawn = seen[known], drawn[:, known]
    return np.asarray(np.sqrt(np.mean(np.sum((drawn - seen) ** 2, axis=2), axis=1)))


def _of_other_rows(shown: str, rows: IntArray, fits: IntArray, mend: bool) -> str:
    """What is said of pictures that fit other rows: exchanged in pairs, slipped by as many rows, or of other rows."""
    pairs = dict(zip(rows.tolist(), fits.tolist(), strict=True))
    done = "they are put there" if mend else "they are left out; --mend puts them where they fit"
    if all(pairs.get(j) == i for i, j in pairs.items()):
        told = " and ".join(f"{i} and {j}" for i, j in pairs.items() if i < j)
        return f"{shown}: the pictures of rows {told} are exchanged; {done}"
    steps = np.unique(rows - fits)
    if len(steps) == 1:
        by = "to the next row" if steps[0] == 1 else f"by {steps[0]} rows"
        return f"{shown}: the pictures of {_rows(rows)} slipped {by}: they fit the postures of {_rows(fits)}; {done}"
    told = ", ".join(f"{i} the posture of {j}" for i, j in list(pairs.items())[:_LISTED])
    return f"{shown}: pictures are in the wrong rows: that of row {told}; {done}"


def _rows(rows: Sequence[int] | IntArray) -> str:
    listed = [str(int(row)) for row in rows[:_LISTED]]
    more = f" and {len(rows) - _LISTED} others" if len(rows) > _LISTED else ""
    return ("row " if len(rows) == 1 else "rows ") + ", ".join(listed) + more
