# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray-painting robot: redundant errors, beams under gravity, chosen poses, commands with a joint held.

"Kinematic Calibration Method for Large-Sized 7-DoF Hybrid Spray-Painting Robots" (2022). The true arm and what each
part finds; what of it is shown is in spray_7dof_page.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.parameter_identifiability import redundancy
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.compensation.commands import compensate
from fastcal.design.poses import design_poses
from fastcal.design.surroundings import Surroundings
from fastcal.ik.inertia_load import inertia_load
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot
from fastcal.units import from_si
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.learning import HAS_TORCH
from fastcal_studies.simulated import WORLDS, FloatArray, Unmodelled, in_world, left, measure, row_numbers
from fastcal_studies.spray_7dof_page import page as page
from fastcal_studies.spray_7dof_steps import NOISE, descent, paths
from fastcal_studies.study import Paper, Run

FITTED, UNSEEN, MANY = 150, 100, 600
STIFFNESS = {"base": 0.8, "arm": 1.25, "forearm": 0.9, "telescope": 0.7}  # of the hidden beams over the file's
BASE = {"xyz_mm": [20.0, -15.0, 10.0], "rpy_deg": [0.5, -0.4, 0.8]}
AXES = {"X": 0, "Y": 2, "Z": 1}  # of O1 in the measuring frame: reach, vertical, rail
WAVES_RAD = (0.0, 2.1e-4, 2.1e-4, 2.1e-4, 3.0e-4, 0.0, 4.2e-4)
BEST = "geometry,beam_gravity:by=group:prior=yes"
HELD = 6
CANDIDATES, ALL_CANDIDATES = 10_000, 78_125

PAPER = Paper(
    robot="spray_7dof",
    reference="Kinematic Calibration Method for Large-Sized 7-DoF Hybrid Spray-Painting Robots (2022)",
    arm=(
        "The paper's tables of sizes and errors are not printed: the arm is fastcal's own of the same arrangement, "
        "with errors of 1 mm and 1 mrad in every number of its rows.",
        "Its beams are 0.8, 1.25, 0.9 and 0.7 times as stiff as the file says (column, arm, forearm, telescope): a "
        "finite-element model is never exact, and the paper takes its own as known.",
        "Waves over pairs of joints, sized so that gravity takes away about the paper's 20 % and 17 % of the error; a "
        "tracker's noise of 0.04 mm a coordinate.",
    ),
)


def bending(robot: Robot) -> Robot:
    """The robot with its beams as the file says."""
    effect = {"effect": "beam_gravity", "owner": "structure", "parameters": {"scale": {"value": 1.0}}}
    return Robot(copy.deepcopy(dict(robot.spec)) | {"effects": [effect]})


def true_arm(nominal: Robot, seed: int) -> Robot:
    """Errors in every row, and beams of other stiffness."""
    spec = dict(perturbed(nominal, length=1e-3, angle=1e-3, seed=seed).spec)
    scales = {f"scale_{group}": {"value": 1 / factor} for group, factor in STIFFNESS.items()}
    effect = {"effect": "beam_gravity", "owner": "structure", "by": "group", "parameters": scales}
    return Robot(spec | {"base": BASE, "effects": [effect]})


def one_arm(seed: int, full: bool) -> Run:
    """All parts on one arm; errors in mm by axis."""
    nominal = load_robot(PAPER.robot)
    true = true_arm(nominal, seed)
    outside = Unmodelled(WAVES_RAD, 1.0, 0.0, seed)
    found = redundancy(nominal, measured="position")
    rows = [name for name in found.kept if name.startswith("joint")]
    count = ALL_CANDIDATES if full else CANDIDATES
    anywhere = Surroundings(mounting=False)  # as the paper, whose grid has all joint limits
    chosen = design_poses(nominal, FITTED, candidate_count=count, surroundings=anywhere, seed=seed)
    greedy = design_poses(nominal, FITTED, candidate_count=count, surroundings=anywhere, exchange=False, seed=seed)
    drawn = random_poses(nominal, FITTED, seed=seed)
    by_chance = design_poses(nominal, FITTED, candidates=drawn, seed=seed)

    def at(q: FloatArray, number: int, waves: Unmodelled = outside) -> Dataset:
        return measure(true, Dataset.from_arrays(q, robot=nominal), waves, NOISE, 100 * seed + number)

    data, unseen = at(chosen.q, 0), at(random_poses(nominal, UNSEEN, seed=1000 + seed), 1)
    everything = [p.name for p in found.parameters if p.kind != "without_effect"]
    beams = bending(nominal)
    ways = {
        "removed": descent(beams, data, found.kept),
        "without": descent(nominal, data, found.kept),
        "kept": descent(beams, data, everything),
        "kept_without": descent(nominal, data, everything),
        "damped": descent(beams, data, everything, damped=True),
    }
    rigid = calibrate(nominal, data, parameters=rows, loss="none")
    models = {
        "before": rigid.nominal,
        "rigid": rigid.model,
        "gravity": calibrate(beams, data, parameters=rows, loss="none").model,
        "best": calibrate(nominal, data, effects=BEST).model,
    }
    groups = models["best"].spec["effects"][0]["parameters"]
    load = inertia_load(nominal, seed=seed)
    still = replace(outside, sizes=(0.0,) * 7)
    without = calibrate(nominal, at(data.q, 0, still), effects=BEST).model
    names = [f"{p.owner} {p.name}" for p in rigid.parameters]
    hidden, of_file = row_numbers(true, names), row_numbers(nominal, names)
    run: Run = {"without_waves": by_axis(without, at(unseen.q, 1, still))}
    if HAS_TORCH:
        from fastcal.networks import train

        many = at(random_poses(nominal, MANY, seed=2000 + seed), 2)
        learnt = train(calibrate(nominal, many, effects=BEST).model, many, rivals=(), seed=seed)
        run["many"] = {"used": learnt.used, **by_axis(learnt.model, unseen)}
    sent, unreachable = commanded(models, true, outside, unseen.q)
    return run | {
        "rank": found.rank,
        "rules": [line.split(": ", 1) for line in str(found).splitlines() if ": held" in line],
        "steps": {name: way.steps for name, way in ways.items()},
        "left": {name: way.left for name, way in ways.items()},
        "paths": paths(beams, data, unseen, everything, ways["removed"]),
        "fitted": {name: by_axis(model, data) for name, model in models.items()},
        "unseen": {name: by_axis(model, unseen) for name, model in models.items()},
        "by_pose": {name: miss(model, unseen) for name, model in models.items()},
        "fitted_by_pose": {name: miss(model, data) for name, model in models.items()},
        "commands": sent,
        "unreachable": unreachable,
        "share": {
            axis: {name: sent[name][axis]["mean"] / sent["rigid"][axis]["mean"] for name in ("gravity", "best")}
            for axis in AXES
        },
        "groups": {
            name: {"found": 1 / groups[f"scale_{name}"]["value"], "std": _std(groups[f"scale_{name}"])}
            for name in STIFFNESS
        },
        "design": {
            name: design.observability["O1"]
            for name, design in (("random", by_chance), ("greedy", greedy), ("exchanged", chosen))
        },
        "inertia": {
            "sensitivity": (load.sensitivity / load.sensitivity[HELD - 1]).tolist(),
            "index": load.index.tolist(),
            "position": load.position[[2, 3, 5]].tolist(),
            "load": load.load[[2, 3, 5]].tolist(),
        },
        "identified": {f"{p.owner} {p.name}": {"found": p.value - p.nominal, "std": p.std} for p in rigid.parameters},
        "hidden": {name: value - of_file[name] for name, value in hidden.items()},
        "worlds": worlds(nominal, true, outside, rows, (data.q, unseen.q)),
    }


