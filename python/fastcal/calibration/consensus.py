# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Search for a consistent subset of rows, for gross errors that a robust fit cannot reject.

A redescending loss finds the fit nearest to its start. Where four rows in ten are gross in the same way, or most rows
are, the start lies between the two, and the fit ends at a noise that hides them all. So the linearized problem is
solved from many small random sets of rows, with the parameters held near nominal (FAST-LTS: P. Rousseeuw, K. Van
Driessen 1999), and each is followed to the set of rows that a mixture of two Gaussians makes most probable: rows that
agree, with the noise that their fit leaves, and the others, with a noise of their own. For k of N rows the negative
logarithm is

    S = (n - p) log s + p/2 log k + m log u + log binomial(N, k)

with s the RMS over n - p degrees of freedom of their n numbers about the fit of p parameters (the first two terms are
what integrating a flat prior of the parameters leaves), u the RMS of the m other numbers, and the last term the price
of naming the rows.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import BoolArray, FloatArray, IntArray, thin_svd

MARGIN = 10.0  # of S, by which a set of rows must be better than that of the fit
GROSS = 8.0  # times the noise of those that agree, RMS: rows less far off are noisy, or the model lacks an effect
_STARTS = 500
_START_ROWS = 5  # 15 numbers: base and tool, and a little of the arm
_FOLLOWED = 80  # sets after the first step
_FEWEST = 0.25  # of the rows may agree
_CONCENTRATIONS = 4  # steps to the fit of as many rows as are nearest
_ROUNDS = 12
_MOST_ROWS = 200  # of more, every k-th is searched
_FREEDOM = 1 / 3  # of a set's numbers must be left by its fit: with fewer it bends to each row
_START_NOISE = 1e-4  # [m] the noise at which a start holds its parameters to their plausible sizes
_NOTHING = 1e-12  # of the largest singular value: rounding
_ROUNDING = 1e-14  # of the largest square: a smaller pull is lost in the sums, and rows that show little are singular
_LOOSE = 1e-6  # weight that holds what the rows do not show, beside that of a start


