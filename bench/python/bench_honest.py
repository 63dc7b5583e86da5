# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals of predicted points cover where data are thin, spoilt or not as assumed?

An arm, its errors, its noise and what is measured are simulated by numpy_arm alone, which shares no line with fastcal:
geometry off by 0.5 mm and 0.5 mrad, 0.05 mm of noise. Each set has its own arm, poses and noise; counted are the
coordinates of 40 new points inside value +- t deviations, in the mean over the sets. bench_honest.json holds 300 sets
of each, docs/noise-and-outliers.md its table.

    python bench/python/bench_honest.py [--sets 300] [--names NAME ...] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from numpy_arm import position_and_jacobian
from scipy import special

from fastcal.calibration.calibrate import calibrate
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]

NOISE = 5e-5
ERROR = 5e-4
NEW_POSES = 40
ARM = "staubli_rx160l"
TARGETS = np.array([[0.0, 0.0, 0.0], [0.08, -0.03, 0.02], [-0.05, 0.09, 0.0]])  # from the tool's point [m]


@dataclass(frozen=True)
class Case:
    """How a set is measured."""

    poses: int = 60
    tails: bool = False  # Student's t with three degrees of freedom
    mixed: float = 0.0  # share of rows whose noise is three times as large
    joints: float = 0.0  # [rad] repeatability of each joint, beside the noise of the points
    targets: int = 1  # at the tool, measured one after the other in each posture
    gross: float = 0.0  # share of rows off by 1 to 20 mm
    memory: float = 0.0  # correlation of neighbouring rows
    sag: float = 0.0  # [rad] joint 2 gives by sin(q2), which the model does not know


CASES = {
    "white": Case(),
    **{f"N = {n}": Case(poses=n) for n in range(10, 17)},
    "t3": Case(tails=True),
    "mixed": Case(mixed=0.2),
    "joint noise": Case(joints=2e-5),
    "joints 0.1": Case(joints=1e-4),
    "three targets": Case(joints=1e-4, targets=3),
    **{f"{round(100 * g)} % gross": Case(poses=100, gross=g) for g in (0.1, 0.2, 0.3, 0.4)},
    "AR(1) 0.8": Case(memory=0.8),
    "missing effect": Case(sag=3e-4),
}


@cache
def arm() -> Robot:
    """Nominal."""
    return load_robot(ARM)


class Simulator:
    """The true arm of one set."""

    def __init__(self, seed: int, case: Case) -> None:
        self.rng, self.case = np.random.default_rng(seed), case
        spec = arm().spec
        degrees = [[joint.get(f"{k}_deg", 0.0) for k in ("theta", "alpha", "beta")] for joint in spec["joints"]]
        lengths = [[joint.get(f"{k}_mm", 0.0) for k in ("d", "a")] for joint in spec["joints"]]
        angle, length = np.radians(degrees), 1e-3 * np.array(lengths)
        rows = np.column_stack([angle[:, 0], length, angle[:, 1:]])
        self.rows = rows + self.rng.normal(0, ERROR, rows.shape)
        self.base = np.concatenate([self.rng.uniform(-2, 2, 3), self.rng.uniform(-0.1, 0.1, 3)])
        self.tool = 1e-3 * np.array(spec["tool"]["xyz_mm"]) + self.rng.normal(0, ERROR, 3)
        limits = [(joint["min_deg"], joint["max_deg"]) for joint in spec["joints"]]
        self.low, self.high = np.radians(limits).T

    def postures(self, count: int) -> Array:
        return np.asarray(self.rng.uniform(self.low, self.high, (count, len(self.low))))

    def points(self, q: Array, target: int = 0) -> Array:
        bent = q.copy()
        bent[:, 1] += self.case.sag * np.sin(q[:, 1])
        tool = self.tool + TARGETS[target]
        return position_and_jacobian(bent, self.base, self.rows, tool, np.zeros(q.shape[1]))[0]

    def noise(self, count: int) -> Array:
        if self.case.tails:
            return np.asarray(NOISE * self.rng.standard_t(3, (count, 3)) / 3**0.5)
        e = self.rng.normal(0, NOISE, (count, 3))
        if self.case.mixed:
            e[self.rng.choice(count, round(self.case.mixed * count), replace=False)] *= 3
        rho = self.case.memory
        for k in range(1, count):
            e[k] = rho * e[k - 1] + (1 - rho**2) ** 0.5 * e[k]
        return np.asarray(e)

    def measured(self) -> Dataset:
        count = self.case.poses
        q = self.postures(count)
        reached = q + self.rng.normal(0, self.case.joints, q.shape) if self.case.joints else q
        targets = range(self.case.targets)
        position = np.stack([self.points(reached, target) for target in targets], axis=1).reshape(-1, 3)
        count = len(position)
        position += self.noise(count)
        bad = self.rng.choice(count, round(self.case.gross * count), replace=False)
        direction = self.rng.normal(size=(len(bad), 3))
        size = self.rng.uniform(1e-3, 2e-2, (len(bad), 1))
        position[bad] += size * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        mount = [f"smr{target}" for target in targets] * len(q) if len(targets) > 1 else None
        return Dataset.from_arrays(np.repeat(q, len(targets), axis=0), position=position, mount=mount, robot=arm())


