# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to measure next if several causes explain the data, and what a planned measurement can show."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fastcal.calibration.simulation import simulate
from fastcal.diagnosis import sensitivity, words
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import Untestable, build_library, parse_exclusions
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.reasons import CauseLabel
from fastcal.diagnosis.result import DetectableEffect
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.effects.traits import filled
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    from fastcal.design.candidates import Candidates  # the rooms of design are entered where a plan is made

# Correlation of two signatures from which on poses confuse them.
CONFUSED_CORRELATION = 0.95
# Poses of a plan at most, and the power at which it asks for no more.
PLAN_POSES = 12
PLAN_POWER = 0.99
# Random postures and levels of payload that a plan chooses from.
PLAN_CANDIDATES = 600
PLAN_PAYLOADS = 3
_SEED = 0


@dataclass(frozen=True, eq=False)
class SeparatingPlan:
    """Poses that tell the names of a set from one another.

    Attributes:
        poses: What to measure, in the order in which they help.
        power_before, power_after: Least probability that the test of a pair refuses the wrong one.
        causes: The hypotheses.
        file: Where `Diagnosis.save` writes the poses.
    """

    poses: Candidates
    power_before: float
    power_after: float
    causes: tuple[CauseLabel, ...]
    file: str = "next_poses.csv"

    @property
    def sentence(self) -> str:
        """For a person."""
        return words.plan_text(self)


def separating_plan(best: SearchNode, rivals: Sequence[Sequence[Hypothesis]]) -> SeparatingPlan | None:
    """Poses within the joint ranges and with the payloads of the data, for the pairs of names that can't be told apart.

    Args:
        best: The set that is given.
        rivals: For each of its members the names that would do as well; the first that can be planned for is.

    Returns:
        None: there are no such names, or the poses that were measured have the power already, and chance, or a cause
        that is neither, kept them from telling the names apart: more of the same is no plan.
    """
    for member, others in zip(best.names, rivals, strict=True):
        if others and (found := _plan(best, member, list(others))) is not None:
            return found
    return None


def _plan(best: SearchNode, member: Hypothesis, others: list[Hypothesis]) -> SeparatingPlan | None:
    from fastcal.design.separation import separating_poses

    problem = best.fit.problem
    causes = [member, *others]
    kept = [name for name in best.names if name is not member]
    whole = fit(problem, [*kept, *causes], best.fit)
    sizes = [fit(problem, [*kept, cause], best.fit).value(cause) for cause in causes]
    blocks = [np.arange(part.start, part.stop) for part in (whole.place(cause) for cause in causes)]
    common = np.setdiff1d(whole.free, np.concatenate(blocks))
    order = np.concatenate([common, *blocks])
    unit = np.array([p.sigma for p in whole.model.parameters])[order]
    first = np.cumsum([len(common), *(len(block) for block in blocks)])

    pool = _candidates(problem.start.robot, problem.kept, causes)
    model, samples = problem.model(whole.entries, _planned(problem.kept, pool))
    theta = whole.theta[: len(whole.model.parameters)].copy()
    for block, size in zip(blocks, sizes, strict=True):
        theta[block] = size / len(causes)  # half way between them: the load is about right, whichever it is
    J = np.asarray(model.parameter_jacobian(samples, theta, 3, problem.threads, None))[:, :, order]
    J = J * unit / (problem.noise.factor * np.hypot(problem.noise.common[0], _claim(problem.kept)))
    A = whole.whitened[0]
    done = A[:, [whole.free.index(int(i)) for i in order]] * unit
    found = separating_poses(
        J[:, :, : len(common)],
        [J[:, :, a:b] for a, b in pairwise(first)],
        [size / unit[a:b] for size, (a, b) in zip(sizes, pairwise(first), strict=True)],
        PLAN_POSES,
        prior=done.T @ done,
        until_power=PLAN_POWER,
        threads=problem.threads,
    )
    if not len(found.chosen):
        return None
    before, after = float(np.nanmin(found.power_before)), float(np.nanmin(found.power_after))
    chosen = pool.select(found.chosen)
    return SeparatingPlan(chosen, before, after, tuple(cause.label for cause in causes))


