# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Curves over the joints' positions beside a fit: how curved each is, as held-out rows predict best."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fastcal import _core
from fastcal.calibration.geometry_anchoring import geometry_pulls
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.smoothing import LinearProblem, choose_curvatures
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit, held
from fastcal.diagnosis.memory import without_memory
from fastcal.effects.entries import build_effects
from fastcal.robot.robot import Spec


def with_curvatures(at: Fit, curves: Sequence[Spec]) -> list[Spec]:
    """The entries with their ranges and `curvature`, near a fit without them: one linearization for all."""
    problem = at.problem
    entries = [with_origins(entry, problem.start.robot, problem.kept) for entry in curves]
    if not entries:
        return []
    model, samples = problem.model([*at.entries, *entries], problem.kept)
    first, last = len(at.model.parameters), len(model.parameters)
    theta = np.concatenate([at.theta[:first], np.zeros(last - first), at.theta[first:]])
    near = _core.linearize(model, samples, problem.measured, theta, problem.common_noise, problem.threads)
    row = np.asarray(near.row, dtype=np.int64)
    others = [i if i < first else i + last - first for i in at.free]
    pull = np.full(len(at.prior), np.inf)
    pull[: problem.own] = geometry_pulls(model)
    own = np.array([p.sigma for p in model.parameters[first:last]])
    weak = np.concatenate([held(at.prior, pull)[at.free], rules.PRIOR_WIDTH * own])
    effects = build_effects(entries, model.robot)
    ends = len(others) + np.cumsum([0, *(len(e.parameters) for e in effects)])
    chosen = choose_curvatures(
        LinearProblem(
            without_memory(problem, np.asarray(near.J)[:, [*others, *range(first, last)]] / problem.noise.factor, row),
            without_memory(problem, np.asarray(near.r) / problem.noise.factor, row),
            row,
            [np.arange(a, b) for a, b in pairwise(ends)],
            [np.asarray(e.penalty) for e in effects],
            weak,
        )
    )
    return [{**entry, "curvature": curvature} for entry, curvature in zip(entries, chosen, strict=True)]
