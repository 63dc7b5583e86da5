# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Errors that repeat with the turns of joints: a scan of all orders, and whether many waves together are the cause.

Of a wave with unknown order the score statistic is scanned over orders, half a resolution apart; the number of
independent orders multiplies the p value (trials factor; E. Gross, O. Vitells, "Trial factors for the look elsewhere
effect", 2010).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.columns import column_lengths
from fastcal.calibration.parallel import each
from fastcal.diagnosis import rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.held_out import fold_of
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import is_excluded
from fastcal.diagnosis.projection import score_tests
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import harmonics
from fastcal.effects.entries import curve_of, effect_names, traits_of
from fastcal.place import joint_name, place_of

if TYPE_CHECKING:
    from fastcal.diagnosis.problem import Problem
    from fastcal.diagnosis.search import SearchNode


# Chi square by which a wave of any other order must fit worse for grade A, up to FINEST_ORDER: five standard
# deviations. Over a grid of positions other orders are the same wave, to the last digit.
OTHER_ORDER_LOSS = 25.0
# Highest order of which each is scored [cycles a turn]; finer ones the periodogram looks for.
MAX_ORDER = 40.0
# Share of the mean square of held-out rows that many waves may leave to be the cause.
MAX_WAVES_SHARE = 0.5
# Share of the likeliest name's worth that each that a scan adds must have: the others are its shadows.
SCANNED_SHARE = 0.5

# Highest order that the periodogram looks for [cycles a turn]: motor turns behind usual reductions, interpolation of
# encoders.
FINEST_WAVE = 400.0
# Peaks of the scan that are taken from each joint.
PEAKS_PER_JOINT = 3
# An order this near to a whole one is whole, and any other unless it explains so much more chi square.
WHOLE_ORDER_WITHIN = 0.15
BROKEN_ORDER_GAIN = 6.0
# Orders that are tried from one step of the scan before a peak to one behind it.
ORDERS_OF_A_STEP = 41
# Waves of a model that errs by many.
MAX_WAVES = 24
_ORDERS_AT_ONCE = 64  # that are scored together, for the memory that their columns take
_ROWS_AT_ONCE = 512  # of a periodogram
_MAY_SHOW = 0.6  # of what is significant, between two orders and beside what a fit absorbs
_PEAK_SHARE = 0.8  # of a peak that the nearest order of a scan has at least: it is an eighth of a lobe away at most
_MOST_ALIKE = 12  # orders that are looked at more closely: one is enough


def is_periodic(name: Hypothesis) -> bool:
    """Is it a piece of what a curve over the joint's position would do as a whole: a wave, a slope?"""
    return name.effect in traits_of(curve_of("joint")).generalizes


def fine_looks(problem: Problem, name: Hypothesis) -> float:
    """How many orders of all joints were looked at before a wave beyond MAX_ORDER was found; 0 of any other name."""
    if not is_periodic(name) or float(name.entry.get("order", 0.0)) <= MAX_ORDER:
        return 0.0
    joint = place_of(name.owner).index
    return float(len(_spaced(float(np.ptp(problem.kept.q[:, joint])), FINEST_WAVE)) * problem.kept.q.shape[1])


def scan(state: SearchNode) -> list[Hypothesis]:
    """Waves of orders beyond the library's that are significant at a fit, the highest peaks of each revolute joint."""
    problem = state.fit.problem
    waves_of_a_joint = [effect for effect in effect_names() if traits_of(effect).is_wave]
    found: list[Hypothesis] = []
    for joint, new in enumerate(each(_orders(state), range(problem.start.robot.joint_count))):
        for effect in waves_of_a_joint:
            bare = {"effect": effect, "owner": joint_name(joint)}
            if not is_excluded(effect, bare["owner"], problem.excluded):
                found += harmonics(bare, problem.start.robot, problem.kept, new)
    there = {repr(name) for name in problem.names}
    return [name for name in found if repr(name) not in there]


def _orders(state: SearchNode) -> Callable[[int], list[float]]:
    """The orders that `scan` finds of a joint."""
    problem = state.fit.problem
    kinds = problem.start.robot.joint_types
    scores_of = [_scored(state, joint) for joint in range(len(kinds))]

    def found(joint: int) -> list[float]:
        span = float(np.ptp(problem.kept.q[:, joint]))
        if kinds[joint] != "revolute" or span <= 0:
            return []
        scored = scores_of[joint]
        orders = _spaced(span, MAX_ORDER)
        scores = scored(orders)
        trials = len(orders) * len(kinds) / 2
        peaks = _peaks(orders, np.asarray(scores.statistic), np.asarray(scores.rank), problem.noise.freedom, trials)
        step = float(orders[1] - orders[0]) if len(orders) > 1 else 0.0
        exact = [order if order == round(order) else _refined(order, step, scored) for order in peaks]
        # Of a wave that is too fine for it this scan sees side lobes; of one that is not, the fine scan sees aliases.
        exact += _fine_orders(state, joint, scored, above=float(np.max(scores.statistic)) if exact else 0.0)
        return [order for order in dict.fromkeys(exact) if order not in rules.WAVE_ORDERS]

    return found


def _fine_orders(
    state: SearchNode, joint: int, scored: Callable[[FloatArray], _core.BlockScores], above: float = 0.0
) -> list[float]:
    """Significant orders beyond MAX_ORDER of a statistic `above` some other: the highest peaks of the periodogram.

    For waves as fine as these nearly all is beyond what the fit absorbs, so |sum_i w_i exp(i n q_i)|^2 over the rows
    finds their places; w_i is what a row leaves along its joint. They are held against what would be left: beside a
    misfit that is no noise, one of thousands of orders explains much of it.
    """
    at = state.fit
    q, turn = at.problem.kept.q[:, joint], state.blocks.frames[joint_name(joint)][:, 0]
    span = float(np.ptp(q))
    orders = _spaced(span, FINEST_WAVE)
    orders = orders[orders > MAX_ORDER]
    if len(orders) < 3:
        return []
    row = at.whitened[2]
    row = row[row >= 0]
    left = at.beyond(at.whitened[1][:, np.newaxis])[: len(row), 0]
    along = np.asarray(np.bincount(row, turn * left, len(q)), dtype=np.float64)
    step = float(orders[1] - orders[0])
    power = _periodogram(q, along, orders)
    inner = np.r_[-np.inf, power, -np.inf]
    trials = len(orders) * at.problem.start.robot.joint_count
    # Of a wave that the fit absorbs nothing of; one that is far from significant so is not scored.
    alone = 2 * power / max(float(turn @ turn), 1e-300)
    enough = _MAY_SHOW * 2 * np.log(trials / rules.ALPHA_WAVE)
    top = np.flatnonzero((power >= inner[:-2]) & (power >= inner[2:]) & (alone > enough))
    found: dict[float, float] = {}
    for i in top[np.argsort(-power[top], kind="stable")][:PEAKS_PER_JOINT]:
        order = _refined(float(orders[i]), step, scored)
        scores = scored(np.array([order]))
        statistic = np.asarray(scores.statistic)
        unexplained = np.maximum((at.remaining - statistic) / at.freedom, 1.0)
        p = p_values(statistic / unexplained, np.asarray(scores.rank), at.problem.noise.freedom)[0]
        if p * trials < rules.ALPHA_WAVE and statistic[0] > above:
            found[order] = float(statistic[0])
    return [order for order, value in found.items() if value > SCANNED_SHARE * max(found.values())]


def _periodogram(q: FloatArray, along: FloatArray, orders: FloatArray) -> FloatArray:
    """|sum_i along_i exp(i n q_i)|^2 of evenly spaced orders n, each wave from the one before by one product.

    In single precision: a thousand products lose a thousandth of a wave, and peaks are scored anew.
    """
    total = np.zeros(len(orders), dtype=np.complex64)
    for first in range(0, len(q), _ROWS_AT_ONCE):
        part = q[first : first + _ROWS_AT_ONCE]
        waves = np.empty((len(orders), len(part)), dtype=np.complex64)
        waves[0] = np.exp(1j * orders[0] * part)
        waves[1:] = np.exp(1j * (orders[1] - orders[0]) * part)
        total += np.cumprod(waves, axis=0) @ along[first : first + _ROWS_AT_ONCE].astype(np.float32)
    return np.asarray(np.abs(total.astype(np.complex128)) ** 2)


def _spaced(span: float, highest: float) -> FloatArray:
    """Orders half a resolution apart of which half a period fits into a range [rad]."""
    orders = np.arange(1.0, highest, np.pi / (2 * span))
    return orders[orders * span > np.pi]


def _scored(state: SearchNode, joint: int) -> Callable[[FloatArray], _core.BlockScores]:
    """Score tests of waves of a joint by their orders, at a fit."""
    problem, Q = state.fit.problem, state.fit.basis
    q, turn = problem.kept.q[:, joint], state.blocks.frames[joint_name(joint)]
    _A, r, row = state.fit.whitened
    row = row[row >= 0]  # numbers that were measured come before priors

    def scored(orders: FloatArray) -> _core.BlockScores:
        angle = np.outer(q, orders)
        C = np.zeros((len(r), 2 * len(orders)))
        measured = C[: len(row)]
        measured[:, 0::2], measured[:, 1::2] = turn * np.sin(angle)[row], turn * np.cos(angle)[row]
        measured[...] = decorrelated(problem, measured, row)
        return score_tests(Q, C, r, [2] * len(orders)).scores

    return scored


def orders_alike(base: SearchNode, name: Hypothesis) -> tuple[float, ...]:
    """Other orders that do as well as that of a wave, at the fit without it: the lowest first, a dozen at most.

    Over positions a step s apart the orders n and k 2 pi / s +- n are one and the same wave. Orders within the
    resolution of the joint's range, 2 pi over it, are not others.
    """
    joint, own = place_of(name.owner).index, float(name.entry["order"])
    span = float(np.ptp(base.fit.problem.kept.q[:, joint]))
    orders = _spaced(span, max(rules.FINEST_ORDER, 2 * own))
    scored, step = _scored(base, joint), np.pi / (2 * span)

    def best(order: float) -> tuple[float, float]:
        """The highest statistic within a step of an order, and where."""
        width = step
        for _ in range(2):
            near = np.linspace(max(order - width, 1.0), order + width, ORDERS_OF_A_STEP)
            statistic = np.asarray(scored(near).statistic)
            order = float(near[int(np.argmax(statistic))])
            width = float(near[1] - near[0])
        return float(statistic.max()), order

    enough = best(own)[0] - OTHER_ORDER_LOSS
    parts = np.array_split(orders, max(1, len(orders) // _ORDERS_AT_ONCE))
    statistic = np.concatenate([np.asarray(scored(part).statistic) for part in parts])
    inner = np.r_[-np.inf, statistic, -np.inf]
    top = (statistic >= inner[:-2]) & (statistic >= inner[2:]) & (statistic > _PEAK_SHARE * enough)
    apart = top & (np.abs(orders - own) > 2 * np.pi / span)
    likeliest = np.flatnonzero(apart)[np.argsort(-statistic[apart], kind="stable")][:_MOST_ALIKE]
    refined = [best(float(orders[i])) for i in likeliest]
    return tuple(sorted(order for height, order in refined if height >= enough))


def slow_waves_alike(base: SearchNode, name: Hypothesis, statistic: float) -> tuple[float, ...]:
    """Whole orders with which a wave does as well as another function of a joint's own position, without it.

    Of a wave slower than half a period in the joint's range a short range shows a slope: so does a wrong ratio.
    """
    if name.traits.is_wave or name.traits.depends_on != ("q{n}",):
        return ()
    joint = place_of(name.owner).index
    if base.fit.problem.start.robot.joint_types[joint] != "revolute":
        return ()
    span = float(np.ptp(base.fit.problem.kept.q[:, joint]))
    orders = np.arange(1.0, max(np.pi / max(span, 1e-3), 1.0) + 1)[:_MOST_ALIKE]
    alike = np.asarray(_scored(base, joint)(orders).statistic) >= statistic - OTHER_ORDER_LOSS
    return tuple(orders[alike].tolist())


def _peaks(
    orders: FloatArray, statistic: FloatArray, rank: NDArray[np.int32], freedom: float, trials: float
) -> list[float]:
    """Orders at the highest significant local maxima, whole where they may be."""
    p = p_values(statistic, rank, freedom)
    inner = np.r_[-np.inf, statistic, -np.inf]
    top = (statistic >= inner[:-2]) & (statistic >= inner[2:]) & (p * trials < rules.ALPHA_WAVE)
    out: list[float] = []
    for i in np.flatnonzero(top)[np.argsort(-statistic[top], kind="stable")][:PEAKS_PER_JOINT]:
        order = float(orders[i])
        whole = float(np.clip(np.round(order), 1, None))
        near = float(np.interp(whole, orders, statistic))
        is_whole = abs(order - whole) < WHOLE_ORDER_WITHIN or statistic[i] - near < BROKEN_ORDER_GAIN
        chosen = whole if is_whole else round(order, 2)
        if chosen not in out:
            out.append(chosen)
    return out


def _refined(order: float, step: float, scored: Callable[[FloatArray], _core.BlockScores]) -> float:
    """The order of the highest statistic within a step of the scan about a peak, whole where it is nearly so."""
    near = np.linspace(max(order - step, 1.0), order + step, ORDERS_OF_A_STEP)
    best = float(near[int(np.argmax(np.asarray(scored(near).statistic)))])
    return float(round(best)) if abs(best - round(best)) < WHOLE_ORDER_WITHIN else round(best, 2)


def many_waves(start: SearchNode, most: int) -> list[int]:
    """Indices of all significant waves, where the errors are those of many waves; none where they are not.

    The first effects that a forward selection picks must all be periodic, more than the `most` that a search of sets
    could hold, and rows that were held out must be predicted by the waves.
    """
    periodic = [i for i, name in enumerate(start.blocks.names) if is_periodic(name)]
    first = forward(start, list(range(start.blocks.count)), most + 1)
    if len(first) <= most or not set(first) <= set(periodic):
        return []
    chosen = forward(start, periodic, MAX_WAVES)
    return chosen if _held_out_share(start, chosen) <= MAX_WAVES_SHARE else []


def forward(state: SearchNode, among: list[int], most: int) -> list[int]:
    """Blocks in the order in which each explains most beyond those before it, while that is significant."""
    added: list[int] = []
    while len(added) < most:
        scores = state.blocks.tests.given(added)
        statistic, rank = np.asarray(scores.statistic)[among], np.asarray(scores.rank)[among]
        worth = state.blocks.worth(statistic, rank, np.array(among))
        best = int(np.argmax(worth))
        p = p_values(statistic[[best]], rank[[best]], state.fit.problem.noise.freedom)[0]
        if worth[best] <= 0 or p * state.family.named > rules.ALPHA_WAVE:
            break
        added.append(among[best])
    return added


def _held_out_share(state: SearchNode, chosen: list[int]) -> float:
    """Mean square of rows at held-out positions of a joint with the blocks, over that without: of the worst joint."""
    A, r, row = state.fit.whitened
    C = state.blocks.columns_of(chosen)
    sets = np.array([np.zeros(C.shape[1], dtype=bool), np.ones(C.shape[1], dtype=bool)])
    A, C = (values / np.where(norm > 0, norm, 1.0) for values, norm in ((A, column_lengths(A)), (C, column_lengths(C))))

    def share(owner: str) -> float:
        fold = fold_of(state.fit.problem.kept, owner).astype(np.int32)[row]
        fold[row < 0] = -1
        errors = _core.SubsetSearch(A, C, r, fold, least_norm=1e-6).of(sets).mean
        return float(errors[1] / errors[0])

    return max(each(share, sorted({state.blocks.names[i].owner for i in chosen})))
