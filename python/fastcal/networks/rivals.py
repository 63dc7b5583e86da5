# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rivals without a network: nearest neighbours, gradient boosting, and the joint profiles of `calibrate`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.calibrate import calibrate
from fastcal.correction.experts import BoostedTrees, Neighbours
from fastcal.correction.inputs import Scaling
from fastcal.correction.trees import Trees
from fastcal.effects.entries import curve_of
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem, residuals_of
from fastcal.robot.robot import Robot

NEIGHBOUR_COUNTS = (2, 4, 8, 16)
BOOSTING = {"max_iter": 300, "learning_rate": 0.05, "early_stopping": False}


def fit_neighbours(problem: Problem, rows: Sequence[IndexArray], options: Options) -> list[Neighbours]:
    """Neighbours of each set of rows; their number is the one of least mean error on the other rows."""
    best, least = None, np.inf
    for count in NEIGHBOUR_COUNTS:
        found = [_neighbours(problem, own, min(count, len(own))) for own in rows]
        errors = []
        for expert, own in zip(found, rows, strict=True):
            other = np.setdiff1d(np.arange(len(problem)), own)
            if len(other):
                errors.append(problem.lengths(problem.left(expert.twist(problem.inputs.select(other)), other)))
        mean = float(np.concatenate(errors).mean()) if errors else 0.0
        if mean < least:
            best, least = found, mean
    assert best is not None  # noqa: S101 - there are counts
    return best


def _neighbours(problem: Problem, own: IndexArray, count: int) -> Neighbours:
    inputs = problem.inputs.select(own)
    scaling = Scaling.of(inputs)
    return Neighbours(scaling, scaling(inputs), problem.residuals[own], count)


def fit_boosting(problem: Problem, rows: Sequence[IndexArray], options: Options) -> list[BoostedTrees]:
    """Histogram gradient boosting, one set of trees a coordinate, for each set of rows."""
    return [_boosted(problem, own, options.seed) for own in rows]


def _boosted(problem: Problem, own: IndexArray, seed: int) -> BoostedTrees:
    inputs = problem.inputs.select(own)
    scaling = Scaling.of(inputs)
    x, wanted, measured = scaling(inputs), problem.wanted[own], problem.measured[own]
    trees = tuple(
        trees_of(
            HistGradientBoostingRegressor(random_state=seed, **BOOSTING).fit(
                x[measured[:, axis]], wanted[measured[:, axis], axis]
            )
        )
        for axis in problem.axes
    )
    return BoostedTrees(scaling, trees, problem.size, problem.turn_size)


def trees_of(boosted: Any) -> Trees:
    """The nodes of a histogram gradient boosting of scikit-learn with one output (a value, or log odds)."""
    parts, roots, at = [], [], 0
    for (tree,) in boosted._predictors:
        nodes = tree.nodes
        itself = np.arange(len(nodes))
        leaf = nodes["is_leaf"].astype(bool)
        left, right = (np.where(leaf, itself, nodes[side].astype(np.intp)) + at for side in ("left", "right"))
        feature = np.where(leaf, 0, nodes["feature_idx"]).astype(float)
        threshold = np.where(leaf, 0.0, nodes["num_threshold"])
        value = np.where(leaf, nodes["value"], 0.0)
        parts.append(np.column_stack([feature, threshold, left, right, value]))
        roots.append(at)
        at += len(nodes)
    return Trees(np.vstack(parts), np.array(roots, dtype=np.intp), float(np.ravel(boosted._baseline_prediction)[0]))


def with_profiles(robot: Robot, problem: Problem, own: IndexArray, threads: int) -> Robot:
    """The model identified again on some rows, with a profile of every joint besides what it has."""
    effects = f"geometry,{curve_of('joint')}"
    return calibrate(robot, problem.data.select(own), effects=effects, checks=False, threads=threads).model


def profile_errors(problem: Problem, threads: int) -> FloatArray:
    """(N, k) held-out errors of the model with joint profiles, measured less predicted, base's axes [m; rad]."""
    errors, count = np.zeros_like(problem.residuals), len(problem.axes)
    for fold, own in enumerate(problem.training_rows()):
        other = np.flatnonzero(problem.folds == fold)
        part = problem.data.select(other)
        model = with_profiles(problem.robot, problem, own, threads)
        found = residuals_of(model, part, model.poses(part))[:, :count]
        errors[other, : found.shape[1]] = found
    return np.where(problem.measured, errors, 0.0)
