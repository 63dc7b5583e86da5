# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Likelihood of the corners with causes of error added to the geometry: the equations of `rig_causes`."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import optimize

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray, thin_svd
from fastcal.calibration.alignment import measurements
from fastcal.calibration.levers import levers
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.unknowns import of_corners
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.rig_library import RigCause
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

_K = (1e-7, 1e-1)  # bounds of k [rad / px]


@dataclass(frozen=True, eq=False)
class Block:
    """Columns (m, p) of a cause, the standard deviations (p,) of what is known of its numbers, and how far they are."""

    columns: FloatArray
    prior: FloatArray
    away: FloatArray


class Corners:
    """Corners near the fit of geometry, cameras and boards, each row's shared error of the joints set apart."""

    def __init__(self, robot: Robot, data: Dataset, causes: Sequence[RigCause], threads: int) -> None:
        self.start: CalibrationProblem = prepare(robot, data, effects="geometry", threads=threads)
        found = self.start.identify()
        self.theta = np.asarray(found.theta)
        near = self.start.linearize(self.theta, [1.0] * len(self.start.measured.observations))
        row, number = np.asarray(near.row, dtype=np.intp), np.asarray(near.number, dtype=np.intp)
        own = of_corners(near, self.start.measured)
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
        self.blocks = {cause: self.block(robot, data, cause, threads) for cause in causes}

    def _drawn(self, robot: Robot, data: Dataset, threads: int) -> FloatArray:
        measured = measurements(data, robot)
        r = _core.residuals(self.start.model, self.start.samples, measured, self.theta, threads)
        return np.asarray(np.asarray(r)[self.row, self.number])

    def block(self, robot: Robot, data: Dataset, cause: RigCause, threads: int) -> Block:
        """The columns of a cause, by differences."""
        out = np.empty((len(self.r), len(cause.names)))
        for k, step in enumerate(cause.steps):
            there = [
                self._drawn(cause.of(robot, sign * step * np.eye(len(cause.steps))[k]), data, threads)
                for sign in (1, -1)
            ]
            out[:, k] = (there[0] - there[1]) / (2 * step)
        return Block(out, cause.prior, np.zeros(len(cause.names)))

    def effect(self, name: Hypothesis) -> Block | None:
        """(m, p) columns of an effect of the arm at 0; None where it changes nothing there."""
        problem = Problem(self.start, self.start.data, self.start.data.measured, [], Noise((1.0, 1.0, 1.0)))
        model, samples = problem.model([*problem.given, name.entry], problem.kept)
        theta = np.concatenate([model.start, self.theta[len(self.start.names) :]])
        theta[: len(self.start.names)] = self.theta[: len(self.start.names)]
        near = _core.linearize(
            model, samples, self.start.measured, theta, [1.0] * len(self.start.measured.observations)
        )
        columns = np.asarray(near.J)[self.own][:, len(self.start.names) : len(model.start)]
        if not np.isfinite(columns).all() or not columns.any():
            return None
        width = columns.shape[1]
        return Block(columns, np.full(width, np.inf), np.zeros(width))


class Likelihood:
    """Of the corners by k, with any of the blocks of columns beside those of the fit; rows are summed once."""

    def __init__(
        self,
        corners: Corners,
        blocks: Sequence[Block],
        rows: IndexArray | None = None,
        sigma: float | None = None,
    ) -> None:
        kept = np.ones(len(corners.r), dtype=bool) if rows is None else np.isin(corners.row, rows)
        self.fitted = corners.J.shape[1]
        ends = np.cumsum([self.fitted, *(block.columns.shape[1] for block in blocks)])
        self.places = [list(range(a, b)) for a, b in pairwise(ends.tolist())]
        X = np.column_stack([corners.J, *(block.columns for block in blocks), corners.r])[kept]
        row, G = corners.row[kept], corners.G[kept]
        turned, sizes = [], []
        for i in np.unique(row):
            U, s, _ = thin_svd(G[row == i])
            turned.append(U.T @ X[row == i])
            sizes.append(s)
        self.Z, self.s, self.N = np.concatenate(turned), np.concatenate(sizes), X.T @ X
        self.weight = 1 / np.concatenate([corners.prior, *(block.prior for block in blocks)]) ** 2
        self.away = np.concatenate([corners.away, *(block.away for block in blocks)])
        self.last: tuple[float, FloatArray] | None = None
        self.sigma = 1.0 if sigma is None else sigma
        if sigma is None:  # what joints can't do is noise of pixels
            inside = self.N - self.Z.T @ self.Z
            freedom = max(len(X) - len(self.s) - (X.shape[1] - 1), 1)
            self.sigma = float(np.sqrt(self._left(inside, range(len(blocks)))[0] / freedom))

    def unheld(self) -> Likelihood:
        """The same with nothing known of the geometry."""
        out = copy.copy(self)
        out.weight = self.weight.copy()
        out.weight[: self.fitted] = 0.0
        return out

    def _columns(self, blocks: Iterable[int]) -> list[int]:
        return [*range(self.fitted), *(i for block in blocks for i in self.places[block])]

    def _left(self, N: FloatArray, blocks: Iterable[int]) -> tuple[float, FloatArray, FloatArray]:
        """What least squares leave, the prior in it, over sigma^2; the change of all columns, and its covariance."""
        at = self._columns(blocks)
        weight, away = self.weight[at], self.away[at]
        A = N[np.ix_(at, at)] / self.sigma**2 + np.diag(weight)
        b = N[at, -1] / self.sigma**2 + weight * away
        scale = 1 / np.sqrt(np.maximum(np.diag(A), np.finfo(np.float64).tiny))
        inverse = scale[:, np.newaxis] * np.linalg.pinv(A * np.outer(scale, scale), 1e-12, hermitian=True) * scale
        d = -inverse @ b
        return float(N[-1, -1] / self.sigma**2 + weight @ away**2 + b @ d), d, inverse

    def _at(self, k: float) -> FloatArray:
        if self.last is not None and self.last[0] == k:
            return self.last[1]
        w = k**2 * self.s**2 / (1 + k**2 * self.s**2)
        self.last = (k, np.asarray(self.N - (self.Z.T * w) @ self.Z))
        return self.last[1]

    def cost(self, blocks: Sequence[int], k: float) -> float:
        """-2 l with some of the blocks at a k."""
        return float(np.sum(np.log1p(k**2 * self.s**2))) + self._left(self._at(k), blocks)[0]

    def best(self, blocks: Sequence[int]) -> Best:
        """The fit with some of the blocks, at the best k."""

        def cost(log_k: float) -> float:
            return self.cost(blocks, float(np.exp(log_k)))

        found = optimize.minimize_scalar(cost, bounds=tuple(np.log(_K)), method="bounded", options={"xatol": 0.02})
        k = float(np.exp(found.x))
        _, d, covariance = self._left(self._at(k), blocks)
        own = slice(self.fitted, None)
        return Best(float(found.fun), k, d, np.sqrt(np.diag(covariance))[own])

    def squares(self, blocks: Sequence[int], change: FloatArray, k: float) -> float:
        """r^T V^-1 r / sigma^2 of these rows after a change of the columns."""
        N = self._at(k)
        at = [*self._columns(blocks), len(N) - 1]
        d = np.append(change, 1.0)
        return float(d @ N[np.ix_(at, at)] @ d) / self.sigma**2


@dataclass(frozen=True, eq=False)
class Best:
    """A fit at its best k."""

    cost: float  # -2 l
    k: float
    change: FloatArray  # of the columns of the fit, then of the blocks
    std: FloatArray  # of the blocks' numbers
