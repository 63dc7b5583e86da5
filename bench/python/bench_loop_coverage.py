# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold the truth for each shipped robot with closed loops, and how near do predictions come?

Each set has a robot of its own (lengths off by 0.5 mm, angles by 0.5 mrad), whose point is measured in 100 random
postures with a noise of 0.05 mm. Counted are all identified parameters of joints, loops and tool. Which ones the gauge
holds depends on the robot, and what a held one is off moves into others; so the truth of a set is what the same
readings with a thousandth of their noise give for the very same parameters. `error` is how far predicted points lie
off in 50 other postures (root of the mean square of a coordinate), over the error that the noise makes inevitable,
sigma (P / 3 N)^0.5. With `--mujoco` (delta, delta_printer, five_bar) the points are MuJoCo's, `mujoco_world.py`.

    python bench/python/bench_loop_coverage.py [--sets 100] [--robots NAME ...] [--noise-mm 0.05] [--mujoco]
        [--out FILE]
"""

from __future__ import annotations

import argparse
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from bench_coverage import wilson
from numpy.typing import NDArray

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.simulation import perturbed, random_poses, simulate
from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_text
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.robots import available, serial
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]

POSES, TESTS = 100, 50
NOISE = to_si(0.05, "mm")
FAINT = 1e-3  # of the noise


def measured(truth: Robot, q: FloatArray, sigma: float, seed: int, *, by_mujoco: bool) -> Dataset:
    """Points of a robot in postures q, by fastcal or by MuJoCo."""
    if not by_mujoco:
        return simulate(truth, q, noise=sigma, seed=seed)
    from mujoco_world import MujocoWorld

    points = MujocoWorld(truth.spec).points(q) + sigma * np.random.default_rng(seed).standard_normal((len(q), 3))
    return Dataset.from_arrays(q, position=points, robot=truth)


def trial(name: str, seed: int, sigma: float = NOISE, *, by_mujoco: bool = False) -> dict[str, float] | None:
    """Sums of one set whose points have a noise of sigma [m].

    None where it is refused or did not converge, or where less noise shows other parameters.
    """
    random = np.random.default_rng([zlib.crc32(name.encode()), seed])
    arm, poses, noise, tests = (int(random.integers(2**31)) for _ in range(4))
    nominal = load_robot(name)
    truth = perturbed(nominal, seed=arm)
    q = random_poses(truth, POSES, seed=poses)
    try:
        data = measured(truth, q, sigma, noise, by_mujoco=by_mujoco)
        found = calibrate(nominal, data, loss="none", priors=False)
        names = full_names(found)
        faint = measured(truth, q, FAINT * sigma, noise, by_mujoco=by_mujoco)
        there = calibrate(nominal, faint, parameters=names, loss="none", checks=False, priors=False)
    except InvalidInput:  # a refusal, such as of identified loops that do not close at the start posture
        return None
    if found.status != "converged" or full_names(there) != names:
        return None
    z = []
    for p, (low, high), other in zip(found.parameters, found.interval(), there.parameters, strict=True):
        if p.owner != "base":
            z.append((bool(low <= other.value <= high), (p.value - other.value) / float(p.std or np.nan)))
    other = random_poses(truth, TESTS, seed=tests)
    off = found.model.forward(other)[:, :3, 3] - truth.forward(other)[:, :3, 3]
    return {
        "counted": len(z),
        "hits": sum(hit for hit, _ in z),
        "squares": float(sum(d * d for _, d in z)),
        "error": float(np.sqrt(np.mean(off**2)) / (sigma * np.sqrt(len(names) / (3 * POSES)))),
    }


def full_names(found: CalibrationResult) -> list[str]:
    """Of the identified parameters, as `parameters` of `calibrate` takes them."""
    return [f"{p.owner} {p.name.rpartition('_')[0] or p.name}" for p in found.parameters]


def row_of(trials: list[dict[str, float] | None]) -> dict[str, Any]:
    """What the sets of one robot come to."""
    done = [each for each in trials if each is not None]
    if not done:
        return {"sets": 0, "left_out": len(trials)}
    counted, hits = (int(sum(each[key] for each in done)) for key in ("counted", "hits"))
    low, high = wilson(hits, counted)
    return {
        "sets": len(done),
        "left_out": len(trials) - len(done),
        "counted": counted,
        "covered": hits / counted,
        "low": low,
        "high": high,
        "rms_deviations": (sum(each["squares"] for each in done) / counted) ** 0.5,
        "error": float(np.median([each["error"] for each in done])),
    }


def main() -> None:
    looped = [name for name in available() if name not in serial()]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--robots", nargs="+", choices=looped, default=looped)
    parser.add_argument("--noise-mm", type=float, default=from_si(NOISE, "mm"))
    parser.add_argument("--mujoco", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    sigma = to_si(options.noise_mm, "mm")
    rows: dict[str, Any] = {}
    for name in options.robots:
        rows[name] = row_of([trial(name, seed, sigma, by_mujoco=options.mujoco) for seed in range(options.sets)])
        print(name, json.dumps(rows[name]), flush=True)
        if options.out:
            write_text(options.out, json.dumps({"poses": POSES, "noise_m": sigma, "robots": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
