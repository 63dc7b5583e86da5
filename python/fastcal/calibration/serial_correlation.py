# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Serially correlated noise: the errors of successive rows are similar.

Temperature, air and drift make noise that changes slowly. Modelled as AR(1), rows s and t are correlated by Omega_st =
rho^|s - t|, each coordinate on its own. Least squares stays unbiased, but its covariance is s^2 H Omega H^T with H =
(J^T J)^-1 J^T and s^2 = |r|^2 / tr(M Omega), M = 1 - J H: the sandwich of W. Newey, K. West 1987 with a parametric
filling, which fifty rows can bear. A fit takes slow noise away, so rho is the one at which the expected product of
neighbouring residuals is the one that is found; the degrees of freedom are F. Satterthwaite's (1946), tr(M Omega)^2 /
tr((M Omega)^2).

Whether there is any is asked as J. Durbin and G. Watson (1950) did: of white noise the products of neighbours, as a
share of the squares, have the mean tr(M B) / tr(M), B 1/2 for neighbours, and nearly the variance 1 / pairs. The mean
is below 0 where the fit has columns that change slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import BoolArray, FloatArray, IntArray
from fastcal.calibration import tall

DEVIATIONS = 3.0  # white noise correlates neighbours by so much in one of a thousand sets
_FEWEST_ROWS = 12
MOST = 0.98
_STEPS = 20
_FADED = 1e-18
_RIDGE = 1e-9  # on unit columns


@dataclass(frozen=True, eq=False)
class SerialCorrelation:
    """What noise that rows share makes of a fit.

    Attributes:
        rho: Correlation of neighbouring rows, or of any two rows of a stay.
        covariance: (p, p) of the parameters.
        noise: The noise, in units of that which white noise would have left.
        freedom: Degrees of freedom of the noise.
    """

    rho: float
    covariance: FloatArray
    noise: float
    freedom: float


def serial_correlation(
    J: FloatArray, residual: FloatArray, row: IntArray, count: int, deviations: float = DEVIATIONS
) -> SerialCorrelation | None:
    """The AR(1) noise that residuals show along the order of the rows; None where white noise would do.

    Arguments as of `neighbour_correlation`.
    """
    alike = _alike(J, residual, row, count, deviations, beside_fit=True)
    if alike is None:
        return None
    Q, R = np.linalg.qr(alike.J)
    r = alike.left(Q)
    q, used, rho = alike.table(Q), alike.used, alike.correlation(Q)
    width, white = q.shape[1], len(r) - len(R)
    Omega_q = _smoothed(q, rho) * used[:, np.newaxis, np.newaxis]
    inner = np.einsum("tcp,tcq->pq", q, Omega_q, optimize=True)
    trace = float(len(r) - np.trace(inner))
    lags = range(1, min(count, 400))
    shared = np.array([np.sum(used[k:] & used[: count - k]) for k in lags])
    squares = width * (used.sum() + 2 * float(shared @ rho ** (2.0 * np.array(lags))))
    squares += float(np.sum(inner * inner)) - 2 * float(np.sum(Omega_q**2))
    inverse = np.linalg.inv(R)
    covariance = inverse @ inner @ inverse.T * (float(r @ r) / trace)
    return SerialCorrelation(rho, covariance, float(np.sqrt(white / trace)), trace**2 / squares)


def neighbour_correlation(
    J: FloatArray,
    residual: FloatArray,
    row: IntArray,
    count: int,
    deviations: float = DEVIATIONS,
    *,
    beside_fit: bool = True,
) -> float | None:
    """The rho of `serial_correlation`, without what it makes of the fit; None where white noise would do.

    Args:
        J: (m, p) whitened columns of the free parameters, of full rank.
        residual: (m,) whitened.
        row: (m,) the row that each number belongs to, 0 ... count - 1 in the order of measuring, ascending.
        count: Rows, those without a number included.
        deviations: By how many standard deviations neighbours must be more alike than white noise makes them.
        beside_fit: Compare with what white noise leaves beside the fit; else with 0, as before any fit, which asks for
            more: neighbours are alike too where an effect is missing and the order of rows is one of poses.
    """
    alike = _alike(J, residual, row, count, deviations, beside_fit)
    if alike is None:
        return None
    return alike.correlation(alike.basis)


@dataclass(frozen=True, eq=False)
class _Alike:
    """Rows whose neighbours err more alike than white noise would make them.

    Attributes:
        used: (N,) rows that count, those with `width` numbers.
        J: (m, p) their columns.
        basis: (m, p) of them, orthonormal but for a ridge.
        residual: (m,).
    """

    used: BoolArray
    width: int
    J: FloatArray
    basis: FloatArray
    residual: FloatArray

    def table(self, values: FloatArray) -> FloatArray:
        """(N, width, ...) with zeros in rows that are not used."""
        if self.used.all():
            return values.reshape(-1, self.width, *values.shape[1:])
        out = np.zeros((len(self.used), self.width, *values.shape[1:]))
        out[self.used] = values.reshape(-1, self.width, *values.shape[1:])
        return out

    def left(self, Q: FloatArray) -> FloatArray:
        """(m,) what columns with the orthonormal basis Q (m, p) leave."""
        return self.residual - Q @ (Q.T @ self.residual)

    def correlation(self, Q: FloatArray) -> float:
        """rho, beside the columns with this basis."""
        r = self.left(Q)
        e = self.table(r)
        return _correlation(self.table(Q), self.used, _neighbours(e, e) / float(r @ r))


