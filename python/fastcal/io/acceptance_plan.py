# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The plan of an acceptance test as CSV: a row a visit, which a measurement file can grow from."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from fastcal.acceptance.plan import AcceptancePlan
from fastcal.acceptance.visits import TARGET_COLUMNS
from fastcal.io.atomic import atomic_paths
from fastcal.io.measurements import load_measurements
from fastcal.io.measurements_out import file_columns
from fastcal.io.programs import program_files, write_documents
from fastcal.io.tables import csv_text
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import quaternions
from fastcal.robot.pendant import controller_columns, joint_columns
from fastcal.robot.robot import Robot
from fastcal.units import from_si


def write_test(path: str | os.PathLike[str], plan: AcceptancePlan, robot: Robot) -> list[Path]:
    """Writes the program and, beside it, its visits as NAME_plan.csv, all or none; returns the files.

    The visits have pose, direction, cycle, qN_deg (jN_deg where the controller counts otherwise), payload_kg, approachN
    and the commanded pose in the base (target_).
    A program never lies beside the visits of another: killed amid its work, this leaves the visits alone.

    Raises:
        InvalidInput: A file cannot be written.
    """
    programs = program_files(Path(path), plan.documents)
    visits = Path(path).with_name(f"{Path(path).stem}_plan.csv")
    with atomic_paths([visits, *programs]) as (temporary, *temporaries):
        temporary.write_text(_visits_text(plan, robot), encoding="utf-8", newline="\n")
        write_documents(temporaries, plan.documents)
    return [*programs, visits]


def _visits_text(plan: AcceptancePlan, robot: Robot) -> str:
    visits = Dataset.from_arrays(plan.q, payload=plan.payload, approach=plan.approach)
    columns = {"pose": [visit.pose for visit in plan.visits]}
    own = joint_columns(robot.description, plan.q)
    if any(visit.direction for visit in plan.visits):
        columns["direction"] = [visit.direction for visit in plan.visits]
    numbers = [*from_si(plan.commanded[:, :3, 3], "mm").T, *quaternions(plan.commanded[:, :3, :3]).T]
    return csv_text(
        columns
        | {"cycle": [visit.cycle for visit in plan.visits]}
        | controller_columns(robot.description, plan.q)
        | {name: column for name, column in file_columns(visits, robot.joint_types).items() if name not in own}
        | dict(zip(TARGET_COLUMNS, numbers, strict=True))
    )


def load_plan(path: str | os.PathLike[str], robot: Robot) -> Dataset:
    """Reads such a file as a data set whose unknown columns hold pose, direction and the commanded pose.

    Raises:
        ParseError: It is no such file; one sentence with file, line and column.
    """
    return replace(load_measurements(path, robot, require_measured=False), source=Path(path).name)
