# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Networks trained on poses: errors of point and orientation on unseen poses, and of commands, before and after.

Three shipped arms, each with waves of two to four cycles in every joint that no model has; 240 poses are learnt (20 um
and 0.05 mrad of noise), 150 others judged, and commands for 40 of these sent to the true arm, with the network and
without. The network is what `train` keeps of mlp by default.

    python bench/python/bench_orientation.py [--first 100] [--sets 1] [-o FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import fastcal
from fastcal.compensation import compensate
from fastcal.networks import train
from fastcal.networks.problem import residuals_of
from fastcal.robot.robot import Robot
from fastcal.units import from_si

ARMS = ("ur5", "staubli_rx160l", "kuka_kr6_r900")
LEARNT, UNSEEN, SENT = 240, 150, 40
NOISE, NOISE_TURN = 2e-5, 5e-5


def with_waves(arm: Robot, random: np.random.Generator) -> Robot:
    """Two to four cycles of error in every joint."""
    waves = [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{joint}",
            "order": int(random.integers(2, 5)),
            "parameters": {
                "amplitude_rad": {"value": float(random.uniform(2e-4, 6e-4))},
                "phase_rad": {"value": float(random.uniform(0, 2 * np.pi))},
            },
        }
        for joint in range(1, arm.joint_count + 1)
    ]
    return Robot(arm.spec | {"effects": waves})


def measured(true: Robot, count: int, random: np.random.Generator) -> fastcal.Dataset:
    """Poses within 1.5 rad of zero and of the limits, as an instrument sees them."""
    low, high = np.maximum(true.limits[:, 0], -1.5), np.minimum(true.limits[:, 1], 1.5)
    q = random.uniform(low, high, (count, true.joint_count))
    return fastcal.simulate(true, q, noise=NOISE, noise_rotation=NOISE_TURN, seed=int(random.integers(2**31)))


def on_poses(model: Robot, data: fastcal.Dataset) -> tuple[float, float]:
    """Mean errors of points [mm] and of orientations [deg]."""
    left = residuals_of(model, data, model.poses(data))
    point, turn = (np.linalg.norm(part, axis=1).mean() for part in (left[:, :3], left[:, 3:]))
    return float(from_si(point, "mm")), float(from_si(turn, "deg"))


def of_commands(true: Robot, q: np.ndarray, targets: np.ndarray) -> tuple[float, float]:
    """How far the true arm is from its targets: mean [mm] and [deg]."""
    T = true.forward(q)
    cosine = (np.trace(T[:, :3, :3].transpose(0, 2, 1) @ targets[:, :3, :3], axis1=1, axis2=2) - 1) / 2
    point = np.linalg.norm(T[:, :3, 3] - targets[:, :3, 3], axis=1).mean()
    return float(from_si(point, "mm")), float(from_si(np.arccos(np.clip(cosine, -1, 1)).mean(), "deg"))


def one(name: str, seed: int) -> dict[str, Any]:
    """One arm."""
    random = np.random.default_rng((seed, ARMS.index(name)))
    arm = fastcal.load_robot(name)
    true = with_waves(arm, random)
    data, unseen = measured(true, LEARNT, random), measured(true, UNSEEN, random)
    model = fastcal.calibrate(arm, data).model
    found = train(model, data, rivals=[], folds=3)
    targets, seeds = model.forward(unseen.q[:SENT]), unseen.q[:SENT]
    plain, sent = (compensate(each, targets, seeds, along_path=False) for each in (model, found.model))
    return {
        "arm": name,
        "seed": seed,
        "used": found.used,
        "unseen": {"model": on_poses(model, unseen), "network": on_poses(found.model, unseen)},
        "commands": {"model": of_commands(true, plain.q, targets), "network": of_commands(true, sent.q, targets)},
    }


def main() -> None:
    """Runs it, prints each arm and writes the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--sets", type=int, default=1)
    parser.add_argument("-o", type=Path)
    given = parser.parse_args()
    runs = [one(name, seed) for seed in range(given.first, given.first + given.sets) for name in ARMS]
    for run in runs:
        print(f"{run['arm']}, seed {run['seed']}, {run['used']}:")
        for part in ("unseen", "commands"):
            (a, b), (c, d) = run[part]["model"], run[part]["network"]
            print(f"  {part}: {a:.4f} mm and {b:.4f} deg, {c:.4f} mm and {d:.4f} deg with the network")
    if given.o is not None:
        given.o.write_text(json.dumps({"runs": runs}, indent=1) + "\n")


if __name__ == "__main__":
    main()
