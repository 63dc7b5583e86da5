# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a comparison of two models; nothing is fitted here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.differences import Difference
from fastcal.report import charts, figures, page, workspace
from fastcal.report import monitoring_figures as drawings
from fastcal.report.arm import compared_arm
from fastcal.report.figures import Figure
from fastcal.report.formatting import fixed, significant, with_uncertainty
from fastcal.report.language import _, in_language
from fastcal.report.parameter_sizes import Moved, differences_at_tool, sizes_figure
from fastcal.report.sections import Section, bare, p_text, present
from fastcal.report.tables import (
    Cell,
    Column,
    Group,
    Table,
    after_number,
    capitalised,
    in_words,
    number_cell,
    unit_text,
)
from fastcal.report.words import Remark, Verdict
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_MOST_NAMED = 4  # parameters that the verdict names
_LEAST_MM = 1e-4  # of what no parameter explains: less is rounding


def comparison_page(found: Comparison, language: str = "en") -> str:
    """The HTML text of a comparison's page."""
    with in_language(language):
        sizes, different = found.at_tool.to_mm(), found.significant
        headline = _headline(found)
        moved = differences_at_tool(found)
        sized = sizes_figure(moved, compared=True)
        drawn = differences_in_space(found, moved)
        shares = [(_("distance"), from_si(found.distance, "mm"), figures.AFTER, "solid")]
        return page.render(
            "monitoring.html",
            title=_("Two models of {robot}", robot=found.first.name),
            eyebrow=_("Two models of one arm"),
            robot_name=found.first.name,
            simulated=False,
            meta=[_("A: {model}", model=_model(found.first)), _("B: {model}", model=_model(found.second))],
            verdict=Verdict(
                "caution" if different else "good",
                _("Different") if different else _("Alike"),
                headline,
                [
                    *(Remark(_changed(d), True, "parameters") for d in _largest(different)),
                    *(Remark(note[:1].upper() + note[1:] + ".", True, "method") for note in found.notes),
                ],
                [which_holds()] if different else [],
            ),
            tiles=[
                (_("Mean at the tool"), f"{significant(sizes['mean'])} mm", _("bases and tools aligned")),
                (_("RMS"), f"{significant(sizes['rms'])} mm", _("over {count} postures", count=len(found.q))),
                (_("Largest"), f"{significant(sizes['max'])} mm", _("in the joint range of both")),
            ],
            sections=[
                Section("tool", _("At the tool"), drawings=[drawings.heat_map(found), _share(shares)]),
                Section("workspace", _("Where in the workspace"), drawings=[drawn]),
                Section(
                    "parameters",
                    _("Parameters"),
                    _(
                        "B is expressed in A's gauge, so that directions which no measurement determines do not "
                        "count as differences. Base and tool are left out."
                    ),
                    drawings=present(sized),
                ),
                Section(
                    "numbers",
                    _("All {count} parameters in their own units", count=len(found.parameters)),
                    tables=[difference_table(found.parameters)],
                    folded=True,
                ),
                Section(
                    "method",
                    _("Method"),
                    facts=[(_("Not explained by any parameter"), f"{_unexplained(found)} mm RMS")],
                ),
            ],
            document=[],
        )


def which_holds() -> str:
    """What to do where two models differ."""
    return _("Measure a few poses: `fastcal check` tells which of the two the arm agrees with now.")


def _headline(found: Comparison) -> str:
    """How many parameters differ, and what that is at the tool."""
    count, every = len(found.significant), len(found.parameters)
    size = fixed(found.at_tool.to_mm()["mean"], 3)
    if count == 0:
        return _("No parameter differs beyond noise: {size} mm at the tool on average.", size=size)
    if count == 1:
        return _("1 of {all} parameters differs beyond noise: {size} mm at the tool on average.", all=every, size=size)
    return _(
        "{count} of {all} parameters differ beyond noise: {size} mm at the tool on average.",
        count=count,
        all=every,
        size=size,
    )


def differences_in_space(found: Comparison, moved: Sequence[Moved]) -> Figure:
    """The arm and how far B's tool is from A's; `moved`: `differences_at_tool`, by which its joints are coloured."""
    positions, apart, arm = compared_arm(found, moved)
    told = _(
        "Each arrow points from the point of A towards that of B, in the base frame, magnified as stated in the "
        "heading."
    )
    title = _("Differences in the workspace")
    return workspace.scene(positions, apart, None, np.zeros(3), _("the base"), arm, told=told, title=title)


def _largest(different: Sequence[Difference]) -> list[Difference]:
    """The surest of them."""
    return sorted(different, key=lambda d: 1.0 if d.p_value is None else d.p_value)[:_MOST_NAMED]


def _changed(d: Difference) -> str:
    """Which parameter, and from what to what."""
    name = in_words(f"{d.owner} {bare(d.name, d.unit)}")
    values = [v for v in (d.a, d.b, d.difference) if v is not None]
    std, *texts = with_uncertainty(d.std, *values)
    numbers = {"name": capitalised(name), "unit": after_number(unit_text(d.unit)), "change": f"{texts[-1]} ± {std}"}
    if d.a is None or d.b is None:
        return _("{name} differs by {change}{unit}.", **numbers)
    return _("{name} differs by {change}{unit}, from {a} to {b}{unit}.", a=texts[0], b=texts[1], **numbers)


def _unexplained(found: Comparison) -> str:
    size = float(from_si(found.unexplained, "mm"))
    return fixed(size, 4) if size >= _LEAST_MM else f"< {fixed(_LEAST_MM, 4)}"


def _share(shares: list[tuple[str, np.ndarray, str, str]]) -> Figure:
    drawn = charts.cumulative(shares, "mm")
    alt = _("Share of postures within a distance between the two models.")
    return Figure(
        "shares",
        _("Share of postures within a distance"),
        alt,
        drawn.traces,
        drawn.layout,
        columns=3,
        height=360,
        paper_height=210,
    )


def difference_table(parameters: Sequence[Difference]) -> Table:
    """The numbers of both models, and by how much they differ."""
    columns = [Column(_("Parameter"), numeric=False), Column("A"), Column("B"), Column(_("B minus A")), Column("±")]
    columns += [Column(_("Unit"), numeric=False), Column(_("p-value")), Column(_("Significant"), numeric=False)]
    return Table(_("Parameters"), columns, [Group([_difference(d) for d in parameters])], True)


def _difference(d: Difference) -> list[Cell]:
    name = in_words(f"{d.owner} {bare(d.name, d.unit)}")
    values = [v for v in (d.a, d.b, d.difference) if v is not None]
    shown = list(with_uncertainty(d.std, *values))
    std = shown.pop(0)
    texts = [shown.pop(0) if v is not None else "\N{EN DASH}" for v in (d.a, d.b, d.difference)]
    cells = [number_cell(text, v) for text, v in zip(texts, (d.a, d.b, d.difference), strict=True)]
    p = "" if d.p_value is None else p_text(d.p_value)
    word = {True: _("yes"), False: _("no"), None: _("unknown")}[d.significant]
    return [Cell(name), *cells, number_cell(std, d.std), Cell(unit_text(d.unit)), number_cell(p, d.p_value), Cell(word)]


def _model(model: Robot) -> str:
    known = [str(model.made_by[key]) for key in ("serial", "date") if model.made_by.get(key)]
    return ", ".join([model.name, *known])
