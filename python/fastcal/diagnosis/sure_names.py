# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which of the reported causes are certain enough for the written model.

A name that noise made moves poses that were not measured by as much as it pretended to explain, and rows held out can't
tell it from a true one: of white noise, x^T r of the whole is sufficient for the size along a column x, so that
what the folds hold of it, once it is given, is the same whether there is a cause or not. Its level alone can.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.held_out import HeldOut, gain
from fastcal.diagnosis.held_out_gains import chance
from fastcal.diagnosis.hypothesis import SLOW, Hypothesis
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.search import Search, SearchNode


@dataclass(frozen=True, eq=False)
class Told:
    """What is given, sure or not.

    Attributes:
        best: The names.
        final: The same with the curves beside them.
        remains: Is there something beyond it?
        unsure: Why a name is not written, by its repr.
    """

    best: SearchNode
    final: SearchNode
    remains: bool
    unsure: dict[str, Because]


def sure_names(search: Search, state: SearchNode) -> tuple[SearchNode, dict[str, Because]]:
    """A set less the names that are no more than likely, the least sure first, and why each is not written.

    Where something remains and postures were measured several times, a name must help to predict other postures. Of
    two that do the same work neither is sure beside the other; once one is out, the other is. The names of a model of
    many waves were judged together.
    """
    out: dict[str, Because] = {}
    if len(state.names) > rules.MAX_EFFECTS_GROWN:
        return state, out
    for name in _changing_otherwise(search, state):
        out[repr(name)] = Because(Reason.CHANGES_OTHERWISE)
        state = search.without(state, next(n for n in state.names if n is name))
    while state.names:
        chances = [chance(search, state, name) for name in state.names]
        least = int(np.argmax(chances))
        if chances[least] < rules.ALPHA_CERTAIN:
            break
        out[repr(state.names[least])] = Because(Reason.MAY_BE_CHANCE, min(chances[least], 1.0), rules.ALPHA_CERTAIN)
        state = search.without(state, state.names[least])
    while state.names and not state.suffices and _postures_repeat(state):
        clear = _leads_of_postures(state)
        least = int(np.argmin(clear))
        if clear[least] >= 0:
            break
        out[repr(state.names[least])] = Because(Reason.NOT_OF_OTHER_POSTURES)
        state = search.without(state, state.names[least])
    return state, out


def _postures_repeat(state: SearchNode) -> bool:
    """Do several rows show one posture? What remains of it makes each of them look like more evidence than it is."""
    posture = posture_groups(state.fit.problem.data)
    return bool(posture.max() + 1 < len(posture))


def _leads_of_postures(state: SearchNode) -> list[float]:
    """By how much more than it must each name helps to predict postures that are held out, as a share of the rest."""
    held, posture = HeldOut(state.fit), posture_groups(state.fit.problem.data)
    whole = held.squares()
    leads = []
    for name in state.names:
        less, error = gain(whole, held.squares(state.fit.columns(name)), posture)
        leads.append(less - (rules.MIN_SEARCHED_GAIN if name.searched else rules.MIN_GAIN) * error)
    return leads


def _changing_otherwise(search: Search, state: SearchNode) -> list[Hypothesis]:
    """Names that change with time or temperature, but may not do so as what they stand for does.

    Beside them something that does so is significant, or another name that changes otherwise would do as well, and they
    do not lead clearly in the last rows that were measured where these are left out: of poses that are measured later
    they say less than those before.
    """
    slow = [name for name in state.names if not SLOW.isdisjoint(name.traits.depends_on)]
    if not slow:
        return []
    if not _leaves_something_slow(state):
        others = dict(zip(map(repr, state.names), search.alternatives(state), strict=True))
        slow = [
            name
            for name in slow
            if not all(_change_alike(name, replacement(state, other)) for other in others[repr(name)])
        ]
    return [name for name in slow if state.lead_at_the_end(name) < rules.UNNAMED_LEAD]


def _change_alike(name: Hypothesis, other: Hypothesis) -> bool:
    """Do two names change by the same law? Those over temperature grow with it, those over time each in their way."""
    by = [SLOW.intersection(of.traits.depends_on) for of in (name, other)]
    return name.effect == other.effect or by == [{"temperature_c"}, {"temperature_c"}]


def _leaves_something_slow(state: SearchNode) -> bool:
    """Is anything significant beside a set that changes with time or temperature?"""
    if state.suffices:
        return False
    found, level = state.blocks, rules.ALPHA_FURTHER / 2
    return any(
        not SLOW.isdisjoint(
            found.names[i].traits.depends_on if i < found.count else found.generics[i - found.count].curves.depends_on
        )
        for i in state.significant(level, level)
    )


def replacement(best: SearchNode, other: SearchNode) -> Hypothesis:
    """The name of `other` that is not in `best`."""
    there = {name.key for name in best.names}
    return next(name for name in other.names if name.key not in there or name not in best.names)
