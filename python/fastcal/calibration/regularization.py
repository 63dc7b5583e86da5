# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Regularized least squares for nearly redundant parameters: Levenberg damping or truncated SVD.

min |J x - r|^2 + s^2 |x / size|^2   (levenberg; A. Tikhonov 1963, K. Levenberg 1944),   or x within the first k right
singular vectors of J diag(size)   (truncated). With the SVD J diag(size) = U S V^T both are filters f on the same sum,
    x = diag(size) sum_i f_i (u_i^T r / s_i) v_i,   f_i = s_i^2 / (s_i^2 + s^2)   or   f_i = [i < k].
Where the strength is not given, generalized cross-validation chooses it: the least m |r - J x|^2 / (m - sum_i f_i)^2
for m rows (G. Golub, M. Heath, G. Wahba 1979).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fastcal.arrays import FloatArray, thin_svd
from fastcal.errors import InvalidInput

METHODS = ("levenberg", "truncated")
_NOTHING = 1e-13  # of the largest singular value: what rounding leaves of nothing
_STRENGTHS = 60  # tried on a logarithmic scale before the best one is refined


@dataclass(frozen=True, eq=False)
class RegularizedSolution:
    """x (P,), its strength (damping s, or how many singular values are kept), and sum f, the numbers that it uses."""

    x: FloatArray
    strength: float
    used: float


def regularized_least_squares(
    J: ArrayLike,
    r: ArrayLike,
    *,
    method: str = "levenberg",
    strength: float | None = None,
    sizes: ArrayLike = 1.0,
) -> RegularizedSolution:
    """Solves J x = r where J determines some directions of x badly or not at all.

    Args:
        J: (m, P) Jacobian, rows whitened.
        r: (m,) what is to be explained.
        method: levenberg (every direction is damped, the weak ones most) or truncated (the weak ones are left at 0).
        strength: The damping s, or how many singular values to keep; None: by generalized cross-validation. With
            rows whitened and plausible sizes, damping 1 is the most likely x given that much prior knowledge.
        sizes: Plausible sizes of x, one number or (P,).

    Raises:
        InvalidInput: Shapes do not fit, a number is not finite, or the method or strength is invalid.
    """
    matrix, right = np.asarray(J, dtype=float), np.asarray(r, dtype=float)
    if matrix.ndim != 2 or right.shape != matrix.shape[:1] or not matrix.size:
        raise InvalidInput(f"J must have shape (m, P) and r (m,), got {matrix.shape} and {right.shape}")
    if method not in METHODS:
        raise InvalidInput(f"method must be one of {', '.join(METHODS)}, got '{method}'")
    size = np.broadcast_to(np.asarray(sizes, dtype=float), matrix.shape[1])
    if not (np.isfinite(matrix).all() and np.isfinite(right).all() and (size > 0).all()):
        raise InvalidInput("J and r must be finite and sizes positive")
    U, s, Vt = thin_svd(matrix * size)
    there = s > _NOTHING * s[0]
    U, s, Vt = U[:, there], s[there], Vt[there]
    projected = U.T @ right
    beyond = float(right @ right - projected @ projected)  # what no x explains

    def filters(at: float) -> FloatArray:
        return s**2 / (s**2 + at**2) if method == "levenberg" else (np.arange(len(s)) < at).astype(float)

    def score(at: float) -> float:
        f = filters(at)
        freedom = len(right) - f.sum()
        return float((max(beyond, 0.0) + (((1 - f) * projected) ** 2).sum()) / freedom**2) if freedom > 0 else np.inf

    if strength is None:
        strength = _best(score, s, method)
    elif not (np.isfinite(strength) and strength >= 0):
        raise InvalidInput(f"strength must be a number that is not negative, got {strength}")
    f = filters(strength)
    return RegularizedSolution(size * (Vt.T @ (f * projected / s)), float(strength), float(f.sum()))


def _best(score: Callable[[float], float], s: FloatArray, method: str) -> float:
    """The strength of the least score."""
    if method == "truncated":
        return float(min(range(len(s) + 1), key=score))
    tried = np.geomspace(s[-1] / 100, s[0] * 100, _STRENGTHS)
    k = int(np.argmin([score(at) for at in tried]))
    low, high = np.log(tried[max(k - 1, 0)]), np.log(tried[min(k + 1, _STRENGTHS - 1)])
    return float(np.exp(minimize_scalar(lambda at: score(float(np.exp(at))), bounds=(low, high), method="bounded").x))
