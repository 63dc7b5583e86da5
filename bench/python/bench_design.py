# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses chosen by design beside random ones and the published greedy order, on the spray arm and the RX160L.

    python bench/python/bench_design.py [--json FILE] [--restarts N] [--arm NAME]

Geometry, base and tool are identified from points with 0.05 mm noise a coordinate; candidates are the even grid of all
joints. Worth: O1, and the mean variance of a predicted coordinate over the whole grid and over a user's targets, points
of a box with the tool pointing at the workpiece. Beside the design stand the median of 50 random choices, sequential
growth (the published greedy order: Y. Sun, J. Hollerbach, "Active robot calibration algorithm", ICRA 2008), and the
best of exchanges from 20 random starts. CPU time of one thread, the arm's file read already.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fastcal import Robot, _core, inverse_kinematics, load_robot, random_poses
from fastcal.design import design_poses
from fastcal.design.candidates import MOST, Candidates, postures, with_conditions
from fastcal.design.linear import LinearProblem, linear_problem
from fastcal.design.search import Search
from fastcal.units import from_si

Array = NDArray[np.float64]
RANDOM, SIGMA = 50, 5e-5


@dataclass(frozen=True)
class Study:
    """An arm, how many poses, and the user's targets: a box [m] and where the tool's x points."""

    arm: str
    poses: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    forward: tuple[float, float, float]


STUDIES = (
    Study("spray_7dof", 150, (2.0, 2.0, 1.0), (3.0, 4.0, 3.0), (1.0, 0.0, 0.0)),
    Study("staubli_rx160l", 60, (0.9, -0.4, 0.2), (1.3, 0.4, 0.8), (0.0, 0.0, -1.0)),
)


def targets(robot: Robot, study: Study) -> Array:
    """Postures that reach points of the box, the tool's x along `forward`; those out of reach are left out."""
    x = np.array(study.forward)
    z = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.5 else np.array([1.0, 0.0, 0.0])
    poses = np.tile(np.eye(4), (150, 1, 1))
    poses[:, :3, :3] = np.column_stack([x, np.cross(z, x), z])
    poses[:, :3, 3] = np.random.default_rng(0).uniform(study.low, study.high, (len(poses), 3))
    found = inverse_kinematics(robot, poses)
    return np.asarray(found.q)[np.asarray(found.status) == "reached"]


@dataclass
class Worth:
    """O1, predicted standard deviation of a coordinate over the grid and over the user's targets [mm], CPU seconds."""

    o1: float
    grid_mm: float
    targets_mm: float
    seconds: float | None = None


class Judge:
    """What a choice of candidates is worth."""

    def __init__(self, problem: LinearProblem, rows: Array, grid: Array, user: Array) -> None:
        self.problem, self.candidates = problem, _core.Candidates(rows, 3)
        self.grid, self.user = grid, user

    def search(self, criterion: str, targets: Array, **options: Any) -> Search:
        return Search(self.candidates, criterion, self.problem.known_before, targets, **options)

    def worth(self, members: list[int], seconds: float | None = None) -> Worth:
        own = np.asarray(self.candidates.information(members))
        covariance = np.linalg.inv(own + self.problem.known_before)
        o1 = _core.observability_index("O1", np.linalg.eigvalsh(own), len(members))
        sizes = [from_si(float(np.sqrt(np.trace(covariance @ B))), "mm") for B in (self.grid, self.user)]
        return Worth(o1, sizes[0], sizes[1], seconds)


