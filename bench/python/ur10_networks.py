# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The UR10's two campaigns: a network on what geometry leaves, held out at random, by regions, and months later.

    python bench/python/ur10_networks.py DATA        # the folder with robot.yaml, campaign_b.csv, campaign_c.csv

Campaign c: trained on 70 % of the rows, tested on the others; the regions' figures are those of the held-out cells of
training itself. Then a model and a network of campaign b are asked about campaign c, base and tool refitted on 20 rows.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from fastcal import Robot, calibrate, evaluate, load_measurements, load_robot
from fastcal.calibration.realign import realign
from fastcal.networks import train


def mean_mm(robot: Robot, data: object) -> float:
    after = evaluate(robot, data).after  # type: ignore[arg-type]
    assert after is not None
    return after.to_mm()["mean"]


def main() -> None:
    folder = Path(sys.argv[1])
    nominal = load_robot(folder / "robot.yaml")
    b, c = (load_measurements(folder / f"campaign_{name}.csv", nominal) for name in "bc")
    test = np.random.default_rng(0).random(len(c)) < 0.3
    learnt, unseen = c.select(~test), c.select(test)
    geometry = calibrate(nominal, learnt).model
    profiles = calibrate(nominal, learnt, effects="geometry,joint_profile").model
    found = train(geometry, learnt, rivals=["gp", "knn", "boosting"])
    print(f"campaign c, {len(unseen)} rows held out at random, mean error:")
    for name, model in (("geometry", geometry), ("joint profiles", profiles), (found.used, found.model)):
        print(f"  {name:16}{mean_mm(model, unseen):.4f} mm")
    said = found.model.correct(unseen.q, unseen.payload)
    assert unseen.position is not None
    inside = np.abs(found.model.poses(unseen)[:, :3, 3] - unseen.position) <= 1.6448536 * said.sigma
    print(f"  90 % intervals hold {inside.mean():.1%} of the coordinates")
    print(f"held-out regions: {found.regions}")
    for name, score in found.scores.items():
        print(f"  {name:16}{score['mean']:.4f} mm")

    older = calibrate(nominal, b).model
    network = train(older, b, rivals=[]).model
    few = np.random.default_rng(1).permutation(len(c))[:20]
    rest = c.select(np.setdiff1d(np.arange(len(c)), few))
    print("trained on b, asked on c, base and tool refitted on 20 rows:")
    for name, model in (("geometry", older), ("network", network)):
        there = realign(model, c.select(few))
        print(f"  {name:16}{mean_mm(there, rest):.4f} mm")


if __name__ == "__main__":
    main()
