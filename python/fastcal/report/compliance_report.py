# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of the joints' compliance: angle against torque, and which joints bend."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fastcal.calibration.compliance import curve
from fastcal.report import figures, page
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import significant
from fastcal.report.tables import Cell, Column, Group, Table, number_cell
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.compliance import Compliance, JointCurve

_NANO = 1e9
_UNITS = {"critical_nm": ("critical torque (N m)", 1.0)}
_NAMES = {
    "compliance_rad_nm": "compliance (nrad/N m)",
    "low_rad_nm": "below the corner (nrad/N m)",
    "high_rad_nm": "above it (nrad/N m)",
}


def compliance_page(found: Compliance, robot_name: str) -> str:
    """The HTML text of the page."""
    bent = [curve.owner for curve in found.curves if curve.bent]
    return page.render(
        "compliance.html",
        title=f"Compliance of {robot_name}",
        robot_name=robot_name,
        simulated=False,
        postures=found.pairs.posture_count,
        rows=found.pairs.row_count,
        sentence=_sentence(bent, found.level),
        noise=f"{significant(found.pairs.sigma_mm, 2)} mm",
        table=_table(found),
        drawings=[_figure(found, own) for own in found.curves],
    )


def _sentence(bent: list[str], level: float) -> str:
    if not bent:
        return f"No joint has a corner that is certain at p < {level:g}: each gives in proportion to its torque."
    return f"A corner, certain at p < {level:g}: {', '.join(bent)}."


def _table(found: Compliance) -> Table:
    columns = [Column("joint", numeric=False), Column("number", numeric=False), Column("value"), Column("std")]
    columns += [Column("p of a corner")]
    rows = []
    for own in found.curves:
        for k, entry in enumerate(p for p in found.pairs.parameters if p.owner == own.owner):
            name, size = _UNITS.get(entry.name) or (_NAMES[entry.name], _NANO)
            std = None if entry.std is None else size * entry.std
            rows.append(
                [
                    Cell(own.owner if k == 0 else ""),
                    Cell(name),
                    number_cell(significant(size * entry.value), size * entry.value),
                    number_cell("" if std is None else significant(std, 2), std),
                    number_cell(significant(own.p, 2) if k == 0 else "", own.p if k == 0 else None),
                ]
            )
    return Table("Compliance of the joints.", columns, [Group(rows)])


def _figure(found: Compliance, own: JointCurve) -> Figure:
    """Torque against angle of one joint: what each row says, and the law."""
    along = np.linspace(own.torque.min(), own.torque.max(), 101)
    law = curve(found, own.owner, along)
    key = [Key("rows", figures.BEFORE, "point"), Key("identified", figures.AFTER, "solid")]
    angle = from_si(own.angle, "deg")
    hover = "%{y:.4g} deg at %{x:.4g} N m"
    traces = [
        figures.points(own.torque, angle, figures.BEFORE, 5, 0.5, hover=hover),
        figures.line(along, law, figures.AFTER, "solid", hover=hover),
    ]
    drawn = figures.layout("torque about the joint (N m)", "angle it gives (deg)")
    alt = f"Angle that {own.owner} gives against the torque about it: every row, and the identified law."
    return Figure(f"joint-{own.owner}", own.owner, alt, traces, drawn, columns=6, height=320, key=key)
