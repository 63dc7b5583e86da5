# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The geometry held near nominal if too few rows determine it, as in `calibrate` (`calibration.shrinkage`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.calibration.shrinkage import MOST, WORTH, errors_size
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.problem import Problem

SHOWN = 10.0  # plausible sizes: ways known no better `calibrate` holds at nominal (GaugeOptions::practical_limit)


def arm_size(last: Fit, within: float = MOST) -> float | None:
    """The arm's errors as a fit shows them, in plausible sizes (`shrinkage`); None where the rows fix it well without.

    With S what the measured numbers tell of the arm, all else open (Schur's complement), and P the deviations of the
    priors, a fit that ends at x has seen S x + P^-2 x, which is drawn from N(0, S + S s^2 S). What names in the fit
    explain is no error of the arm; what the fit leaves counts as noise. Ways that the arm could go farther than
    `within` sizes unseen say nothing.
    """
    own, every = last.problem.own, last.model.parameters
    arm = [k for k, i in enumerate(last.free) if i < own and every[i].owner not in ("base", "tool")]
    if len(arm) < 2:
        return None
    indices = np.array(last.free)[arm]
    size = np.array([every[i].sigma for i in indices])
    prior = (last.prior[indices] / size) ** -2.0
    x = (last.theta - np.append(last.model.start, last.problem.unknowns))[indices] / size
    covariance = last.covariance[np.ix_(arm, arm)] / np.outer(size, size)
    told, ways = np.linalg.eigh(np.linalg.inv(covariance) - np.diag(prior))
    seen = told > within**-2.0
    told, ways = told[seen], ways[:, seen]
    noise = (_left(last) / last.problem.noise.factor) ** 2
    found, spared = errors_size(ways.T @ x + (ways.T @ (prior * x)) / told, np.diag(noise / told))
    return None if spared < WORTH * len(last.free) else found


def _left(last: Fit) -> float:
    """Factor of the noise by which a fit leaves no more than it: that of the instrument, or larger."""
    left = last.problem.noise.factor * float(np.sqrt(last.remaining / last.freedom))
    return max(left, last.problem.noise.factor)


def holding(problem: Problem, size: float, last: Fit) -> Problem:
    """The problem with the geometry held near nominal, by `size`, against what the `last` fit leaves.

    What is missing pulls the geometry about as noise of its size does; against the noise of the instrument alone
    nothing would hold it.
    """
    return replace(problem, arm_size=size, noise=replace(problem.noise, factor=max(_left(last), problem.noise.factor)))
