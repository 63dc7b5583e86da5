# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes of error in a camera or a board rather than the arm: wrong values in the cell file.

Corners r (m,) [px] of geometry, cameras and boards fitted have the covariance sigma^2 V, where in each row

    V = 1 + k^2 G G^T

G = dr/dq being the levers of the joints and k their repeatability over sigma (`postures`). A cause is a block of
columns H beside those of the fit J; by it the likelihood, at the best k of each, rises by

    gain = 2 (l(J, H) - l(J)),   l = -1/2 (log det V + |r - J a - H b|^2_V / sigma^2 + |a|^2_prior).

Geometry is held near nominal by its plausible sizes: a board that is too large looks like an arm that is too large in
every length, which is far less likely. All corners of a picture share one error of its joints, so that what differs
between them shows lens and board alone. Each effect of the arm is tried in the same way.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from fastcal.arrays import FloatArray
from fastcal.calibration.unknowns import CORNERS
from fastcal.diagnosis import rules
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Finding, NamedValue
from fastcal.diagnosis.rig_library import RigCause, rig_causes
from fastcal.diagnosis.rig_likelihood import Block, Corners, Likelihood
from fastcal.diagnosis.rig_steps import joint_steps, placement_steps
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import has_rig
from fastcal.robot.robot import Robot

_ROUNDS = 4  # of setting a cause's numbers and fitting again
_SETTLED = 0.05  # standard deviations
_MOST_SHOWN, _NOT_NIL = 9, 3.0  # numbers of a cause, and standard deviations from which on one of more is shown


def found_rig_causes(
    robot: Robot, data: Dataset, names: Sequence[Hypothesis], excluded: Collection[str] = (), threads: int = 1
) -> tuple[Robot, list[Finding]]:
    """The cell with all in it that is wrong with its cameras and boards, and the findings; the largest first.

    A cause must be no chance, lead every effect of the arm in `names` and predict held-out pictures better.

    Args:
        robot: With its cameras and boards.
        data: What was measured, pictures in their rows.
        names: Effects of the arm that may be what is missing.
        excluded: Names that are not to be given, EFFECT or EFFECT@OWNER.
        threads: Cores.
    """
    findings: list[Finding] = []
    if CORNERS not in data.kinds or not has_rig(robot.description):
        return robot, findings
    seen = data.select(np.isfinite(data.observed[CORNERS]).any(axis=1))
    causes = [c for c in rig_causes(robot, seen) if not {c.effect, c.label} & set(excluded)]
    while True:
        found = _leading(robot, seen, causes, names, excluded, threads)
        if found is None:
            break
        cause, robot, finding = found
        findings.append(finding)
        causes = [c for c in causes if c is not cause and not _holds(cause, c)]
    return robot, findings


def _leading(
    robot: Robot,
    data: Dataset,
    causes: Sequence[RigCause],
    names: Sequence[Hypothesis],
    excluded: Collection[str],
    threads: int,
) -> tuple[RigCause, Robot, Finding] | None:
    """The cause that leads all others, the robot with it, and the finding; None where none does."""
    corners = Corners(robot, data, causes, threads)
    steady = Likelihood(corners, list(corners.blocks.values()))
    steps = placement_steps(corners, robot, data, steady, steady.best([]), threads)
    offered = corners.blocks | {c: block for c, block in steps.items() if not {c.effect, c.label} & set(excluded)}
    if not offered:
        return None
    causes, blocks = list(offered), list(offered.values())
    likelihood = Likelihood(corners, blocks, sigma=steady.sigma)
    without = likelihood.best([]).cost
    gain = np.array([without - likelihood.best([i]).cost for i in range(len(causes))])
    first, near = leading(causes, gain)
    cause = causes[first]
    tried = len(names) + sum(other.looked for other in causes)
    p = chance(gain[first], len(cause.names), tried)
    if p > rules.ALPHA_RIG:
        return None
    of_the_arm = [block for name in names if (block := corners.effect(name)) is not None]
    of_the_arm += joint_steps(corners, data, cause) if cause.at else []
    least = gain[first] - cause.by_chance - rules.RIG_LEAD
    if any(_above_chance(corners, block, without, likelihood.sigma) > least for block in of_the_arm):
        return None
    share, error, stability = _held_out(corners, blocks, first, likelihood.sigma)
    if share <= 0:
        return None
    equivalents = tuple((causes[i].effect, causes[i].owner) for i in near)
    free = likelihood.unheld()
    alone = free.best([]).cost - free.best([first]).cost
    limits = []
    if equivalents or chance(alone, len(cause.names), tried) > rules.ALPHA_RIG:
        limits.append(Because(Reason.EQUIVALENTS))
    if share < rules.GRADE_A_GAIN * error:
        limits.append(Because(Reason.NOT_HELD_OUT))
    mended, values, std = _mended(robot, data, cause, threads)
    finding = Finding(
        cause.effect,
        cause.owner,
        "B" if limits else "A",
        _shown(cause, values, std),
        float(np.sqrt(gain[first])),
        p,
        equivalents,
        (share, error),
        stability,
        tuple(limits),
    )
    return cause, mended, finding


