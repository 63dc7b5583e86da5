# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The papers' networks and fastcal's behind the same model, learnt from the same rows, one network each."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.experts import Expert
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem, lengths_mm, problem_of
from fastcal.robot.robot import Robot
from fastcal_studies.networks.bso_mlp import ARCHITECTURE, SCHEDULE, fit_bso_mlp
from fastcal_studies.networks.ca_somm import fit_ca_somm
from fastcal_studies.networks.ga_dnn import fit_ga_dnn
from fastcal_studies.networks.plain import fit_plain
from fastcal_studies.networks.somm import fit_somm
from fastcal_studies.simulated import left

Own = list[NDArray[np.intp]]
Fit = Callable[[Problem, Own, Options], Sequence[Expert]]


def _backpropagation(problem: Problem, own: Own, options: Options) -> Sequence[Expert]:
    """BSO-MLP's network and training from a random start."""
    return fit_plain(problem, own, options, architecture=ARCHITECTURE, schedule=SCHEDULE)


FITS: dict[str, Fit] = {
    "bp": _backpropagation,
    "bso": fit_bso_mlp,
    "somm": fit_somm,
    "ca": fit_ca_somm,
    "ga_dnn": fit_ga_dnn,
    "mlp": fit_mlp,
    "gp": fit_gaussian_process,
}


def behind(
    model: Robot, learnt: Dataset, unseen: Dataset, methods: Sequence[str], seed: int, full: bool
) -> dict[str, dict[str, float]]:
    """mean, rms and max [mm] of the errors of `unseen` by method, one network of each behind the model.

    Rows of `learnt` that the model misses by 8 times the typical length are learnt by none; all of `unseen` count.
    """
    problem = problem_of(model, learnt, seed=seed)
    own = [np.arange(len(problem))]
    inputs, bare = model.inputs(unseen.q, unseen.payload), left(model, unseen)
    out = {}
    with one_thread():
        for name in methods:
            (member,) = FITS[name](problem, own, Options(seed=seed, trials=None if full else 0, full=full))
            out[name] = lengths_mm(bare - member.displacement(inputs))
    return out