def to_diagnose(seed: int) -> tuple[Robot, Dataset, Dataset, Robot]:
    """Nominal arm, the poses that it is calibrated in, unseen ones, and the hidden arm."""
    nominal = load_robot(PAPER.robot)
    true, outside = true_arm(nominal, seed), Unmodelled(WAVES_RAD, 1.0, 0.0, seed)
    q = design_poses(
        nominal, FITTED, candidate_count=CANDIDATES, surroundings=Surroundings(mounting=False), seed=seed
    ).q
    rows = (q, random_poses(nominal, UNSEEN, seed=1000 + seed))
    sent = [Dataset.from_arrays(own, robot=nominal) for own in rows]
    data, unseen = (measure(true, own, outside, NOISE, 100 * seed + k) for k, own in enumerate(sent))
    return nominal, data, unseen, true


def miss(model: Robot, data: Dataset) -> dict[str, list[float]]:
    """Error of each pose along each axis of O1 [mm]."""
    off = (model.poses(data)[:, :3, 3] - np.asarray(data.position)) / MM
    return {axis: off[:, column].tolist() for axis, column in AXES.items()}


def by_axis(model: Robot, data: Dataset) -> dict[str, dict[str, float]]:
    """Mean and max of the sizes of the error along each axis [mm]."""
    return {axis: _sizes(np.array(values)) for axis, values in miss(model, data).items()}


def _sizes(values: FloatArray) -> dict[str, float]:
    return {"mean": float(np.abs(values).mean()), "max": float(np.abs(values).max())}


def commanded(
    models: Mapping[str, Robot], true: Robot, outside: Unmodelled, q: FloatArray
) -> tuple[dict[str, dict[str, dict[str, float]]], int]:
    """Errors of the true arm [mm] by model and axis at commands for poses that the nominal arm reaches at q (N, 6).

    Joint 6 is held where q has it. A pose that a model can't reach so (its number is given as well) is no command, and
    is left out for all models.
    """
    nominal = models["before"]
    wanted = nominal.forward(q)
    sent, reached = {"before": q}, np.ones(len(q), dtype=bool)
    for name, model in models.items():
        if model is not nominal:
            found = compensate(model, Targets(wanted, seed=q), nominal=nominal, hold=[HELD], along_path=False)
            sent[name], reached = found.q, reached & found.reached
    out = {}
    for name, own in sent.items():
        off = (true.forward(own + outside(own, np.zeros(len(q))))[:, :3, 3] - wanted[:, :3, 3])[reached]
        out[name] = {axis: _sizes(from_si(off[:, column], "mm")) for axis, column in AXES.items()}
    return out, int(np.sum(~reached))


def worlds(nominal: Robot, true: Robot, outside: Unmodelled, rows: Sequence[str], q: Sequence[FloatArray]) -> Run:
    """Mean error [mm] of the unseen poses q[1], models fitted to q[0], where the hidden errors have other forms."""
    sent = [Dataset.from_arrays(own, robot=nominal) for own in q]
    out: Run = {}
    for world in WORLDS:
        there = in_world(outside, world, true, sent[1])
        data, unseen = (measure(true, own, there, NOISE, 100 * outside.seed + k) for k, own in enumerate(sent))
        models = {
            "rigid": calibrate(nominal, data, parameters=rows, loss="none").model,
            "gravity": calibrate(bending(nominal), data, parameters=rows, loss="none").model,
            "best": calibrate(nominal, data, effects=BEST).model,
        }
        out[world] = {name: lengths_mm(left(model, unseen))["mean"] for name, model in models.items()}
    return out


def _std(scale: dict[str, float]) -> float | None:
    return None if scale["std"] is None else scale["std"] / scale["value"] ** 2
