# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A search, repeated if its result changes the noise estimate or the waves that it started from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fastcal.diagnosis import periodic, rivals, rules, scans
from fastcal.diagnosis.decorrelation import joint_share
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.noise import NoiseLevel, with_estimated_noise
from fastcal.diagnosis.noise_scales import rms_sigma
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.variants import effect_has_moment
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of, sigma_field, tables_of

# Common noise to begin with where the data claim none [m, rad]; it is estimated from there on.
NOISE_GUESS = 1e-4

# Share of the variance below which the noise was taken too large and the search begins again.
RESTART_BELOW = 0.85
# Searches with a new noise or new waves at most.
MAX_SEARCHES = 3


def claimed(data: Dataset, sigma: float | None) -> Noise:
    """The noise to begin with: as the data or the user claim it, else a guess."""
    first = sigma if sigma is not None else (0.0 if data.sigma_position is not None else NOISE_GUESS)
    angles = {table.name for table in tables_of(data.q.shape[1]).values() if table.quantity == "angle"}
    claims = {sigma_field(kind) for kind in kinds_of(data)} & angles
    turn = 0.0 if claims and all(data.table(claim) is not None for claim in claims) else NOISE_GUESS
    return Noise((first, turn, first))


def searched(
    problem: Problem,
    level: NoiseLevel,
    sigma: float | None,
    notify: Callable[[str], None],
    *,
    steps_in_noise: bool = True,
) -> tuple[rivals.Rivals, SearchNode, NoiseLevel]:
    """The rivals of a search, its best set, and the noise that this shows; begun again where that differs from before.

    Where names are hopeless, none is searched for, and once more with the waves of the scan among them; they are not
    where the search before found a set that suffices. A search that was cut short begins again once, where a scan names
    what it lacked.

    Of rows without times, steps are looked for in what passes for noise too (`steps_in_noise`): noise that was steps
    remembers nothing once they are named; what still does would have been cut into steps by their moments.
    """
    given, known = problem, level
    plain = rivals.Rivals(Search(problem, notify))
    was_hopeless = was_cut_short = has_sufficed = False
    for round_ in range(MAX_SEARCHES):
        again: Problem | None
        if not has_sufficed and plain.names_are_hopeless:
            best = plain.search.start
            more = [] if was_hopeless else _scanned(plain.search, best)
            again = _with_names(problem, more) if more else None
            was_hopeless = True
        else:
            best = _best(plain.search.grow())
            has_sufficed = best.suffices
            again, level = _again(plain.search, best, sigma, steps_in_noise=steps_in_noise)
            if plain.search.is_cut_short:
                has_more = again is not None and len(again.names) > len(problem.names)
                again = again if has_more and not was_cut_short else None
                was_cut_short = True
        if again is None or round_ == MAX_SEARCHES - 1:
            break
        plain = plain.again(again)
        problem = again
    if steps_in_noise and _cuts_memory_into_steps(plain.search, best):
        return searched(given, known, sigma, notify, steps_in_noise=False)
    return plain, best, level


def _cuts_memory_into_steps(search: Search, best: SearchNode) -> bool:
    """Does the noise beside steps of rows without times still have a memory?"""
    has_steps = any(effect_has_moment(name.effect) for name in best.names)
    return has_steps and search.problem.data.time is None and search.problem.noise.memory > 0


def _again(
    search: Search, best: SearchNode, sigma: float | None, *, steps_in_noise: bool
) -> tuple[Problem | None, NoiseLevel]:
    """The noise as the set that was found shows it.

    With a new start where it shows further names, such as waves of other orders, markedly less noise than there seemed
    to be, or a memory or joints that repeat badly, which the search did not allow for or which are none; else None.
    """
    problem = search.problem
    more = _further_names(search, best, steps_in_noise=steps_in_noise)
    begun = replace(claimed(problem.data, sigma), scale=problem.noise.scale)
    again = replace(_with_names(problem, more), noise=begun)
    calmer, level = with_estimated_noise(again, best.fit, sigma)
    changes = any(of(calmer.noise) != of(problem.noise) for of in (_follows, _repeats_badly))
    return (calmer if more or changes or _is_calmer(calmer, problem) else None), level


def _further_names(search: Search, best: SearchNode, *, steps_in_noise: bool) -> list[Hypothesis]:
    """Names that the library does not hold, where a set leaves something: beyond it, and beyond none of its names.

    Where nothing is left, waves are looked for all the same, since blocks without a name are too smooth for most; and
    where a name follows time or heat, others that do: the likelier law is the one that is given.
    """
    if best.suffices:
        alone = scans.without_a_block(timed=search.problem.data.time is not None or not steps_in_noise)
        fine = [*periodic.scan(best), *scans.scan(best, among=alone)]
        return scans.with_further_steps(search, best, fine) + scans.rivals_of_slow(search, best)
    found = _scanned(search, best)
    there = {name.key for name in found}
    return found + [name for name in scans.scan(search.start) if best.names and name.key not in there]


def _scanned(search: Search, best: SearchNode) -> list[Hypothesis]:
    """All that scans find beyond a set."""
    return scans.with_further_steps(search, best, [*periodic.scan(best), *scans.scan(best)])


def _with_names(problem: Problem, more: list[Hypothesis]) -> Problem:
    """A problem with more names; of what stepped more than once, the steps at their own moments are its only ones."""
    twice = {name.key for name in more if name.has_its_moment}
    return replace(problem, names=[*(name for name in problem.names if name.key not in twice), *more])


def _is_calmer(now: Problem, before: Problem) -> bool:
    """Is the noise of one problem markedly below that of another one?"""
    squares = [rms_sigma(of) ** 2 + joint_share(of) ** 2 for of in (now, before)]
    return squares[0] < RESTART_BELOW * squares[1]


def _follows(noise: Noise) -> bool:
    return noise.follows


def _repeats_badly(noise: Noise) -> bool:
    return noise.repeatability > 0


def _best(levels: list[list[SearchNode]]) -> SearchNode:
    """The most likely set that suffices, unless one that leaves something is still likelier by DECISIVE_BIC."""
    likeliest = min((state for level in levels for state in level if not state.impossible), key=lambda s: s.bic)
    likely = sorted(levels[-1], key=lambda s: s.bic)
    enough = next((state for state in likely if state.suffices), likeliest)  # to ask of each takes long
    return likeliest if likeliest.bic < enough.bic - rules.DECISIVE_BIC else enough
