# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""SOMM-ANN and CA-SOMM-ANN with the paper's sizes, one plain network, and fastcal's, on rows that are dealt evenly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.experts import AxisNetworks, Expert
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.fitting import Schedule
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture
from fastcal.networks.problem import Problem, problem_of
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.networks.ca_somm import fit_ca_somm, found_split
from fastcal_studies.networks.plain import fit_plain, train_plain
from fastcal_studies.networks.somm import BATCH, fit_somm
from fastcal_studies.networks.somm import PAPER as PAPER_SIZES
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.study import Run

IntArray = NDArray[np.intp]

PLAIN = Architecture.plain((50, 50, 40, 30), "tanh")
SCHEDULE = Schedule(epochs=200, batch=200, rate=1e-3)
SEARCHED, ENSEMBLE = 20, 3
UNTRAINED = ("GB10", "GB30")


def _stopped_early(problem: Problem, own: list[IntArray], options: Options) -> list[AxisNetworks]:
    """SOMM-ANN as the text trains it: 50 epochs at most, until the training loss has not fallen for five of them."""
    found = []
    for axis, sizes in enumerate(PAPER_SIZES):
        schedule = Schedule(epochs=50, batch=BATCH, rate=sizes.rate, patience=5, check=1)
        axes, members = [(axis,)], [sizes.architecture]
        found += train_plain(problem, members, axes, own, schedule, options, validation=own)[0]
    return [AxisNetworks(found[0].scaling, tuple(net for part in found for net in part.nets), found[0].unit)]


def compared(model: Robot, best: Robot, sets: Mapping[str, Dataset], seed: int) -> dict[str, float]:
    """Mean errors [mm] of the rows not trained on: the paper's networks, mlp, and both behind fastcal's."""
    problem, ours = (problem_of(of, sets["GA10"], seed=seed) for of in (model, best))
    own, rows = [np.arange(len(problem))], [np.arange(len(ours))]
    options = Options(seed=seed, trials=0)
    with one_thread():
        fitted: dict[str, tuple[Robot, Sequence[Expert]]] = {
            "somm": (model, fit_somm(problem, own, options)),
            "ca": (model, fit_ca_somm(problem, own, options)),
            "mlp": (model, fit_mlp(problem, own, options)),
            "somm_ours": (best, fit_somm(ours, rows, options)),
            "best": (best, fit_mlp(ours, rows * ENSEMBLE, options)),
        }
    return {
        name: lengths_mm(np.vstack([_left_by(of, members, sets[key]) for key in UNTRAINED]))["mean"]
        for name, (of, members) in fitted.items()
    }


def _left_by(model: Robot, members: Sequence[Expert], data: Dataset) -> FloatArray:
    """(N, 3) what is left behind a model and the mean of some networks [m]."""
    inputs = model.inputs(data.q, data.payload)
    return np.asarray(left(model, data) - np.mean([member.displacement(inputs) for member in members], axis=0))


def networks(
    model: Robot,
    yielding: Robot,
    sets: Mapping[str, Dataset],
    best: Robot,
    seed: int,
    full: bool,
) -> Run:
    """Errors [mm] on each set, all learn from GA10.

    `model` is the paper's before networks, `yielding` fastcal's, `best` fastcal's with a slack.
    """
    problem, smooth = problem_of(model, sets["GA10"], seed=seed), problem_of(yielding, sets["GA10"], seed=seed)
    ours = problem_of(best, sets["GA10"], seed=seed)
    own = [np.arange(len(problem))]
    options = Options(seed=seed, trials=SEARCHED if full else 0)
    with one_thread():
        plain = fit_plain(problem, own, options, architecture=PLAIN, schedule=SCHEDULE)
        somm, ca = fit_somm(problem, own, options), fit_ca_somm(problem, own, options)
        fitted: dict[str, tuple[Robot, Sequence[Expert]]] = {
            "plain": (model, plain),
            "somm": (model, somm),
            "stopped": (model, _stopped_early(problem, own, options)),
            "ca": (model, ca),
            "somm_ours": (best, fit_somm(ours, [np.arange(len(ours))], options)),
            "mlp": (model, fit_mlp(problem, own, options)),
            "smooth": (yielding, fit_mlp(smooth, [np.arange(len(smooth))] * ENSEMBLE, options)),
            "gp": (best, fit_gaussian_process(ours, [np.arange(len(ours))], options)),
            "best": (best, fit_mlp(ours, [np.arange(len(ours))] * ENSEMBLE, options)),
        }
    out: Run = {}
    errors: dict[str, dict[str, FloatArray]] = {}
    for name, (of, members) in fitted.items():
        errors[name] = {key: _left_by(of, members, data) for key, data in sets.items()}
        out[name] = {key: lengths_mm(e) for key, e in errors[name].items()}
        out[name]["untrained"] = lengths_mm(np.vstack([errors[name][key] for key in UNTRAINED]))
    bare = [left(model, sets[key]) for key in UNTRAINED]
    heaps = found_split(replace(problem, residuals=np.vstack([problem.residuals, *bare])), own[0], seed)
    sides = np.concatenate([ca[0].classes(model.inputs(sets[key].q, sets[key].payload)) for key in UNTRAINED])
    column = np.vstack(bare)[:, heaps.axis] / MM
    high = heaps.classes[len(problem) :]
    return {
        "networks": out,
        "class_rate": float(np.mean(sides == high)),
        "class_axis": "XYZ"[heaps.axis],
        "heaps": {"lower": column[~high].tolist(), "upper": column[high].tolist()},
    }
