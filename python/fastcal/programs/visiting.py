# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The poses of a plan as a program that drives to each once and waits there for the instrument.

Where a joint has to arrive from another side than the way brings it, the arm runs up to the pose: a stop at q - 2 deg
times the direction of approach. The program halts where the payload changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import BoolArray, FloatArray
from fastcal.programs.languages import doubts_on_joints
from fastcal.programs.measuring import Cycles, Stop, as_written, write_cycles
from fastcal.programs.program import Document
from fastcal.robot.robot import Robot
from fastcal.units import to_si

RUN_UP = to_si(2.0, "deg")


@dataclass(frozen=True, eq=False)
class Visits:
    """A program and where it goes.

    Attributes:
        documents: The program's files.
        q: (N, n) the poses as the program's own digits say [rad], those that it leaves out as they were.
        notes: What a reader should know, a sentence each.
    """

    documents: tuple[Document, ...]
    q: FloatArray
    notes: list[str]


def visiting_program(
    robot: Robot,
    q: FloatArray,
    payload: FloatArray,
    approach: FloatArray | None,
    driven: BoolArray,
    *,
    language: str,
    program: str,
    title: str,
    dwell_s: float,
    speed: float,
    is_clear: Callable[[FloatArray], BoolArray],
) -> Visits:
    """Writes the program.

    Args:
        robot: Its limits, and how its controller counts joints.
        q: (N, n) poses in the order of visiting [rad].
        payload: (N,) [kg].
        approach: (N, n) +1 or -1: from which side a joint arrives, 0 where that does not matter; None: nowhere.
        driven: (N,) which of them the program drives to, at least one.
        language: `rapid`, `krl`, `fanuc` or `urscript`.
        program: The file that it will be; gives the program its name.
        title: The first line for a reader of the program.
        dwell_s: Wait at each pose [s].
        speed: Share of the greatest speed, above 0 to 1.
        is_clear: Of postures (M, n): where the arm may be. What it runs up from must be.

    Raises:
        InvalidInput: The language can't hold the arm.
    """
    rows = np.flatnonzero(driven)
    starts, missed = _run_ups(robot, q[rows], None if approach is None else approach[rows], is_clear)
    letter, other = ("Q", "B") if program[:1].upper() in "PA" else ("P", "A")  # no target is named as the program is
    names = [f"{letter}{row + 1:03d}" for row in rows] + [f"{other}{rows[k] + 1:03d}" for k in starts]
    place = {k: len(rows) + at for at, k in enumerate(starts)}
    stops: list[Stop] = []
    for k, row in enumerate(rows):
        changes = k > 0 and payload[row] != payload[rows[k - 1]]
        pause = f"payload from here: {payload[row]:g} kg" if changes else ""
        if k in place:
            stops.append(Stop(place[k], False, pause))
            pause = ""
        stops.append(Stop(k, True, pause))
    comment = [title, f"arm: {robot.name[:40]}", f"poses: {len(rows)}", f"payload: {payload[rows[0]]:g} kg"]
    comment += ["ways are not checked:", "drive them slowly first"]
    shown = robot.pendant.shown(np.vstack([q[rows], *(start[np.newaxis] for start in starts.values())]))
    documents = write_cycles(language, program, Cycles(names, shown, [(1, stops)], dwell_s, speed, comment))
    written = q.copy()
    written[rows] = robot.follow(robot.pendant.chain(as_written(documents, stops, shown))[: len(rows)])
    notes = [] if robot.description.pendant is not None else doubts_on_joints(documents[0].name, robot.name)
    if missed:
        told = "1 pose is" if missed == 1 else f"{missed} poses are"
        notes.append(f"{told} not approached from its side by the program: there the arm has no room to run up")
    return Visits(documents, written, notes)


def _run_ups(
    robot: Robot, q: FloatArray, approach: FloatArray | None, is_clear: Callable[[FloatArray], BoolArray]
) -> tuple[dict[int, FloatArray], int]:
    """The postures to run up from, by the poses that need one, and how many poses lack it.

    These cannot be reached from their side: a joint ends there, or something stands in the way.
    """
    if approach is None:
        return {}, 0
    wanted = dict(_turned_wrong(q, approach))
    if not wanted:
        return {}, 0
    rows = np.array(list(wanted))
    starts = np.array(list(wanted.values()))
    within = ((starts >= robot.limits[:, 0]) & (starts <= robot.limits[:, 1])).all(axis=1)
    good = within & is_clear(starts)
    return dict(zip(rows[good].tolist(), starts[good], strict=True)), int(np.sum(~good))


def _turned_wrong(q: FloatArray, approach: FloatArray) -> Iterator[tuple[int, FloatArray]]:
    """Each pose that some joint reaches from the other side, and where the arm would run up from.

    The first is one of them: nobody knows whence the arm comes.
    """
    arrives = np.zeros(q.shape[1])
    for k, (at, sides) in enumerate(zip(q, approach, strict=True)):
        if k:
            step = np.sign(at - q[k - 1])
            arrives = np.where(step == 0, arrives, step)
        asked = sides != 0
        if (arrives[asked] != sides[asked]).any():
            yield k, at - RUN_UP * sides
            arrives = np.where(asked, sides, arrives)