def run(study: Study, restarts: int) -> dict[str, Any]:
    robot = load_robot(study.arm)
    begin = time.process_time()
    whole = design_poses(robot, study.poses, criterion="variance", sigma=SIGMA)
    seconds = time.process_time() - begin
    begin = time.process_time()
    design_poses(robot, study.poses, sigma=SIGMA)
    seconds_o1 = time.process_time() - begin

    pool = with_conditions(postures(robot, "grid", MOST, 0), [0.0], [], MOST, 0)
    problem = linear_problem(
        robot, pool, study.poses, geometry=True, sigma=SIGMA, sigma_rotation=None, seed=0, threads=1
    )
    rows = problem.rows(pool)
    q = targets(robot, study)
    user = problem.target_information(Candidates(q, np.zeros(len(q))))
    judge = Judge(problem, rows, problem.target_information(pool), user)

    random = np.random.default_rng(0)
    choices = [list(random.choice(len(pool), study.poses, replace=False)) for _ in range(RANDOM)]
    drawn = [judge.worth(members) for members in choices]
    table = {f"random, median of {RANDOM}": Worth(*np.median([(w.o1, w.grid_mm, w.targets_mm) for w in drawn], axis=0))}
    shares: dict[str, float | None] = {}
    for name, criterion, goal in (
        ("O1", "O1", judge.grid),
        ("variance, grid", "variance", judge.grid),
        ("variance, targets", "variance", judge.user),
    ):
        table[f"growth by {name}"] = judge.worth(judge.search(criterion, goal, exchange=False).run(study.poses).members)
        begin = time.process_time()
        found = judge.search(criterion, goal).run(study.poses)
        table[f"design by {name}"] = judge.worth(found.members, time.process_time() - begin)
        shares[name] = found.efficiency
        best = None
        search = judge.search(criterion, goal)
        for seed in range(restarts):
            members = _core.draw_design(len(pool), study.poses, seed)
            choice = _core.exchange_design(
                judge.candidates, criterion, start=search.known, targets=goal, members=members
            )
            if best is None or choice.value > best.value:
                best = choice
        if best is not None:
            table[f"best of {restarts} restarts by {name}"] = judge.worth(best.members)
    q_free = random_poses(robot, len(q), region=[study.low, study.high])
    goal = problem.target_information(Candidates(q_free, np.zeros(len(q_free))))
    free = Judge(problem, rows, judge.grid, goal)
    chosen = free.search("variance", goal).run(study.poses)
    spread = float(np.median([free.worth(members).targets_mm for members in choices]))
    return {
        "free": {"gain": (spread / free.worth(chosen.members).targets_mm) ** 2, "share_of_best": chosen.efficiency},
        "study": asdict(study),
        "candidates": len(pool),
        "targets": len(q),
        "parameters": len(problem.free),
        "whole": {"variance": seconds, "O1": seconds_o1, "sigma_mm": from_si(whole.sigma, "mm")},
        "share_of_best": shares,
        "table": {name: asdict(worth) for name, worth in table.items()},
    }


def show(result: dict[str, Any]) -> None:
    study = result["study"]
    print(f"{study['arm']}: {study['poses']} of {result['candidates']} candidates, {result['parameters']} parameters")
    print(f"{'':42}{'O1':>8}{'grid mm':>10}{'targets mm':>12}{'CPU s':>8}")
    for name, w in result["table"].items():
        seconds = "" if w["seconds"] is None else f"{w['seconds']:8.2f}"
        print(f"{name:42}{w['o1']:8.3f}{w['grid_mm']:10.5f}{w['targets_mm']:12.5f}{seconds}")
    table = result["table"]
    random = table[f"random, median of {RANDOM}"]
    for goal, key in (("grid", "grid_mm"), ("targets", "targets_mm")):
        gain = (random[key] / table[f"design by variance, {goal}"][key]) ** 2
        print(f"variance over the {goal}: {gain:.2f} times lower than the random median")
    free = result["free"]
    print(
        f"variance over the box, the tool pointing anywhere: {free['gain']:.2f} times lower than the random median, "
        f"no choice reaches {free['gain'] / free['share_of_best']:.2f}"
    )
    whole = result["whole"]
    print(f"design_poses as a whole: {whole['O1']:.2f} s by O1, {whole['variance']:.2f} s by the variance (CPU)")
    shares = ", ".join(f"{name} {share:.1%}" for name, share in result["share_of_best"].items())
    print(f"reached surely of the best possible: {shares}\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--restarts", type=int, default=20)
    parser.add_argument("--arm", choices=[study.arm for study in STUDIES])
    options = parser.parse_args()
    results = []
    with threadpool_limits(1):
        for study in STUDIES:
            if options.arm in (None, study.arm):
                results.append(run(study, options.restarts))
                show(results[-1])
    if options.json:
        text = json.dumps({"machine": platform.processor() or platform.machine(), "studies": results}, indent=1)
        options.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
