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
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

JUDGED = 5.0  # times better than as it is, in px
ABOUT = 4.0  # times the median picture: an arm as it is drawn misses some pictures by more than others
FEWEST = 4  # pictures of a camera and a board, from which a few can be told from the many
_LISTED = 12  # rows that a sentence names


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
    drawn = _drawn(robot, data, unknowns, threads)
    if drawn is None:
        return Pictures(data)
    uv = data.observed[CORNERS].reshape(len(data), -1, 2).copy()
    notes: list[str] = []
    for (camera, board), part in pictures(robot.spec).items():
        seen = uv[:, part]
        shown = f"board {board} in camera {camera}"
        turned, fits = _slips(seen, drawn[:, part], turnable=robot.spec["boards"][board]["kind"] != "points")
        if turned.any():
            seen[turned] = seen[turned, ::-1]
            notes.append(
                f"{shown}: in {_rows(np.flatnonzero(turned))} it was read from its other end, turned by 180 degrees; "
                "its corners are renumbered there"
            )
        moved = np.flatnonzero(fits != np.arange(len(data)))
        if len(moved):
            before = seen.copy()
            seen[moved] = np.nan
            if mend:
                seen[fits[moved]] = before[moved]
            notes.append(_of_other_rows(shown, moved, fits[moved], mend))
    if not notes:
        return Pictures(data)
    return Pictures(replace(data, observed={**data.observed, CORNERS: uv.reshape(len(data), -1)}), tuple(notes))


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


def _slips(seen: FloatArray, drawn: FloatArray, *, turnable: bool) -> tuple[NDArray[np.bool_], IntArray]:
    """(N,) was the board read from its other end, and (N,) the row whose posture the picture fits.

    `seen` and `drawn` are (N, K, 2) of one camera and board; pictures without corners fit their own row.
    """
    count = len(seen)
    turned, fits = np.zeros(count, dtype=bool), np.arange(count)
    known: NDArray[np.bool_] = np.isfinite(seen[..., 0]) & np.isfinite(seen[..., 1])
    rows = np.flatnonzero(known.any(axis=1))
    if len(rows) < FEWEST:
        return turned, fits
    ways = (drawn, drawn[:, ::-1]) if turnable else (drawn,)
    # (pictures, ways, postures)
    rms = np.array([[_rms(seen[i, known[i]], way[:, known[i]]) for way in ways] for i in rows])
    own = rms[np.arange(len(rows)), :, rows]
    usual = float(np.median(own[:, 0]))
    for k, i in enumerate(rows.tolist()):
        best = float(rms[k].min())
        if best * JUDGED > own[k, 0] or best > ABOUT * usual:
            continue
        way, posture = divmod(int(np.argmin(rms[k])), count)
        if own[k].min() <= 2 * best:  # its own posture does as well
            way, posture = int(np.argmin(own[k])), i
        turned[i], fits[i] = way == 1, posture
    return turned, fits


def _rms(seen: FloatArray, drawn: FloatArray) -> FloatArray:
    """(N,) root mean square distance of a picture's corners (k, 2) from those (N, k, 2) that each posture draws."""
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