def _alike(
    J: FloatArray, residual: FloatArray, row: IntArray, count: int, deviations: float, beside_fit: bool
) -> _Alike | None:
    """None where white noise would do; arguments as of `neighbour_correlation`."""
    numbers = np.bincount(row, minlength=count)
    width = int(np.bincount(numbers[numbers > 0]).argmax())
    used = numbers == width
    keep = used[row]
    if not keep.all():
        J, residual = J[keep], residual[keep]
    if used.sum() < _FEWEST_ROWS or len(residual) <= J.shape[1]:
        return None

    pairs = width * int(np.sum(used[1:] & used[:-1]))
    white = len(residual) - J.shape[1]
    found = _Alike(used, width, J, _basis(J), residual)
    e = found.table(found.left(found.basis))
    alike = _neighbours(e, e) / max(float(np.sum(e * e)), 1e-300)
    if pairs == 0 or (alike + beside_fit * J.shape[1] / white) * np.sqrt(pairs) < deviations:
        return None  # whatever the mean is: a column lowers the sum of products by one square at most
    if beside_fit:
        q = found.table(found.basis)
        mean = -_neighbours(q, q) / white
        if (alike - mean) * np.sqrt(pairs) < deviations:
            return None
    return found


def _correlation(q: FloatArray, used: BoolArray, found: float) -> float:
    """The rho at which noise makes the products of neighbouring residuals this share of their squares, by bisection.

    q (N, width, p) is an orthonormal basis of the columns, 0 in rows that are not `used`. Both sums are polynomials in
    rho: Q^T Omega Q is the sum over k of rho^|k| sum over t of q_t^T q_(t+k), so the squares are
    tr(M Omega) = m - sum over k of rho^|k| sum over t of q_t . q_(t+k), and the products, with
    K = sum over t of q_t^T q_(t+1) and w_t = q_(t-1) + q_(t+1), are
    rho pairs + sum over k of rho^|k| sum over t of q_t . (q K - w)_(t+k).
    """
    width, p = q.shape[1:]
    beside = np.zeros_like(q)
    beside[1:] += q[:-1]
    beside[:-1] += q[1:]
    beside[~used] = 0.0
    K = tall.inner(q[:-1].reshape(-1, p), q[1:].reshape(-1, p))
    squares, products = _lagged(q, (q, tall.times(q.reshape(-1, p), K).reshape(q.shape) - beside))
    numbers, pairs = width * used.sum(), width * np.sum(used[1:] & used[:-1])
    low, high, lag = 0.0, MOST, np.arange(len(q))
    for _ in range(_STEPS):
        middle = (low + high) / 2
        faded = middle**lag
        is_less = middle * pairs + faded @ products < found * (numbers - faded @ squares)
        low, high = (middle, high) if is_less else (low, middle)
    return low


def _lagged(a: FloatArray, others: Sequence[FloatArray]) -> list[FloatArray]:
    """(N,) of each b: sum over t of a_t . b_(t+k) + a_t . b_(t-k), of k = 0 once; a, b (N, width, p). By spectra."""
    size = _fast_length(2 * len(a))
    spectra = np.zeros((len(others), size // 2 + 1))
    for c in range(a.shape[1]):  # one coordinate at a time: memory
        of_a = np.fft.rfft(a[:, c].T, size)
        for spectrum, b in zip(spectra, others, strict=True):
            of_b = of_a if b is a else np.fft.rfft(b[:, c].T, size)
            spectrum += np.einsum("pf,pf->f", of_a.real, of_b.real) + np.einsum("pf,pf->f", of_a.imag, of_b.imag)
    even = np.fft.irfft(spectra, size)[:, : len(a)]  # of k and -k, the mean
    return [np.r_[sums[0], 2 * sums[1:]] for sums in even]


def _fast_length(least: int) -> int:
    """The next number whose prime factors are 2, 3 and 5: a spectrum of such a length is quick.

    SciPy has the same as `next_fast_len`, but its import takes longer than a calibration.
    """
    odd: list[int] = [3**i * 5**j for i in range(least.bit_length()) for j in range(least.bit_length())]
    return min(factor << (-(-least // factor) - 1).bit_length() for factor in odd)


def _basis(J: FloatArray) -> FloatArray:
    """Q (m, p) of J, but for the ridge: a tenth of the work of a QR, which few fits need."""
    normal = tall.gram(J)
    length = np.sqrt(np.diag(normal))
    length = np.where(length > 0, length, 1.0)
    normal /= np.outer(length, length)
    normal[np.diag_indices_from(normal)] += _RIDGE
    return tall.over(J, length[:, np.newaxis] * np.linalg.cholesky(normal))


def _neighbours(a: FloatArray, b: FloatArray) -> float:
    """Sum over t of a_t b_(t+1); (N, width) or (N, width, p)."""
    return float(np.vdot(a[:-1], b[1:]))


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
