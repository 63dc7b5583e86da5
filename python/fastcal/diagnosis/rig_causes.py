# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is wrong with a camera or a board, and not with the arm: numbers of the cell file that are not as it says.

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

import copy
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.levers import levers
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.unknowns import CORNERS
from fastcal.diagnosis import rules
from fastcal.diagnosis.library import Hypothesis
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Finding, NamedValue
from fastcal.effects.rig_traits import BOARD_BEND, BOARD_SCALE, INTRINSICS
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import BEND, has_rig, lens_numbers
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

CHANCE = 1e-4  # of the best of all names, by noise alone
LEAD = 10.0  # of a cause over the next, in gain above what blocks of their sizes gain by chance
FOLDS = 5
_ROUNDS = 4  # of setting a cause's numbers and fitting again
_SETTLED = 0.05  # standard deviations
_K = (1e-7, 1e-1)  # bounds of k [rad / px]
_LENS = ("fx_px", "fy_px", "cx_px", "cy_px")
_LENS_STEP, _DISTORTION_STEP = 1e-2, 1e-5


@dataclass(frozen=True)
class RigCause:
    """Numbers of a camera or board that may not be as the file says.

    Attributes:
        names: Of its numbers, with their unit.
        steps: By which derivatives are taken.
        change: Adds (p,) numbers to a spec's own copy.
    """

    effect: str
    owner: str
    names: tuple[str, ...]
    steps: tuple[float, ...]
    change: Callable[[Spec, FloatArray], None]

    def of(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with its numbers changed."""
        spec = Robot(robot.spec).spec
        self.change(spec, values)
        return Robot(spec)


def rig_causes(robot: Robot) -> list[RigCause]:
    """What may be wrong with the cameras and boards of a cell."""
    out = []
    for name, camera in robot.description.cameras.items():
        if camera["intrinsics"] != "identify":
            coefficients = len(camera["distortion"])
            names = (*_LENS, *(f"distortion{k}" for k in range(1, coefficients + 1)))
            steps = (_LENS_STEP,) * 4 + (_DISTORTION_STEP,) * coefficients
            out.append(RigCause(INTRINSICS, name, names, steps, _lens_change(name)))
    for name, board in robot.description.boards.items():
        if board["kind"] == "points":
            continue
        out.append(RigCause(BOARD_SCALE, name, ("scale",), (1e-5,), _scale_change(name)))
        out.append(RigCause(BOARD_BEND, name, BEND, (1e-3,) * 3, _bend_change(name)))
    return out


def _lens_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        camera = spec["cameras"][name]
        numbers = [a + b for a, b in zip(lens_numbers(camera), values.tolist(), strict=True)]
        camera["focal_px"], camera["centre_px"], camera["distortion"] = numbers[:2], numbers[2:4], numbers[4:]

    return change


def _scale_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        board = spec["boards"][name]
        for key in ("square_mm", "tag_mm", "gap_mm", "marker_mm"):
            if key in board:
                board[key] *= 1.0 + float(values[0])

    return change


def _bend_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        board = spec["boards"][name]
        board["bend_mm"] = (np.asarray(board.get("bend_mm", [0.0, 0.0, 0.0])) + values).tolist()

    return change


class _Corners:
    """Corners near the fit of geometry, cameras and boards, each row's shared error of the joints set apart."""

    def __init__(self, robot: Robot, data: Dataset, causes: Sequence[RigCause], threads: int) -> None:
        self.start: CalibrationProblem = prepare(robot, data, effects="geometry", threads=threads)
        found = self.start.identify()
        self.theta = np.asarray(found.theta)
        near = self.start.linearize(self.theta, [1.0] * len(self.start.measured.observations))
        of = next(of for of in self.start.measured.observations if of.field == CORNERS)
        row, number = np.asarray(near.row, dtype=np.intp), np.asarray(near.number, dtype=np.intp)
        own = (number >= of.first_number) & (number < of.first_number + len(of.components))
        self.own, self.row, self.number = own, row[own], number[own]
        unknowns = self.theta[len(self.start.names) :]
        self.G = levers(self.start.model.robot, data, self.start.measured, unknowns, threads)[self.row, self.number]
        free = list(found.free)
        self.J, self.r = np.asarray(near.J)[own][:, free], np.asarray(near.r)[own]
        size = np.full(len(self.theta), np.inf)
        nominal = self.start.model.start
        size[: len(self.start.names)] = [
            np.inf if p.owner in ("base", "tool") else p.sigma for p in self.start.parameters
        ]
        self.prior = size[free]
        self.away = np.where(np.isfinite(size), self.theta - np.concatenate([nominal, unknowns]), 0.0)[free]
        self.blocks = {cause: self._derivative(robot, data, cause, threads) for cause in causes}

    def _drawn(self, robot: Robot, data: Dataset, threads: int) -> FloatArray:
        measured = measurements(data, robot)
        r = _core.residuals(self.start.model, self.start.samples, measured, self.theta, threads)
        return np.asarray(np.asarray(r)[self.row, self.number])

    def _derivative(self, robot: Robot, data: Dataset, cause: RigCause, threads: int) -> FloatArray:
        out = np.empty((len(self.r), len(cause.names)))
        for k, step in enumerate(cause.steps):
            there = [
                self._drawn(cause.of(robot, sign * step * np.eye(len(cause.steps))[k]), data, threads)
                for sign in (1, -1)
            ]
            out[:, k] = (there[0] - there[1]) / (2 * step)
        return out

    def effect(self, name: Hypothesis) -> FloatArray | None:
        """(m, p) columns of an effect of the arm at 0; None where it changes nothing there."""
        problem = Problem(self.start, self.start.data, self.start.data.measured, [], Noise((1.0, 1.0, 1.0)))
        model, samples = problem.model([*problem.given, name.entry], problem.kept)
        theta = np.concatenate([model.start, self.theta[len(self.start.names) :]])
        theta[: len(self.start.names)] = self.theta[: len(self.start.names)]
        near = _core.linearize(
            model, samples, self.start.measured, theta, [1.0] * len(self.start.measured.observations)
        )
        columns = np.asarray(near.J)[self.own][:, len(self.start.names) : len(model.start)]
        return columns if np.isfinite(columns).all() and columns.any() else None


class _Likelihood:
    """Of the corners by k, with any of the blocks of columns beside those of the fit; rows are summed once."""

    def __init__(
        self, corners: _Corners, blocks: Sequence[FloatArray], rows: IntArray | None = None, sigma: float | None = None
    ) -> None:
        kept = np.ones(len(corners.r), dtype=bool) if rows is None else np.isin(corners.row, rows)
        self.fitted = corners.J.shape[1]
        ends = np.cumsum([self.fitted, *(block.shape[1] for block in blocks)])
        self.places = [list(range(a, b)) for a, b in pairwise(ends.tolist())]
        X = np.column_stack([corners.J, *blocks, corners.r])[kept]
        row, G = corners.row[kept], corners.G[kept]
        turned, sizes = [], []
        for i in np.unique(row):
            U, s, _ = np.linalg.svd(G[row == i], full_matrices=False)
            turned.append(U.T @ X[row == i])
            sizes.append(s)
        self.Z, self.s, self.N = np.concatenate(turned), np.concatenate(sizes), X.T @ X
        self.weight, self.away = 1 / corners.prior**2, corners.away
        self.sigma = 1.0 if sigma is None else sigma
        if sigma is None:  # what joints can't do is noise of pixels
            inside = self.N - self.Z.T @ self.Z
            freedom = max(len(X) - len(self.s) - (X.shape[1] - 1), 1)
            self.sigma = float(np.sqrt(self._left(inside, range(len(blocks)))[0] / freedom))

    def unheld(self) -> _Likelihood:
        """The same with nothing known of the geometry."""
        out = copy.copy(self)
        out.weight = np.zeros_like(self.weight)
        return out

    def _columns(self, blocks: Iterable[int]) -> list[int]:
        return [*range(self.fitted), *(i for block in blocks for i in self.places[block])]

    def _left(self, N: FloatArray, blocks: Iterable[int]) -> tuple[float, FloatArray, FloatArray]:
        """What least squares leave, the prior in it, over sigma^2; the change of all columns, and its covariance."""
        at = self._columns(blocks)
        weight, away = np.zeros(len(at)), np.zeros(len(at))
        weight[: self.fitted], away[: self.fitted] = self.weight, self.away
        A = N[np.ix_(at, at)] / self.sigma**2 + np.diag(weight)
        b = N[at, -1] / self.sigma**2 + weight * away
        scale = 1 / np.sqrt(np.maximum(np.diag(A), np.finfo(np.float64).tiny))
        inverse = scale[:, np.newaxis] * np.linalg.pinv(A * np.outer(scale, scale), 1e-12, hermitian=True) * scale
        d = -inverse @ b
        return float(N[-1, -1] / self.sigma**2 + weight @ away**2 + b @ d), d, inverse

    def _at(self, k: float) -> FloatArray:
        w = k**2 * self.s**2 / (1 + k**2 * self.s**2)
        return np.asarray(self.N - (self.Z.T * w) @ self.Z)

    def best(self, blocks: Sequence[int]) -> _Best:
        """The fit with some of the blocks, at the best k."""

        def cost(log_k: float) -> float:
            k = float(np.exp(log_k))
            return float(np.sum(np.log1p(k**2 * self.s**2))) + self._left(self._at(k), blocks)[0]

        found = optimize.minimize_scalar(cost, bounds=tuple(np.log(_K)), method="bounded", options={"xatol": 0.02})
        k = float(np.exp(found.x))
        _, d, covariance = self._left(self._at(k), blocks)
        own = slice(self.fitted, None)
        return _Best(float(found.fun), k, d, np.sqrt(np.diag(covariance))[own])

    def squares(self, blocks: Sequence[int], change: FloatArray, k: float) -> float:
        """r^T V^-1 r / sigma^2 of these rows after a change of the columns."""
        N = self._at(k)
        at = [*self._columns(blocks), len(N) - 1]
        d = np.append(change, 1.0)
        return float(d @ N[np.ix_(at, at)] @ d) / self.sigma**2


@dataclass(frozen=True, eq=False)
class _Best:
    cost: float  # -2 l
    k: float
    change: FloatArray  # of the columns of the fit, then of the blocks
    std: FloatArray  # of the blocks' numbers


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
    if CORNERS not in data.kinds or not has_rig(robot.spec):
        return robot, findings
    seen = data.select(np.isfinite(data.observed[CORNERS]).any(axis=1))
    causes = [c for c in rig_causes(robot) if not {c.effect, f"{c.effect}@{c.owner}"} & set(excluded)]
    while causes:
        found = _leading(robot, seen, causes, names, threads)
        if found is None:
            break
        cause, robot, finding = found
        findings.append(finding)
        causes.remove(cause)
    return robot, findings


def _leading(
    robot: Robot, data: Dataset, causes: Sequence[RigCause], names: Sequence[Hypothesis], threads: int
) -> tuple[RigCause, Robot, Finding] | None:
    """The cause that leads all others, the robot with it, and the finding; None where none does."""
    corners = _Corners(robot, data, causes, threads)
    blocks = [corners.blocks[cause] for cause in causes]
    likelihood = _Likelihood(corners, blocks)
    without = likelihood.best([]).cost
    size = np.array([len(cause.names) for cause in causes])
    gain = np.array([without - likelihood.best([i]).cost for i in range(len(causes))])
    first = int(np.argmax(gain - size))
    tried = len(causes) + len(names)
    p = min(1.0, float(stats.chi2.sf(gain[first], size[first])) * tried)
    if p > CHANCE or _arm_does_as_well(corners, names, gain[first] - size[first], without, likelihood.sigma):
        return None
    share, error, stability = _held_out(corners, blocks, first, likelihood.sigma)
    if share <= 0:
        return None
    near = [i for i in range(len(causes)) if i != first and gain[first] - size[first] - gain[i] + size[i] < LEAD]
    equivalents = tuple((causes[i].effect, causes[i].owner) for i in near)
    free = likelihood.unheld()
    alone = free.best([]).cost - free.best([first]).cost
    limits = []
    if equivalents or float(stats.chi2.sf(max(alone, 0.0), size[first])) * tried > CHANCE:
        limits.append(Because(Reason.EQUIVALENTS))
    if share < rules.GRADE_A_GAIN * error:
        limits.append(Because(Reason.NOT_HELD_OUT))
    cause = causes[first]
    mended, values, std = _mended(robot, data, cause, threads)
    finding = Finding(
        cause.effect,
        cause.owner,
        "B" if limits else "A",
        {name: NamedValue(*of) for name, *of in zip(cause.names, values.tolist(), std.tolist(), strict=True)},
        float(np.sqrt(gain[first])),
        p,
        equivalents,
        (share, error),
        stability,
        tuple(limits),
    )
    return cause, mended, finding


def _arm_does_as_well(
    corners: _Corners, names: Sequence[Hypothesis], least: float, without: float, sigma: float
) -> bool:
    """Does an effect of the arm gain about as much, above chance?"""
    for name in names:
        columns = corners.effect(name)
        if columns is None:
            continue
        gain = without - _Likelihood(corners, [columns], sigma=sigma).best([0]).cost
        if gain - columns.shape[1] > least - LEAD:
            return True
    return False


def _held_out(corners: _Corners, blocks: Sequence[FloatArray], first: int, sigma: float) -> tuple[float, float, float]:
    """By how much squares of held-out pictures are lower with a cause, its standard error; how often it comes first."""
    rows = np.unique(corners.row)
    shares, firsts = [], 0
    for fold in range(FOLDS):
        held = rows[fold::FOLDS]
        train = _Likelihood(corners, blocks, np.setdiff1d(rows, held), sigma)
        test = _Likelihood(corners, blocks, held, sigma)
        fits = [train.best([i]) for i in range(len(blocks))]
        own, none = fits[first], train.best([])
        # Weighed alike: else what is missing passes for noise of the joints.
        with_it, without = test.squares([first], own.change, own.k), test.squares([], none.change, own.k)
        shares.append(1 - with_it / without)
        firsts += int(np.argmin([of.cost + block.shape[1] for of, block in zip(fits, blocks, strict=True)])) == first
    return float(np.mean(shares)), float(np.std(shares, ddof=1) / np.sqrt(FOLDS)), firsts / FOLDS


def _mended(robot: Robot, data: Dataset, cause: RigCause, threads: int) -> tuple[Robot, FloatArray, FloatArray]:
    """The robot with the numbers of a cause as the corners want them, these changes, and their standard deviations."""
    values, std = np.zeros(len(cause.names)), np.zeros(len(cause.names))
    for _ in range(_ROUNDS):
        corners = _Corners(cause.of(robot, values), data, [cause], threads)
        found = _Likelihood(corners, [corners.blocks[cause]]).best([0])
        change, std = found.change[corners.J.shape[1] :], found.std
        values = values + change
        if (np.abs(change) < _SETTLED * std).all():
            break
    return cause.of(robot, values), values, std
