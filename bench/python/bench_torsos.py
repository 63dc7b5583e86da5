# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Torsos with two arms and a head: is the other arm's weight in the model, and is it missed where its posture is not?

Each torso has its own lengths (0.85 to 1.2 of a life-size humanoid's), masses (a quarter more or less), centres (20
mm) and compliances of six joints; 150 points of the left hand in random postures of all joints, noise 0.2 mm. `floor`
is how far points in 200 other postures are missed by the calibrated model over the noise of a point; `with` and
`without`: does `diagnose` name `branch_posture` where the other arm and the head have their columns, and where they
have none?

    python bench/python/bench_torsos.py --out FILE [--first 0] [--torsos 10]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fastcal import calibrate, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.io.atomic import write_text
from fastcal.robot.robot import Robot

NOISE = 2e-4  # [m]
COUNT, TESTS = 150, 200
YIELDING = {1: 3e-5, 2: 4e-5, 12: 3e-5, 13: 3e-5, 14: 3e-5, 15: 6e-5}  # [rad / (N m)] by joint
BESIDE = list(range(2, 11))
# Of the left arm: place [mm], axis, limits [deg], mass [kg], its centre [mm].
ARM = [
    ([0, 160, 230], [0, 0, 1], (-60, 60), 2.7, [0, 0, -20]),
    ([0, 140, 0], [1, 0, 0], (0, 120), 2.4, [10, 0, -60]),
    ([0, 0, -120], [0, 0, 1], (-100, 100), 2.3, [0, 10, -120]),
    ([20, 0, -150], [0, 1, 0], (-120, -5), 1.7, [0, 0, -50]),
    ([-20, 0, -260], [0, 0, 1], (-120, 120), 1.9, [0, 0, 50]),
    ([0, 0, 0], [1, 0, 0], (-70, 70), 0.4, [0, 0, 0]),
    ([0, 0, 0], [0, 1, 0], (-35, 35), 0.6, [0, 0, -60]),
]
TORSO = [([0, 0, 70], [0, 0, 1], (-70, 70), 3.0, [0, 0, 50]), ([0, 0, 100], [0, 1, 0], (-13, 40), 17.0, [-40, 0, 140])]
HEAD = [([20, 0, 320], [0, 1, 0], (-10, 40), 0.6, [0, 0, 20]), ([0, 0, 20], [0, 0, 1], (-70, 70), 1.4, [10, 0, 150])]


def torso(random: np.random.Generator | None = None) -> Robot:
    """Joints 1 and 2 the torso, 3 to 9 the right arm, 10 and 11 the head, 12 to 18 the left arm with the tool.

    One as drawn, else as the tables above have it.
    """
    longer = 1.0 if random is None else random.uniform(0.85, 1.2)
    joints = []
    for branch, parts in (("torso", TORSO), ("right", ARM), ("head", HEAD), ("left", ARM)):
        for k, (xyz, axis, limits, mass, com) in enumerate(parts, start=1):
            side = -1.0 if branch == "right" else 1.0
            low, high = (-limits[1], -limits[0]) if branch == "right" and axis == [1, 0, 0] else limits
            place, centre = longer * np.array(xyz, dtype=float), np.array(com, dtype=float)
            centre += 0.0 if random is None else random.normal(0, 20, 3)
            place[1] *= side
            centre[1] *= side
            joint: dict[str, Any] = {"name": f"{branch}_{k}", "type": "revolute", "axis": axis}
            joint |= {"origin": {"xyz_mm": place.tolist(), "rpy_deg": [0, 0, 0]}, "min_deg": low, "max_deg": high}
            heavier = 1.0 if random is None else float(np.exp(random.normal(0, 0.25)))
            joint["link"] = {"mass_kg": mass * heavier, "com_mm": centre.tolist()}
            if k == 1 and branch != "torso":
                joint["on"] = "link2"
            joints.append(joint)
    tool = {"xyz_mm": [0, 0, -120], "rpy_deg": [0, 0, 0]}
    return load_robot({"name": "torso", "kinematics": "urdf", "joints": joints, "tool": tool})


def trial(seed: int) -> dict[str, Any]:
    random = np.random.default_rng([47, seed])
    nominal = torso(random)
    built, drawn, others, noise, more = (int(random.integers(2**31)) for _ in range(5))
    soft = {k: float(c * np.exp(random.normal(0, 0.4))) for k, c in YIELDING.items()}
    entries = [
        {"effect": "joint_compliance", "owner": f"joint{k}", "parameters": {"compliance_rad_nm": c}}
        for k, c in soft.items()
    ]
    real = perturbed(nominal, seed=built).with_(effects=entries)
    data = simulate(real, random_poses(nominal, COUNT, seed=drawn), noise=NOISE, seed=noise)
    test = simulate(real, random_poses(nominal, TESTS, seed=others), noise=NOISE, seed=more)
    effects = ["geometry", *(f"joint_compliance@joint{k}" for k in YIELDING)]
    found = calibrate(nominal, data, effects=effects, test=test)
    assert found.test is not None
    rms = float(np.sqrt(np.mean(np.sum(found.test.error_after**2, axis=1))))
    q = data.q.copy()
    q[:, BESIDE] = 0
    named = [
        [f.label for f in diagnose(nominal, rows).effects if f.effect == "branch_posture"]
        for rows in (data, replace(data, q=q))
    ]
    return {"seed": seed, "floor": rms / (NOISE * 3**0.5), "with": named[0], "without": named[1]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--torsos", type=int, default=10)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for seed in range(given.first, given.first + given.torsos):
        rows.append(trial(seed))
        print(json.dumps(rows[-1]), flush=True)
        sums = {
            "torsos": len(rows),
            "within_1.1": sum(row["floor"] < 1.1 for row in rows),
            "worst": max(row["floor"] for row in rows),
            "said_with_columns": sum(bool(row["with"]) for row in rows),
            "named_without": sum(bool(row["without"]) for row in rows),
        }
        if given.out is not None:
            lines = ",\n".join(json.dumps(row) for row in rows)
            write_text(given.out, f'{{"sums": {json.dumps(sums)}, "sets": [\n{lines}\n]}}\n')
    print(sums)


if __name__ == "__main__":
    main()
