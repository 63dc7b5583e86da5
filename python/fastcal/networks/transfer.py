# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was trained on one arm as the prior of few rows of another of its kind.

    error of the new arm = prior(q, load) + d(q, load),   d a Gaussian process of joint errors, 0 where no row speaks

Few rows let geometry bend to what the prior explains, so the model is identified again behind it. Held-out rows decide:
the arm alone, a process from nothing, the prior as it is, or the prior with d. Where the prior does not clearly gain,
nothing of it is used, and training goes on from nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.prediction import without_correction
from fastcal.correction.correction import Correction, spread
from fastcal.correction.experts import Expert, Shifted
from fastcal.correction.uncertainty import DEVIATIONS, Uncertainty
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.splits import deal
from fastcal.networks.device import one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.options import Options
from fastcal.networks.problem import REGION_ROWS, Problem, cells, residuals_of
from fastcal.robot.robot import Robot

FEWEST_ROWS = 10
LEAST_FOLDS = 5  # with fewer, few rows are a geometry of half of them
GAIN = 1.0  # standard errors by which the prior must beat what is had without it
ALONE, NOTHING, PRIOR, SHIFTED = "model", "gp", "prior", "prior and gp"


class Transfer(NamedTuple):
    """What held-out rows say of a prior.

    Attributes:
        model: With the prior in force, as it would be kept.
        problem: The rows, and the residuals of the arm alone in the folds that did not see them.
        errors: (N, k) held-out errors of each candidate, by its name.
        used: Of the candidates.
        coverage: Share of held-out coordinates within their 90 % intervals.
    """

    model: Robot
    problem: Problem
    errors: dict[str, FloatArray]
    used: str
    coverage: float

    @property
    def helps(self) -> bool:
        """Is the prior used?"""
        return self.used in (PRIOR, SHIFTED)


