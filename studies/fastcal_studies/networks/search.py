# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Candidates of a search: trained in batches of a fixed size, side by side where there are workers, and remembered.

Batches do not depend on how many workers there are, and each network has its own seed, so that one core, several, or a
Dask cluster (`joblib.parallel_backend("dask")`) find the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import optuna
import optuna.storages.journal
from numpy.typing import NDArray

from fastcal.errors import InvalidInput
from fastcal.networks.device import one_thread
from fastcal.networks.fitting import Schedule
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture
from fastcal.networks.problem import Problem
from fastcal_studies.networks.plain import train_plain

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

BATCH = 25


@dataclass(frozen=True)
class Candidate:
    """A network to be tried.

    Attributes:
        architecture: Its layers.
        rate: Learning rate.
        rule: Of `optimizers`.
        axes: The coordinates that it gives.
        rows, validation: What it learns from and is judged on.
        seed: Of its start and of the order of its rows.
        decay: Of its weights.
    """

    architecture: Architecture
    rate: float
    rule: str
    axes: tuple[int, ...]
    rows: IntArray
    validation: IntArray
    seed: int
    decay: float = 0.0


def losses_of(
    problem: Problem, candidates: Sequence[Candidate], epochs: int, batch: int, options: Options
) -> FloatArray:
    """(C,) loss of each candidate on its validation rows after so many epochs."""
    # Networks of one depth together, and those that change their activation at one layer: see `population`.
    shapes = [candidate.architecture for candidate in candidates]
    order = sorted(range(len(candidates)), key=lambda k: (-len(shapes[k].hidden), shapes[k].activations, k))
    parts = [[candidates[k] for k in order[at : at + BATCH]] for at in range(0, len(order), BATCH)]
    plain = Options(options.seed, options.device)  # what workers receive holds no function of the caller
    work = joblib.Parallel(n_jobs=options.jobs if options.jobs > 1 else None)
    found = work(joblib.delayed(_losses)(problem, part, epochs, batch, plain) for part in parts)
    losses = np.empty(len(candidates))
    losses[order] = np.concatenate(list(found))
    return losses


def _losses(problem: Problem, candidates: Sequence[Candidate], epochs: int, batch: int, options: Options) -> FloatArray:
    # Squares are compared as they are: a network that has learnt nothing has a loss near half its outputs.
    schedule = Schedule(
        epochs=epochs,
        batch=batch,
        rule=[candidate.rule for candidate in candidates],
        rate=[candidate.rate for candidate in candidates],
        decay=[candidate.decay for candidate in candidates],
    )
    with one_thread():
        _, losses = train_plain(
            problem,
            [candidate.architecture for candidate in candidates],
            [candidate.axes for candidate in candidates],
            [candidate.rows for candidate in candidates],
            schedule,
            options,
            validation=[candidate.validation for candidate in candidates],
            seeds=[candidate.seed for candidate in candidates],
        )
    return losses


def study_of(name: str, storage: Path | None, seed: int) -> optuna.Study:
    """An Optuna study, kept in a journal file where one is named, and gone on with where it is there already.

    Raises:
        InvalidInput: The file is no journal of a search.
    """
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    kept: Any = None
    try:
        if storage is not None:
            kept = optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(str(storage)))
        return optuna.create_study(
            study_name=f"{name} seed {seed}", storage=kept, direction="minimize", load_if_exists=True
        )
    except (ValueError, KeyError, OSError, AttributeError, TypeError) as error:
        raise InvalidInput(f"{storage}: cannot be resumed as the trials of a search: {str(error)[:80]}") from None


def remembered(study: optuna.Study, generation: int, count: int, compute: Callable[[], FloatArray]) -> FloatArray:
    """(count,) the values of a generation: those the study holds, or else what `compute` gives, which it then holds."""
    known = {
        trial.user_attrs["place"]: trial.value
        for trial in study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])
        if trial.user_attrs.get("generation") == generation
    }
    if len(known) == count:
        return np.array([known[place] for place in range(count)])
    values = compute()
    for place in range(count):
        if place not in known:
            attributes = {"generation": generation, "place": place}
            study.add_trial(optuna.trial.create_trial(value=float(min(values[place], 1e30)), user_attrs=attributes))
    return np.minimum(values, 1e30)
