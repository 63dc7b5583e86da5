# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do expanded uncertainties of acceptance tests cover? Simulated tests whose instrument, target and room are wrong.

Each test draws where the tracker stands, how far each pose is off, and one error of each input of the budget from its
distribution; what the tracker then reads is computed from that by geometry (a beam that is too long, turned; a target
beside the tool's point; a longer arm), with nothing of fastcal's budgets. A figure is covered where it differs by no
more than U from the same figure of an errorless measurement. `wrong` is the share of passes over the limit (and of
failures within it) among those decided, for limits about the true figure. `predicted` calibrates an arm before the same
kind of instrument and asks whether the model's own points are covered.

    python bench/python/bench_acceptance.py --tests 2000 --out bench/python/bench_acceptance.json
"""

from __future__ import annotations

import argparse
import functools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.acceptance import accept, plan_acceptance
from fastcal.acceptance.acceptance import Acceptance
from fastcal.acceptance.volume import predicted_uncertainty
from fastcal.budget import Budget, Input, drawn
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset
from fastcal.robot.se3 import pose

Array = NDArray[np.float64]

NOISE = 1.5e-5  # m, of a coordinate of a visit
OFF = 2e-4  # m, of a coordinate of a pose
ARM = "ur10"
INPUTS = (
    Input("offset", "range", "length", 8e-6, "rectangular"),
    Input("scale", "range", "per_length", 4e-6, "rectangular"),
    Input("angles", "angle", "per_length", 4e-6, "normal", common=False),
    Input("reflector", "target", "length", 5e-6, "arcsine"),
    Input("room", "temperature", "temperature", 0.5, "triangular", expansion=1.15e-5),
)
VISITED = ("P1", "P2", "P3", "P4", "P5")
SYMBOLS = ("AP_x", "AP_y", "AP_z", "AP", "AD")


@functools.cache
def commands() -> tuple[fastcal.Robot, Dataset]:
    """The arm, and the visits of its test as a plan."""
    arm = fastcal.load_robot(ARM)
    made = plan_acceptance(arm, language="urscript", program="iso.script", cycles=30)
    T = made.commanded
    extra = {f"target_{axis}_mm": 1000 * T[:, i, 3] for i, axis in enumerate("xyz")}
    turned = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    extra |= {f"target_q{name}": turned[:, i] for i, name in enumerate("wxyz")}
    names = [visit.pose for visit in made.visits]
    return arm, Dataset.from_arrays(made.q, position=T[:, :3, 3], extra=extra, extra_labels={"pose": names})


def read(points: Array, turned: Array, names: list[str], instrument: Array, random: np.random.Generator) -> Array:
    """What a tracker at `instrument` says of the tool's points (N, 3), for one draw of every input."""
    size = {each.name: each.standard * drawn(each, random, (3,)) for each in INPUTS}
    warm = points * (1 + INPUTS[4].expansion * size["room"][0])
    seen = warm + turned @ size["reflector"] - instrument
    length = np.linalg.norm(seen, axis=1, keepdims=True)
    seen = seen * (1 + size["scale"][0]) + seen / length * size["offset"][0]
    for name in dict.fromkeys(names):
        rows = [i for i, other in enumerate(names) if other == name]
        beam = seen[rows[0]] / np.linalg.norm(seen[rows[0]])
        level = np.cross([0, 0, 1.0], beam)
        level /= np.linalg.norm(level)
        level_angle, upright_angle = INPUTS[2].standard * random.standard_normal(2)
        turn = Rotation.from_rotvec([0, 0, level_angle / np.linalg.norm(beam[:2])]) * Rotation.from_rotvec(
            -upright_angle * level
        )
        seen[rows] = turn.apply(seen[rows])
    return np.asarray(seen + instrument)


def test(seed: int, align: bool) -> list[tuple[str, bool, str | None, bool]]:
    """(symbol, covered, verdict, truly within its limit) of the figures of one simulated test."""
    arm, plan = commands()
    random = np.random.default_rng([seed, align])
    names = plan.extra_labels["pose"]
    off = dict(zip(VISITED, random.normal(0, OFF, (5, 3)), strict=True))
    true = np.asarray(plan.position) + np.array([off[name] for name in names])
    turned = Rotation.from_quat(
        np.column_stack([plan.extra[f"target_q{c}"] for c in "wxyz"]), scalar_first=True
    ).as_matrix()
    instrument = random.uniform([1.5, -2.0, -0.5], [4.0, 2.0, 1.0])
    said = read(true, turned, names, instrument, random) + random.normal(0, NOISE, true.shape)
    exact = replace(plan, position=true + 1e-12 * random.normal(size=true.shape))
    budget = Budget(INPUTS, instrument)
    truth = {key(e): e.figure.value for e in judged(arm, exact, align, None, {}).figures}
    limit = 1e3 * abs(truth["AP", "P3"]) * random.uniform(0.93, 1.07)
    found = judged(arm, replace(plan, position=said), align, budget, {"ap_mm": limit})
    return [
        (
            e.figure.symbol,
            abs(e.figure.value - truth[key(e)]) <= e.uncertainty.expanded,
            e.verdict if e.figure.where == "P3" else None,
            truth[key(e)] <= 1e-3 * limit,
        )
        for e in found.figures
        if e.figure.symbol in SYMBOLS
    ]


def judged(
    arm: fastcal.Robot, data: Dataset, align: bool, budget: Budget | None, limits: dict[str, float]
) -> Acceptance:
    return accept(arm, data, limits=limits, budget=budget, align=align, draws=0)


def key(judged: Any) -> tuple[str, str]:
    return judged.figure.symbol, judged.figure.where


def calibrated(seed: int) -> list[bool]:
    """Are the three coordinates of the model's points at the test's poses covered, after a calibration of 60 poses?"""
    random = np.random.default_rng([seed, 2])
    arm, plan = commands()
    instrument = random.uniform([1.5, -2.0, -0.5], [4.0, 2.0, 1.0])
    T = pose(Rotation.random(random_state=random).as_matrix(), -instrument)
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz", degrees=True)
    real = fastcal.perturbed(arm, seed=int(random.integers(2**31)))
    real = fastcal.Robot(real.spec | {"base": {"xyz_mm": (1000 * T[:3, 3]).tolist(), "rpy_deg": rpy.tolist()}})
    q = fastcal.random_poses(real, 60, seed=int(random.integers(2**31)))
    scale = INPUTS[1].standard * float(drawn(INPUTS[1], random, (1,))[0])
    points = real.forward(q)[:, :3, 3] * (1 + scale) + random.normal(0, 3e-5, (len(q), 3))
    result = fastcal.calibrate(arm, Dataset.from_arrays(q, position=points, robot=arm), loss="none")
    model = result.model
    # The test's poses by the model's own commands; a base that a scaled world puts elsewhere is no error of the arm.
    base = real.core.base_and_tool(real.core.nominal)[0][:3, 3]
    cycle = replace(plan, extra={}, extra_labels={}).select(slice(0, 10))
    measured = accept(model, replace(cycle, position=model.forward(cycle.q)[:, :3, 3]), align=False, draws=0)
    known = predicted_uncertainty(model, measured.campaign, Budget((INPUTS[1],)))
    if known is None:
        raise RuntimeError("the model is calibrated")
    R = model.core.base_and_tool(model.core.nominal)[0][:3, :3]
    out = []
    for name, U in zip(known.names, known.coordinates, strict=True):
        station = next((s for s in measured.campaign.stations if s.pose == name), None)
        if station is not None:
            at = cycle.q[station.rows[:1]]
            miss = R.T @ (model.forward(at)[0, :3, 3] - real.forward(at)[0, :3, 3] - scale * base)
            out += [abs(m) <= u.expanded for m, u in zip(miss, U, strict=True)]
    return out


Rows = list[list[tuple[str, bool, str | None, bool]]]


def share(hits: list[bool]) -> dict[str, float]:
    """How many, and how many of them are covered."""
    return {"count": len(hits), "covered": float(np.mean(hits))}


def summary(tests: Rows) -> dict[str, Any]:
    """Coverage by symbol, of the coordinates of AP together, and how often a verdict was wrong."""
    every = [row for several in tests for row in several]
    out: dict[str, Any] = {symbol: share([row[1] for row in every if row[0] == symbol]) for symbol in SYMBOLS}
    out["coordinates"] = share([row[1] for row in every if row[0] in SYMBOLS[:3]])
    asked = [row for row in every if row[0] == "AP" and row[2] is not None]
    wrong = [(row[2] == "pass") != row[3] for row in asked if row[2] != "cannot_tell"]
    out["verdicts"] = {"asked": len(asked), "decided": len(wrong), "wrong": sum(wrong)}
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tests", type=int, default=2000)
    parser.add_argument("--calibrations", type=int, default=500)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    table: dict[str, Any] = {"tests": options.tests, "calibrations": options.calibrations, "level": 0.95}
    for name, align in (("model", False), ("fit", True)):
        seeds = range(options.tests)
        table[name] = summary(joblib.Parallel(options.jobs)(joblib.delayed(test)(seed, align) for seed in seeds))
    found = joblib.Parallel(options.jobs)(joblib.delayed(calibrated)(seed) for seed in range(options.calibrations))
    table["predicted"] = share([hit for several in found for hit in several])
    if options.out:
        write_text(options.out, json.dumps(table, indent=1) + "\n")
    print(json.dumps(table, indent=1))


if __name__ == "__main__":
    main()
