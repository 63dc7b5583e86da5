# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold what a sensor on an arm will see of tags on other arms?

Each set is the cell of bench_sensor_causes.py, off from its file by 0.5 mm and 0.5 mrad in all that its readings show,
calibrated by postures with noise. What is counted are places and turns of the tags in the sensor's frame at postures
that were not read: these no gauge touches, whatever parameters it holds. (Parameters of cells whose instruments stand
in the room are counted by bench_coverage_cells.py.)

    python bench/python/bench_coverage_sensors.py [--sets 20] [--jobs N] [--first 0] [--out FILE]
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from bench_sensor_causes import NOISE, NOISE_TURN, VIEWS, content, disturbed
from coverage_of_parts import count_parts
from scipy.stats import t as student

from fastcal import _core
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.effects.entries import full_name
from fastcal.io.tree_file import load_cell
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.calibration_record import CalibrationRecord

POSTURES, ASKED, RANGE = 100, 10, 2.4  # [rad]
PARTS = ("points", "turns")


def nominal() -> Cell:
    """As its file has it."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "cell.yaml"
        path.write_text(yaml_text(content()), encoding="utf-8")
        return load_cell(path)


def trial(seed: int) -> dict[str, list[tuple[float, bool]]] | None:
    """Misses in deviations by part, and whether the interval holds the truth; None where it did not converge."""
    random = np.random.default_rng([45, 2, seed])
    cell = nominal()
    true = disturbed(cell, random)
    count = len(cell.joint_columns)
    q = random.uniform(-RANGE, RANGE, (POSTURES, count))
    read = simulate_cell(true, Readings(q, {}, "q"), VIEWS, noise=NOISE, noise_rotation=NOISE_TURN, seed=seed)
    found = calibrate_cell(cell, read)
    record = CalibrationRecord.from_spec(found.cell.record)
    if found.status != "converged" or record is None:
        return None
    model = found.cell.model
    names = [full_name(parameter) for parameter in model.parameters]
    none = np.zeros(len(record.parameters) + len(record.unknowns))
    L = np.array([record.roots.get(name, none) for name in names])
    within = float(student.ppf(0.975, found.degrees_of_freedom))
    asked = random.uniform(-RANGE, RANGE, (ASKED, count))
    out: dict[str, list[tuple[float, bool]]] = {part: [] for part in PARTS}
    for view in VIEWS:
        J = np.asarray(model.parameter_jacobian(_core.Samples(asked), model.start, rows=6, of=view))
        std = np.linalg.norm(J @ L, axis=2)
        there, truth = (view_poses(of, Readings(asked, {}, ""), view) for of in (found.cell, true))
        moved = truth[:, :3, 3] - there[:, :3, 3]
        turned = [_core.log_so3(R @ own.T) for R, own in zip(truth[:, :3, :3], there[:, :3, :3], strict=True)]
        for part, off, of in (("points", moved, std[:, :3]), ("turns", np.array(turned), std[:, 3:])):
            ratio = (off / of).ravel()
            out[part] += [(float(z), bool(abs(z) <= within)) for z in ratio]
    return out


if __name__ == "__main__":
    count_parts(__doc__, trial, PARTS)
