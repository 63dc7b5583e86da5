# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cells in which an instrument, a base or a target may be moved between two rows: two arms, an arm on a track."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.cells.cell import Arm, Cell
from fastcal.cells.diagnose import diagnose_cell
from fastcal.cells.diagnosis import CellDiagnosis
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import seen_ways
from fastcal.cells.simulate import simulate_cell
from fastcal.io.tree_file import load_cell
from fastcal.io.tree_readings import load_readings
from fastcal.io.way_readings import way_datasets

from .test_calibrate import off, written
from .test_diagnose import write_poses

NOISE = 2e-5  # [m]
TRACK = {"type": "prismatic", "theta_deg": 0, "d_mm": 0, "a_mm": 0, "alpha_deg": 90, "min_mm": 0, "max_mm": 2000}
TRACKER = {"sensors": {"tracker": {"on": "world", "xyz_mm": [-2500, 100, 800], "rpy_deg": [10, -20, 120]}}}
TWO_ARMS: dict[str, Any] = {
    "cell": "two",
    "arms": {"left": {"robot": "ur5", "xyz_mm": [0, 500, 0]}, "right": {"robot": "ur10", "xyz_mm": [0, -500, 0]}},
    "targets": {
        "smr_left": {"on": "left", "xyz_mm": [40, 10, 120]},
        "smr_right": {"on": "right", "xyz_mm": [-30, 20, 100]},
    },
}
ON_A_TRACK: dict[str, Any] = {
    "cell": "track",
    "arms": {
        "track": {"robot": {"name": "track", "kinematics": "mdh", "joints": [TRACK]}, "xyz_mm": [0, 300, 150]},
        "arm": {"robot": "ur10", "on": "track", "rpy_deg": [-90, 0, 0]},
    },
    "targets": {"smr": {"on": "arm", "xyz_mm": [40, 10, 120]}},
}


@dataclass(frozen=True)
class Scene:
    """A cell, what is read in it, and what moves: a point (its name), an arm's base, `world`, or "" for nothing."""

    content: dict[str, Any]
    views: tuple[str, ...]
    moves: str = ""

    def drawn(self, folder: Path, seed: int, rows: int = 70, at_row: int = 30, size_mm: float = 0.5) -> Cell:
        """Writes cell.yaml and poses.csv; the cell as it truly is; what moves turns by 0.04 degrees a mm."""
        cell = load_cell(written(folder, self.content))
        random = np.random.default_rng(seed)
        nominal = Readings(
            np.zeros((1, len(cell.joint_types))), {f"position@{of}": np.zeros((1, 3)) for of in self.views}, ""
        )
        truth = off(cell, nominal, random)
        span = np.array([[-2.5, 2.5] if kind == "revolute" else [0.0, 2.0] for kind in cell.joint_types])
        q = random.uniform(span[:, 0], span[:, 1], (rows, len(span)))
        shift, turn = size_mm * unit(random), 0.04 * size_mm * unit(random)
        if self.moves in {of.name for of in truth.points}:
            knocked = {"at_row": at_row, "before_mm": shift.tolist(), "before_deg": turn.tolist()}
            points = tuple(replace(of, knocked=knocked) if of.name == self.moves else of for of in truth.points)
            truth = replace(truth, points=points)
        elif self.moves:
            roots = {arm.name for arm in truth.arms if arm.on == "world" and self.moves in ("world", arm.name)}
            step = np.append(1e-3 * shift, np.radians(turn))
            arms = (stepping(arm, step, at_row, rows) if arm.name in roots else arm for arm in truth.arms)
            truth = replace(truth, arms=tuple(arms))
        order = Readings(q, {}, "", row=np.arange(rows))
        readings = simulate_cell(truth, order, self.views, noise=NOISE, seed=seed + 1)
        write_poses(folder, truth, readings)
        return truth

    def diagnosed(self, folder: Path, **options: Any) -> CellDiagnosis:
        """Of what `drawn` has written."""
        cell, poses = load_cell(folder / "cell.yaml"), folder / "poses.csv"
        return found_in(cell, poses, **options)


def unit(random: np.random.Generator) -> np.ndarray:
    direction = random.normal(size=3)
    return np.asarray(direction / np.linalg.norm(direction))


def stepping(arm: Arm, step: np.ndarray, at_row: int, rows: int) -> Arm:
    """The arm whose base steps by a twist (6,) [m, rad] about the origin of the world."""
    about_base = step[:3] + np.cross(step[3:], arm.robot.T_world_base[:3, 3])
    names = [f"step_{axis}_mm" for axis in "xyz"] + [f"step_r{axis}_rad" for axis in "xyz"]
    values = [*(1e3 * about_base).tolist(), *step[3:].tolist()]
    parameters = {"at_row": {"value": at_row}} | {name: {"value": of} for name, of in zip(names, values, strict=True)}
    entry = {"effect": "base_step", "owner": "base", "rows": rows, "parameters": parameters}
    return replace(arm, robot=arm.robot.with_(effects=[entry]))


def found_in(cell: Cell, poses: Path, **options: Any) -> CellDiagnosis:
    """The diagnosis of a cell."""
    readings = load_readings(poses, cell)
    ways = seen_ways(cell, readings)
    rows = way_datasets(poses, cell, ways, readings)
    return diagnose_cell(cell, readings, [(*of, None) for of in zip(ways, rows, strict=True)], **options)
