# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which of many changes a check shows: score tests and odds, from matrices alone.

Whitened residual r (m,), columns B (m, b) of which nothing is known, columns K_i of each hypothesis; P projects across
B. T = |P r|^2 and what a hypothesis explains, T_i = |P K_i (P K_i)^+ r|^2, follow F with the degrees of freedom nu of
the noise (C. R. Rao 1948; prediction test of G. Chow 1960). Odds: k_i ~ N(0, (s S_i)^2) with typical sizes S_i and s
spread over SCALES, the noise's variance integrated out:

    odds_i ~ mean_s |1 + s^2 G_i|^-1/2 (nu + T - Q_i(s))^-(nu + f) / 2

with G_i = (P K_i S_i)^T P K_i S_i, Q_i(s) what this prior lets it explain, f = m - b.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special

from fastcal.arrays import FloatArray, thin_svd

SCALES = (0.3, 1.0, 3.0, 10.0, 30.0)  # typical sizes: an event may be a tenth or thirty of it
NOISE_SCALES = (1.5, 2.0, 3.0, 5.0, 10.0, 30.0)
_ABSORBED = 0.02  # least length that B must leave of a column to speak of it
_UNSEEN = 0.1  # standard deviations of a number: a typical change that makes less does not show
_DRAWS = 1024


