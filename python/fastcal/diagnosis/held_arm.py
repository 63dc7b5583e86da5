# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The geometry held near nominal, where too few rows fix it: as `calibrate` holds it (`calibration.shrinkage`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.calibration.shrinkage import shrinkage
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.problem import Problem


def arm_size(problem: Problem) -> float | None:
    """The arm's errors, as far as the rows say, in plausible sizes; None where they fix the geometry well without."""
    start = problem.start.with_(loss="none")
    held = shrinkage(start, start.identify())
    return None if held is None else held.size


def holding(problem: Problem, size: float, last: Fit) -> Problem:
    """The problem with the geometry held near nominal, by `size`, against what the `last` fit leaves.

    What is missing pulls the geometry about as noise of its size does; against the noise of the instrument alone
    nothing would hold it.
    """
    left = last.problem.noise.factor * float(np.sqrt(last.remaining / last.freedom))
    return replace(problem, arm_size=size, noise=replace(problem.noise, factor=max(left, problem.noise.factor)))
