# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners of `fastcal compliance`: how often one is drawn on a straight joint, and how far off it is on a bent one.

    python bench/python/bench_corners.py --sets 100 --seed 0

Each set: an RX160L of known geometry, 40 random postures under six payloads, 5 um of noise a coordinate. The joints
asked about are 2 to 5, one of 2, 3 and 5 with a corner at random within the middle of what it feels. Written: of all
straight joints how many got a corner, of the bent ones how many were found, and how many are within two of the standard
deviations that are stated.
"""

from __future__ import annotations

import argparse
import copy

import numpy as np

import fastcal
from fastcal.calibration.compliance import identify_compliance, torques_of
from fastcal.robot.robot import Robot

PAYLOADS = (0.4, 1.95, 3.95, 5.95, 7.95, 9.95)
STRAIGHT = {2: 1 / 2.34e6, 3: 1 / 9.73e5, 4: 1 / 8.52e4, 5: 1 / 8.07e3}  # rad / N m
RATIOS = (0.5, 0.7, 1.5, 2.0)  # above the corner over below
POSTURES, NOISE = 40, 5e-6


def arm() -> Robot:
    """The shipped arm without link masses, a payload whose centre lies before the flange."""
    spec = copy.deepcopy(dict(fastcal.load_robot("staubli_rx160l").spec))
    for joint in spec["joints"]:
        joint.pop("link")
    return Robot(spec | {"payload": {"com_mm": [30.0, 10.0, 120.0]}})


def one(seed: int) -> tuple[int, int, bool, float | None]:
    """Straight joints, those of them with a corner, whether the bent one was found, and its error in deviations."""
    random = np.random.default_rng((seed, 77))
    known = arm()
    bent = int(random.choice([2, 3, 5]))
    postures = fastcal.random_poses(known, POSTURES, seed=seed)
    q, payload = np.repeat(postures, len(PAYLOADS), axis=0), np.tile(PAYLOADS, POSTURES)
    rows = fastcal.Dataset.from_arrays(q, payload=payload)
    felt = np.abs(torques_of(known, rows, "payload"))[:, bent - 1]
    critical, ratio = float(np.quantile(felt, random.uniform(0.3, 0.7))), float(random.choice(RATIOS))
    effects = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": c}}
        for j, c in STRAIGHT.items()
        if j != bent
    ]
    low = STRAIGHT[bent]
    own = {"low_rad_nm": low, "high_rad_nm": low * ratio, "critical_nm": critical}
    kind = {"effect": "joint_compliance_nonlinear", "owner": f"joint{bent}", "torque": "payload"}
    true = Robot({**known.spec, "effects": [*effects, kind | {"parameters": own}]})
    data = fastcal.simulate(true, q, payload=payload, noise=NOISE, seed=seed)
    found = identify_compliance(known, data, joints=tuple(STRAIGHT), torque="payload")
    bends = {curve.owner: curve.bent for curve in found.curves}
    was_found = bends.pop(f"joint{bent}")
    off = [
        (p.value - critical) / p.std
        for p in found.pairs.parameters
        if p.owner == f"joint{bent}" and p.name == "critical_nm" and p.std
    ]
    return len(bends), sum(bends.values()), was_found, off[0] if was_found else None


def main() -> None:
    """Prints the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    straight = drawn = 0
    off: list[float] = []
    for seed in range(asked.seed, asked.seed + asked.sets):
        count, false, _, away = one(seed)
        straight, drawn = straight + count, drawn + false
        off += [] if away is None else [away]
    near = sum(abs(z) <= 2 for z in off)
    print(f"straight joints {straight}: {drawn} with a corner")
    print(f"bent joints {asked.sets}: {len(off)} found, {near} of these within two standard deviations")


if __name__ == "__main__":
    main()
