# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a diagnosis says of cells whose sensor stands on an arm: a head that turns and nods sees tags on two arms.

Each set hides one cause, or none, in one arm drawn at random; all arms are off from their file by 0.5 mm and 0.5 mrad
and all readings have noise. "bending" is one that such a diagnosis cannot name: what it says instead must not be sure.

    python bench/python/bench_sensor_causes.py [--sets 28] [--first 0] [--out FILE]
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.cells.asked import asked_parameters
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.cli.app import main
from fastcal.io.tree_file import load_cell
from fastcal.io.yaml_text import yaml_text

FloatArray = NDArray[np.float64]

POSTURES = 100
NOISE, NOISE_TURN, OFF = 5e-5, 1e-4, 5e-4  # [m, rad]; of geometry
VIEWS = ("tag_left:camera", "tag_right:camera")
KINDS = ("none", "wave", "slow wave", "compliance", "backlash", "zero step", "bending")
WHERE = {"head": 2, "left": 6, "right": 6}
CAN_TELL = {"wave": "gear_harmonic", "slow wave": "gear_harmonic", "compliance": "joint_compliance"}
CAN_TELL |= {"backlash": "backlash", "zero step": "zero_step"}


def content() -> dict[str, Any]:
    """The cell's file."""
    link = {"mass_kg": 3.0, "com_mm": [20.0, 10.0, 60.0]}
    row = {"type": "revolute", "theta_deg": 0.0, "link": link}
    neck = [{**row, "d_mm": 120.0, "a_mm": 40.0, "alpha_deg": -90.0}]
    neck += [{**row, "d_mm": 30.0, "a_mm": 90.0, "alpha_deg": 0.0}]
    arms = {
        "head": {"robot": {"name": "head", "kinematics": "dh", "joints": neck}, "xyz_mm": [0.0, 0.0, 900.0]},
        "left": {"robot": "ur5", "xyz_mm": [0.0, 250.0, 500.0], "rpy_deg": [-50.0, 0.0, 0.0]},
        "right": {"robot": "ur10", "xyz_mm": [0.0, -250.0, 500.0], "rpy_deg": [50.0, 0.0, 0.0]},
    }
    targets = {"tag_left": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}, "tag_right": {"on": "right"}}
    targets["tag_right"]["xyz_mm"] = [-30.0, 20.0, 100.0]
    camera = {"on": "head", "xyz_mm": [100.0, 0.0, 60.0], "rpy_deg": [0.0, 90.0, 0.0]}
    return {"cell": "hidden", "arms": arms, "targets": targets, "sensors": {"camera": camera}}


def disturbed(cell: Cell, random: np.random.Generator) -> Cell:
    """With an error in all that its readings can show."""
    width = {"position": 3, "rotation": 4}
    one = {f"{kind}@{view}": np.zeros((1, n)) for view in VIEWS for kind, n in width.items()}
    theta = np.array(cell.core.nominal)
    asked = asked_parameters(cell, Readings(np.zeros((1, len(cell.joint_columns))), one, ""))
    theta[asked] += OFF * random.standard_normal(len(asked))
    return cell.with_values(theta)


def with_effect(cell: Cell, arm: str, effect: str, owner: str, **parameters: float) -> Cell:
    """With an effect in one arm."""
    entry = {"effect": effect, "owner": owner, "parameters": {name: {"value": of} for name, of in parameters.items()}}
    arms = (replace(of, robot=of.robot.with_(effects=[entry])) if of.name == arm else of for of in cell.arms)
    return replace(cell, arms=tuple(arms))


