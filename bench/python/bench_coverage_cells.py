# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold the truth for the places and arms of a cell, and for an axis found by a few readings?

Each set has two arms on a column that turns and a target on each, all off from their file by half a plausible size, and
postures with noise, positions and orientations of the targets from the world. Which parameters the gauge holds is no
matter of noise, and what a held one is off moves into others: so the truth of a set is what the same readings with a
thousandth of their noise give for the very same parameters. (A sensor on an arm is placed in closed form first, and
what the gauge then holds depends on the noise: it is left out.) A turntable in its own cell is placed by twelve
readings. In a further set, drawn apart, each arm carries 10 kg in half of its postures, reached from either side, and a
joint of the left one is compliant and another has backlash.

    python bench/python/bench_coverage_cells.py [--sets 20] [--jobs N] [--first 0] [--out FILE]
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from coverage_of_parts import count_parts
from numpy.typing import NDArray
from scipy.stats import t as student

from fastcal.calibration.result import IdentifiedParameter
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Arm, Cell, Point
from fastcal.cells.place import place_axis
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.place import place_of
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

POSTURES, TOUCHES = 150, 12
NOISE, NOISE_TURN, FAINT = 3e-5, 1e-4, 1e-3  # [m, rad] of a reading; share of it in the truth
VIEWS = ("smr", "tag")
PARTS = ("arms", "places", "turns", "axis", "ratio", "effects")
PAYLOAD = 10.0  # [kg] on a flange, or nothing
HIDDEN = {"joint_compliance": ("compliance_rad_nm", 1e-6), "backlash": ("gap_rad", 2e-4)}  # of an effect, how large
ZERO = {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}


def axis(name: str, kind: str = "revolute") -> Robot:
    """An arm of one joint."""
    row: dict[str, Any] = {"type": kind, "theta_deg": 0.0, "d_mm": 500.0, "a_mm": 0.0, "alpha_deg": 0.0}
    return load_robot({"name": name, "kinematics": "dh", "joints": [row]})


def two_arms() -> Cell:
    """As its file has it."""

    def arm(name: str, robot: Robot, on: str, xyz: list[float], roll: float) -> Arm:
        return Arm(name, robot.with_(base={"xyz_mm": xyz, "rpy_deg": [roll, 0.0, 0.0]}), on)

    arms = (
        arm("column", axis("column"), "world", [10.0, 20.0, 0.0], 0.0),
        arm("left", load_robot("ur5"), "column.link1", [0.0, 200.0, 100.0], -50.0),
        arm("right", load_robot("ur10"), "column.link1", [0.0, -200.0, 100.0], 50.0),
    )
    points = (
        Point("smr", "target", "left.link6", ZERO | {"xyz_mm": [40.0, 10.0, 120.0]}),
        Point("tag", "target", "right.link6", ZERO | {"xyz_mm": [-30.0, 20.0, 100.0]}),
    )
    return Cell("two_arms", arms, points)


def disturbed(cell: Cell, random: np.random.Generator) -> Cell:
    """Off by half a plausible size."""
    start = np.asarray(cell.core.nominal)
    return cell.with_values(start + 0.5 * random.standard_normal(len(start)) * [p.sigma for p in cell.core.parameters])


def trial(seed: int) -> dict[str, list[tuple[float, bool]]] | None:
    """Misses in deviations by part, and whether the interval holds the truth; None where it did not converge."""
    random = np.random.default_rng([45, seed])
    cell = two_arms()
    true = disturbed(cell, random)
    q = random.uniform(-1.5, 1.5, (POSTURES, len(cell.joint_columns)))

    def read(scale: float) -> Readings:
        return simulate_cell(
            true, Readings(q, {}, "q"), VIEWS, noise=scale * NOISE, noise_rotation=scale * NOISE_TURN, seed=seed
        )

    found, there = calibrate_cell(cell, read(1.0)), calibrate_cell(cell, read(FAINT))
    if found.status != "converged" or found.held or labels(found.parameters) != labels(there.parameters):
        return None
    out: dict[str, list[tuple[float, bool]]] = {part: [] for part in PARTS}
    within = float(student.ppf(0.975, found.degrees_of_freedom))
    for p, other in zip(found.parameters, there.parameters, strict=True):
        off = (p.value - other.value) / p.std
        out[part_of(p.owner, p.unit)].append((off, bool(abs(off) <= within)))
    for part, own in placed(random, seed).items():
        out[part] += own
    out["effects"] = carried(seed)
    return out


