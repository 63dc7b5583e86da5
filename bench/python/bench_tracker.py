# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a tracker's own covariance is worth: rows weighted along and across its beam, beside rows of one noise.

Each arm (year_arm.py, which shares no code with fastcal; rigid here) is measured by a tracker that stands somewhere,
its lengths and angles wrong by normal errors. Counted, for both ways to weigh: how far the calibrated model is from the
arm on unseen poses, how many of its 95 % intervals of a predicted coordinate hold the arm, alarms of checks while
nothing has changed, and alarms at the first check after joint 4's zero has moved by 0.02 deg.

    python bench/python/bench_tracker.py [--arms 100] [--first 0] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from bench_year import MONTHLY, POSES, UNSEEN, away, bodies, built, nominal, postures, set_up
from numpy.typing import NDArray
from year_arm import Arm

import fastcal
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset

FloatArray = NDArray[np.float64]

RANGE, ANGLE = 5e-6, 2e-5  # [m], [rad]: 0.06 mm across the beam at 3 m
MOVED = 0.02  # deg, joint 4
WAYS = ("weighted", "plain")


def measured(arm: Arm, q: FloatArray, payload: FloatArray, random: np.random.Generator, weighted: bool) -> Dataset:
    """Points from a length, an azimuth and an elevation, each with its error."""
    x, y, z = arm.points(q, payload).T
    level = np.hypot(x, y)
    length = np.hypot(level, z) + RANGE * random.standard_normal(len(q))
    elevation = np.arctan2(z, level) + ANGLE * random.standard_normal(len(q))
    # An azimuth is as sure as its circle is read: across the beam both angles make the same error.
    azimuth = np.arctan2(y, x) + ANGLE / np.cos(elevation) * random.standard_normal(len(q))
    level = length * np.cos(elevation)
    points = np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), length * np.sin(elevation)])
    data = Dataset.from_arrays(q, payload=payload, position=points, robot=nominal())
    return data.with_tracker(RANGE, ANGLE) if weighted else data


def one(index: int) -> dict[str, dict[str, float]]:
    """One arm, both ways from the same readings."""
    out = {}
    for way in WAYS:
        random = np.random.default_rng([2027, index])
        weighted = way == "weighted"
        masses, centres = bodies()
        arm = built(random).with_(masses=masses, centres=centres, compliance=np.zeros(6))
        model = fastcal.calibrate(nominal(), measured(arm, *postures(POSES, random), random, weighted)).model
        q, payload = postures(UNSEEN, random)
        known = fastcal.predict(model, Dataset.from_arrays(q, payload=payload, robot=nominal()))
        inside = np.abs(known.position - arm.points(q, payload)) <= 1.96 * known.sigma_position
        poses = fastcal.check_poses(model, MONTHLY)
        rows = arm.rows.copy()
        rows[3, 0] += np.radians(MOVED)
        found = []
        for each in (arm, arm.with_(rows=rows)):
            today = measured(each.with_(base=set_up(random)), poses.q, poses.payload, random, weighted)
            found.append(fastcal.check(model, today).verdict == "changed")
        out[way] = {
            "away_mm": 1e3 * away(model, arm, random),
            "covered": float(inside.mean()),
            "false_alarm": float(found[0]),
            "alarm": float(found[1]),
        }
    return out


def table(arms: list[dict[str, dict[str, float]]]) -> dict[str, Any]:
    """The figures of all arms, by the way to weigh."""
    out: dict[str, Any] = {"arms": len(arms), "range_mm": 1e3 * RANGE, "angle_mrad": 1e3 * ANGLE}
    for way in WAYS:
        rows = [arm[way] for arm in arms]
        mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
        out[way] = mean | {"away_mm": float(np.sqrt(np.mean([row["away_mm"] ** 2 for row in rows])))}
    return out


def markdown(found: dict[str, Any]) -> str:
    """The table of docs/uncertainty.md."""
    lines = ["| rows | RMS on unseen poses | 95 % intervals that hold | false alarms | alarm at joint 4's zero |"]
    lines.append("|---|---|---|---|---|")
    for way, name in zip(WAYS, ("weighted by the tracker's covariance", "of one noise"), strict=True):
        row = found[way]
        covered, false_alarm, alarm = (100 * row[key] for key in ("covered", "false_alarm", "alarm"))
        shares = f"{covered:.1f} % | {false_alarm:.0f} % | {alarm:.0f} %"
        lines.append(f"| {name} | {row['away_mm']:.4f} mm | {shares} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    arms = [one(index) for index in range(options.first, options.first + options.arms)]
    found = table(arms)
    if options.out:
        write_text(options.out, json.dumps(found | {"each": arms}, indent=1) + "\n")
    print(markdown(found))


if __name__ == "__main__":
    main()