def hidden_set(folder: Path, kind: str, seed: int) -> str:
    """Writes cell.yaml and poses.csv; the name of what is hidden, or nothing."""
    random = np.random.default_rng([45, seed])
    (folder / "cell.yaml").write_text(yaml_text(content()), encoding="utf-8")
    cell = load_cell(folder / "cell.yaml")
    true = disturbed(cell, random)
    q = random.uniform(-2.4, 2.4, (POSTURES, len(cell.joint_columns)))
    there, approach = q.copy(), np.sign(random.standard_normal(q.shape))
    arm = str(random.choice(list(WHERE)))
    joint = int(random.integers(WHERE[arm]))
    names = [titles[0] for titles in cell.joint_columns]
    at = names.index(f"{arm}.q{joint + 1}")
    if kind == "compliance":
        joint = 1  # of each of these arms one that bears its weight
        size = 2e-4 if arm == "head" else 2e-5
        true = with_effect(true, arm, "joint_compliance", "joint2", compliance_rad_nm=size)
    elif kind == "bending":
        arm = str(random.choice(["left", "right"]))
        true = with_effect(true, arm, "link_bending", f"link{2 + joint % 2}", inverse_ei_1_nm2=1.5e-4)
    elif kind == "backlash":
        there[:, at] += 4e-4 * approach[:, at]
    elif kind == "zero step":
        there[POSTURES // 2 :, at] += 5e-4
    elif kind != "none":
        order = 1.0 if kind == "slow wave" else float(random.integers(2, 6))
        there[:, at] += 4e-4 * np.sin(order * q[:, at] + random.uniform(0, 2 * np.pi))
    seen = simulate_cell(true, Readings(there, {}, ""), VIEWS, noise=NOISE, noise_rotation=NOISE_TURN, seed=seed)
    titles, parts = [f"{name}_deg" for name in names], [np.degrees(q)]
    for view in VIEWS:
        titles += [*(f"{axis}_mm@{view}" for axis in "xyz"), *(f"q{of}@{view}" for of in "wxyz")]
        parts += [1e3 * seen.tables[f"position@{view}"], seen.tables[f"rotation@{view}"]]
    titles += [name.replace(".q", ".approach") for name in names]
    rows = np.hstack([*parts, approach])
    with (folder / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *([f"{value:.9f}" for value in row] for row in rows)])
    return f"{CAN_TELL[kind]}@{arm}.joint{joint + 1}" if kind in CAN_TELL else ""


def told(kind: str, seed: int) -> tuple[str, list[tuple[str, str, set[str]]], str]:
    """What is hidden, and of each name that is given its grade and what it is said to be like; the verdict."""
    with tempfile.TemporaryDirectory() as place, contextlib.redirect_stderr(io.StringIO()):
        folder = Path(place)
        truth = hidden_set(folder, kind, seed)
        with contextlib.redirect_stdout(io.StringIO()):
            code = main(["diagnose", f"{folder}/cell.yaml", f"{folder}/poses.csv", "-o", f"{folder}/out"])
        if code not in (0, 3):
            return truth, [], f"exit {code}"
        found = json.loads((folder / "out/diagnosis.json").read_text(encoding="utf-8"))
    named = []
    for of in found["effects"]:
        like = {f"{other['effect']}@{other['owner']}" for other in of["equivalents"]}
        named.append((f"{of['effect']}@{of['owner']}", of["grade"], like))
    return truth, named, found["verdict"]


def judged(kind: str, seed: int) -> str:
    """One word for a set, and its line on the terminal."""
    truth, named, verdict = told(kind, seed)
    if any(grade == "A" and name != truth for name, grade, _ in named):
        word = "wrong A"
    elif verdict.startswith("exit"):
        word = "refused"
    elif not truth:
        word = "not named" if named == [] else "named, not sure"
    elif any(name == truth and grade == "A" for name, grade, _ in named):
        word = "right, A"
    elif any(truth == name or truth in like for name, _, like in named):
        word = "right, not sure"
    else:
        word = "missed" if named == [] else "wrong, not sure"
    print(f"{seed:5d}  {kind:10s} {truth or '-':28s} {word:16s} {verdict:12s}", end=" ")
    print(", ".join(f"{name} {grade}" for name, grade, _ in named), flush=True)
    return word


def run() -> None:
    """Prints a line a set, then how often each word fell of each kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=4 * len(KINDS))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    count: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    for k in range(options.sets):
        kind = KINDS[(options.first + k) % len(KINDS)]
        count[kind][judged(kind, options.first + k)] += 1
    for kind, words in count.items():
        print(f"{kind}: " + ", ".join(f"{word} {n}" for word, n in sorted(words.items())))
    if options.out is not None:
        content = {"sets": options.sets, "first": options.first, "found": {k: dict(of) for k, of in count.items()}}
        options.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    run()
