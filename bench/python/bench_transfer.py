# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A network of one arm as the prior of few rows of ten others: mean errors on unseen poses, with and without it.

    python bench/python/bench_transfer.py -o bench/python/bench_transfer.json
    python bench/python/bench_transfer.py --first 300 -o bench/python/bench_transfer_fresh.json

Every arm is an RX160L with its own errors of geometry (0.3 mm and 0.3 mrad) and three waves in each joint. In arms of
one kind the waves are the kind's, each with its own amplitude (20 %) and phase (0.2 rad); in strangers they are drawn
anew, so that the prior is wrong. The first arm is trained with 400 rows; the others have 20, 50 or 100. Each is
calibrated on its rows, then trained from nothing and with `--from`; both are judged on 200 unseen poses.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import fastcal
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.networks import train
from fastcal.robot.robot import Robot
from fastcal.units import from_si

ARM, ARMS, COUNTS, FIRST_ROWS, UNSEEN = "staubli_rx160l", 10, (20, 50, 100), 400, 200
NOISE = 2e-5
ORDERS = (1, 2, 4)
WIDE = 1.5  # rad: how far joints are driven, as far as their limits let them


def waves_of_kind(seed: int, joints: int) -> np.ndarray:
    """(n, 3, 2) amplitudes [rad] and phases [rad] of the waves of a kind."""
    random = np.random.default_rng((seed, 1))
    return np.stack([random.uniform(1e-4, 3e-4, (joints, 3)), random.uniform(0, 2 * np.pi, (joints, 3))], axis=2)


def made(arm: Robot, waves: np.ndarray, seed: int) -> Robot:
    """One arm of a kind: its geometry is off, and its waves are the kind's within 20 % and 0.2 rad."""
    random = np.random.default_rng((seed, 2))
    own = waves.copy()
    own[..., 0] *= 1 + 0.2 * random.standard_normal(own.shape[:2])
    own[..., 1] += 0.2 * random.standard_normal(own.shape[:2])
    effects = [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{joint + 1}",
            "order": order,
            "parameters": {
                "amplitude_rad": {"value": float(abs(own[joint, k, 0]))},
                "phase_rad": {"value": float(own[joint, k, 1])},
            },
        }
        for joint in range(len(own))
        for k, order in enumerate(ORDERS)
    ]
    return Robot(bent_geometry(arm, random).spec | {"effects": effects})


def bent_geometry(arm: Robot, random: np.random.Generator) -> Robot:
    """The arm with every parameter of its geometry off by 0.3 mm or 0.3 mrad."""
    spec: dict[str, Any] = dict(arm.spec)
    rows = [dict(row) for row in spec["joints"]]
    for row in rows:
        for name, size in (
            ("a_mm", 0.3),
            ("d_mm", 0.3),
            ("alpha_deg", from_si(3e-4, "deg")),
            ("theta_deg", from_si(3e-4, "deg")),
        ):
            if name in row:
                row[name] = float(row[name]) + size * float(random.standard_normal())
    return Robot(spec | {"joints": rows})


def measured(true: Robot, count: int, seed: int) -> Dataset:
    """Random postures and their noisy points."""
    random = np.random.default_rng((seed, 3))
    low, high = np.maximum(true.limits[:, 0], -WIDE), np.minimum(true.limits[:, 1], WIDE)
    return fastcal.simulate(true, random.uniform(low, high, (count, true.joint_count)), noise=NOISE, seed=seed)


def mean_mm(model: Robot, unseen: Dataset) -> float:
    """Mean error on unseen poses."""
    assert unseen.position is not None
    return from_si(float(np.linalg.norm(model.poses(unseen)[:, :3, 3] - unseen.position, axis=1).mean()), "mm")


def compared(arm: Robot, true: Robot, prior: Robot, rows: int, seed: int) -> dict[str, Any]:
    """One arm with so many rows, from nothing and with the prior."""
    data, unseen = measured(true, rows, seed), measured(true, UNSEEN, seed + 500)
    model = fastcal.calibrate(arm, data).model
    folds = max(2, min(5, rows // 25))  # of cells of twenty rows, as many as fifty and a hundred rows have
    out: dict[str, Any] = {"seed": seed, "rows": rows, "model": mean_mm(model, unseen)}
    try:
        found = train(model, data, rivals=["gp"], folds=folds)
        out |= {"nothing": mean_mm(found.model, unseen), "nothing_used": found.used}
    except InvalidInput:  # too few rows to train
        out |= {"nothing": out["model"], "nothing_used": "refused"}
    moved = train(model, data, rivals=["gp"], folds=folds, prior=prior)
    return out | {"prior": mean_mm(moved.model, unseen), "prior_used": moved.used}


def main() -> None:
    """Runs it, prints a table and writes the record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", type=Path, help="where the record is written")
    parser.add_argument("--arms", type=int, default=ARMS)
    parser.add_argument("--first", type=int, default=0, help="seed of the kind and of the first arm; others follow it")
    parser.add_argument("--counts", type=int, nargs="+", default=list(COUNTS))
    given = parser.parse_args()
    arm = fastcal.load_robot(ARM)
    kind = waves_of_kind(given.first, arm.joint_count)
    first = measured(made(arm, kind, given.first + 1000), FIRST_ROWS, given.first + 1000)
    prior = train(fastcal.calibrate(arm, first).model, first, rivals=["gp"]).model
    results: dict[str, list[dict[str, Any]]] = {"of the kind": [], "strangers": []}
    for name, found in results.items():
        for seed in range(given.first, given.first + given.arms):
            waves = kind if name == "of the kind" else waves_of_kind(100 + seed, arm.joint_count)
            for rows in given.counts:
                found.append(compared(arm, made(arm, waves, seed), prior, rows, seed))
                print(name, found[-1], flush=True)
    for name, found in results.items():
        for rows in given.counts:
            own = [each for each in found if each["rows"] == rows]
            medians = {key: float(np.median([each[key] for each in own])) for key in ("model", "nothing", "prior")}
            worst = max(each["prior"] / each["nothing"] for each in own)
            print(
                f"{name}, {rows} rows: "
                + ", ".join(f"{k} {v:.4f}" for k, v in medians.items())
                + f"; worst {worst:.3f}"
            )
    if given.o is not None:
        content = {"arm": ARM, "first": given.first, "noise_mm": from_si(NOISE, "mm"), "results": results}
        given.o.write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main()
