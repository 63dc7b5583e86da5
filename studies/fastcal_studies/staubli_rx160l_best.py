# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The best of fastcal on the RX160L's rows: geometry fitted to all of them, a Gaussian process on joint errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fastcal.calibration.calibrate import calibrate
from fastcal.correction.joints import GaussianProcess
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import problem_of
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import lengths_mm
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.staubli_rx160l_networks import ENSEMBLE, SHOWN, lengths, load_adds, sizes
from fastcal_studies.study import Run

LIKELIHOOD_ROWS = 300
SHARES = (1, 2, 4)  # all rows, half of them, a quarter
FOLDS = 3  # the few rows of the calibration are not regions enough for more


def best(
    nominal: Robot,
    of_many: tuple[Robot, list[GaussianProcess]],
    few: tuple[Dataset, Dataset],
    many: tuple[Dataset, Dataset],
    heavy: Sequence[Dataset],
    linear: Robot,
    seed: int,
) -> Run:
    """Errors [mm] on other rows than the fitted, each pair's second, and under the loads of `heavy`.

    Args:
        nominal: What is identified, all of its geometry.
        of_many: What `with_process` finds of the network's rows, by SHARES.
        few: The calibration's rows and those held out.
        many: The network's rows and those not learnt.
        heavy: The latter under other loads.
        linear: What the load moves: compliances that do not change with it.
        seed: Of the arm.
    """
    of_few, (alone,) = with_process(nominal, few[0], seed)
    model, members = of_many
    learnt, unseen = (after(model, members[0], data) for data in many)
    return {
        "few": lengths_mm(after(of_few, alone, few[1])),
        "few_by_many": lengths_mm(after(model, members[0], few[1])),
        "before": {part: lengths(left(model, data)) for part, data in zip(("learnt", "unseen"), many, strict=True)},
        "learnt": lengths(learnt),
        "unseen": lengths(unseen) | {"by_pose": sizes(unseen)[:SHOWN]},
        "by_rows": {
            str(len(many[0]) // share): lengths_mm(after(model, member, many[1]))["mean"]
            for share, member in zip(SHARES, members, strict=True)
        },
        "loads": {
            f"{data.payload[0]} kg": lengths(after(model, members[0], data) - load_adds(linear, data, model))
            for data in heavy
        },
    }


def with_process(
    nominal: Robot, data: Dataset, seed: int, shares: Sequence[int] = (1,)
) -> tuple[Robot, list[GaussianProcess]]:
    """Geometry and, behind it, the posterior given all rows, given half of them, ..., hyperparameters from all."""
    model = calibrate(nominal, data, loss="none").model
    problem = problem_of(model, data, folds=FOLDS, seed=seed)
    order = np.random.default_rng((seed, 12)).permutation(len(problem))
    rows = [np.sort(order[: len(problem) // share]) for share in shares]
    with one_thread():
        return model, fit_gaussian_process(
            problem, rows, Options(seed=seed), most_rows=len(problem), likelihood_rows=LIKELIHOOD_ROWS
        )


def elsewhere(
    nominal: Robot, parameters: Sequence[str], rows: Mapping[str, Sequence[Dataset]], seed: int
) -> tuple[dict[str, tuple[Robot, Dataset, Dataset]], dict[str, dict[str, float]]]:
    """In other worlds: what GA-DNN has to learn there, and the mean errors [mm] that mlp and the process leave.

    GA-DNN stands behind the paper's geometry, as mlp does, and, `_same`, behind that of all rows, as the process.

    Args:
        nominal: What is identified.
        parameters: Of the paper's geometry, as they were chosen in the world of joints.
        rows: Of each world those of the calibration, those learnt and those not learnt.
        seed: Of the arm.
    """
    others: dict[str, tuple[Robot, Dataset, Dataset]] = {}
    means = {}
    for world, (few, many, unseen) in rows.items():
        model, (process,) = with_process(nominal, many, seed)
        chosen = calibrate(nominal, few, parameters=parameters).model
        others[world] = chosen, many, unseen
        others[f"{world}_same"] = model, many, unseen
        problem = problem_of(chosen, many, seed=seed)
        with one_thread():
            members = fit_mlp(problem, [np.arange(len(problem))] * ENSEMBLE, Options(seed=seed))
        predicted = np.mean([member.displacement(chosen.inputs(unseen.q)) for member in members], axis=0)
        means[world] = {
            "mlp": lengths_mm(left(chosen, unseen) - predicted)["mean"],
            "best": lengths_mm(after(model, process, unseen))["mean"],
        }
    return others, means


def after(model: Robot, process: GaussianProcess, data: Dataset) -> FloatArray:
    """(N, 3) what is left [m]; the process knows no load."""
    return np.asarray(left(model, data) - process.displacement(model.inputs(data.q)))
