# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The best of fastcal on the SR210D's calibration rows, a Gaussian process behind each fit, and what it lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fastcal.calibration.calibrate import CalibrationResult
from fastcal.correction.joints import GaussianProcess
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.options import Options
from fastcal.networks.problem import problem_of
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.study import Run

FOLDS = 2  # 50 rows are not regions enough for more


def behind(model: Robot, data: Dataset, seed: int, shown: Mapping[str, Dataset]) -> Run:
    """Errors [mm] of the rows `shown` with a Gaussian process, fitted to `data`, behind the model."""
    process = _process(model, data, seed)
    out: Run = {}
    for name, rows in shown.items():
        errors = _after(model, process, rows)
        out[name] = lengths_mm(errors) | {"by_pose": [float(x) for x in np.linalg.norm(errors, axis=1) / MM]}
    return out


def by_rows(
    fit: Callable[[Dataset], CalibrationResult],
    always: Dataset,
    more: Dataset,
    counts: Sequence[int],
    unseen: Dataset,
    seed: int,
) -> dict[str, float]:
    """Mean errors [mm] of `unseen` by how many rows of `more` are learnt.

    Args:
        fit: The model of all rows.
        always: Rows of the model alone.
        more: Rows that the process behind it learns as well, the first of them.
        counts: How many.
        unseen: Other rows.
        seed: Of the process.
    """
    out = {}
    for count in counts:
        rows = more.select(np.arange(count))
        model = fit(Dataset.concatenate([always, rows])).model
        out[str(count)] = lengths_mm(_after(model, _process(model, rows, seed), unseen))["mean"]
    return out


def _process(model: Robot, data: Dataset, seed: int) -> GaussianProcess:
    problem = problem_of(model, data, folds=FOLDS, seed=seed)
    with one_thread():
        (process,) = fit_gaussian_process(problem, [np.arange(len(problem))], Options(seed=seed))
    return process


def _after(model: Robot, process: GaussianProcess, data: Dataset) -> FloatArray:
    """(N, 3) what is left [m]."""
    return np.asarray(left(model, data) - process.displacement(model.inputs(data.q, data.payload)))
