# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals of predicted points cover where data are thin, spoilt or not as assumed?

An arm, its errors, its noise and what is measured are simulated by numpy_arm alone, which shares no line with fastcal:
geometry off by 0.5 mm and 0.5 mrad, 0.05 mm of noise. Each set has its own arm, poses and noise; counted are the
coordinates of 40 new points inside value +- t deviations, in the mean over the sets.

    python bench/python/bench_honest.py [--sets 300] [--names NAME ...] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from numpy_arm import position_and_jacobian
from scipy import special

from fastcal.calibration.calibrate import calibrate
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]

NOISE = 5e-5
ERROR = 5e-4
NEW_POSES = 40
ARM = "staubli_rx160l"


@dataclass(frozen=True)
class Case:
    """How a set is measured."""

    poses: int = 60
    tails: bool = False  # Student's t with three degrees of freedom
    gross: float = 0.0  # share of rows off by 1 to 20 mm
    memory: float = 0.0  # correlation of neighbouring rows
    sag: float = 0.0  # [rad] joint 2 gives by sin(q2), which the model does not know


CASES = {
    "white": Case(),
    **{f"N = {n}": Case(poses=n) for n in (10, 11, 12, 13, 14, 16)},
    "t3": Case(tails=True),
    **{f"{round(100 * g)} % gross": Case(poses=100, gross=g) for g in (0.1, 0.2, 0.3, 0.4)},
    "AR(1) 0.8": Case(memory=0.8),
    "missing effect": Case(sag=3e-4),
}


class Simulator:
    """The true arm of one set."""

    def __init__(self, seed: int, case: Case) -> None:
        self.rng, self.case = np.random.default_rng(seed), case
        spec = load_robot(ARM).spec
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

    def points(self, q: Array) -> Array:
        bent = q.copy()
        bent[:, 1] += self.case.sag * np.sin(q[:, 1])
        return position_and_jacobian(bent, self.base, self.rows, self.tool, np.zeros(q.shape[1]))[0]

    def noise(self, count: int) -> Array:
        if self.case.tails:
            return np.asarray(NOISE * self.rng.standard_t(3, (count, 3)) / 3**0.5)
        e = self.rng.normal(0, NOISE, (count, 3))
        rho = self.case.memory
        for k in range(1, count):
            e[k] = rho * e[k - 1] + (1 - rho**2) ** 0.5 * e[k]
        return np.asarray(e)

    def measured(self) -> Dataset:
        count = self.case.poses
        q = self.postures(count)
        position = self.points(q) + self.noise(count)
        bad = self.rng.choice(count, round(self.case.gross * count), replace=False)
        direction = self.rng.normal(size=(len(bad), 3))
        size = self.rng.uniform(1e-3, 2e-2, (len(bad), 1))
        position[bad] += size * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        return Dataset.from_arrays(q, position=position)


def covered(seed: int, case: Case) -> tuple[float, bool] | None:
    """Share of new coordinates inside their 95 % intervals, and whether a note says that intervals do not hold."""
    simulator = Simulator(seed, case)
    result = calibrate(load_robot(ARM), simulator.measured())
    if result.status != "converged":
        return None
    q = simulator.postures(NEW_POSES)
    error = result.model.forward(q)[:, :3, 3] - simulator.points(q)
    t = float(special.stdtrit(max(result.degrees_of_freedom, 1), 0.975))
    inside = np.abs(error) <= t * result.model.position_deviation(q)
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


def main() -> None:
    """Runs the cases and writes them one by one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--names", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    out: dict[str, Any] = {}
    for name in options.names:
        out[name] = run(name, options.sets)
        print(f"{name:16} {out[name]}", flush=True)
        if options.out is not None:
            options.out.write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main()
