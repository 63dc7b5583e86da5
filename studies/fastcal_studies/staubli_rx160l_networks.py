# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""GA-DNN beside its rivals at equal epochs, and global compensation under other loads (14)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from fastcal.correction import Inputs
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import problem_of
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.kernel_networks import fit_grnn, fit_rbf
from fastcal_studies.networks.ga_dnn import FULL, Budget, search
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.staubli_rx160l_worlds import deep, plain
from fastcal_studies.study import Run

ENSEMBLE = 3
SMALL = Budget(population=60, generations=4)  # of the search, unless the whole of the paper's is asked for
SHOWN = 200
SAME = "joints_same"  # GA-DNN behind geometry of all rows, in the world of joints: fastcal's best has such a geometry


class Trained(Protocol):
    """What gives displacements; kernel networks do, though they can't be saved."""

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m] in the base's axes."""


def networks(
    model: Robot,
    learnt: Dataset,
    unseen: Dataset,
    heavy: Sequence[Dataset],
    stiff: Mapping[str, Robot],
    others: Mapping[str, tuple[Robot, Dataset, Dataset]],
    seed: int,
    full: bool,
) -> Run:
    """Errors [mm] of all networks on learnt and unseen poses, by epochs, and under the loads of `heavy`.

    `stiff` are models of what the load does: the paper's pieces, and compliances that do not change with the load.
    `others` are a model, rows learnt and unseen of the same poses where something is another: GA-DNN learns them too,
    in the shape that was found for `learnt`; SAME is also judged under the loads.
    """
    problem = problem_of(model, learnt, seed=seed)
    options = Options(seed=seed, full=full)
    own = [np.arange(len(problem))]
    wanted = {"ga_dnn": (model, learnt)} | {name: (of, rows) for name, (of, rows, _) in others.items()}
    with one_thread():
        found = search(problem, options, FULL if full else SMALL)
        ga_dnn, curve = deep(problem, found, wanted, options, (model, unseen))
        bp, curves = plain(problem, options, (model, unseen))
        experts: dict[str, Sequence[Trained]] = {
            **{name: [net] for name, net in bp.items()},
            "grnn": fit_grnn(problem, own, options),
            "rbf": fit_rbf(problem, own, options),
            "ga_dnn": [ga_dnn["ga_dnn"]],
            "mlp": fit_mlp(problem, own * ENSEMBLE, options),
        }
    before = {part: left(model, data) for part, data in (("learnt", learnt), ("unseen", unseen))}
    inputs = {part: model.inputs(data.q) for part, data in (("learnt", learnt), ("unseen", unseen))}
    out: Run = {name: {} for name in experts}
    for name, members in experts.items():
        for part, errors in before.items():
            predicted = np.mean([member.displacement(inputs[part]) for member in members], axis=0)
            out[name][part] = lengths(errors - predicted)
            if part == "unseen":
                out[name]["by_pose"] = sizes(errors - predicted)[:SHOWN]
    out["before"] = {part: lengths_mm(errors) for part, errors in before.items()}
    out["before"]["by_pose"] = sizes(before["unseen"])[:SHOWN]
    return {
        "networks": out,
        "depth": len(found.architecture.hidden),
        "widths": list(found.architecture.hidden),
        "epochs": curves | {"ga_dnn": curve},
        "others": {
            name: {
                "before": lengths(left(of, rows)),
                "ga_dnn": lengths(_left_by(of, ga_dnn[name], rows)),
                "ga_dnn_learnt": lengths(_left_by(of, ga_dnn[name], own)),
            }
            for name, (of, own, rows) in others.items()
        },
        "places": {"x_mm": _column(learnt, 0), "y_mm": _column(learnt, 1), "error_mm": sizes(before["learnt"])[:SHOWN]},
        "loads": {
            f"{data.payload[0]} kg": _any_load(model, data, experts, stiff)
            | {
                name: lengths(_left_by(of, ga_dnn[name], data) - load_adds(stiff["pieces"], data, of))
                for name, (of, *_) in others.items()
                if name == SAME
            }
            for data in heavy
        },
    }


def _left_by(model: Robot, network: Trained, data: Dataset) -> FloatArray:
    """(N, 3) what is left behind a model and a network [m]; the network knows no load."""
    return np.asarray(left(model, data) - network.displacement(model.inputs(data.q)))


def _any_load(model: Robot, data: Dataset, experts: Mapping[str, Sequence[Trained]], stiff: Mapping[str, Robot]) -> Run:
    """The network alone, and with what the load beyond the tool's 3.6 kg adds."""
    bare = left(model, data)
    predicted = {
        name: np.mean([member.displacement(model.inputs(data.q)) for member in experts[name]], axis=0)
        for name in ("ga_dnn", "mlp")
    }
    added = {name: load_adds(robot, data, model) for name, robot in stiff.items()}
    errors = {
        "none": bare,
        "network": bare - predicted["ga_dnn"],
        "global": bare - predicted["ga_dnn"] - added["pieces"],
        "mlp": bare - predicted["mlp"] - added["linear"],
        "mlp_pieces": bare - predicted["mlp"] - added["pieces"],
    }
    return {name: lengths(e) for name, e in errors.items()}


def lengths(errors: FloatArray) -> dict[str, float]:
    """mean, std, max and the length that 98 % of the errors (N, 3) [m] stay within, in mm."""
    return lengths_mm(errors) | {"98": float(np.quantile(sizes(errors), 0.98))}


def load_adds(stiff: Robot, data: Dataset, model: Robot) -> FloatArray:
    """(N, 3) what the load beyond the tool's moves [m], in the axes of the model's base."""
    loaded = stiff.forward(data.q, payload=data.payload)[:, :3, 3]
    return np.asarray((loaded - stiff.forward(data.q, payload=3.6)[:, :3, 3]) @ pose(model.spec["base"])[:3, :3])


def sizes(errors: FloatArray) -> list[float]:
    """Lengths of errors (N, 3) [m] in mm."""
    return [float(x) for x in np.linalg.norm(errors, axis=1) / MM]


def _column(data: Dataset, axis: int) -> list[float]:
    return [] if data.position is None else [float(x) for x in data.position[:SHOWN, axis] / MM]
