# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Smoothness of joint curves and other smoothed effects, chosen by the prediction of held-out rows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.geometry_anchoring import geometry_pulls
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.smoothing import LinearProblem, choose_curvatures
from fastcal.diagnosis import rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.priors import held
from fastcal.effects.entries import curve_of
from fastcal.place import place_of
from fastcal.robot.robot import Spec

# Knots over those of the coarser curve, from which on a finer one is tried.
FINER = 1.25
# Parts of an interval between knots, of which on average one must hold rows, and measured numbers a knot at least.
PLACES_PER_KNOT = 4
NUMBERS_PER_KNOT = 4
# Knots of all curves at most: a file holds their covariance.
MAX_KNOTS = 850


def with_finer_knots(at: Fit, curves: Sequence[Spec]) -> list[Spec] | None:
    """The entries with knots close enough for waves up to FINEST_ORDER; None where the rows show no finer curves.

    A joint that makes more than a turn gets one curve for all of them: what gears and encoders err by comes again.
    """
    q = at.problem.kept.q
    wanted, entries = [], []
    for entry in curves:
        own = q[:, place_of(entry["owner"]).index]
        bare = {"effect": entry["effect"], "owner": entry["owner"]}
        if np.ptp(own) > 2 * np.pi:
            own, bare = own % (2 * np.pi), {**bare, "periodic": 1}
        wanted.append(_shown(own))
        entries.append(bare)
    most = min(len(at.near.r) / NUMBERS_PER_KNOT, MAX_KNOTS)
    share = min(1.0, most / max(sum(wanted), 1))
    coarse = [len(effect.parameters) for effect in at.problem.effects(curves)]
    is_finer = [share * own > FINER * before for own, before in zip(wanted, coarse, strict=True)]
    if not any(is_finer):
        return None
    return [
        {**bare, "knots": int(share * own)} if finer else entry
        for entry, bare, own, finer in zip(curves, entries, wanted, is_finer, strict=True)
    ]


def _shown(q: FloatArray) -> int:
    """How many knots show waves of FINEST_ORDER over a joint's range, or as many as it has been at places apart."""
    span = float(np.ptp(q))
    knots = int(span * rules.FINEST_ORDER / np.pi)
    while knots > 0:
        apart = span / (knots * PLACES_PER_KNOT)
        if len(np.unique(np.floor((q - q.min()) / apart))) >= knots:
            break
        knots = int(0.9 * knots)
    return knots


def with_curvatures(at: Fit, curves: Sequence[Spec], start: Sequence[float] | None = None) -> list[Spec]:
    """The entries with their ranges and `curvature`, near a fit without them: one linearization for all.

    Those that have nothing to smooth stay without; beside curves of joints the geometry is pulled.

    Args:
        at: The fit.
        curves: The entries.
        start: Curvatures that the search begins from, such as those of coarser knots; None: it tries all.
    """
    problem = at.problem
    entries = [with_origins(entry, problem.start.robot, problem.kept) for entry in curves]
    if not entries:
        return []
    model, samples = problem.model([*at.entries, *entries], problem.kept)
    first, last = len(at.model.parameters), len(model.parameters)
    theta = np.concatenate([at.theta[:first], np.zeros(last - first), at.theta[first:]])
    near = problem.linearized(model, samples, theta)
    row = near.row
    others = [i if i < first else i + last - first for i in at.free]
    pull = np.full(len(at.prior), np.inf)
    if any(entry["effect"] == curve_of("joint") for entry in entries):
        pull[: problem.own] = geometry_pulls(model)
    own = np.array([p.sigma for p in model.parameters[first:last]])
    weak = np.concatenate([held(at.prior, pull)[at.free], rules.PRIOR_WIDTH * own])
    effects = problem.effects(entries)
    ends = len(others) + np.cumsum([0, *(len(e.parameters) for e in effects)])
    blocks = [np.arange(a, b) for a, b in pairwise(ends)]
    smooth = [k for k, effect in enumerate(effects) if effect.penalty]
    if not smooth:
        return entries
    J = np.take(near.J, [*others, *range(first, last)], axis=1)
    J /= problem.noise.factor
    chosen = choose_curvatures(
        LinearProblem(
            decorrelated(problem, J, row),
            decorrelated(problem, near.r / problem.noise.factor, row),
            row,
            [blocks[k] for k in smooth],
            [np.asarray(effects[k].penalty) for k in smooth],
            weak,
        ),
        start,
    )
    of = dict(zip(smooth, chosen, strict=True))
    return [{**entry, "curvature": of[k]} if k in of else entry for k, entry in enumerate(entries)]