def covered(seed: int, case: Case) -> tuple[float, bool] | None:
    """Share of new coordinates inside their 95 % intervals, and whether a note says that intervals do not hold."""
    simulator = Simulator(seed, case)
    result = calibrate(arm(), simulator.measured())
    if result.status != "converged":
        return None
    q = simulator.postures(NEW_POSES)
    first: dict[str, Any] = {"mount": "smr0"} if case.targets > 1 else {}
    error = result.model.forward(q, **first)[:, :3, 3] - simulator.points(q)
    t = float(special.stdtrit(max(result.degrees_of_freedom, 1), 0.975))
    inside = np.abs(error) <= t * result.model.position_deviation(q, **first)
    return float(inside.mean()), any("do not hold" in note for note in result.notes)


def run(name: str, sets: int) -> dict[str, Any]:
    """The figures of one case over seeds 0 ... sets - 1."""
    found = [f for seed in range(sets) if (f := covered(seed, CASES[name])) is not None]
    share = np.array([f[0] for f in found])
    return {
        "sets": sets,
        "converged": len(found),
        "covered": float(share.mean()),
        "standard_error": float(share.std(ddof=1) / len(share) ** 0.5),
        "worst_set": float(share.min()),
        "said_that_intervals_do_not_hold": float(np.mean([f[1] for f in found])),
    }


WORDS = {
    "white": "white noise, 60 poses",
    "t3": "Student's t, 3 degrees of freedom",
    "mixed": "a fifth of the rows three times as noisy",
    "joint noise": "joint repeatability of 0.02 mrad, in addition to the noise",
    "joints 0.1": "joint repeatability of 0.1 mrad, in addition to the noise",
    "three targets": "three targets in each posture, joint repeatability of 0.1 mrad",
    "AR(1) 0.8": "neighbouring rows correlated by 0.8",
    "missing effect": "0.3 mrad of sag that the model lacks",
}


def table(found: dict[str, Any]) -> str:
    """Markdown, the cases in the order of CASES."""
    rows = [
        "| data | sets | converged | inside 95 % intervals | worst set | reported that intervals do not hold |",
        "|---|---|---|---|---|---|",
    ]
    for name in (name for name in CASES if name in found):
        row = found[name]
        words = WORDS.get(
            name,
            f"{CASES[name].poses} poses, white"
            if name.startswith("N")
            else f"{name.replace('gross', 'outliers')}, 100 poses",
        )
        share = f"{100 * row['covered']:.1f} ± {100 * row['standard_error']:.1f} %"
        said = f"{100 * row['said_that_intervals_do_not_hold']:.0f} %"
        rows.append(f"| {words} | {row['sets']} | {row['converged']} | {share} | {row['worst_set']:.0%} | {said} |")
    return "\n".join(rows)


def main() -> None:
    """Runs the cases and writes them one by one; cases of an earlier run that are not asked for stay in the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--names", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    kept = options.out is not None and options.out.exists()
    out: dict[str, Any] = json.loads(options.out.read_text()) if kept else {}
    for name in options.names:
        out[name] = run(name, options.sets)
        out = {name: out[name] for name in CASES if name in out}
        print(f"{name:16} {out[name]}", flush=True)
        if options.out is not None:
            options.out.write_text(json.dumps(out, indent=1) + "\n")
    print(table(out))


if __name__ == "__main__":
    main()
