# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise of each kind of reading, with its own degrees of freedom.

A fit takes more from few heights, which alone show how their planes lie, than from many points; with one share of
freedom for all, the noise of the few comes out too small and their rows weigh too much. With h_i the leverage of number
i in the weighted fit, the numbers of observation k have n_k - sum h_i degrees of freedom, and

    s_k^2 = sum r_i^2 / (n_k - sum h_i),

weights and noise found by turns (variance components: F. R. Helmert 1924; W. Foerstner 1979).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.problem import CalibrationProblem

MOST_ROWS = 5000  # of more, no parameter takes a share that counts
_RANK = 1e-13
_ROUNDS = 50
_SETTLED = 1e-4  # relative
_STANDS = 0.01  # relative: the fit does not see a smaller change
_LEAST_FREEDOM = 2.0
_ROUNDING = 1e-9  # [m, rad] noise of exact, simulated numbers
_LEAST = 1e-10  # [m, rad] that a noise can be given as; none is reported as 0 beside a claim that explains all


def noise_of_own_freedom(problem: CalibrationProblem, found: _core.Identification) -> list[float] | None:
    """The common noise of each observation [m or rad]; None where one is read, or the fit's own stands."""
    observations = problem.measured.observations
    common = list(found.common_noise)
    if len(observations) < 2 or len(problem.data) > MOST_ROWS or found.status != "converged" or not found.free:
        return None
    near = problem.linearize(np.asarray(found.theta), common)
    kept = ~np.isin(np.asarray(near.row), found.outliers)
    of_number = np.array([k for k, of in enumerate(observations) for _ in of.components])
    of = of_number[np.asarray(near.number)][kept]
    J, r = np.asarray(near.J)[kept][:, found.free], np.asarray(near.r)[kept]
    estimated = [not each.claims_sigma and tau > _ROUNDING for each, tau in zip(observations, common, strict=True)]
    factor = _factors(J, r, of, estimated)
    if factor is None or np.abs(np.log(factor)).max() < _STANDS:
        return None
    return [max(tau * float(by), _LEAST) for tau, by in zip(common, factor, strict=True)]


def freedom_of_parameters(problem: CalibrationProblem, found: _core.Identification) -> FloatArray | None:
    """(P,) degrees of freedom of each free parameter's deviation; None where one noise, or its claim, stands for all.

    A parameter that few heights determine has a deviation as uncertain as their noise. With v_k the part of its
    variance that the numbers of observation k bring, and nu_k their degrees of freedom,

        nu = (sum v_k)^2 / sum v_k^2 / nu_k  (F. E. Satterthwaite 1946; JCGM 100, G.4.1);  claimed noise: nu_k infinite.
    """
    observations = problem.measured.observations
    if len(observations) < 2 or len(problem.data) > MOST_ROWS or found.status != "converged" or not found.free:
        return None
    near = problem.linearize(np.asarray(found.theta), list(found.common_noise))
    kept = ~np.isin(np.asarray(near.row), found.outliers)
    of = np.array([k for k, each in enumerate(observations) for _ in each.components])[np.asarray(near.number)][kept]
    J = np.asarray(near.J)[kept][:, found.free]
    Q, R = np.linalg.qr(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300))
    size = np.abs(np.diag(R))
    if not size.min() > _RANK * size.max(initial=0.0):
        return None
    by_number = np.linalg.solve(R, Q.T) ** 2  # (P, m): squared shifts by one standard deviation of each number
    v = np.array([by_number[:, of == k].sum(axis=1) for k in range(len(observations))])
    nu = np.array(
        [
            np.inf if each.claims_sigma else max(float(np.sum(1 - np.sum(Q[of == k] ** 2, axis=1))), 1.0)
            for k, each in enumerate(observations)
        ]
    )
    spread = np.sum(v**2 / nu[:, np.newaxis], axis=0)
    whole = np.sum(v, axis=0) ** 2
    return np.asarray(np.divide(whole, spread, out=np.full(len(whole), np.inf), where=spread > 0))


def _factors(J: FloatArray, r: FloatArray, of: NDArray[np.int64], estimated: list[bool]) -> FloatArray | None:
    """(K,) by which to multiply the noise of each observation; None where one leaves no freedom.

    Args:
        J: (m, p) whitened columns.
        r: (m,) whitened residuals at the fit.
        of: (m,) the observation of each number.
        estimated: (K,) is the noise of the observation neither claimed nor rounding?
    """
    factor = np.ones(len(estimated))
    for _ in range(_ROUNDS):
        weight = 1 / factor[of]
        Q = np.linalg.qr(J * weight[:, np.newaxis])[0]
        white = r * weight
        left = white - Q @ (Q.T @ white)
        leverage = np.sum(Q**2, axis=1)
        by = np.ones(len(factor))
        for k in np.flatnonzero(estimated):
            own = of == k
            if not own.any():
                continue
            freedom = float(np.sum(own) - leverage[own].sum())
            if freedom < _LEAST_FREEDOM:
                return None
            by[k] = np.sqrt(float(left[own] @ left[own]) / freedom)
        if not (by > 0).all():
            return None
        factor *= by
        if np.abs(np.log(by)).max() < _SETTLED:
            break
    return factor
