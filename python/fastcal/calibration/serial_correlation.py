# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise with memory: errors of rows that were measured one after the other are alike.

Temperature, air and drift make noise that changes slowly. Modelled as AR(1), rows s and t are correlated by Omega_st =
rho^|s - t|, each coordinate on its own. Least squares stays unbiased, but its covariance is s^2 H Omega H^T with H =
(J^T J)^-1 J^T and s^2 = |r|^2 / tr(M Omega), M = 1 - J H: the sandwich of W. Newey, K. West 1987 with a parametric
filling, which fifty rows can bear. A fit takes slow noise away, so rho is the one at which the expected product of
neighbouring residuals is the one that is found; the degrees of freedom are F. Satterthwaite's (1946), tr(M Omega)^2 /
tr((M Omega)^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_DEVIATIONS = 3.0  # white noise correlates neighbours by so much in one of a thousand sets
_FEWEST_ROWS = 12
_MOST = 0.98
_STEPS = 20
_FADED = 1e-18
_RIDGE = 1e-9  # on unit columns


@dataclass(frozen=True, eq=False)
class SerialCorrelation:
    """What AR(1) noise makes of a fit.

    Attributes:
        rho: Correlation of neighbouring rows.
        covariance: (p, p) of the parameters.
        noise: The noise, in units of that which white noise would have left.
        freedom: Degrees of freedom of the noise.
    """

    rho: float
    covariance: FloatArray
    noise: float
    freedom: float


def serial_correlation(J: FloatArray, residual: FloatArray, row: IntArray, count: int) -> SerialCorrelation | None:
    """The AR(1) noise that residuals show along the order of the rows; None where white noise would do.

    Args:
        J: (m, p) whitened columns of the free parameters, of full rank.
        residual: (m,) whitened.
        row: (m,) the row that each number belongs to, 0 ... count - 1 in the order of measuring, ascending.
        count: Rows, those without a number included.
    """
    numbers = np.bincount(row, minlength=count)
    width = int(np.bincount(numbers[numbers > 0]).argmax())
    used = numbers == width
    keep = used[row]
    J, residual = J[keep], residual[keep]
    if used.sum() < _FEWEST_ROWS or len(residual) <= J.shape[1]:
        return None

    def table(values: FloatArray) -> FloatArray:
        """(count, width, ...) with zeros in rows that are not used."""
        out = np.zeros((count, width, *values.shape[1:]))
        out[used] = values.reshape(-1, width, *values.shape[1:])
        return out

    pairs = width * int(np.sum(used[1:] & used[:-1]))
    e = table(_left(J, residual))
    if pairs == 0 or _neighbours(e, e) * np.sqrt(pairs) < _DEVIATIONS * float(np.sum(e * e)):
        return None
    Q, R = np.linalg.qr(J)
    r = residual - Q @ (Q.T @ residual)
    e = table(r)
    found = _neighbours(e, e) / float(r @ r)
    q, here = table(Q), used[:, np.newaxis, np.newaxis]

    def at(rho: float) -> tuple[float, float, FloatArray, FloatArray]:
        """tr(M Omega), the expected product of neighbours, Q^T Omega Q and Omega Q."""
        Omega_q = _smoothed(q, rho) * here
        inner = np.einsum("tcp,tcq->pq", q, Omega_q, optimize=True)
        product = rho * pairs - _neighbours(q, Omega_q) - _neighbours(Omega_q, q) + _neighbours(q @ inner, q)
        return float(len(r) - np.trace(inner)), product, inner, Omega_q

    low, high = 0.0, _MOST
    for _ in range(_STEPS):
        middle = (low + high) / 2
        trace, product, _, _ = at(middle)
        low, high = (middle, high) if product < found * trace else (low, middle)
    trace, _, inner, Omega_q = at(low)
    lags = range(1, min(count, 400))
    shared = np.array([np.sum(used[k:] & used[: count - k]) for k in lags])
    squares = width * (used.sum() + 2 * float(shared @ low ** (2.0 * np.array(lags))))
    squares += float(np.sum(inner * inner)) - 2 * float(np.sum(Omega_q**2))
    white = len(r) - J.shape[1]
    inverse = np.linalg.inv(R)
    covariance = inverse @ inner @ inverse.T * (float(r @ r) / trace)
    return SerialCorrelation(low, covariance, float(np.sqrt(white / trace)), trace**2 / squares)


def _left(J: FloatArray, residual: FloatArray) -> FloatArray:
    """(m,) what J leaves, by normal equations: a tenth of the work of a QR, which few fits need after all."""
    length = np.linalg.norm(J, axis=0)
    J = J / np.where(length > 0, length, 1.0)
    normal = J.T @ J
    normal[np.diag_indices_from(normal)] += _RIDGE
    return np.asarray(residual - J @ np.linalg.solve(normal, J.T @ residual))


def _neighbours(a: FloatArray, b: FloatArray) -> float:
    """Sum over t of a_t b_(t+1); (N, width) or (N, width, p)."""
    return float(np.sum(a[:-1] * b[1:]))


def _smoothed(values: FloatArray, rho: float) -> FloatArray:
    """Omega values, values (N, ...): what came before and what comes after, each fading by rho a row."""
    return _faded(values, rho) + _faded(values[::-1], rho)[::-1] - values


def _faded(values: FloatArray, rho: float) -> FloatArray:
    """(N, ...) sum over k of rho^k values[t - k] = (1 + rho B) (1 + rho^2 B^2) (1 + rho^4 B^4) ..., B the step back."""
    out, step, factor = values, 1, rho
    while step < len(values) and factor > _FADED:
        later = out.copy()
        later[step:] += factor * out[:-step]
        out, step, factor = later, 2 * step, factor * factor
    return out
