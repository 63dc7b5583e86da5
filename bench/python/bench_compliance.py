# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compliance` on joints that bend: which corners are found, how sure, and which no test could find.

    python bench/python/bench_compliance.py -o bench/python/bench_compliance.json

Every set is an RX160L whose geometry is off, its joints 2 to 5 springs, one of which bends: joint, place of the corner
among the loads (quantiles 0.25 to 0.75) and change of compliance (15 to 60 %) are drawn. 40 postures carry six
payloads; the noise of a coordinate is 5 um. Beside each stands the power of the F test that is told where the corner
is, at the same level: what is missed where this is small is not in the rows.
"""

from __future__ import annotations

import argparse
import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

import fastcal
from fastcal.calibration.compliance import LEVEL, identify_compliance, torques_of
from fastcal.calibration.payload_pairs import differences, rows_in_pairs
from fastcal.robot.robot import Robot

JOINTS = (2, 3, 4, 5)
STRAIGHT = {2: 1 / 2.34e6, 3: 1 / 9.73e5, 4: 1 / 8.52e4, 5: 1 / 8.07e3}  # rad / (N m): RX160L paper, table 3
PAYLOADS = (0.4, 1.95, 3.95, 5.95, 7.95, 9.95)
POSTURES, NOISE = 40, 5e-6
QUANTILES, CHANGES = (0.25, 0.75), (0.15, 0.6)


def nominal() -> Robot:
    """The arm without masses, its payload's centre known."""
    spec = copy.deepcopy(dict(fastcal.load_robot("staubli_rx160l").spec))
    for joint in spec["joints"]:
        joint.pop("link")
    return Robot(spec | {"payload": {"com_mm": [30.0, 10.0, 120.0]}})


def drawn(seed: int) -> tuple[Robot, fastcal.Dataset, int, dict[str, float]]:
    """The true arm, its rows, the joint that bends and its law."""
    random = np.random.default_rng((seed, 1))
    bare = fastcal.perturbed(nominal(), seed=seed)
    q = np.repeat(fastcal.random_poses(bare, POSTURES, seed=seed), len(PAYLOADS), axis=0)
    payload = np.tile(PAYLOADS, POSTURES)
    joint = int(random.choice(JOINTS))
    loads = np.abs(torques_of(bare, fastcal.Dataset.from_arrays(q, payload=payload), "payload")[:, joint - 1])
    low = STRAIGHT[joint]
    law = {
        "low_rad_nm": low,
        "high_rad_nm": low * (1 - float(random.uniform(*CHANGES))),
        "critical_nm": float(np.quantile(loads, random.uniform(*QUANTILES))),
    }
    effects = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": STRAIGHT[j]}}
        for j in JOINTS
        if j != joint
    ]
    bends = {"effect": "joint_compliance_nonlinear", "owner": f"joint{joint}", "torque": "payload", "parameters": law}
    arm = Robot(bare.spec | {"effects": [*effects, bends]})
    return arm, fastcal.simulate(arm, q, payload=payload, noise=NOISE, seed=seed), joint, law


def told_power(arm: Robot, data: fastcal.Dataset, joint: int, law: dict[str, float]) -> float:
    """Chance that the F test of a corner at the true place finds it, the noise and all else as they are."""
    straight = [f"joint_compliance@joint{j}" for j in JOINTS if j != joint]
    asked = [*straight, f"joint_compliance_nonlinear@joint{joint}:torque=payload"]
    ready, problem = differences(arm.with_(effects=[]), data, asked, 1)
    model = ready.model
    own = len(model.robot.parameters)
    effects = model.parameters[own:]
    theta = np.array(model.start)
    for k, parameter in enumerate(effects):
        names = {"low": "low_rad_nm", "high": "high_rad_nm", "critical": "critical_nm"}
        if parameter.owner == f"joint{joint}":
            theta[own + k] = law[names[parameter.name]]
        else:
            theta[own + k] = STRAIGHT[int(parameter.owner[-1])]
    places = {p.name: k for k, p in enumerate(effects) if p.owner == f"joint{joint}"}
    J = problem.jacobian(theta)
    others = [k for k in range(len(effects)) if k not in places.values()]
    A = np.column_stack([J[:, others], J[:, places["low"]] + J[:, places["high"]]])
    A = A / np.linalg.norm(A, axis=0)
    b = J[:, places["high"]] * (law["high_rad_nm"] - law["low_rad_nm"])
    b = b - A @ np.linalg.lstsq(A, b, rcond=None)[0]
    freedom = 3 * (len(rows_in_pairs(data)[0]) - POSTURES) - A.shape[1] - 1
    bound = stats.f.isf(LEVEL, 1, freedom)
    return float(stats.ncf.sf(bound, 1, freedom, float(b @ b) / NOISE**2))


def one(seed: int) -> dict[str, Any]:
    """A set, and what was found in it."""
    arm, data, joint, law = drawn(seed)
    found = identify_compliance(nominal(), data, joints=JOINTS, torque="payload")
    own = found.curves[JOINTS.index(joint)]
    entries = {p.name: p for p in found.pairs.parameters if p.owner == own.owner}
    out: dict[str, Any] = {"seed": seed, "joint": joint, "p": own.p, "found": own.bent}
    out["others"] = [curve.owner for curve in found.curves if curve.bent and curve is not own]
    out["told_power"] = round(told_power(arm, data, joint, law), 4)
    if own.bent:
        critical = entries["critical_nm"]
        out["off_sigma"] = round((critical.value - law["critical_nm"]) / float(critical.std or np.inf), 2)
    return out


def main() -> None:
    """Runs it, prints the sums and writes the record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", type=Path, help="where the record is written")
    parser.add_argument("--sets", type=int, default=190)
    parser.add_argument("--first", type=int, default=1000)
    given = parser.parse_args()
    sets = []
    for seed in range(given.first, given.first + given.sets):
        sets.append(one(seed))
        print(sets[-1], flush=True)
    found = [each for each in sets if each["found"]]
    inside = sum(abs(each["off_sigma"]) <= 2 for each in found)
    told = sum(each["told_power"] for each in sets)
    print(f"{len(found)} of {len(sets)} found (told the place: {told:.1f} expected), {inside} within two sigma")
    if given.o is not None:
        given.o.write_text(json.dumps({"noise_mm": 0.005, "level": LEVEL, "sets": sets}, indent=1) + "\n")


if __name__ == "__main__":
    main()
