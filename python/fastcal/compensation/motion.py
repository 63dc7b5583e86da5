# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How each joint comes to a command, where the targets do not say it: rows are a path, each driven to from the last.

Play and settling look at it, and it follows from the commands, which are looked for: solve, take the moves from the
commands, and solve again until these stand. `predict` reads the moves of a table of commands in the same way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.effects.entries import MOVE, conditions_read, label, own_columns
from fastcal.measurements.last_moves import directions, last_moves
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot

MOST_ROUNDS = 20
_NO_MOVE = 1e-8  # [rad or m], ten times what the solver leaves: such a move is none, and has no direction
_SAME_MOVE = 1e-10  # [rad or m]


def readers(model: Robot, targets: Targets) -> dict[str, str]:
    """The effects, as on a command line, that look at what the targets do not give: "approach" or "move"."""
    found = {}
    for entry, effect in zip(model.entries, model.effects, strict=True):
        columns = [*conditions_read(entry, effect), *own_columns(entry)]
        for name, start in (("approach", "approach"), ("move", MOVE)):
            if not _given(targets, name) and any(column.startswith(start) for column in columns):
                found[label(entry)] = name
    return found


def moved_along(targets: Targets, q: FloatArray | None, joint_count: int) -> Targets:
    """The targets with the directions and moves that they lack: those of a path through q (N, n), or none.

    Rows of q that are NaN are not driven to. What the targets give counts; a move against it is unknown, and 0.
    """
    approach, move = np.zeros((len(targets), joint_count)), np.zeros((len(targets), joint_count))
    given = None
    if _given(targets, "approach"):
        given = np.broadcast_to(np.asarray(targets.conditions["approach"]), move.shape)
    if q is not None:
        rows = np.flatnonzero(np.isfinite(q).all(axis=1))
        move[rows] = last_moves(q[rows], None if given is None else given[rows])
        approach[rows] = directions(move[rows])
    known = {name: value for name, value in targets.conditions.items() if value is not None}
    return replace(targets, conditions={"approach": approach, "move": move} | known)


def at_rest(q: FloatArray) -> FloatArray:
    """Commands q (N, n) in which a joint that all but stays from one row to the next stays: rounding has no side."""
    out = q.copy()
    rows = np.flatnonzero(np.isfinite(q).all(axis=1))
    for before, row in pairwise(rows):
        out[row] = np.where(np.abs(q[row] - out[before]) < _NO_MOVE, out[before], q[row])
    return out


def settled(solve: Callable[[Targets], FloatArray], targets: Targets, q: FloatArray) -> Targets:
    """The targets with the moves of their own commands.

    Where a joint moves by less than its play, each side leads to the other one: there it is to come from neither, which
    leaves half the play.

    Args:
        solve: Commands (N, n) of targets with moves, NaN in rows that are not driven to.
        targets: What is known of them.
        q: The commands as if nothing had moved.
    """
    passed = [moved_along(targets, at_rest(q), q.shape[1])]
    for _ in range(MOST_ROUNDS):
        aimed = moved_along(targets, at_rest(solve(passed[-1])), q.shape[1])
        if _same(aimed, passed[-1]):
            return aimed
        passed.append(aimed)
        if any(_same(aimed, other) for other in passed[-3:-1]):
            break
    sides = [np.asarray(each.conditions["approach"]) for each in passed[-2:]]
    return replace(aimed, conditions={**aimed.conditions, "approach": np.where(sides[0] == sides[1], sides[1], 0.0)})


def _same(a: Targets, b: Targets) -> bool:
    turned = np.any(np.asarray(a.conditions["approach"]) != np.asarray(b.conditions["approach"]))
    moved = np.abs(np.asarray(a.conditions["move"]) - np.asarray(b.conditions["move"]))
    return not turned and bool((moved < _SAME_MOVE).all())


def _given(targets: Targets, name: str) -> bool:
    return targets.conditions.get(name) is not None
