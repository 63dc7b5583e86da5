# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a tracker recorded while an arm drove a path: points at a steady rate, no joints; and the corners of a plan."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fastcal.acceptance.path_figures import PathRun
from fastcal.acceptance.path_plan import PathPlan
from fastcal.io.atomic import atomic_paths
from fastcal.io.columns import match_columns, would_do
from fastcal.io.measurements import Columns
from fastcal.io.programs import program_files, write_documents
from fastcal.io.table import Table
from fastcal.io.tables import csv_text, read_table
from fastcal.measurements.rotations import quaternions, rotations
from fastcal.units import from_si


def load_run(path: str | os.PathLike[str]) -> PathRun:
    """Reads x_mm y_mm z_mm, and qw qx qy qz or rx_deg ry_deg rz_deg if any; rows without a point drop out.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
    """
    return run_of(read_table(path))


def run_of(table: Table) -> PathRun:
    """What such a table holds, as `load_run`."""
    run, whole = _poses(table)
    if whole.sum() < 2:
        raise table.error("holds fewer than two whole points; expected those of one run of the path")
    return PathRun(run.points[whole], None if run.rotations is None else run.rotations[whole])


def load_corners(path: str | os.PathLike[str]) -> PathRun:
    """Reads the commanded points of a path, in their order; columns as of a run, and every row holds a point.

    Raises:
        ParseError: As `load_run`.
    """
    table = read_table(path)
    corners, whole = _poses(table)
    if not whole.all():
        raise table.error(f"data row {int(np.argmin(whole))} holds no pose; expected the corners of the path")
    return corners


def write_path_test(path: str | os.PathLike[str], plan: PathPlan) -> list[Path]:
    """Writes the program and, beside it, its corners as NAME_corners.csv, all or none; returns the files.

    Raises:
        InvalidInput: A file cannot be written.
    """
    programs = program_files(Path(path), plan.documents)
    corners = Path(path).with_name(f"{Path(path).stem}_corners.csv")
    columns = [*from_si(plan.corners[:, :3, 3], "mm").T, *quaternions(plan.corners[:, :3, :3]).T]
    names = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
    with atomic_paths([corners, *programs]) as (temporary, *temporaries):
        temporary.write_text(csv_text(dict(zip(names, columns, strict=True))), encoding="utf-8", newline="\n")
        write_documents(temporaries, plan.documents)
    return [*programs, corners]


def _poses(table: Table) -> tuple[PathRun, NDArray[np.bool_]]:
    """The poses of all rows, and (N,) which are whole."""
    known, _ = match_columns(table, ())
    columns = Columns(table, known)
    position = columns.numbers("position", ["x", "y", "z"])
    if position is None:
        raise table.error(f"holds no points of a path; expected {would_do('x', 'length')}, and y and z")
    wxyz = columns.rotation()
    whole = np.asarray(np.isfinite(position).all(axis=1))
    if wxyz is None:
        return PathRun(position), whole
    length = np.linalg.norm(wxyz, axis=1, keepdims=True)
    whole &= np.isfinite(length[:, 0]) & (length[:, 0] > 0)
    turned = np.full((len(wxyz), 3, 3), np.nan)
    turned[whole] = rotations(wxyz[whole] / length[whole])
    return PathRun(position, turned), whole
