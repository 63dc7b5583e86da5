# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which poses separate one cause of error from another: T-optimality, from Jacobian blocks alone.

    D_ij = |P C_i b_i|^2,  P the projection across [A, C_j]

is what the fit of a wrong cause j leaves of the true cause i, in squared standard deviations: the noncentrality of the
chi-squared test that would refuse j (A. Atkinson, V. Fedorov 1975). No robot is known here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput

LEVEL = 0.01  # of the test that refuses the wrong cause


@dataclass(frozen=True, eq=False)
class Separation:
    """What `separating_poses` chose; [i, j]: cause i is there, cause j is fitted; diagonals are 0 (D) and nan (power).

    Attributes:
        chosen: Indices of the candidates, in the order in which they were added.
        before: (m, m) D_ij of the data measured already.
        after: (m, m) D_ij with the chosen candidates.
        power_before: (m, m) probability that the test at `level` refuses j.
        power_after: The same with the chosen candidates.
        level: Probability that the test refuses what is right.
    """

    chosen: list[int]
    before: FloatArray
    after: FloatArray
    power_before: FloatArray
    power_after: FloatArray
    level: float

    def of(self, candidates: ArrayLike) -> Separation:
        """The same where candidate i is `candidates[i]` of a longer list."""
        longer = np.asarray(candidates, dtype=np.int64)
        return replace(self, chosen=[int(c) for c in longer[self.chosen]])


def separating_poses(
    common: ArrayLike,
    causes: Sequence[ArrayLike],
    expected: Sequence[ArrayLike],
    count: int,
    *,
    prior: ArrayLike | None = None,
    until_power: float | None = None,
    level: float = LEVEL,
    threads: int = 1,
) -> Separation:
    """Chooses candidates that best separate m causes of error.

    Greedy on sum over i != j of log(1 + D_ij); each candidate's gain is exact. Before anything was measured, those that
    determine most of the parameters come first.

    Args:
        common: (N, k, p) derivatives of what a candidate measures by the parameters that are identified in any case,
            each row divided by its standard deviation.
        causes: m arrays (N, k, c_i), the same by the parameters of each cause.
        expected: m arrays: (c_i,) how much of cause i there is, as found or as plausible; or (c_i, e_i), columns whose
            squares add up, such as the diagonal of independent plausible sizes.
        count: Candidates to choose; each at most once.
        prior: Information J^T J (P, P) of the data measured already, on [common, causes ...] in this order, P their
            sum; None: nothing was measured yet.
        until_power: Stop where each pair is separated with this probability.
        level: Of the test.
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: Shapes do not fit, or a number is not finite.
    """
    blocks = [np.asarray(block, dtype=float) for block in (common, *causes)]
    if any(block.ndim != 3 or block.shape[:2] != blocks[0].shape[:2] for block in blocks):
        raise InvalidInput(
            f"common and causes must have shapes (N, k, columns) of one N and k, got {[b.shape for b in blocks]}"
        )
    rows = blocks[0].shape[1]
    flat = [np.ascontiguousarray(block.reshape(-1, block.shape[2])) for block in blocks]
    sizes = [np.asarray(size, dtype=float) for size in expected]
    sizes = [size[:, None] if size.ndim == 1 else size for size in sizes]
    freedom = np.array([size.shape[1] for size in sizes])
    enough = np.inf if until_power is None else float(_needed(until_power, level, int(freedom.max(initial=1))))
    found = _core.separate(
        flat[0],
        flat[1:],
        sizes,
        count,
        rows=rows,
        prior=None if prior is None else np.asarray(prior, dtype=float),
        enough=enough,
        threads=threads,
    )
    before, after = np.asarray(found.before), np.asarray(found.after)
    return Separation(
        list(found.chosen), before, after, _power(before, freedom, level), _power(after, freedom, level), level
    )


def _power(separation: FloatArray, freedom: NDArray[np.int64], level: float) -> FloatArray:
    """(m, m) probability that a chi-squared of `freedom[i]` and noncentrality D_ij passes its limit."""
    from scipy import stats  # takes long to import

    k = np.broadcast_to(freedom[:, None], separation.shape)
    power = np.asarray(stats.ncx2.sf(stats.chi2.isf(level, k), k, separation))
    np.fill_diagonal(power, np.nan)
    return power


def _needed(power: float, level: float, freedom: int) -> float:
    """The noncentrality at which the test at `level` has this power."""
    from scipy import optimize, stats  # take long to import

    if not level < power < 1:
        raise InvalidInput(f"until_power must lie between the level {level} and 1, got {power}")
    limit = stats.chi2.isf(level, freedom)
    return float(optimize.brentq(lambda d: stats.ncx2.sf(limit, freedom, d) - power, 0.0, 1e4))