def _shown(cause: RigCause, values: FloatArray, std: FloatArray) -> dict[str, NamedValue]:
    """The numbers of a cause; of many, those that are not 0: the model has them all."""
    named = {name: NamedValue(*of) for name, *of in zip(cause.names, values.tolist(), std.tolist(), strict=True)}
    if cause.at:
        return {name: NamedValue(value, None) for name, value in cause.at} | named
    if len(named) <= _MOST_SHOWN:
        return named
    return {name: of for name, of in named.items() if abs(of.value) > _NOT_NIL * (of.std or 0.0)} or named


def leading(causes: Sequence[RigCause], gain: FloatArray) -> tuple[int, list[int]]:
    """The cause that gains most above what its numbers gain by chance, and those that gain about as much.

    One that holds another as a special case comes first only where its further numbers lead too, and is no rival of it.
    """
    above = gain - np.array([cause.by_chance for cause in causes])
    first = int(np.argmax(above))
    for i, cause in enumerate(causes):
        if _holds(causes[first], cause) and above[first] - above[i] < rules.RIG_LEAD:
            first = i
            break
    near = [
        i
        for i, cause in enumerate(causes)
        if i != first and above[first] - above[i] < rules.RIG_LEAD and not _holds(cause, causes[first])
    ]
    return first, near


def _holds(cause: RigCause, other: RigCause) -> bool:
    return (cause.holds, cause.owner) == (other.effect, other.owner)


def chance(gain: float, numbers: int, tried: int) -> float:
    """Of the best of so many names to gain so much by noise alone."""
    return min(1.0, float(stats.chi2.sf(max(gain, 0.0), numbers)) * tried)


def _above_chance(corners: Corners, block: Block, without: float, sigma: float) -> float:
    """What one more block gains, less what its columns gain by chance."""
    with_it = Likelihood(corners, [block], sigma=sigma).best([0])
    return float(without - with_it.cost - block.columns.shape[1])


def _held_out(corners: Corners, blocks: Sequence[Block], first: int, sigma: float) -> tuple[float, float, float]:
    """By how much squares of held-out pictures are lower with a cause, its standard error; how often it comes first."""
    rows = np.unique(corners.row)
    shares, firsts = [], 0
    for fold in range(rules.FOLDS):
        held = rows[fold :: rules.FOLDS]
        train = Likelihood(corners, blocks, np.setdiff1d(rows, held), sigma)
        test = Likelihood(corners, blocks, held, sigma)
        fits = [train.best([i]) for i in range(len(blocks))]
        own, none = fits[first], train.best([])
        # Weighed alike: else what is missing passes for noise of the joints.
        with_it, without = test.squares([first], own.change, own.k), test.squares([], none.change, own.k)
        shares.append(1 - with_it / without)
        firsts += (
            int(np.argmin([of.cost + block.columns.shape[1] for of, block in zip(fits, blocks, strict=True)])) == first
        )
    return float(np.mean(shares)), float(np.std(shares, ddof=1) / np.sqrt(rules.FOLDS)), firsts / rules.FOLDS


def _mended(robot: Robot, data: Dataset, cause: RigCause, threads: int) -> tuple[Robot, FloatArray, FloatArray]:
    """The robot with the numbers of a cause as the corners want them, these changes, and their standard deviations."""
    values, std = np.zeros(len(cause.names)), np.zeros(len(cause.names))
    for _ in range(_ROUNDS):
        corners = Corners(cause.of(robot, values), data, [cause], threads)
        found = Likelihood(corners, [replace(corners.blocks[cause], away=values)]).best([0])
        change, std = found.change[corners.J.shape[1] :], found.std
        values = values + change
        if (np.abs(change) < _SETTLED * std).all():
            break
    return cause.of(robot, values), values, std
