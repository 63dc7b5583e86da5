# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A Gaussian process on joint errors: hyperparameters by marginal likelihood, then the exact posterior."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import linalg

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.joints import GaussianProcess, Phases
from fastcal.networks.curves import phases_of
from fastcal.networks.optimizers import Optimizer
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem

MOST_NUMBERS = 4500  # of a posterior, 1500 points; more are drawn from, since its cost grows with the cube
LIKELIHOOD_ROWS = 200
STEPS = 60
RATE = 0.08
_BLOCK = 64  # points whose covariances with all others are in memory at once


def fit_gaussian_process(
    problem: Problem,
    rows: Sequence[IndexArray],
    options: Options,
    *,
    most_rows: int | None = None,
    likelihood_rows: int = LIKELIHOOD_ROWS,
) -> list[GaussianProcess]:
    """One process for each set of training rows; all have the hyperparameters that some rows of all find likeliest.

    Args:
        problem: The rows.
        rows: Training rows of each process.
        options: How to train.
        most_rows: Of a posterior; time grows with their cube, memory with their square (3,000 points: 2.5 GB). None:
            1,500 points, 750 poses.
        likelihood_rows: That decide the hyperparameters.
    """
    most_rows = most_rows or MOST_NUMBERS // len(problem.axes)
    phases = phases_of(problem)
    x = np.hstack([phases(problem.inputs), phases.load(problem.inputs)])
    some = np.random.default_rng((options.seed, 2)).permutation(len(problem))[:likelihood_rows]
    numbers = hyperparameters(x[some], problem.J[some], problem.wanted[some], problem.measured[some])
    found = []
    for k, own in enumerate(rows):
        options.progress(f"Gaussian process {k + 1} of {len(rows)}")
        drawn = own if len(own) <= most_rows else np.random.default_rng((options.seed, 3)).permutation(own)[:most_rows]
        found.append(_posterior(problem, phases, x, np.sort(drawn), numbers))
    return found


def covariance(x: torch.Tensor, J: torch.Tensor, numbers: torch.Tensor, some: slice = slice(None)) -> torch.Tensor:
    """(k S, k M) of residuals, J (M, k, n), without noise: those of `some` S points by all.

    numbers: a, b, c, l, L, as in `GaussianProcess`, noise.
    """
    own, shared, free, alone, together = numbers[:5]
    here = x[some]
    squares = 2 * torch.sin((here[:, None, :-1] - x[None, :, :-1]) / 2) ** 2
    joint = torch.exp(-((here[:, None, -1] - x[None, :, -1]) ** 2 / 2 + squares.sum(dim=2)) / together**2)
    K = own**2 * torch.exp(-squares / alone**2) + shared**2 * joint[..., None]
    blocks = torch.einsum("nai,nmi,mbi->namb", J[some], K, J)
    blocks = blocks + free**2 * joint[:, None, :, None] * torch.eye(J.shape[1], dtype=x.dtype)[None, :, None, :]
    out: torch.Tensor = blocks.reshape(J.shape[1] * len(here), -1)
    return out


def hyperparameters(x: FloatArray, J: FloatArray, wanted: FloatArray, measured: NDArray[np.bool_]) -> FloatArray:
    """Likeliest a, b, c in units of the residuals, l, L [rad], noise of points and of turns; Adam on the logarithms.

    -log likelihood = y' K^-1 y / 2 + log|K| / 2, with the slope (K^-1 - a a') / 2 by K, a = K^-1 y.

    Args:
        x: (M, n + 1) phases and load.
        J: (M, k, n) residuals by the joints.
        wanted: (M, k) residuals in their units.
        measured: (M, k) which of them are any.
    """
    xt, Jt, used = torch.tensor(x), torch.tensor(J), torch.tensor(measured.ravel())
    y = torch.tensor(wanted.ravel())[used]
    kinds = wanted.shape[1] // 3
    logs = torch.log(torch.tensor([0.6, 0.2, 0.2, 0.3, 1.5] + [0.3] * kinds, dtype=torch.float64)).requires_grad_(True)
    optimizer = Optimizer(["adam"], [RATE], logs[None])  # torch's own takes seconds to import
    best, least = logs.detach().clone(), math.inf
    for _ in range(STEPS):
        numbers = torch.exp(logs)
        noise = (numbers[5:] ** 2 + 1e-6).repeat_interleave(3).repeat(len(x))[used]
        K = covariance(xt, Jt, numbers)[used][:, used] + torch.diag(noise)
        with torch.no_grad():
            L = torch.linalg.cholesky(K)
            alpha = torch.cholesky_solve(y[:, None], L)
            value = float(y @ alpha[:, 0] / 2 + torch.log(torch.diagonal(L)).sum())
            by_K = (torch.cholesky_inverse(L) - alpha @ alpha.T) / 2
        if value < least:
            best, least = logs.detach().clone(), value
        (slope,) = torch.autograd.grad(K, logs, by_K)
        with torch.no_grad():
            optimizer.step(logs[None], slope[None])
            logs.clamp_(math.log(1e-3), math.log(30.0))
    return np.asarray(torch.exp(best).numpy())


def _posterior(
    problem: Problem, phases: Phases, x: FloatArray, own: IndexArray, numbers: FloatArray
) -> GaussianProcess:
    J, measured = problem.J[own], problem.measured[own]
    used = np.flatnonzero(measured.ravel())
    K = np.empty((measured.size, measured.size))
    xt, Jt = torch.tensor(x[own]), torch.tensor(J)
    with torch.no_grad():
        for at in range(0, len(own), _BLOCK):
            some = slice(at, at + _BLOCK)
            K[J.shape[1] * at :][: J.shape[1] * _BLOCK] = covariance(xt, Jt, torch.tensor(numbers), some)
    K = K if len(used) == len(K) else K[np.ix_(used, used)]
    K[np.diag_indices_from(K)] += np.tile(np.repeat(numbers[5:] ** 2 + 1e-6, 3), len(own))[used]
    alpha = np.zeros(measured.shape)
    # K is symmetric: its transpose is in LAPACK's order and needs no copy.
    factor = linalg.cho_factor(K.T, lower=True, overwrite_a=True, check_finite=False)
    alpha[measured] = linalg.cho_solve(factor, problem.wanted[own].ravel()[used])
    variances = (numbers[0] ** 2, numbers[1] ** 2, numbers[2] ** 2)
    return GaussianProcess(
        phases,
        x[own],
        problem.size * np.einsum("mij,mi->mj", J, alpha),
        alpha * problem.units,
        tuple(map(float, variances)),  # type: ignore[arg-type]
        (float(numbers[3]), float(numbers[4])),
    )
