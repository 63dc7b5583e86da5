# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Scans for parameters that a fit cannot find: the row of a jump, a period, a time constant, a lag.

Each is scanned over a grid by score tests at a fit, one projection for all; the number of looks multiplies the p value
(trials factor; E. Gross, O. Vitells 2010), and what would be left is the noise that it must stand out of: beside a
misfit that is no noise the best of hundreds of looks explains much of it. The best of each owner is refined between its
neighbours and then is a name like any other: a search begins again with it.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fastcal.arrays import FloatArray
from fastcal.calibration.change_point import find_step
from fastcal.diagnosis import periodic, rules
from fastcal.diagnosis.blocks import columns_at
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.held_out import positions
from fastcal.diagnosis.hypothesis import SLOW, Hypothesis
from fastcal.diagnosis.library import is_excluded
from fastcal.diagnosis.projection import score_tests
from fastcal.diagnosis.step_or_condition import is_a_condition, is_placed
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import (
    effect_has_moment,
    from_moment,
    from_position,
    from_the_beginning,
    jumps_with_posture,
    moment_of,
    order_of_rows,
    rows_between_steps,
    scanned,
    with_number,
)
from fastcal.effects.entries import effect_names, effect_owners, position_option, traits_of
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_name, source_of
from fastcal.units import to_si

if TYPE_CHECKING:
    from fastcal.diagnosis.problem import Problem
    from fastcal.diagnosis.search import Search, SearchNode


# Names that a scan may add.
SCANNED_NAMES = 8
# Steps of one thing at most: what moves more often is a matter of the rows' labels, or no step.
MOST_STEPS = 4
_AT_ONCE = 128  # names that are scored together, for the memory that their columns take
_LOADS_APART = 4.0  # loads of a form that are tried, above and below the first
_ROUNDS, _BETWEEN = 2, 9  # of refining, and numbers that each tries between two neighbours


def scan(state: SearchNode, *, among: Container[str] | None = None) -> list[Hypothesis]:
    """The scanned effects that are significant at a fit, at their best number; the likeliest of their owners.

    With `among` those of them alone.
    """
    grid = [name for name in _grid(state) if among is None or name.effect in among]
    if not grid:
        return []
    worth, p = _weighed(state, grid)
    found: list[tuple[float, Hypothesis]] = []
    for _key, group in groupby(range(len(grid)), key=lambda i: grid[i].key):
        own = list(group)
        best = max(own, key=lambda i: worth[i])
        if p[best] * len(grid) < rules.ALPHA_SCAN:
            name = refined(grid[best], [grid[i] for i in own], state)
            if not is_a_condition(name, state.fit, len(grid)) and _is_of_positions(name, state.fit, len(grid)):
                found.append((float(worth[best]), name))
    likeliest = sorted(found, key=lambda pair: -pair[0])[:SCANNED_NAMES]
    enough = periodic.SCANNED_SHARE * max((value for value, _ in likeliest), default=0.0)
    return [name for value, name in likeliest if value >= enough]


def _is_of_positions(name: Hypothesis, at: Fit, tried: int) -> bool:
    """Is a jump with the position of a joint significant where each position, and not each row, is one witness?

    Rows that share a position share what is wrong with them. With the whitened residuals r and the jump's column c,
    less what the fit takes of it, b = c^T r / c^T c has the variance sum_g (c_g^T (r_g - c_g b))^2 / (c^T c)^2 over the
    positions g (K.-Y. Liang and S. Zeger 1986), and b over its root Student's distribution of as many, less one.
    """
    if not jumps_with_posture(name.effect):
        return True
    _, r, row = at.whitened
    c = columns_at(at, [name]).values[:, 0]
    c = c - at.basis @ (at.basis.T @ c)
    measured, size = row >= 0, float(c @ c)
    where = positions(at.problem.kept, joint_name(source_of(name.owner).index))[row[measured]]
    b = float(c @ r) / size
    witness = np.bincount(where, (c * (r - b * c))[measured])
    deviation = float(np.linalg.norm(witness)) / size
    freedom = len(np.unique(where)) - 1
    return bool(2 * stats.t.sf(abs(b) / deviation, freedom) * tried < rules.ALPHA_SCAN)


def without_a_block(*, timed: bool) -> frozenset[str]:
    """Scanned effects that no block without a name shows, since these are smooth: waves of an instrument, and steps.

    Steps of rows with a time are of the library; those of others may have passed for noise.
    """
    every = ((effect, traits_of(effect)) for effect in effect_names() if _is_scanned(effect, timed=timed))
    return frozenset(e for e, t in every if SLOW.isdisjoint(t.depends_on) or (not timed and effect_has_moment(e)))


