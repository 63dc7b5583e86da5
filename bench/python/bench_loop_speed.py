# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How long `calibrate` takes for the shipped robots with closed loops: CPU seconds, 60 points each.

Robots are built as a workshop does (lengths off by 0.5 mm, angles by 0.5 mrad) and measured in random postures with a
noise of 0.05 mm. In a running Python process; one calibration before them is not counted.

    OMP_NUM_THREADS=1 python bench/python/bench_loop_speed.py [--robots NAME ...] [--sets 20] [--first 0]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from fastcal import load_robot
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import perturbed, random_poses, simulate

LOOPED = ("delta", "delta_printer", "five_bar", "hexapod", "palletizer", "parallelogram_6r")
POINTS, NOISE = 60, 5e-5


def seconds(name: str, seed: int) -> float:
    """CPU time of one calibration."""
    nominal = load_robot(name)
    built, drawn, noise = np.random.SeedSequence(seed).generate_state(3).tolist()
    real = perturbed(nominal, seed=built)
    data = simulate(real, random_poses(nominal, POINTS, seed=drawn), noise=NOISE, seed=noise)
    begun = time.process_time()
    calibrate(nominal, data)
    return time.process_time() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", choices=LOOPED, default=list(LOOPED))
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    print(f"{'robot':18}{'sets':>6}{'median':>9}{'largest':>9}  [s of CPU]")
    for name in given.robots:
        seconds(name, given.first)
        took = [seconds(name, seed) for seed in range(given.first, given.first + given.sets)]
        print(f"{name:18}{len(took):6}{np.median(took):9.3f}{np.max(took):9.3f}", flush=True)


if __name__ == "__main__":
    main()
