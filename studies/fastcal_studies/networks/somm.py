# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""SOMM-ANN (PMC, III.B): one network an axis, each of its own depth; sizes from the paper's tables, or found by TPE."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import optuna
from numpy.typing import NDArray

from fastcal.correction.experts import AXES, AxisNetworks
from fastcal.networks.fitting import Schedule
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture
from fastcal.networks.problem import Problem
from fastcal_studies.networks.plain import train_plain
from fastcal_studies.networks.search import Candidate, losses_of, study_of

IntArray = NDArray[np.intp]


class AxisSizes(NamedTuple):
    """The network of one axis, its learning rate and the decay of its weights."""

    architecture: Architecture
    rate: float
    decay: float = 0.0


# Tables 2 and 3; Adam, 200 epochs, batches of 200. Turns, which the paper has not, take the same three sizes.
PAPER = (
    AxisSizes(Architecture.plain((20, 20, 20, 20, 10, 20), "tanh"), 8e-4),
    AxisSizes(Architecture.plain((100, 50), "relu"), 5e-4),
    AxisSizes(Architecture.plain((50, 50, 40, 30), "tanh"), 1e-3),
)
EPOCHS, BATCH = 200, 200
TRIALS, ASKED, TRIAL_EPOCHS = 20, 5, 60
DEEPEST = 6


def fit_somm(
    problem: Problem, rows: Sequence[IntArray], options: Options, *, sizes: Sequence[AxisSizes] | None = None
) -> list[AxisNetworks]:
    """A network an axis for each set of rows; those of all sets train together.

    Sizes that are not given are the paper's where `options.trials` is 0, else found by TPE.
    """
    chosen = sizes_of(problem, options) if sizes is None else sizes
    schedule = Schedule(
        epochs=EPOCHS,
        batch=BATCH,
        rate=[axis.rate for _ in rows for axis in chosen],
        decay=[axis.decay for _ in rows for axis in chosen],
    )
    members = [axis.architecture for _ in rows for axis in chosen]
    count = len(chosen)
    axes = [(axis,) for _ in rows for axis in range(count)]
    each = [own for own in rows for _ in range(count)]
    found, _ = train_plain(problem, members, axes, each, schedule, options)
    return [
        replace(found[k], nets=tuple(net for part in found[k : k + count] for net in part.nets))
        for k in range(0, len(found), count)
    ]


def sizes_of(problem: Problem, options: Options) -> tuple[AxisSizes, ...]:
    """The paper's sizes, or those that a search finds."""
    if options.trials == 0:
        return tuple(PAPER[axis % len(PAPER)] for axis in problem.axes)
    return tuple(_searched(problem, axis, options) for axis in problem.axes)


def _searched(
    problem: Problem, axis: int, options: Options, asked: int = ASKED, epochs: int = TRIAL_EPOCHS
) -> AxisSizes:
    """Depth, widths, activation, decay and rate of least loss on the first fold, by a tree of Parzen estimators.

    Some are asked at a time and trained as one. The sampler starts again each time, seeded by how many there are, so
    that a search taken up again asks what it would have asked.
    """
    study = study_of(f"somm axis {axis}", options.storage, options.seed)
    wanted = TRIALS if options.trials is None else options.trials
    done = (optuna.trial.TrialState.COMPLETE,)
    learnt, judged = problem.training_rows()[0], np.flatnonzero(problem.folds == 0)
    while (count := len(study.get_trials(deepcopy=False, states=done))) < wanted:
        if count > 0 and options.is_over:
            options.notes.append(f"the search for axis {AXES[axis]} ended after {count} of {wanted} trials: time is up")
            break
        options.progress(f"searching the network of axis {AXES[axis]}, trial {count} of {wanted}")
        study.sampler = optuna.samplers.TPESampler(seed=options.seed * 7919 + count, constant_liar=True)
        trials = [study.ask() for _ in range(min(asked, wanted - count))]
        sizes = [_suggested(trial) for trial in trials]
        candidates = [
            Candidate(
                size.architecture, size.rate, "adam", (axis,), learnt, judged, options.seed * 31 + count + k, size.decay
            )
            for k, size in enumerate(sizes)
        ]
        losses = losses_of(problem, candidates, epochs, BATCH, options)
        for trial, value in zip(trials, losses, strict=True):
            study.tell(trial, float(min(value, 1e30)))
    return _suggested(optuna.trial.FixedTrial(study.best_params))


def _suggested(trial: optuna.trial.BaseTrial) -> AxisSizes:
    depth = trial.suggest_int("depth", 1, DEEPEST)
    widths = [trial.suggest_int(f"width{layer}", 10, 100, step=10) for layer in range(depth)]
    activation = trial.suggest_categorical("activation", ["tanh", "relu"])
    # The paper has no decay of weights; where rows share few configurations, networks this large remember them.
    decay = trial.suggest_categorical("decay", [0.0, 0.5, 2.0])
    rate = trial.suggest_float("rate", 2e-4, 5e-3, log=True)
    return AxisSizes(Architecture.plain(widths, activation), rate, decay)
