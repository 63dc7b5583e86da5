# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does `diagnose` name what is wrong with a robot of closed loops, and nothing where nothing is?

Each set is one shipped robot with loops, built as a workshop does (lengths off by 0.5 mm, angles by 0.5 mrad), of which
one thing is wrong: a rod's length, slack in a pin or in a rod's balls, something of the loop that yields (a motor's
joint, a pin, a rod); or nothing (`clean`); or a cause that is not the loops' (`other`). 90 points with three payloads,
noise 0.05 mm. A cause is as large as makes

    SNR = |(1 - P) d| / sigma,    d what it adds to the points, P the projection on the geometry's columns,

12 to 60; where that would be beyond what a robot still works with, the set is `unseen` and not counted. `named`: it is
among the effects; `listed`: or among the equivalents of one. `wrong`: an effect of grade A that is neither.
The five-bar, which lies flat, hangs on a wall here.

    python bench/python/bench_loop_causes.py --out FILE [--first 1000] [--sets 5] [--robots ...] [--kinds ...]
    python bench/python/bench_loop_causes.py --sums FILE
"""

from __future__ import annotations

import argparse
import json
import time
import zlib
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import diagnose, load_robot, perturbed, predict, random_poses, simulate
from fastcal.effects.entries import edge_name, effect_owners, value_at_edge
from fastcal.errors import FastcalError
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset
from fastcal.robot.loops import closed_within
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

POSES, NOISE = 90, 5e-5
PAYLOADS = {  # [kg]
    "delta": 4.0, "delta_printer": 0.5, "five_bar": 2.0, "hexapod": 40.0, "palletizer": 120.0, "parallelogram_6r": 20.0,
}  # fmt: skip
KINDS = ("length", "slack", "yields", "clean", "other")
OTHERS = ("backlash", "gear_harmonic:order=2", "reduction_ratio")
SIGNALS = (12.0, 60.0)
LARGEST = {"pin_slack": 3e-3, "rod_slack": 3e-3}  # [m]; of a compliance what it moves the tool by
FARTHEST = 2e-2  # [m]
LENGTHS = (6e-3, 12e-3)  # [m]
BUILT, ANYWHERE = 5e-4, 1.0  # [m, rad]: as `perturbed` builds a robot, and where its base and tool may be


def shipped(name: str) -> Robot:
    robot = load_robot(name)
    on_wall = {"base": {"xyz_mm": [0, 0, 0], "rpy_deg": [90, 0, 0]}, "gravity_frame": "measuring"}
    return robot.with_(**on_wall) if name == "five_bar" else robot


def drawn_cause(kind: str, robot: Robot, random: np.random.Generator) -> tuple[str, str]:
    """Effect and owner."""
    if kind == "length":
        return "loop_length", str(random.choice([loop["name"] for loop in robot.description.loops]))
    if kind == "other":
        effect = str(random.choice(OTHERS))
        motors = [f"joint{k + 1}" for k in range(robot.joint_count) if k not in robot.passive]
        there = effect_owners(effect.partition(":")[0], robot.core)
        motors = [owner for owner in motors if owner in there]
        return (effect, str(random.choice(motors))) if motors else drawn_cause(kind, robot, random)
    names = ("pin_slack", "rod_slack") if kind == "slack" else ("pin_compliance", "rod_compliance", "joint_compliance")
    driven = {f"joint{k + 1}" for k in range(robot.joint_count) if k not in robot.passive}
    causes = [
        (name, owner)
        for name in names
        for owner in effect_owners(name, robot.core)
        if name != "joint_compliance" or owner in driven
    ]
    effect = str(random.choice(sorted({name for name, _ in causes})))
    return effect, str(random.choice([owner for name, owner in causes if name == effect]))


def with_cause(real: Robot, effect: str, owner: str, size: float) -> Robot:
    """The robot with a cause of a size in SI."""
    if effect == "loop_length":
        loops = [dict(loop) for loop in real.description.loops]
        for loop in loops:
            loop["length_mm"] += 1e3 * size * (loop["name"] == owner)
        return real.with_(loops=loops)
    name, _, option = effect.partition(":")
    entry: dict[str, Any] = {"effect": name, "owner": owner}
    if option:
        entry["order"] = float(option.partition("=")[2])
    (built,) = real.with_(effects=[entry]).effects
    values = {
        edge_name(p, geometry=False): value_at_edge(p, size * (k == 0), geometry=False)
        for k, p in enumerate(built.parameters)
    }
    if name == "gear_harmonic":  # a wave is written by its amplitude and phase
        values = {"amplitude_rad": size, "phase_rad": 0.5}
    return real.with_(effects=[entry | {"parameters": values}])


def points(robot: Robot, rows: Dataset) -> FloatArray:
    return np.asarray(predict(robot, rows).position)


def signal(real: Robot, rows: Dataset, effect: str, owner: str, step: float) -> tuple[float, float]:
    """SNR and the largest motion of a point [m], of a cause of one unit of SI, by a small one."""
    d = (points(with_cause(real, effect, owner, step), rows) - points(real, rows)) / step
    model = real.error_model
    own = slice(len(real.core.nominal))
    J = np.asarray(model.parameter_jacobian(real.conditions(rows.q, payload=rows.payload), model.start, 3))[:, :, own]
    J = J.reshape(-1, J.shape[2])
    U, size, _ = np.linalg.svd(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300), full_matrices=False)
    U = U[:, size > 1e-9 * size[0]]
    left = d.ravel() - U @ (U.T @ d.ravel())
    return float(np.linalg.norm(left) / NOISE), float(np.linalg.norm(d, axis=1).max())


def length_signal(real: Robot, rows: Dataset, loop: str, size: float) -> float:
    """SNR of a length that is off by `size` [m]: sqrt(d' C^-1 d), d what it adds to the points, C their covariance.

    C = sigma^2 I + J S J': noise, and what all else of the geometry adds, which is built to S = (0.5 mm)^2, (0.5
    mrad)^2; base and tool are anywhere. For a part that is only longer than the others of its kind the projection of
    the other causes leaves nothing: its own column is among the geometry's.
    """
    model = real.error_model
    J = np.asarray(model.parameter_jacobian(real.conditions(rows.q, payload=rows.payload), model.start, 3))
    J = J.reshape(-1, J.shape[2])
    parameters = real.core.parameters
    built = [ANYWHERE if p.owner in ("base", "tool") else BUILT for p in parameters]
    of = next(k for k, p in enumerate(parameters) if (p.owner, p.name) == (loop, "length"))
    others = np.arange(len(parameters)) != of
    A = J[:, : len(parameters)][:, others] * np.array(built)[others] / NOISE
    d = size * J[:, of] / NOISE
    left = d - A @ np.linalg.solve(np.eye(A.shape[1]) + A.T @ A, A.T @ d)
    return float(np.sqrt(d @ left))


def trial(name: str, kind: str, seed: int) -> dict[str, Any]:
    """One set and what came of it."""
    random = np.random.default_rng([zlib.crc32(f"{name} {kind}".encode()), seed])
    built, drawn, noise = (int(random.integers(2**31)) for _ in range(3))
    nominal = shipped(name)
    real = perturbed(nominal, seed=built)
    out: dict[str, Any] = {"robot": name, "kind": kind, "seed": seed}
    if kind == "length":
        effect, owner = drawn_cause(kind, nominal, random)
        size = float(random.uniform(*LENGTHS) * random.choice([-1, 1]))
        real = with_cause(real, effect, owner, size)
        out |= {"cause": f"{effect}@{owner}", "size": size}
    q = closed_within(real.core, random_poses(nominal, POSES + 40, seed=drawn), nominal.limits)[:POSES]
    payload = np.tile([0.0, PAYLOADS[name] / 2, PAYLOADS[name]], POSES)[: len(q)]
    if kind == "length":
        out["snr"] = length_signal(nominal, Dataset.from_arrays(q, payload=payload), owner, size)
    approach: dict[str, Any] = {}
    if kind not in ("length", "clean"):
        rows = Dataset.from_arrays(q, payload=payload)
        for _ in range(30):
            effect, owner = drawn_cause(kind, nominal, random)
            if effect == "backlash":
                approach = {"approach": random.choice([-1.0, 1.0], q.shape)}
                rows = Dataset.from_arrays(q, payload=payload, **approach)
            step = 1e-5 if "slack" in effect else 1e-4 if kind == "other" else 1e-9
            snr, moves = signal(real, rows, effect, owner, step)
            wanted = float(np.exp(random.uniform(*np.log(SIGNALS))))
            size = wanted / max(snr, 1e-300)
            if size < LARGEST.get(effect, np.inf) and NOISE < size * moves < FARTHEST:
                break
        else:
            return out | {"unseen": True}
        real = with_cause(real, effect, owner, size)
        out |= {"cause": f"{effect.partition(':')[0]}@{owner}", "size": size, "snr": wanted}
    data = simulate(real, q, noise=NOISE, seed=noise, payload=payload, **approach)
    begun = time.process_time()
    try:
        found = diagnose(nominal, data)
    except FastcalError as error:
        return out | {"refused": str(error)}
    effects = [(f"{f.effect}@{f.owner}", f.grade, [f"{e}@{o}" for e, o in f.equivalents]) for f in found.effects]
    cause = out.get("cause")
    return out | {
        "named": any(cause == label for label, _, _ in effects),
        "listed": any(cause in (label, *others) for label, _, others in effects),
        "wrong": any(grade == "A" and cause not in (label, *others) for label, grade, others in effects),
        "effects": effects,
        "verdict": found.verdict,
        "cpu_s": round(time.process_time() - begun, 2),
    }


def sums(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts by kind and robot."""
    out: dict[str, Any] = {}
    for keys in (("kind",), ("kind", "robot")):
        groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
        for row in rows:
            groups[" ".join(row[key] for key in keys)].append(row)
        for name, group in sorted(groups.items()):
            done = [row for row in group if "verdict" in row]
            out[name] = {"sets": len(done), "unseen": sum("unseen" in row for row in group)}
            out[name] |= {"refused": sum("refused" in row for row in group)}
            out[name] |= {key: sum(row[key] for row in done) for key in ("named", "listed", "wrong")}
            out[name] |= {"none": sum(row["verdict"] == "none" for row in done)}
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--sets", type=int, default=5)
    parser.add_argument("--robots", nargs="+", choices=PAYLOADS, default=list(PAYLOADS))
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--out", type=Path)
    parser.add_argument("--sums", type=Path)
    given = parser.parse_args()
    if given.sums is not None:
        for name, counts in sums(json.loads(given.sums.read_text())["sets"]).items():
            print(name, counts)
        return
    rows: list[dict[str, Any]] = []
    for seed in range(given.first, given.first + given.sets):
        for kind in given.kinds:
            for name in given.robots:
                rows.append(trial(name, kind, seed))
                print(json.dumps(rows[-1]), flush=True)
                if given.out is not None:
                    lines = ",\n".join(json.dumps(row) for row in rows)
                    write_text(given.out, f'{{"sets": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
