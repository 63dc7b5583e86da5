# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows of the UR10's campaign b that no model of the arm can predict: what they and the rows nearest to them are off.

Geometry and profiles of all joints are fitted to the other rows (../shared/data/ur10_tmac, docs/public-data.md), so
that what such a row is off is off a prediction. Another visit at the same joint readings is 0.0 deg away.

    python bench/python/ur10_gross_rows.py [--beyond-mm 1]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fastcal

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "ur10_tmac"
NEIGHBOURS = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beyond-mm", type=float, default=1.0)
    options = parser.parse_args()
    robot = fastcal.load_robot(DATA / "robot.yaml")
    data = fastcal.load_measurements(DATA / "campaign_b.csv", robot)
    measured = np.asarray(data.position)
    model = fastcal.calibrate(robot, data, effects="geometry,joint_profile").model
    first = 1e3 * np.linalg.norm(measured - model.poses(data)[:, :3, 3], axis=1)
    gross = np.flatnonzero(first > options.beyond_mm)
    rest = np.setdiff1d(np.arange(len(data)), gross)
    model = fastcal.calibrate(robot, data.select(rest), effects="geometry,joint_profile").model
    off = 1e3 * (measured - model.poses(data)[:, :3, 3])
    others = np.sqrt(np.mean(np.sum(off[rest] ** 2, axis=1)))
    print(f"{len(gross)} of {len(data)} are off by more than {options.beyond_mm:g} mm; the others {others:.3f} mm RMS")
    q = np.degrees(data.q)
    for row in gross:
        print(f"row {row}: {_mm(off[row])} mm, q {_deg(q[row])} deg; nearest postures:")
        away = np.abs((q - q[row] + 180) % 360 - 180).max(axis=1)
        away[row] = np.inf
        for other in np.argsort(away)[:NEIGHBOURS]:
            print(f"    row {other}: {_mm(off[other])} mm, {away[other]:.1f} deg away")


def _mm(v: NDArray[np.float64]) -> str:
    return " ".join(f"{x:6.2f}" for x in v)


def _deg(v: NDArray[np.float64]) -> str:
    return " ".join(f"{x:7.2f}" for x in v)


if __name__ == "__main__":
    main()
