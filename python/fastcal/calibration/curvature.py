# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Is the fit linear within its confidence intervals? If not, other parameters follow the curvature.

From theta along the directions v of the free parameters that rows show least, to the ends of their 95 % intervals,
d = +-1.96 s v with |J v| = 1, the whitened residuals r leave their straight line by

    c = (r(theta + d) + r(theta - d) - 2 r(theta)) / 2,    which other parameters take up by  f = J^+ c.

The bend is the root of the mean square of f_k / (1.96 s_k), s_k their stated deviations: the parameter-effects
curvature of D. Bates and D. Watts (1980, J. R. Statist. Soc. B 42), by parameters. Stated deviations come from J alone;
where the fit is bent, intervals come from profiles (`bent_intervals`). What holds parameters near a value within a
deviation is a row of J each, which does not bend.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fastcal.arrays import FloatArray, thin_svd
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals
from fastcal.said import said

_DIRECTIONS = 3
_REACH = 1.96  # standard deviations
_BENT = 0.15  # of the parameters' own intervals; those of a delta printer, mostly beyond, hold 89 % of the truth


def bend(near: Residuals, problem: CalibrationProblem, limits: Mapping[str, FloatArray]) -> float:
    """The largest of the directions that rows show least; 0 of a robot without closed loops.

    `limits`: the priors and pulls of the fit.
    """
    if not problem.robot.passive:
        return 0.0
    sigma = [limits[key][near.free] for key in ("prior_sigma", "pull_sigma") if len(limits.get(key, ()))]
    J = np.vstack([near.J[near.kept][:, near.free], *(np.diag(1 / each) for each in sigma)])
    size = np.linalg.norm(J, axis=0)
    if len(J) <= J.shape[1] or not size.all():
        return 0.0
    _, S, Vt = thin_svd(J / size)
    r = near.residual[near.kept]
    reach = _REACH * float(np.sqrt(r @ r / max(len(r) - J.shape[1], 1)))
    std = np.linalg.norm(Vt / S[:, np.newaxis], axis=0)  # over s
    largest = 0.0
    for k in range(max(0, len(S) - _DIRECTIONS), len(S)):
        d = np.zeros(len(near.theta))
        d[near.free] = reach * Vt[k] / S[k] / size
        ends = [np.asarray(problem.linearize(near.theta + sign * d, near.noise).r) for sign in (1.0, -1.0)]
        second = np.zeros(len(J))
        second[: len(r)] = ((ends[0] + ends[1])[near.place][near.kept] - 2 * r) / 2
        follows = np.linalg.lstsq(J / size, second, rcond=None)[0]
        largest = max(largest, float(np.sqrt(np.mean((follows / (reach * std)) ** 2))))
    return largest


def is_bent(size: float) -> bool:
    """Is a bend one beyond which the intervals of a straight fit are too narrow?"""
    return not size < _BENT


def bend_caveat(size: float, *, follows: bool) -> str:
    """That deviations are those of a straight fit; and intervals, unless these follow the curve."""
    what = (
        said(
            "the intervals account for the curvature, but the stated standard deviations are those of the linearization"
        )
        if follows
        else said("the stated deviations and intervals are too narrow")
    )
    return said(
        "the rows hardly show some combinations of parameters, and over their intervals the fit is not straight (other "
        "parameters follow by {share:.0%} of theirs): {what}; hold what a caliper knows better, or measure the "
        "orientation too",
        share=size,
        what=what,
    )
