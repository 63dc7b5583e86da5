# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of measured paths: accuracy and repeatability along the commanded path, and its corners; path.json."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.report import figures, page
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import significant
from fastcal.report.tables import Column, Group, Table, number_cell
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance.path_figures import PathFigures

FILES = ("path.json", "report.html")


def write_measured_path(found: PathFigures, robot_name: str, folder: str | os.PathLike[str]) -> None:
    """Writes path.json and report.html into a folder, both or none."""
    with atomic_folder(folder, owned=FILES) as place:
        write_json(place / "path.json", found.to_json_dict())
        (place / "report.html").write_text(measured_path_page(found, robot_name), encoding="utf-8")


def measured_path_page(found: PathFigures, robot_name: str) -> str:
    """The HTML text of the page."""
    return page.render(
        "measured_path.html",
        title=f"Measured path of {robot_name}",
        robot_name=robot_name,
        simulated=False,
        runs=found.runs,
        length=f"{significant(from_si(found.length, 'mm'), 4)} mm",
        table=_table(found),
        drawing=_figure(found),
    )


def _table(found: PathFigures) -> Table:
    content = found.to_json_dict()
    names = [("AT (mm)", "AT_mm"), ("RT (mm)", "RT_mm")]
    if found.turn_accuracy is not None:
        names += [
            (f"{symbol} about {axis} (deg)", f"{symbol}_r{axis}_deg") for symbol in ("AT", "RT") for axis in "xyz"
        ]
    values = [(name, float(content[key])) for name, key in names]
    for each in found.corners:
        values.append((f"CR, corner {each.corner} (mm)", float(from_si(each.rounding, "mm"))))
        values.append((f"CO, corner {each.corner} (mm)", float(from_si(each.overshoot, "mm"))))
    rows = [[number_cell(name, None), number_cell(significant(value, 4), value)] for name, value in values]
    return Table("Figures of ISO 9283.", [Column("figure", numeric=False), Column("value")], [Group(rows)])


def _figure(found: PathFigures) -> Figure:
    along = from_si(found.along, "mm")
    key = [Key("accuracy |m - c|", figures.BEFORE, "dash"), Key("repeatability l + 3 S", figures.AFTER, "solid")]
    traces = [
        figures.line(along, from_si(values, "mm"), entry.colour, entry.mark, hover="%{y:.4g} mm at %{x:.5g} mm")
        for entry, values in zip(key, (found.accuracy, found.repeatability), strict=True)
    ]
    drawn = figures.layout("along the path (mm)", "mm")
    alt = "Path accuracy and repeatability at each plane along the commanded path."
    return Figure("measured-path", "Along the path", alt, traces, drawn, columns=6, height=380, key=key)
