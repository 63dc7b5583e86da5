# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How much effects improve the prediction of held-out rows, and the set of those that do.

The linearized rows do not always say it: not of closed loops, which are nonlinear, nor of a name that brings something
else, which goes with it.
"""

from __future__ import annotations

import numpy as np

from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.doubts import is_plausible
from fastcal.diagnosis.held_out import gain, squares
from fastcal.diagnosis.hypothesis import SLOW, Hypothesis
from fastcal.diagnosis.library import without_masses
from fastcal.diagnosis.periodic import fine_looks, is_periodic
from fastcal.diagnosis.problem import with_nuisances
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.tail_probabilities import p_values


def gains(search: Search, state: SearchNode) -> list[tuple[float, float]]:
    """By how much each name helps to predict held-out rows, and its standard error.

    `SearchNode.gains` takes what the rows would be without a name from the linearized rows. Closed loops bend between
    the two; and a compliance of an arm without masses brings its joint's sag under the arm's weight, which under one
    payload would do its work alone. Of these the fit without the name and what it brings counts as well. Payloads that
    vary show the compliance itself.
    """
    loops = bool(search.problem.start.robot.passive)
    return [
        max(pair, beyond(state, search.without(state, name)), key=_deviations)
        if loops or brings_more(state, name)
        else pair
        for pair, name in zip(state.gains, state.names, strict=True)
    ]


def brings_more(state: SearchNode, name: Hypothesis) -> bool:
    """Would something at its own joint that does the same go with a name: a sag with a compliance under one payload?"""
    robot = state.fit.problem.start.robot
    if not without_masses(robot) or np.ptp(state.fit.problem.data.payload):
        return False
    rest = with_nuisances([other.entry for other in state.names if other is not name], robot)
    left = {(entry["effect"], entry["owner"]) for entry in rest}
    every = with_nuisances([other.entry for other in state.names], robot)
    return any(
        entry.get("prior") and entry["owner"] == name.owner and (entry["effect"], entry["owner"]) not in left
        for entry in every
    )


def beyond(state: SearchNode, simpler: SearchNode) -> tuple[float, float]:
    """By how much a set predicts held-out rows better than a simpler one, with closed loops than that one fits them."""
    if not state.fit.problem.start.robot.passive:
        return gain(state.predicted, simpler.predicted)
    return gain(state.predicted, squares(simpler.fit), posture_groups(state.fit.problem.data))


def borne_out(search: Search, state: SearchNode) -> SearchNode:
    """The set without the names that do not help to predict held-out rows, the least helpful first.

    Of many, the less helpful half of those that do not help at once. Beside something that remains, no wave stays that
    is implausibly large: it makes up for what is unexplained. Names that help beside what comes with them, such as the
    sag of an arm without masses, must also do better with it than the start, by as much as the surest of them must.
    """
    while state.names:
        over = np.array(
            [_margin(search, state, name, helps) for name, helps in zip(state.names, gains(search, state), strict=True)]
        )
        worst = np.argsort(over, kind="stable")[: np.sum(over < 0)]
        if len(worst) == 0:
            break
        at_once = 1 if len(state.names) <= rules.MAX_EFFECTS_GROWN else (len(worst) + 1) // 2
        gone = [state.names[i] for i in worst[:at_once]]
        rest = [name for name in state.names if not any(name is g for g in gone)]
        state = search.state(rest, state) if rest else search.start
    if not state.names:
        return state
    less, error = beyond(state, search.start)
    return state if less > min(_least_gain(search, state, name) for name in state.names) * error else search.start


def _is_oversized_wave(state: SearchNode, name: Hypothesis) -> bool:
    """Is it a wave larger than gears have, where something remains?"""
    if not name.traits.is_wave:
        return False
    place = state.fit.place(name)
    return not is_plausible(state.fit.model.parameters[place], state.fit.theta[place]) and not state.suffices


def _margin(search: Search, state: SearchNode, name: Hypothesis, helps: tuple[float, float]) -> float:
    """By how much a name helps to predict held-out rows beyond what it must; below 0 it goes.

    What is not certain and changes slowly must predict whole stretches of the order of measuring too: their neighbours
    tell of a wrong cause as well as of the right one, and the model is used on poses that are measured later.
    """
    if _is_oversized_wave(state, name):
        return -np.inf
    least = _least_gain(search, state, name)
    margin = helps[0] - least * helps[1]
    if least > rules.MIN_RIVAL_GAIN and not SLOW.isdisjoint(name.traits.depends_on):
        less, error = state.gain_by_stretches(name)
        margin = min(margin, less - rules.MIN_GAIN * error)
    return margin


def _least_gain(search: Search, state: SearchNode, name: Hypothesis) -> float:
    """Standard errors by which a name must help: fewer for a certain one, but not for a wave where something remains.

    Waves are picked out of thousands, there by a misfit that is no noise, whatever their level against noise. An order,
    a moment or a lag that was searched for was chosen by the rows held out as well.
    """
    uncertain = rules.MIN_SEARCHED_GAIN if name.searched else rules.MIN_GAIN
    if len(state.names) > rules.MAX_EFFECTS_GROWN or (is_periodic(name) and not state.suffices):
        return uncertain
    return rules.MIN_RIVAL_GAIN if chance(search, state, name) < rules.ALPHA_CERTAIN else uncertain


def chance(search: Search, state: SearchNode, name: Hypothesis) -> float:
    """That noise makes some name of the family do as much beside the others of a set; what was searched for counts."""
    drop = np.array([search.without(state, name).fit.remaining - state.fit.remaining])
    place = state.fit.place(name)
    rank = np.array([place.stop - place.start + name.searched], dtype=np.int32)
    looks = search.start.family.named + fine_looks(search.problem, name)
    return float(p_values(drop, rank, search.problem.noise.freedom)[0]) * looks


def _deviations(helps: tuple[float, float]) -> float:
    return helps[0] / max(helps[1], 1e-300)