def with_further_steps(search: Search, best: SearchNode, found: list[Hypothesis]) -> list[Hypothesis]:
    """Names that a scan found, and of each thing that stepped, in them or in a set, all its steps where it did twice.

    A reflector that was reseated twice, a tripod that was knocked twice: each step is then a name at its own moment.
    One more at a time, and each once more beside the others, since the first was found where two were. More than
    MOST_STEPS are a staircase that stands for what moves slowly. Of a joint's zero one step alone is looked for: heat
    creeps, and few stairs are enough to follow it.
    """
    names = [name for name in (*best.names, *found) if _may_step_again(name)]
    every: list[Hypothesis] = []
    for name in names:
        state = best if name in best.names else search.state((*best.names, name), best)
        steps = [replace(name, has_its_moment=True)]
        while len(steps) <= MOST_STEPS and (more := _next_step(name, state)) is not None:
            steps.append(more)
            state = search.state((*state.names, more), state)
        if 1 < len(steps) <= MOST_STEPS:
            every += [_beside(step, state, search) for step in steps]
    twice = {step.key for step in every}
    return [*(name for name in found if name.key not in twice), *every]


def _may_step_again(name: Hypothesis) -> bool:
    return effect_has_moment(name.effect) and is_placed(name) and not name.has_its_moment


def _next_step(name: Hypothesis, state: SearchNode) -> Hypothesis | None:
    """A step of what `name` is of that is significant beyond a set, at its best moment."""
    problem = state.fit.problem
    grid = scanned(name.effect, name.owner, problem.start.robot, problem.kept)
    worth, p = _weighed(state, grid) if grid else (np.zeros(0), np.ones(0))
    if not len(grid) or np.min(p) * len(grid) >= rules.ALPHA_SCAN:
        return None
    step = at_best_moment(grid[int(np.argmax(worth))], state)
    others = [other for other in state.names if other.key == step.key]
    if is_a_condition(step, state.fit, len(grid)) or not _leaves_rows_between([step, *others], problem.kept):
        return None
    return replace(step, has_its_moment=True)


def _leaves_rows_between(steps: Sequence[Hypothesis], data: Dataset) -> bool:
    """Are there enough rows between any two steps? There and back around a row or two is a gross error of these."""
    return bool(np.all(rows_between_steps(steps, data) >= rules.MIN_ROWS_BESIDE_STEP))


def _beside(step: Hypothesis, state: SearchNode, search: Search) -> Hypothesis:
    """A step at the moment that is its best beside the others of a set."""
    rest = [name for name in state.names if name.label != step.label]
    free = replace(step, has_its_moment=False)
    return replace(at_best_moment(free, search.state(rest, state)), has_its_moment=True)


def rivals_of_slow(search: Search, best: SearchNode) -> list[Hypothesis]:
    """Scanned effects that explain about as much as all names of a set that follow time or heat, or more."""
    rest = [name for name in best.names if SLOW.isdisjoint(name.traits.depends_on)]
    if len(rest) == len(best.names):
        return []
    base = search.state(rest, best) if rest else search.start
    timed = search.problem.data.time is not None
    found = scan(base, among=frozenset(effect_names()) - without_a_block(timed=timed))
    worth = _weighed(base, found)[0] if found else np.zeros(0)
    gain = base.bic - best.bic
    return [name for name, value in zip(found, worth, strict=True) if value > gain - rules.DECISIVE_BIC]


def _grid(state: SearchNode) -> list[Hypothesis]:
    """All that is scanned for beyond a set: one owner after the other."""
    problem = state.fit.problem
    robot, data = problem.start.robot, problem.kept
    there = {name.key for name in (*problem.names, *state.names)}
    there |= {(entry["effect"], entry["owner"]) for entry in problem.given}
    return [
        name
        for effect in effect_names()
        if _is_scanned(effect, timed=data.time is not None)
        for owner in effect_owners(effect, robot.core)
        if (effect, owner) not in there and not is_excluded(effect, owner, problem.excluded)
        for name in scanned(effect, owner, robot, data)
    ]


def _is_scanned(effect: str, *, timed: bool) -> bool:
    """Is it no part of the library? Steps are none where no row has a time."""
    return traits_of(effect).role == "scanned" or (not timed and effect_has_moment(effect))


def _weighed(state: SearchNode, names: list[Hypothesis]) -> tuple[FloatArray, FloatArray]:
    """BIC's worth of each name at a fit, and the p value of its score test against what it would leave."""
    at = state.fit
    statistic, rank = _scores(at, names)
    left = np.maximum((at.remaining - statistic) / at.freedom, 1.0)
    searched = np.array([name.searched for name in names])
    worth = statistic - (rank + searched) * np.log(len(at.near.r) + len(at.free))
    return np.where(rank > 0, worth, -np.inf), p_values(statistic / left, rank, at.problem.noise.freedom)


def _scores(at: Fit, names: list[Hypothesis]) -> tuple[FloatArray, NDArray[np.int32]]:
    """Score statistic of each name and its rank."""
    statistic, rank = [], []
    for first in range(0, len(names), _AT_ONCE):
        columns = columns_at(at, names[first : first + _AT_ONCE])
        scores = score_tests(at.basis, columns.values, at.whitened[1], columns.sizes).scores
        statistic.append(np.asarray(scores.statistic))
        rank.append(np.asarray(scores.rank))
    return np.concatenate(statistic), np.concatenate(rank)


