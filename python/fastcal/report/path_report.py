# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a path: how far the tool is from where it should be, without and with compensation."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from fastcal.io.atomic import write_text
from fastcal.report import figures, page
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import significant
from fastcal.report.tables import Column, Group, Table, number_cell
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.compensation import PathAccuracy

_LEAST_MM = 1e-6  # what a logarithmic axis shows of zero


def write_path_report(found: PathAccuracy, robot_name: str, path: str | os.PathLike[str]) -> None:
    """Writes the page, whole or not at all."""
    write_text(path, path_page(found, robot_name))


def path_page(found: PathAccuracy, robot_name: str) -> str:
    """The HTML text of the page."""
    return page.render(
        "path.html",
        title=f"Path of {robot_name}",
        robot_name=robot_name,
        simulated=False,
        points=len(found.points),
        length=f"{significant(from_si(float(found.along[-1]), 'mm'), 4)} mm",
        table=_table(found),
        drawing=_drawing(found),
    )


def _table(found: PathAccuracy) -> Table:
    columns = [Column("", numeric=False), *(Column(f"{name} (mm)") for name in ("mean", "RMS", "largest"))]
    columns.append(Column("path accuracy, ISO 9283 (mm)"))
    rows = []
    for name, size, off in (
        ("without compensation", found.before, found.off_before),
        ("with compensation", found.after, found.off_after),
    ):
        mm = from_si(size, "mm")
        values = [mm.mean(), np.sqrt(np.mean(mm**2)), mm.max(), from_si(float(off.max()), "mm")]
        cells = [number_cell(significant(float(value), 3), float(value)) for value in values]
        rows.append([number_cell(name, None), *cells])
    return Table("Error along the path, without and with compensation.", columns, [Group(rows)])


def _drawing(found: PathAccuracy) -> Figure:
    along = from_si(found.along, "mm")
    key = [Key("without compensation", figures.BEFORE, "dash"), Key("with compensation", figures.AFTER, "solid")]
    traces = []
    sizes = [np.maximum(from_si(size, "mm"), _LEAST_MM) for size in (found.before, found.after)]
    for entry, size in zip(key, sizes, strict=True):
        hover = f"{entry.label}: %{{y:.3g}} mm at %{{x:.4g}} mm"
        traces.append(figures.line(along, size, entry.colour, entry.mark, hover=hover))
    at = found.points
    traces.append(figures.points(along[at], sizes[1][at], figures.AFTER, 7, hover="target at %{x:.4g} mm"))
    key.append(Key("target", figures.AFTER, "point"))
    drawn = figures.layout(
        "along the path (mm)", "error of the tool (mm), logarithmic", yaxis={"type": "log", "exponentformat": "power"}
    )
    alt = "Distance of the tool from its place along the path, on a logarithmic axis, without and with compensation."
    return Figure("path", "Error along the path", alt, traces, drawn, columns=6, height=380, key=key)
