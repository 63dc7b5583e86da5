# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of the joints' compliance: angle against torque, and which joints bend."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fastcal.calibration.compliance import curve
from fastcal.report import figures, page
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import MISSING, plural, significant, with_uncertainty
from fastcal.report.language import _, in_language
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, in_words, number_cell, unit_text
from fastcal.report.words import Verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.compliance import Compliance, JointCurve

_MICRO = 1e6
_MOST_TILES = 4


def compliance_page(found: Compliance, robot_name: str, language: str = "en") -> str:
    """The HTML text of the page."""
    bent = [curve.owner for curve in found.curves if curve.bent]
    with in_language(language):
        return page.render(
            "compliance.html",
            title=_("Compliance of {robot}", robot=robot_name),
            robot_name=robot_name,
            simulated=False,
            postures=plural(found.pairs.posture_count, _("posture"), _("postures")),
            rows=plural(found.pairs.row_count, _("row"), _("rows")),
            verdict=Verdict("good", _("Bends") if bent else _("Straight"), _sentence(bent, found.level)),
            tiles=_tiles(found),
            noise=f"{significant(found.pairs.sigma_mm, 2)} mm",
            table=_table(found),
            drawings=[_figure(found, own) for own in found.curves],
        )


def _sentence(bent: list[str], level: float) -> str:
    if not bent:
        return _(
            "No joint has a corner that is certain at p < {level:g}: each deflects in proportion to its torque.",
            level=level,
        )
    joints = ", ".join(map(in_words, bent))
    return _("A corner, certain at p < {level:g}: {joints}.", level=level, joints=joints)


def _tiles(found: Compliance) -> list[tuple[str, str, str]]:
    """The first joints, each by how much it gives, or where it bends."""
    tiles = []
    for own in found.curves[:_MOST_TILES]:
        entries = {entry.name: entry for entry in found.pairs.parameters if entry.owner == own.owner}
        name, unit = ("critical_nm", unit_text("nm")) if own.bent else ("compliance_rad_nm", f"µ{unit_text('rad_nm')}")
        factor = 1.0 if own.bent else _MICRO
        entry = entries[name]
        std, value = with_uncertainty(*(None if size is None else factor * size for size in (entry.std, entry.value)))
        note = _("where it bends") if own.bent else _("compliance")
        tiles.append(
            (capitalised(in_words(own.owner)), f"{value} {unit}", note if std == MISSING else f"± {std}, {note}")
        )
    return tiles


def _named(name: str) -> tuple[str, float]:
    """A parameter's name with its unit, and the factor from SI."""
    return {
        "compliance_rad_nm": (_("compliance (µrad/(N m))"), _MICRO),
        "low_rad_nm": (_("below the corner (µrad/(N m))"), _MICRO),
        "high_rad_nm": (_("above it (µrad/(N m))"), _MICRO),
        "critical_nm": (_("critical torque (N m)"), 1.0),
    }[name]


def _table(found: Compliance) -> Table:
    columns = [Column(capitalised(_("joint")), numeric=False), Column(capitalised(_("number")), numeric=False)]
    columns += [Column(_("Value")), Column(_("Std")), Column(_("p of a corner"))]
    rows = []
    for own in found.curves:
        for k, entry in enumerate(p for p in found.pairs.parameters if p.owner == own.owner):
            name, size = _named(entry.name)
            std = None if entry.std is None else size * entry.std
            rows.append(
                [
                    Cell(in_words(own.owner) if k == 0 else ""),
                    Cell(name),
                    number_cell(significant(size * entry.value), size * entry.value),
                    number_cell("" if std is None else significant(std, 2), std),
                    number_cell(significant(own.p, 2) if k == 0 else "", own.p if k == 0 else None),
                ]
            )
    return Table(_("Compliance of the joints."), columns, [Group(rows)])


def _figure(found: Compliance, own: JointCurve) -> Figure:
    """Torque against angle of one joint: what each row says, and the law."""
    along = np.linspace(own.torque.min(), own.torque.max(), 101)
    law = curve(found, own.owner, along)
    key = [Key(_("rows"), figures.BEFORE, "point"), Key(_("identified"), figures.AFTER, "solid")]
    angle = from_si(own.angle, "deg")
    hover = _("%{{y:.4g}} deg at %{{x:.4g}} N m")
    traces = [
        figures.points(own.torque, angle, figures.BEFORE, 5, 0.5, hover=hover),
        figures.line(along, law, figures.AFTER, "solid", hover=hover),
    ]
    drawn = figures.layout(_("torque about the joint (N m)"), _("deflection (°)"))
    joint = in_words(own.owner)
    alt = _("Deflection of {joint} against the torque about it: every row, and the identified law.", joint=joint)
    return Figure(f"joint-{own.owner}", capitalised(joint), alt, traces, drawn, columns=6, height=320, key=key)
