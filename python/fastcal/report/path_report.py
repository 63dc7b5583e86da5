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
from fastcal.report.language import _
from fastcal.report.tables import Column, Group, Table, number_cell
from fastcal.report.words import Remark, Verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.compensation import PathAccuracy

_LEAST_MM = 1e-4  # what a logarithmic axis shows of zero


def write_path_report(
    found: PathAccuracy, robot_name: str, path: str | os.PathLike[str], *, targets_name: str = ""
) -> None:
    """Writes the page, whole or not at all; `targets_name` is the file of the path."""
    write_text(path, path_page(found, robot_name, targets_name))


def path_page(found: PathAccuracy, robot_name: str, targets_name: str = "") -> str:
    """The HTML text of the page."""
    return page.render(
        "path.html",
        title=_("Path of {robot}", robot=robot_name),
        robot_name=robot_name,
        targets_name=targets_name,
        verdict=_verdict(found),
        tiles=_tiles(found),
        simulated=False,
        points=len(found.points),
        length=f"{significant(from_si(float(found.along[-1]), 'mm'), 4)} mm",
        table=_table(found),
        drawing=path_figure(found),
    )


def _verdict(found: PathAccuracy) -> Verdict:
    """What compensation does to the largest error, and how sure that is."""
    before, after = (float(from_si(float(size.max()), "mm")) for size in (found.before, found.after))
    known = _sigma_mm(found)
    told = {"before": significant(before, 3), "after": _no_finer(after, known)}
    remarks = [Remark(_sureness(found), known is None, "accuracy")]
    if after >= before:
        text = _("Compensation raises the largest error on the path from {before} to {after} mm.", **told)
        return Verdict("bad", _("No gain"), text, remarks, [_("Run the program as it is, or calibrate the arm again.")])
    text = _("Compensation lowers the largest error on the path from {before} to {after} mm.", **told)
    return Verdict("good", _("Predicted"), text, remarks)


def _tiles(found: PathAccuracy) -> list[tuple[str, str, str]]:
    """The largest errors and the path accuracy, with compensation and without."""
    known, tiles = _sigma_mm(found), []
    for title, before, after in (
        (_("Largest error"), found.before, found.after),
        (_("Path accuracy, ISO 9283"), found.off_before, found.off_after),
    ):
        was, now = (float(from_si(float(size.max()), "mm")) for size in (before, after))
        without = _("{size} mm without compensation", size=significant(was, 3))
        tiles.append((title, f"{_no_finer(now, known)} mm", without))
    return tiles


def _table(found: PathAccuracy) -> Table:
    titles = (_("Mean"), _("RMS"), _("Largest"), _("Path accuracy, ISO 9283"))
    columns = [Column(_("Program"), numeric=False), *(Column(f"{title} (mm)") for title in titles)]
    rows = []
    known = _sigma_mm(found)
    for name, size, off in (
        (_("without compensation"), found.before, found.off_before),
        (_("with compensation"), found.after, found.off_after),
    ):
        mm = from_si(size, "mm")
        values = [mm.mean(), np.sqrt(np.mean(mm**2)), mm.max(), from_si(float(off.max()), "mm")]
        cells = [number_cell(_no_finer(float(value), known), float(value)) for value in values]
        rows.append([number_cell(name, None), *cells])
    return Table(_("Error along the path, without and with compensation."), columns, [Group(rows)])


def _sigma_mm(found: PathAccuracy) -> float | None:
    """Standard deviation of a predicted coordinate along the path, RMS [mm]; None for an uncalibrated model."""
    known = found.sigma[np.isfinite(found.sigma)]
    return float(from_si(float(np.sqrt(np.mean(known**2))), "mm")) if len(known) else None


def _no_finer(value: float, sigma: float | None) -> str:
    """A predicted error; one below a tenth of the model's own uncertainty is shown as that."""
    least = 0.0 if sigma is None else sigma / 10
    return f"< {significant(least, 1)}" if value < least else significant(value, 3)


def _sureness(found: PathAccuracy) -> str:
    """How sure the model is of its own prediction."""
    sigma = _sigma_mm(found)
    if sigma is None:
        return _("The model was not calibrated: how sure its prediction is, is not known.")
    return _(
        "The model's own prediction has a standard deviation of {sigma} mm per coordinate along this path: the tool "
        "may be that far off, however small the predicted error is.",
        sigma=significant(sigma, 2),
    )


def path_figure(found: PathAccuracy) -> Figure:
    """Error along the path, without and with compensation."""
    along = from_si(found.along, "mm")
    key = [
        Key(_("without compensation"), figures.BEFORE, "dash"),
        Key(_("with compensation"), figures.AFTER, "solid"),
    ]
    traces = []
    sizes = [np.maximum(from_si(size, "mm"), _LEAST_MM) for size in (found.before, found.after)]
    for entry, size in zip(key, sizes, strict=True):
        hover = f"{entry.label}: %{{y:.3g}} mm @ %{{x:.4g}} mm"
        traces.append(figures.line(along, size, entry.colour, entry.mark, hover=hover))
    sigma = _sigma_mm(found)
    if sigma is not None:
        traces.append(figures.line(along[[0, -1]], np.full(2, sigma), figures.INK, "dot"))
        key.append(Key(_("standard deviation of the prediction, a coordinate"), figures.INK, "dot"))
    at = found.points
    traces.append(figures.points(along[at], sizes[1][at], figures.AFTER, 7, hover=f"{_('target pose')}: %{{x:.4g}} mm"))
    key.append(Key(_("target pose"), figures.AFTER, "point"))
    drawn = figures.layout(
        _("along the path (mm)"),
        _("error of the tool (mm), logarithmic"),
        yaxis={"type": "log", "exponentformat": "none", "dtick": 1},
    )
    alt = _("Distance of the tool from its place along the path, on a logarithmic axis, without and with compensation.")
    return Figure("path", _("Error along the path"), alt, traces, drawn, columns=6, height=380, key=key)