@dataclass(frozen=True, eq=False)
class Evidence:
    """Tests of hypotheses at one linear problem, everything whitened.

    Attributes:
        r: (m,).
        B: (m, b).
        K: Columns (m, d_i) of each hypothesis.
        sizes: (d_i,) typical sizes of each.
        freedom: nu.
    """

    r: FloatArray
    B: FloatArray
    K: list[FloatArray]
    sizes: list[FloatArray]
    freedom: float

    @cached_property
    def _Q(self) -> FloatArray:
        length = np.linalg.norm(self.B, axis=0)
        return np.asarray(np.linalg.qr(self.B / np.where(length > 0, length, 1.0))[0])

    @cached_property
    def left(self) -> FloatArray:
        """(m,) P r."""
        return np.asarray(self.r - self._Q @ (self._Q.T @ self.r))

    @property
    def degrees(self) -> int:
        """F = m - b."""
        return int(len(self.r) - self.B.shape[1])

    @property
    def misfit(self) -> float:
        """T = |P r|^2."""
        return float(self.left @ self.left)

    @property
    def p_value(self) -> float:
        """Of the misfit as a whole."""
        return _tail(self.misfit, self.degrees, self.freedom)

    @cached_property
    def tests(self) -> list[Tested]:
        """One a hypothesis."""
        return [self._tested(k, s) for k, s in zip(self.K, self.sizes, strict=True)]

    def _tested(self, K: FloatArray, sizes: FloatArray) -> Tested:
        PK = K - self._Q @ (self._Q.T @ K)
        before = np.linalg.norm(K * sizes, axis=0)
        scaled = PK * sizes
        U, length, Vt = thin_svd(scaled)
        seen = length > max(_ABSORBED * float(before.max(initial=0.0)), _UNSEEN)
        if not seen.any():
            return Tested(
                0, 0.0, 1.0, np.zeros(K.shape[1]), np.full(K.shape[1], np.inf), -np.inf, np.zeros((len(K), 0))
            )
        U, length, Vt = U[:, seen], length[seen], Vt[seen]
        c = U.T @ self.left
        value = sizes * (Vt.T @ (c / length))
        std = sizes * np.sqrt(np.sum((Vt.T / length) ** 2, axis=1))
        if not seen.all():
            std = np.where(np.linalg.norm(Vt, axis=0) > 0.99, std, np.inf)
        logs = []
        for s in SCALES:
            g = (s * length) ** 2
            explained = float(np.sum(c**2 * g / (1 + g)))
            logs.append(-0.5 * float(np.sum(np.log1p(g))) - self._power * np.log(self._spread(explained)))
        statistic = float(c @ c)
        rank = int(seen.sum())
        odds = float(special.logsumexp(logs) - np.log(len(SCALES)))
        return Tested(rank, statistic, _tail(statistic, rank, self.freedom), value, std, odds, U)

    def odds_of(self, several: list[int]) -> float:
        """Logarithm of the odds of several hypotheses together, on the scale of `Tested.odds`."""
        K = np.hstack([self.K[i] for i in several])
        return self._tested(K, np.concatenate([self.sizes[i] for i in several])).odds

    @property
    def _power(self) -> float:
        return 0.5 * (self._known + self.degrees)

    @property
    def _known(self) -> float:
        return min(self.freedom, 1e6)

    def _spread(self, explained: float) -> float:
        """1 + (T - explained) / nu."""
        return max(1 + (self.misfit - explained) / self._known, 1e-300)

    @property
    def noise_odds(self) -> tuple[float, float]:
        """Logarithm of the odds that nothing but the noise has grown, and by which factor: sqrt(T / f)."""
        logs = [
            -self.degrees * np.log(k) - self._power * np.log(1 + self.misfit / k**2 / self._known) for k in NOISE_SCALES
        ]
        grown = float(np.sqrt(self.misfit / max(self.degrees, 1)))
        return float(special.logsumexp(logs) - np.log(len(NOISE_SCALES))), grown

    @cached_property
    def effective_tests(self) -> float:
        """How many independent tests the hypotheses are worth: from the mean of the smallest p under noise alone."""
        shown = [t for t in self.tests if t.rank > 0]
        if not shown:
            return 1.0
        draws = np.random.default_rng(0).standard_normal((_DRAWS, len(self.r)))
        smallest = np.ones(_DRAWS)
        for t in shown:
            statistic = np.sum((draws @ t.basis) ** 2, axis=1)
            smallest = np.minimum(smallest, special.chdtrc(t.rank, statistic))
        return max(float(1 / smallest.mean() - 1), 1.0)

    def adjusted(self, p: float) -> float:
        """A p-value of one hypothesis, held against having tried all of them."""
        return float(-np.expm1(self.effective_tests * np.log1p(-min(p, 1 - 1e-16))))

    @property
    def smallest_p(self) -> float:
        """The smallest adjusted p-value of a hypothesis."""
        return self.adjusted(min((t.p_value for t in self.tests if t.rank > 0), default=1.0))

    def given(self, added: list[int]) -> Evidence:
        """The same with the columns of some hypotheses among those of which nothing is known."""
        columns = []
        for i in added:
            K = self.K[i] * self.sizes[i]
            columns.append(K[:, np.linalg.norm(K, axis=0) > 0])
        B = np.hstack([self.B, *columns])
        Q, R = np.linalg.qr(B / np.maximum(np.linalg.norm(B, axis=0), 1e-300))
        kept = np.abs(np.diag(R)) > 1e-9
        return Evidence(self.r, Q[:, kept], self.K, self.sizes, self.freedom)


@dataclass(frozen=True, eq=False)
class Tested:
    """One hypothesis.

    Attributes:
        rank: Directions of it that show.
        statistic, p_value: What it explains.
        value, std: (d,) its numbers when it alone is there, SI; inf where they don't show.
        odds: Logarithm; only differences mean something.
        basis: (m, rank) orthonormal, of what shows of it.
    """

    rank: int
    statistic: float
    p_value: float
    value: FloatArray
    std: FloatArray
    odds: float
    basis: FloatArray


def _tail(statistic: float, rank: int, freedom: float) -> float:
    """P(statistic or more) of rank times F(rank, freedom)."""
    if rank <= 0:
        return 1.0
    if not np.isfinite(freedom) or freedom > 1e6:
        return float(special.chdtrc(rank, statistic))
    return float(special.fdtrc(rank, max(freedom, 1.0), statistic / rank))
