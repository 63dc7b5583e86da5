# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Detectable and undetectable effects, look-alikes, and why each cause was not reported."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import special

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.diagnosis import rules
from fastcal.diagnosis.hypothesis import Hypothesis, Key
from fastcal.diagnosis.library import Library, Untestable, needs
from fastcal.diagnosis.reasons import Because, CauseLabel, Reason
from fastcal.diagnosis.result import DetectableEffect, RankedHypothesis
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import effect_has_moment
from fastcal.effects.entries import build_effects, edge_name, edge_unit
from fastcal.units import from_si

# Probability with which the smallest effect that could have been seen is seen.
DETECTION_POWER = 0.8
# Names in the ranking, and in the map of confusions.
RANKING_LENGTH = 12
CONFUSION_LENGTH = 8
_SURELY = 4.0  # standard deviations: beyond where one of two chances is enough, both are
_HALVINGS = 40


def untestable(search: Search, library: Library) -> list[Untestable]:
    """Names whose columns are missing or whose signature the fitted parameters absorb whole, in every variant.

    Steps are looked for by the order of the rows, where these have no time.
    """
    found = search.start.blocks
    rank = np.asarray(found.tests.scores.rank)[: found.count]
    alive = {name.key for name, r in zip(found.names, rank, strict=True) if r > 0}
    dead = dict.fromkeys(name.key for name in found.names if name.key not in alive)
    return [
        *(one for one in library.untestable if not effect_has_moment(one.effect)),
        *(Untestable(effect, owner, needs(effect, owner, columns=False)) for effect, owner in dead),
    ]


def barely_shown(state: SearchNode) -> set[Key]:
    """Names of one number that moves all rows together by less than one standard deviation at a size that no arm has.

    So an axis that only a centre of mass beside it loads: its number is what noise makes of it, a thousand sizes.
    """
    found = state.blocks
    length = np.asarray(found.tests.length)
    first = np.concatenate([[0], np.cumsum(found.sizes)])
    core = state.fit.problem.start.model.robot
    out: set[Key] = set()
    for i, name in enumerate(found.names):
        if found.sizes[i] == 1:
            (effect,) = build_effects([name.entry], core)
            if rules.MAX_PLAUSIBLE_SIZE * effect.parameters[0].sigma * length[first[i]] < 1.0:
                out.add(name.key)
    return out


def smallest(state: SearchNode) -> list[DetectableEffect]:
    """For each parameter of each name the size that would be found four times in five, alone, in these data.

    Size = root of the noncentrality at which some block, the name's own or another that looks like it, passes its limit
    of detection and then helps to predict held-out rows, over the length that the column keeps.
    """
    found = state.blocks
    rank = np.asarray(found.tests.scores.rank)
    length = np.asarray(found.tests.length)
    first = np.concatenate([[0], np.cumsum(found.sizes)])
    core = state.fit.problem.start.model.robot
    tested: dict[Key, int] = {}
    for i, name in enumerate(found.names):
        least = found.sizes[i] if name.traits.is_wave else 1  # a wave that can hide in its phase shows at no size
        if rank[i] >= least and not name.is_start:  # the size of those depends on corner or moment
            tested.setdefault(name.key, i)
    columns = [int(c) for i in tested.values() for c in range(first[i], first[i + 1])]
    limits, threads = _limits(state), state.fit.problem.threads
    detected = np.asarray(found.tests.detectable(columns, limits, DETECTION_POWER, threads=threads))
    roots = dict(zip(columns, _also_borne_out(detected), strict=True))
    out: list[DetectableEffect] = []
    for i in tested.values():
        part = slice(first[i], first[i + 1])
        root = np.array([roots[c] for c in range(part.start, part.stop)])
        name = found.names[i]
        out += [
            DetectableEffect(*name.key, parameter, value) for parameter, value in _sizes(name, length[part], root, core)
        ]
    return out


def _also_borne_out(detected: FloatArray) -> FloatArray:
    """(columns,) roots that pass both with probability DETECTION_POWER; `detected`, those that are detected so often.

    A root s is detected with probability Phi(z + s - detected), Phi(z) = DETECTION_POWER, and helps to predict by s / 2
    standard errors, give or take one, of which it needs MIN_GAIN; each by a chance of its own.
    """
    z = float(special.ndtri(DETECTION_POWER))
    low = np.maximum(detected, 2 * (rules.MIN_GAIN + z))
    high = low + _SURELY
    for _ in range(_HALVINGS):
        s = 0.5 * (low + high)
        with np.errstate(invalid="ignore"):  # of what no size shows
            passes = special.ndtr(z + s - detected) * special.ndtr(s / 2 - rules.MIN_GAIN) >= DETECTION_POWER
        low, high = np.where(passes, low, s), np.where(passes, s, high)
    return high


