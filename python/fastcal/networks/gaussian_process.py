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

from fastcal.correction.joints import GaussianProcess, Phases
from fastcal.networks.curves import phases_of
from fastcal.networks.optimizers import Optimizer
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

MOST_ROWS = 1500  # of a posterior; more are drawn from, since its cost grows with the cube
LIKELIHOOD_ROWS = 200
STEPS = 60
RATE = 0.08


def fit_gaussian_process(
    problem: Problem,
    rows: Sequence[IntArray],
    options: Options,
    *,
    most_rows: int = MOST_ROWS,
    likelihood_rows: int = LIKELIHOOD_ROWS,
) -> list[GaussianProcess]:
    """One process for each set of training rows; all have the hyperparameters that some rows of all find likeliest.

    Args:
        problem: The rows.
        rows: Training rows of each process.
        options: How to train.
        most_rows: Of a posterior; time grows with their cube, memory with their square (3,000: 2.5 GB).
        likelihood_rows: That decide the hyperparameters.
    """
    phases = phases_of(problem)
    x = np.hstack([phases(problem.inputs), phases.load(problem.inputs)])
    some = np.random.default_rng((options.seed, 2)).permutation(len(problem))[:likelihood_rows]
    numbers = hyperparameters(x[some], problem.inputs.J_tool_q[some], problem.residuals[some] / problem.size)
    found = []
    for k, own in enumerate(rows):
        options.progress(f"Gaussian process {k + 1} of {len(rows)}")
        drawn = own if len(own) <= most_rows else np.random.default_rng((options.seed, 3)).permutation(own)[:most_rows]
        found.append(_posterior(problem, phases, x, np.sort(drawn), numbers))
    return found


def covariance(x: torch.Tensor, J: torch.Tensor, numbers: torch.Tensor) -> torch.Tensor:
    """(3 M, 3 M) of the residuals, without noise; numbers: a, b, c, noise, l, L, as in `GaussianProcess`."""
    own, shared, free, _, alone, together = numbers
    squares = 2 * torch.sin((x[:, None, :-1] - x[None, :, :-1]) / 2) ** 2
    joint = torch.exp(-((x[:, None, -1] - x[None, :, -1]) ** 2 / 2 + squares.sum(dim=2)) / together**2)
    K = own**2 * torch.exp(-squares / alone**2) + shared**2 * joint[..., None]
    blocks = torch.einsum("nai,nmi,mbi->namb", J, K, J)
    blocks = blocks + free**2 * joint[:, None, :, None] * torch.eye(3, dtype=x.dtype)[None, :, None, :]
    out: torch.Tensor = blocks.reshape(3 * len(x), 3 * len(x))
    return out


def hyperparameters(x: FloatArray, J: FloatArray, residuals: FloatArray) -> FloatArray:
    """Likeliest a, b, c, noise in units of the residuals, l, L [rad]; Adam on their logarithms."""
    xt, Jt = torch.tensor(x), torch.tensor(J)
    y = torch.tensor(residuals.ravel())
    logs = torch.log(torch.tensor([0.6, 0.2, 0.2, 0.3, 0.3, 1.5], dtype=torch.float64)).requires_grad_(True)
    optimizer = Optimizer(["adam"], [RATE], logs[None])  # torch's own takes seconds to import
    best, least = logs.detach().clone(), math.inf
    for _ in range(STEPS):
        numbers = torch.exp(logs)
        K = covariance(xt, Jt, numbers) + (numbers[3] ** 2 + 1e-6) * torch.eye(len(y), dtype=torch.float64)
        L = torch.linalg.cholesky(K)
        half = torch.linalg.solve_triangular(L, y[:, None], upper=False)
        value = (half**2).sum() / 2 + torch.log(torch.diagonal(L)).sum()
        if value.item() < least:
            best, least = logs.detach().clone(), value.item()
        (slope,) = torch.autograd.grad(value, logs)
        with torch.no_grad():
            optimizer.step(logs[None], slope[None])
            logs.clamp_(math.log(1e-3), math.log(30.0))
    return np.asarray(torch.exp(best).numpy())


def _posterior(problem: Problem, phases: Phases, x: FloatArray, own: IntArray, numbers: FloatArray) -> GaussianProcess:
    J = problem.inputs.J_tool_q[own]
    with torch.no_grad():
        K = covariance(torch.tensor(x[own]), torch.tensor(J), torch.tensor(numbers)).numpy()
    K[np.diag_indices_from(K)] += numbers[3] ** 2 + 1e-6
    alpha = linalg.cho_solve(linalg.cho_factor(K, lower=True, overwrite_a=True), problem.residuals[own].ravel())
    alpha = alpha.reshape(-1, 3)
    variances = (numbers[0] ** 2, numbers[1] ** 2, numbers[2] ** 2)
    return GaussianProcess(
        phases,
        x[own],
        np.einsum("mij,mi->mj", J, alpha),
        alpha,
        tuple(map(float, variances)),  # type: ignore[arg-type]
        (float(numbers[4]), float(numbers[5])),
    )
