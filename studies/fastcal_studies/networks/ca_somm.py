# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""CA-SOMM-ANN (PMC, V.B.3): a classifier before two sets of networks, the split of the rows found from their errors.

A mixture of two normal distributions is fitted to the errors of each axis; the axis whose two heaps are farthest
apart, in their own widths (Ashman, Bird, Zepf 1994), is split. A classifier learns from joints and load which heap a
row belongs to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.mixture import GaussianMixture

from fastcal.correction.experts import AXES, ClassifiedNetworks
from fastcal.correction.inputs import Scaling
from fastcal.correction.trees import Trees
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem
from fastcal.networks.rivals import trees_of
from fastcal_studies.networks.somm import AxisSizes, fit_somm, sizes_of

IntArray = NDArray[np.intp]

# V.B.3, (a) to (e); the log loss is (27).
PAPER = {"max_depth": 3, "max_leaf_nodes": 60, "min_samples_leaf": 66, "learning_rate": 0.001, "max_iter": 300}
FEWEST = 30  # rows of a class


class Split(NamedTuple):
    """The class of each row (N,), and the axis whose errors made it."""

    classes: NDArray[np.bool_]
    axis: int


def found_split(problem: Problem, own: IntArray, seed: int = 0) -> Split:
    """Two heaps of the errors of the given rows; the classes of all rows by the same mixture."""
    values = problem.wanted
    best: tuple[float, GaussianMixture, int] | None = None
    for axis in problem.axes:
        column = values[own][:, [axis]]
        two = GaussianMixture(2, random_state=seed, n_init=2).fit(column)
        apart = float(np.ptp(two.means_) / np.sqrt(two.covariances_.sum() / 2))
        if best is None or apart > best[0]:
            best = apart, two, axis
    assert best is not None  # noqa: S101 - there are axes
    _, mixture, axis = best
    upper = int(np.argmax(mixture.means_[:, 0]))
    return Split(mixture.predict(values[:, [axis]]) == upper, axis)


def classifier_of(problem: Problem, own: IntArray, classes: NDArray[np.bool_], scaling: Scaling, seed: int) -> Trees:
    """Boosted trees, as the paper sets them, with both classes weighing the same; leaves shrink with few rows."""
    settings = PAPER | {"min_samples_leaf": max(2, min(int(PAPER["min_samples_leaf"]), len(own) // 12))}
    boosted = HistGradientBoostingClassifier(
        random_state=seed, early_stopping=False, class_weight="balanced", **settings
    )
    return trees_of(boosted.fit(scaling(problem.inputs)[own], classes[own]))


def fit_ca_somm(
    problem: Problem, rows: Sequence[IntArray], options: Options, *, sizes: Sequence[AxisSizes] | None = None
) -> list[ClassifiedNetworks]:
    """For each set of rows a split, a classifier and two SOMM-ANN; what is noted is its rate on the other rows."""
    sizes = sizes_of(problem, options) if sizes is None else sizes
    scaling = Scaling.of(problem.inputs)
    splits = [found_split(problem, own, options.seed) for own in rows]
    parts: list[IntArray] = []
    for own, split in zip(rows, splits, strict=True):
        for second in (False, True):
            part = own[split.classes[own] == second]
            parts.append(part if len(part) >= FEWEST else own)
    networks = fit_somm(problem, parts, options, sizes=sizes)
    found, right = [], []
    for k, (own, split) in enumerate(zip(rows, splits, strict=True)):
        trees = classifier_of(problem, own, split.classes, scaling, options.seed)
        expert = ClassifiedNetworks(trees, networks[2 * k], networks[2 * k + 1])
        other = np.setdiff1d(np.arange(len(problem)), own)
        right.append(expert.classes(problem.inputs)[other] == split.classes[other])
        found.append(expert)
    rate = float(np.concatenate(right).mean()) if any(len(part) for part in right) else float("nan")
    axes = ", ".join(sorted({AXES[split.axis] for split in splits}))
    options.notes.append(
        f"two classes by the errors in {axes}: {rate:.0%} of rows not trained on are put in the right one"
    )
    return found