def carried(seed: int) -> list[tuple[float, bool]]:
    """Misses of what an arm's loads and approaches set, the other arm with payloads of its own; none: no fit."""
    random = np.random.default_rng([46, seed])
    owners = [f"joint{joint + 1}" for joint in random.permutation(4)[:2] + 1]
    sizes = [random.uniform(0.5, 2) * size for _, size in HIDDEN.values()]

    def cell(sizes: list[float]) -> Cell:
        entries = [
            {"effect": effect, "owner": owner, "parameters": {name: {"value": size, "std": None}}}
            for (effect, (name, _)), owner, size in zip(HIDDEN.items(), owners, sizes, strict=True)
        ]
        plain = two_arms()
        arms = (replace(of, robot=of.robot.with_(effects=entries)) if of.name == "left" else of for of in plain.arms)
        return replace(plain, arms=tuple(arms))

    true = cell(sizes)
    start = np.asarray(true.model.start)
    off = 0.5 * random.standard_normal(len(true.core.nominal)) * [p.sigma for p in true.core.parameters]
    true = true.with_values(start + np.pad(off, (0, len(start) - len(off))))
    q = random.uniform(-1.5, 1.5, (POSTURES, len(true.joint_columns)))
    arms = {}
    for of in (branch for branch in true.core.branches if branch.joint_count):
        payload = PAYLOAD * random.integers(0, 2, POSTURES) * (of.joint_count > 1)
        approach = random.choice([-1.0, 1.0], (POSTURES, of.joint_count))
        own = q[:, of.first_joint : of.first_joint + of.joint_count]
        arms[of.name] = Dataset.from_arrays(own, payload=payload, approach=approach)
    sent = Readings(q, {}, "q", arms=arms)
    noise: dict[str, Any] = {"noise": NOISE, "noise_rotation": NOISE_TURN, "seed": seed}
    found = calibrate_cell(cell([0.0, 0.0]), simulate_cell(true, sent, VIEWS, **noise), effects=True)
    if found.status != "converged" or found.held:
        return []
    within = float(student.ppf(0.975, found.degrees_of_freedom))
    out = []
    for (_, (name, _)), size in zip(HIDDEN.items(), sizes, strict=True):
        ((value, std),) = ((p.value, p.std) for p in found.parameters if p.name == name and p.std)
        miss = (value - size) / std
        out.append((miss, bool(abs(miss) <= within)))
    return out


def placed(random: np.random.Generator, seed: int) -> dict[str, list[tuple[float, bool]]]:
    """The same of a turntable and its ratio."""
    mark = Point("mark", "target", "table.link1", ZERO | {"xyz_mm": [150.0, 60.0, 30.0]})
    cell = Cell("table", (Arm("table", axis("table")),), (mark,))
    true = disturbed(cell, random)
    q = np.linspace(-2.5, 2.5, TOUCHES)[:, np.newaxis]
    ratio = random.normal(0, 3e-4)
    there = Readings(q * (1 + ratio), {}, "q")

    def found(scale: float) -> Any:
        return place_axis(cell, replace(simulate_cell(true, there, noise=scale * NOISE, seed=seed), q=q))

    with_noise, without = found(1.0), found(FAINT)
    out: dict[str, list[tuple[float, bool]]] = {"axis": [], "ratio": []}
    for of, other in zip(with_noise.members, without.members, strict=True):
        pairs = [*zip(of.xyz_mm, of.std_mm, other.xyz_mm, strict=True)]
        pairs += zip(of.rpy_deg, of.std_deg, other.rpy_deg, strict=True)
        out["axis"] += [((a - b) / std, bool(abs(a - b) <= 1.96 * std)) for a, std, b in pairs if std]
    error, std = with_noise.ratio
    out["ratio"].append(((error - ratio) / std, bool(abs(error - ratio) <= 1.96 * std)))
    return out


def labels(parameters: list[IdentifiedParameter]) -> list[tuple[str, str]]:
    """Owner and name of what was identified."""
    return [(p.owner, p.name) for p in parameters]


def part_of(owner: str, unit: str) -> str:
    """Which of PARTS a parameter is of."""
    if place_of(owner).kind in ("joint", "link"):
        return "arms"
    return "places" if unit == "mm" else "turns"


if __name__ == "__main__":
    count_parts(__doc__, trial, PARTS)