def transfer(robot: Robot, data: Dataset, prior: Robot, *, folds: int, options: Options) -> Transfer:
    """Holds the prior of another arm against rows of this one.

    Args:
        robot: The arm's own model, calibrated; it is identified again behind the prior.
        data: Its rows.
        prior: A model that `train` made, of another arm of its kind.
        folds: K, at least five.
        options: How to train.

    Raises:
        InvalidInput: The prior has no network, or is of another kind of arm; or too few rows.
    """
    known = _correction_of(prior, robot)
    bare = robot.with_(correction=None)
    if data.position is None:
        raise InvalidInput(f"{data.source}: training needs measured points, x_mm y_mm z_mm")
    rows = data.select(np.flatnonzero(np.isfinite(data.position).all(axis=1)))
    if len(rows) < FEWEST_ROWS:
        raise InvalidInput(f"{data.source}: a prior needs at least {FEWEST_ROWS} rows with a point, got {len(rows)}")
    folds = max(folds, LEAST_FOLDS)
    regions = cells(rows.q, max(1, min(REGION_ROWS, len(rows) // (2 * folds))))
    count = int(regions.max()) + 1
    if count < folds:
        raise InvalidInput(f"{data.source}: {len(rows)} rows are {count} regions, too few for {folds} folds")
    fold = deal(count, folds, np.random.default_rng((options.seed, 0)))[regions]
    seen = residuals_of(bare, rows, bare.poses(rows))
    errors = {name: np.full_like(seen, np.nan) for name in (ALONE, NOTHING, PRIOR, SHIFTED)}
    for k in range(folds):
        options.progress(f"holding out part {k + 1} of {folds}")
        held = np.flatnonzero(fold == k)
        for own, name, further in ((None, ALONE, NOTHING), (known, PRIOR, SHIFTED)):
            fitted, process = _fitted(bare, rows.select(np.flatnonzero(fold != k)), own, options)
            part = rows.select(held)
            left = residuals_of(fitted, part, fitted.poses(part))
            errors[name][held, : left.shape[1]] = left
            added = process.twist(fitted.inputs(part.q, part.payload))[:, : left.shape[1]]
            errors[further][held, : left.shape[1]] = left - added
    measured = np.isfinite(seen)
    errors = {name: np.where(measured, np.nan_to_num(left), 0.0) for name, left in errors.items()}
    inputs = bare.inputs(rows.q, rows.payload)
    problem = Problem(bare, rows, inputs, errors[ALONE], measured, regions, fold, np.zeros(0, dtype=np.intp), 0)
    used = _best(problem, errors)
    model, process = _fitted(bare, rows, known, options)
    return _kept(model, known, process if used == SHIFTED else None, problem, errors, used)


def _correction_of(prior: Robot, robot: Robot) -> Correction:
    """The prior's network, for an arm of its kind."""
    if prior.correction is None:
        raise InvalidInput(f"expected a model with a network, as fastcal train makes it, got {prior.name} without one")
    if prior.joint_types != robot.joint_types:
        kinds = (f"{len(each.joint_types)} joints ({', '.join(each.joint_types)})" for each in (robot, prior))
        raise InvalidInput("expected a prior of an arm of {}, got one of {}".format(*kinds))
    return prior.correction


def _fitted(bare: Robot, rows: Dataset, prior: Correction | None, options: Options) -> tuple[Robot, Expert]:
    """The model identified on rows behind the prior, and the process of what both leave."""
    behind = without_correction(bare.with_(correction=prior), rows)
    fitted = calibrate(bare, behind, checks=False, threads=options.jobs).model.with_(correction=prior)
    left = residuals_of(fitted, rows, fitted.poses(rows))
    every = np.arange(len(rows))
    problem = Problem(
        fitted,
        rows,
        fitted.inputs(rows.q, rows.payload),
        np.nan_to_num(left),
        np.isfinite(left),
        np.zeros(len(rows), dtype=np.intp),
        np.zeros(len(rows), dtype=np.intp),
        every[:0],
        0,
    )
    with one_thread():
        (process,) = fit_gaussian_process(problem, [every], replace(options, progress=lambda text: None))
    return fitted, process


def _best(problem: Problem, errors: dict[str, FloatArray]) -> str:
    """The candidate of least mean error; one with the prior only if it gains by GAIN standard errors of the rows."""
    lengths = {name: problem.lengths(left) for name, left in errors.items()}
    without = min((ALONE, NOTHING), key=lambda name: float(lengths[name].mean()))
    behind = min((PRIOR, SHIFTED), key=lambda name: float(lengths[name].mean()))
    gain = lengths[without] - lengths[behind]
    return behind if gain.mean() > GAIN * gain.std(ddof=1) / np.sqrt(len(gain)) else without


def _kept(
    model: Robot,
    prior: Correction,
    process: Expert | None,
    problem: Problem,
    errors: dict[str, FloatArray],
    used: str,
) -> Transfer:
    """The model with the correction that is used, whose limits and uncertainty are what the rows show."""
    left = errors[PRIOR if process is None else SHIFTED]
    members = prior.members
    limits = np.array([prior.limit, prior.turn_limit])
    if process is not None:
        members = tuple(Shifted(member, process, float(problem.has_turns)) for member in members)
        parts = (errors[PRIOR][:, :3], errors[PRIOR][:, 3:])
        limits += [float(np.linalg.norm(part, axis=1).max(initial=0.0)) for part in parts]
    apart = spread(np.array([member.twist(problem.inputs) for member in members]))
    known, before = (np.where(problem.measured, each, np.nan) for each in (left, problem.residuals))
    uncertainty = Uncertainty.fitted(known, apart, before)
    correction = replace(
        prior, members=members, limit=float(limits[0]), turn_limit=float(limits[1]), uncertainty=uncertainty
    )
    sigma = uncertainty.sigma(apart, np.ones(len(problem)))[:, : left.shape[1]]
    inside = np.abs(left) <= DEVIATIONS * sigma
    return Transfer(model.with_(correction=correction), problem, errors, used, float(inside[problem.measured].mean()))