def refined(name: Hypothesis, grid: Iterable[Hypothesis], state: SearchNode) -> Hypothesis:
    """A name at the best number near that of the grid."""
    if effect_has_moment(name.effect) or jumps_with_posture(name.effect):
        return at_best_moment(name, state)
    option = name.traits.searched
    if option not in name.entry:
        return name
    tried = sorted({float(n.entry[option]) for n in grid if option in n.entry})
    at = tried.index(float(name.entry[option]))
    for _ in range(_ROUNDS):
        low, high = tried[max(at - 1, 0)], tried[min(at + 1, len(tried) - 1)]
        tried = np.geomspace(low, high, _BETWEEN).tolist()
        near = [with_number(name.entry, option, value) for value in tried]
        at = int(np.argmax(_scores(state.fit, near)[0]))
        name = near[at]
    return name


def at_best_moment(name: Hypothesis, state: SearchNode) -> Hypothesis:
    """A step at the moment, or the position, of all between two rows that explains most; other names as they are."""
    data, robot = state.fit.problem.kept, state.fit.problem.start.robot
    bare = name.bare
    if name.has_its_moment:
        return name
    if effect_has_moment(name.effect):
        at, _ = _best_step(state.fit, from_the_beginning(bare, data), order_of_rows(data))
        return from_moment(bare, at, data)
    if jumps_with_posture(name.effect):
        q = data.q[:, source_of(name.owner).index]
        at, _ = _best_step(state.fit, from_position(bare, -np.inf, robot), q)
        return from_position(bare, at, robot)
    return name


def _best_step(fit: Fit, always: Hypothesis, course: FloatArray) -> tuple[float, float]:
    """`find_step` along a course (N,) of the rows, of a step that `always` has before every row.

    Fewer than MIN_ROWS_BESIDE_STEP on one side are rows that are wrong, or leave others free to follow something else.
    """
    A, r, row = fit.standardized
    measured = row >= 0
    step = columns_at(fit, [always], as_measured=True).values[: int(measured.sum())]
    # Half of a jump stays on either side: a step with a shift of all rows.
    others = np.hstack([A[measured], step]) if jumps_with_posture(always.effect) else A[measured]
    return find_step(others, step, -r[measured], row[measured], course, rules.MIN_ROWS_BESIDE_STEP)


def beside_lost_rows(search: Search, best: SearchNode) -> SearchNode:
    """A set whose jumps and steps also leave the least of rows that no fit held.

    Each lies midway between two rows that are fitted. Rows next to it, whose jump nothing explained before it was
    found, may have been left out as gross: on which side of it they lie is decided by what it leaves of them.
    """
    for name in best.names:
        near = [at for at in _between_lost_rows(name, best.fit.problem) if at.label != name.label]
        if near:
            others = [other for other in best.names if other is not name]
            states = [best, *(search.state((*others, at), best) for at in near)]
            best = min(states, key=lambda state: _left_of_lost_rows(state.fit))
    return best


def _between_lost_rows(name: Hypothesis, problem: Problem) -> list[Hypothesis]:
    """The name between each two neighbours of the rows that were left out where it is, and the fitted ones there."""
    data, robot = problem.data, problem.start.robot
    if effect_has_moment(name.effect):
        course, at = order_of_rows(data), moment_of(name)
    elif jumps_with_posture(name.effect):
        joint = source_of(name.owner).index
        option, unit = position_option(robot.joint_types[joint])
        course, at = data.q[:, joint], to_si(float(name.entry[option]), unit)
    else:
        return []
    held = course[problem.used]
    low, high = held[held < at].max(initial=-np.inf), held[held >= at].min(initial=np.inf)
    lost = course[data.measured & ~problem.used & (course > low) & (course < high)]
    if len(lost) == 0 or not np.isfinite([low, high]).all():
        return []
    ends = np.unique([low, *lost, high])
    there = [
        from_moment(name.bare, middle, problem.kept)
        if effect_has_moment(name.effect)
        else from_position(name.bare, middle, robot)
        for middle in (ends[1:] + ends[:-1]) / 2
    ]
    return [replace(one, has_its_moment=name.has_its_moment) for one in there]


def _left_of_lost_rows(at: Fit) -> float:
    """Sum of squares of the rows that a fit does not hold, each GROSS_SIZE typical numbers at most."""
    whole = at.on_every_row
    _, r, row = whole.whitened
    lost = (row >= 0) & ~np.isin(whole.problem.rows[row], at.problem.rows)
    return float(np.sum(np.minimum(r[lost] ** 2, rules.GROSS_SIZE**2)))


def at_best_load(name: Hypothesis, law: str, load: str, state: SearchNode) -> Hypothesis:
    """A form with the load near its own that explains most."""
    spread = _LOADS_APART
    for _ in range(_ROUNDS):
        sizes = float(name.entry[load]) * np.geomspace(1 / spread, spread, _BETWEEN)
        near = [with_number(name.entry, load, size, law) for size in sizes]
        name = near[int(np.argmax(_scores(state.fit, near)[0]))]
        spread **= 2 / (_BETWEEN - 1)
    return name