def _planned(data: Dataset, pool: Candidates) -> Dataset:
    """The candidates under the conditions of the first row."""
    same = data.select(np.zeros(len(pool), dtype=np.intp))
    approach = same.approach
    if approach is not None and pool.approach is not None:
        approach = np.where(pool.approach != 0, pool.approach, approach)
    return replace(same, q=pool.q, payload=pool.payload, approach=approach)


def _claim(data: Dataset) -> float:
    return 0.0 if data.sigma_position is None else float(np.sqrt(np.nanmean(data.sigma_position**2)))


def _candidates(robot: Robot, data: Dataset, causes: Sequence[Hypothesis]) -> Candidates:
    """Random postures within the ranges that were measured, the payloads at hand, directions where they matter."""
    from fastcal.design.candidates import joint_ranges, postures, with_conditions

    q = postures(robot, "random", PLAN_CANDIDATES, _SEED)
    limits = joint_ranges(robot)
    low, high = data.q.min(axis=0), data.q.max(axis=0)
    q = low + (q - limits[:, 0]) / (limits[:, 1] - limits[:, 0]) * (high - low)
    levels = np.unique(data.payload)
    payloads = levels[np.unique(np.linspace(0, len(levels) - 1, PLAN_PAYLOADS).round().astype(int))]
    return with_conditions(q, [float(p) for p in payloads], approached_joints(causes), PLAN_CANDIDATES, _SEED)


def approached_joints(causes: Sequence[Hypothesis]) -> list[int]:
    """Joints, from 0, for whose direction of approach one of the causes asks."""
    on = [filled(variable, cause.owner) for cause in causes for variable in cause.traits.depends_on]
    return [int(name.removeprefix("approach")) - 1 for name in on if name.startswith("approach")]


@dataclass(frozen=True, eq=False)
class Foresight:
    """What poses would show before they are measured.

    Attributes:
        smallest: The least size of each effect that would be detected four times in five.
        untestable: Effects on which they would hold no information.
        confused: Pairs of names whose signatures correlate by more than CONFUSED_CORRELATION, and how much, the
            largest first.
    """

    smallest: list[DetectableEffect]
    untestable: list[Untestable]
    confused: list[tuple[str, str, float]]


def foresee(
    robot: Robot, poses: Dataset, sigma: float, *, exclude: Collection[str] = (), threads: int = 1
) -> Foresight:
    """What these poses, payloads and directions will show, and what they will confuse.

    Args:
        robot: The arm as the controller has it.
        poses: What is to be measured, with its conditions; measured columns are not read.
        sigma: Standard deviation of a measured coordinate [m].
        exclude: Names that are of no interest.
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: sigma is not positive, or the poses are too few to fit the geometry.
    """
    if not (np.isfinite(sigma) and sigma > 0):
        raise InvalidInput(f"sigma must be above 0, got {sigma}")
    data = simulate(robot, poses)
    library = build_library(robot, data, parse_exclusions(exclude, robot))
    search = Search(prepared_problem(robot, data, library.names, Noise((sigma, sigma, sigma)), threads))
    found = search.start.blocks
    first = {name.key: i for i, name in reversed(list(enumerate(found.names))) if found.tests.scores.rank[i] > 0}
    chosen = list(first.values())
    r = np.asarray(found.tests.correlation(chosen, chosen))
    pairs = [(a, b) for a, b in zip(*np.triu_indices(len(chosen), 1), strict=True) if r[a, b] > CONFUSED_CORRELATION]
    confused = [(repr(found.names[chosen[a]]), repr(found.names[chosen[b]]), float(r[a, b])) for a, b in pairs]
    return Foresight(
        sensitivity.smallest(search.start),
        sensitivity.untestable(search, library),
        sorted(confused, key=lambda pair: -pair[2]),
    )
