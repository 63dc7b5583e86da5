# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a tracker recorded while an arm drove a path: points at a steady rate, one file a run, no joints."""

from __future__ import annotations

import os

import numpy as np

from fastcal.acceptance.path_figures import PathRun
from fastcal.calibration.prediction import rotations
from fastcal.io.columns import match_columns, would_do
from fastcal.io.measurements import Columns
from fastcal.io.tables import read_table


def load_run(path: str | os.PathLike[str]) -> PathRun:
    """Reads x_mm y_mm z_mm, and qw qx qy qz or rx_deg ry_deg rz_deg if any; rows without a point drop out.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
    """
    table = read_table(path)
    known, _ = match_columns(table, ())
    columns = Columns(table, known)
    position = columns.numbers("position", ["x", "y", "z"])
    if position is None:
        raise table.error(f"holds no recorded points; expected {would_do('x', 'length')}, and y and z")
    wxyz = columns.rotation()
    whole = np.isfinite(position).all(axis=1)
    if wxyz is not None:
        whole &= np.isfinite(wxyz).all(axis=1) & (np.abs(wxyz).max(axis=1) > 0)
    if whole.sum() < 2:
        raise table.error("holds fewer than two whole points; expected those of one run of the path")
    if wxyz is None:
        return PathRun(position[whole])
    turned = wxyz[whole] / np.linalg.norm(wxyz[whole], axis=1, keepdims=True)
    return PathRun(position[whole], rotations(turned))