class Rows:
    """The linearized problem of rows with three numbers each."""

    def __init__(self, J: FloatArray, residual: FloatArray, rank: int) -> None:
        """J (N, 3, P) by plausible sizes, residual (N, 3) predicted less measured, rank: parameters that show."""
        self.J, self.residual, self.rank = J, residual, rank
        self.count = len(J)
        # A fit held at 0 stays in the space of the rows of J: with it as the basis there are fewer parameters.
        _, s, V = thin_svd(J.reshape(-1, J.shape[2]))
        self.reduced = J @ V[s > _NOTHING * s[0]].T
        self.columns = self.reduced.shape[2]
        self._least = _ROUNDING * float(s[0]) ** 2
        self.above = np.triu_indices(self.columns)
        first, second = self.above
        self.normal = (self.reduced.transpose(0, 2, 1) @ self.reduced)[:, first, second]
        self.pull = np.einsum("nci,nc->ni", self.reduced, residual)

    def squares(self, chosen: BoolArray, held: float) -> FloatArray:
        """(S, N) squared residual lengths about the fits of the rows chosen (S, N), parameters held at 0."""
        weight = chosen.astype(np.float64)
        A = np.empty((len(weight), self.columns, self.columns))
        A[:, self.above[0], self.above[1]] = A[:, self.above[1], self.above[0]] = weight @ self.normal
        A[:, range(self.columns), range(self.columns)] += max(held, self._least)
        x = -np.linalg.solve(A, (weight @ self.pull)[..., np.newaxis])[..., 0]
        left = x @ self.reduced.reshape(-1, self.columns).T + self.residual.ravel()
        return np.asarray(np.square(left, out=left).reshape(-1, self.count, 3).sum(axis=2))

    def squares_of_few(self, picked: IntArray, held: float) -> FloatArray:
        """The same of a few rows each, by their numbers picked (S, k).

        From the dual: x = -J_k' (J_k J_k' + held 1)^-1 r_k for the 3 k numbers r_k of the picked rows, so that a set is
        a system of 3 k equations and no parameter appears.
        """
        J = self.reduced.reshape(-1, self.columns)
        K, r = J @ J.T, self.residual.ravel()
        numbers = (3 * picked[:, :, np.newaxis] + np.arange(3)).reshape(len(picked), -1)
        A = K[numbers[:, :, np.newaxis], numbers[:, np.newaxis]] + max(held, self._least) * np.eye(numbers.shape[1])
        pulled = np.linalg.solve(A, r[numbers][..., np.newaxis])[..., 0]
        x = -(pulled[:, np.newaxis] @ J[numbers])[:, 0]
        left = x @ J.T + r
        return np.asarray(np.square(left, out=left).reshape(-1, self.count, 3).sum(axis=2))

    def score(self, inside: FloatArray, outside: FloatArray, k: IntArray) -> FloatArray:
        """S by the sums of squares of k rows and of the others; infinite where too few degrees of freedom are left."""
        N, tiny = self.count, np.finfo(float).tiny
        freedom = 3 * k - self.rank
        n, m = np.maximum(freedom, 1), np.maximum(3 * (N - k), 1)
        total = 0.5 * n * np.log(np.maximum(inside, tiny) / n) + 0.5 * self.rank * np.log(np.maximum(k, 1))
        total += np.where(k < N, 0.5 * m * np.log(np.maximum(outside, tiny) / m), 0.0)
        log_factorial = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, N + 1)))])
        total += log_factorial[N] - log_factorial[k] - log_factorial[N - k]
        return np.where(freedom >= _FREEDOM * 3 * k, total, np.inf)

    def noise(self, chosen: BoolArray, held: float) -> float:
        """Root mean square of the numbers of the rows chosen (N,) about their fit, over its degrees of freedom."""
        return float(self._noise(chosen[np.newaxis], self.squares(chosen[np.newaxis], held))[0])

    def _noise(self, chosen: BoolArray, squares: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt((squares * chosen).sum(axis=1) / np.maximum(3 * chosen.sum(axis=1) - self.rank, 1)))

    def are_gross(self, chosen: BoolArray, held: float) -> BoolArray:
        """(S,) are the rows that are not chosen (S, N) off by GROSS times the noise of the others?"""
        squares = self.squares(chosen, held)
        off = np.sqrt((squares * ~chosen).sum(axis=1) / np.maximum(3 * (~chosen).sum(axis=1), 1))
        return np.asarray(off >= GROSS * self._noise(chosen, squares))

    def contradict(self, chosen: BoolArray, held: float) -> bool:
        """Are the others off by GROSS times the noise of the rows chosen (N,), beyond what these can't say of them?

        A fit to the rows of one station leaves those of another anywhere. With A the normal matrix of the rows chosen
        and J of the others, the errors e of these have the covariance s^2 C, C = 1 + J A^-1 J^T, and
        e^T C^-1 e = e^T e - e^T J (A + J^T J)^-1 J^T e.
        """
        chosen_J, J = self.reduced[chosen].reshape(-1, self.columns), self.reduced[~chosen].reshape(-1, self.columns)
        A = chosen_J.T @ chosen_J + max(held, self._least) * np.eye(self.columns)
        e = self.residual[~chosen].ravel() - J @ np.linalg.solve(A, self.pull[chosen].sum(axis=0))
        g = J.T @ e
        squares = float(e @ e - g @ np.linalg.solve(A + J.T @ J, g))
        return bool(np.sqrt(max(squares, 0.0) / len(e)) >= GROSS * self.noise(chosen, held))

    def most_probable(self, squares: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Of the sets of the k smallest `squares` (S, N) that with the least S: S (S,) and its rows (S, N)."""
        order = np.argsort(squares, axis=1)
        inside = np.cumsum(np.take_along_axis(squares, order, axis=1), axis=1)
        scores = self.score(inside, inside[:, -1:] - inside, np.arange(1, self.count + 1))
        best = np.argmin(scores, axis=1)[:, np.newaxis]
        return np.take_along_axis(scores, best, axis=1)[:, 0], np.argsort(order, axis=1) <= best


def leave_freedom(count: int, rank: int) -> bool:
    """Can a fit of `rank` parameters leave any set of the rows that are searched, of `count`, enough freedom?"""
    numbers = 3 * min(count, _MOST_ROWS)
    return numbers - rank >= _FREEDOM * numbers


def agreeing_rows(rows: Rows, kept: BoolArray, noise: float) -> BoolArray | None:
    """(N,) rows that agree far better than those that the fit kept, None where there are none.

    Args:
        rows: The problem, linearized where the parameters are nominal.
        kept: (N,) the rows that the fit kept.
        noise: [m] what a whitened 1 stands for.
    """
    loose = _LOOSE * (_START_NOISE / noise) ** 2
    chosen = np.linspace(0, rows.count - 1, min(rows.count, _MOST_ROWS)).round().astype(int)
    some = Rows(rows.J[chosen], rows.residual[chosen], rows.rank)
    rng = np.random.default_rng(0)
    picked = np.argsort(rng.random((_STARTS, some.count)), axis=1)[:, :_START_ROWS]
    squares = some.squares_of_few(picked, (_START_NOISE / noise) ** 2)
    scores, sets = some.most_probable(squares)
    few = min(some.count, max(round(_FEWEST * some.count), rows.rank // 2 + 1))
    nearest = squares
    for _ in range(_CONCENTRATIONS):
        nearest = some.squares(nearest <= np.partition(nearest, few - 1, axis=1)[:, few - 1 : few], loose)
    more_scores, more = some.most_probable(nearest)
    scores, sets = np.concatenate([scores, more_scores]), np.concatenate([sets, more])
    followed = np.zeros((0, some.count), dtype=bool)
    for _ in range(_ROUNDS):
        before, followed = followed, np.unique(sets[np.argsort(scores, kind="stable")[:_FOLLOWED]], axis=0)
        if np.array_equal(followed, before):
            break
        scores, sets = some.most_probable(some.squares(followed, loose))
    gross = some.are_gross(sets, loose)
    if not gross.any():
        return None
    found = np.zeros(rows.count, dtype=bool)
    found[chosen] = sets[np.argmin(np.where(gross, scores, np.inf))]
    for _ in range(_ROUNDS):
        last = found
        (score,), (found,) = rows.most_probable(rows.squares(found[np.newaxis], loose))
        if np.array_equal(found, last):
            break
    left = rows.squares(kept[np.newaxis], loose)[0]
    own = rows.score(left[kept].sum(), left[~kept].sum(), np.asarray(kept.sum()))
    return found if not found.all() and rows.contradict(found, loose) and score < own - MARGIN else None
