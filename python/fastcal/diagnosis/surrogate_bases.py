# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The result compared with simpler models that have a surrogate of their residuals.

A wrong name, a sag or a curve of every joint takes a part of what has no name, and what it leaves of that no smooth
function of one place finds any more. So the geometry alone, and with the names alone, are tried with their surrogates
as well. Rows held out decide: those of a model's own fit, less what its surrogate takes of rows left out of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.adaptation import robot_of
from fastcal.diagnosis.held_out import fold_of, gain
from fastcal.diagnosis.noise import NoiseLevel
from fastcal.diagnosis.plain_models import JUDGED, Judged, judged
from fastcal.diagnosis.remaining_surrogate import surrogate_of
from fastcal.diagnosis.rivals import Model

# Share of the noise that a model with a surrogate must leave of rows held out to be compared: less is no prediction,
# but squares of large errors, linearized at two fits. Where it was real it left 1.18 or more, in nine sets.
MIN_LEFT = 0.5


def best_with_surrogate(written: Judged, simpler: Sequence[Model], level: NoiseLevel, threads: int) -> Judged:
    """The written model, or the simpler one that with its surrogate predicts held-out rows best, if clearly better."""
    others = [model for model in simpler if model.fit is not written.model.fit]
    if not others or len(written.model.fit.problem.rows) > rules.CHOSEN_AGAIN_ROWS:
        return written
    less = None if written.holds_the_arm else _less(written.model, level, threads)
    own = written.squares if less is None else written.squares - less
    best, lead = written, 0.0
    for model in others:
        less = _less(model, level, threads)
        if less is None:
            continue
        one = judged(model, is_plain=True)
        left = one.squares - less
        if np.nanmean(left) < MIN_LEFT * _noise(model):
            continue  # squares of large errors, linearized at two fits, do not compare
        share, error = gain(left, own, posture_groups(model.fit.problem.data))
        if share > max(lead, rules.MIN_PLAIN_SHARE, rules.MIN_GAIN * error):
            best, lead = replace(one, lead=share, has_surrogate=True), share
    return best


def _noise(model: Model) -> float:
    """The mean square of a row that noise makes, in units of its claimed noise."""
    at = model.fit
    return len(at.near.r) / len(at.problem.rows) * at.problem.noise.factor**2


def _less(model: Model, level: NoiseLevel, threads: int) -> FloatArray | None:
    """(N,) by how much the square of each measured row, left out, is less with the surrogate of a model; None: none."""
    at, data = model.fit, model.fit.problem.data
    folds = []
    for owner in JUDGED:
        fold = np.full(len(data), -1, dtype=np.intp)
        fold[data.measured] = fold_of(data.select(data.measured), owner)
        folds.append(fold)
    robot, drifts = robot_of(at, level.sigma), level.slow.drifts
    found = surrogate_of(robot, at, model.reaches, drifts=drifts, folds=folds, threads=threads)
    if found is None or not found.added:
        return None
    out = np.zeros(len(model.reaches))
    out[model.reaches] = found.less * at.problem.noise.factor**2
    return out