def _limits(state: SearchNode) -> FloatArray:
    """(blocks,) statistics from which on something is detected."""
    found = state.blocks
    rank = np.maximum(np.asarray(found.tests.scores.rank), 1)
    freedom = state.fit.problem.noise.freedom
    is_name = np.arange(len(rank)) < found.count
    level = rules.ALPHA_DETECT / 2 / np.where(is_name, state.family.named, state.family.generic)
    if np.isinf(freedom):
        return np.asarray(special.chdtri(rank, level))
    return np.asarray(rank * special.fdtri(rank, freedom, 1 - level))


def _sizes(
    name: Hypothesis, length: FloatArray, root: FloatArray, core: _core.RobotModel
) -> Iterable[tuple[str, float]]:
    """Parameter and size, of those that the fit does not absorb and that an arm may have.

    A column that is nearly nothing, such as the compliance of an axis that only a tool's offset loads, promises
    nothing: it would take a size that no arm has, and the real centres of mass make another column of it.
    """
    if name.traits.is_wave:  # of any phase
        yield f"amplitude_rad of {name.variant or 'the wave'}", float(np.mean(root) / np.sqrt(np.mean(length**2)))
        return
    (effect,) = build_effects([name.entry], core)
    for parameter, own, at in zip(effect.parameters, length, root, strict=True):
        if np.isfinite(at) and at <= rules.MAX_PLAUSIBLE_SIZE * parameter.sigma * own:
            value = from_si(float(at / own), edge_unit(parameter, geometry=False))
            yield edge_name(parameter, geometry=False), value


def ranking(search: Search, best: SearchNode) -> list[RankedHypothesis]:
    """Names by what each alone explains over the calibrated geometry, and why it is not given."""
    start = search.start
    found = start.blocks
    scores = found.tests.scores
    statistic, rank = np.asarray(scores.statistic)[: found.count], np.asarray(scores.rank)[: found.count]
    misfit = max(start.fit.remaining - start.fit.freedom, 1.0)
    given = {name.key for name in best.names}
    estimate = np.asarray(found.tests.estimate)
    first = np.concatenate([[0], np.cumsum(found.sizes)])
    core = start.fit.problem.start.model.robot
    out: list[RankedHypothesis] = []
    seen: set[tuple[str, str]] = set()
    for i in np.argsort(-found.worth(statistic, rank, np.arange(found.count)), kind="stable"):
        name = found.names[i]
        if rank[i] == 0 or name.key in seen:
            continue
        if len(out) >= RANKING_LENGTH:
            break
        seen.add(name.key)
        (effect,) = build_effects([{k: v for k, v in name.entry.items() if k != "corner"}], core)
        values = {
            edge_name(p, geometry=False): from_si(float(v), edge_unit(p, geometry=False))
            for p, v in zip(effect.parameters, estimate[first[i] : first[i + 1]], strict=True)
        }
        share = float(np.clip((statistic[i] - rank[i]) / misfit, 0.0, 1.0))
        snr = float(np.sqrt(statistic[i]))
        out.append(RankedHypothesis(name.label, snr, share, values, _because(search, int(i), given)))
    return out


def _because(search: Search, index: int, given: set[tuple[str, str]]) -> Because:
    start = search.start
    name = start.blocks.names[index]
    if name.key in given:
        return Because(Reason.GIVEN)
    known = search.seen.get((repr(name),))
    if known is not None and known.impossible:
        return Because(Reason.IMPOSSIBLE)
    if known is not None and known.is_tested:
        p, found = known.p_values, known.blocks
    else:
        left = start.blocks.tests.given([index])
        p = p_values(np.asarray(left.statistic), np.asarray(left.rank), start.fit.problem.noise.freedom)
        found = start.blocks
    if start.p_values[index] * start.family.named > rules.ALPHA_NAMED:
        return Because(Reason.NOT_SIGNIFICANT)
    least = int(np.argmin(p))
    family = start.family.named if least < found.count else start.family.generic
    if p[least] * family > rules.ALPHA_NAMED:
        return Because(Reason.NOT_NEEDED)
    return Because(Reason.LEAVES_MORE, min(1.0, float(p[least] * family)), subjects=(found.label(least),))


def confusion(search: Search) -> tuple[list[CauseLabel], FloatArray]:
    """The names that explain most over the calibrated geometry, and the correlation of each pair."""
    found = search.start.blocks
    statistic = np.asarray(found.tests.scores.statistic)[: found.count]
    chosen: list[int] = []
    for i in np.argsort(-statistic, kind="stable"):
        if statistic[i] > 0 and all(found.names[i].key != found.names[k].key for k in chosen):
            chosen.append(int(i))
        if len(chosen) == CONFUSION_LENGTH:
            break
    return [found.names[i].label for i in chosen], np.asarray(found.tests.correlation(chosen, chosen))
