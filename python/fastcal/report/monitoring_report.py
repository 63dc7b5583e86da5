# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of a check, an update, a comparison and a history; nothing is fitted here."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any

import numpy as np

from fastcal.monitoring import words
from fastcal.monitoring.check import FEWEST_DEGREES
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.update import UpdateResult
from fastcal.report import charts, figures, page
from fastcal.report import monitoring_figures as drawings
from fastcal.report.figures import Figure
from fastcal.report.formatting import fixed, plural, significant, with_uncertainty
from fastcal.report.language import _, decimal_sign, in_language
from fastcal.report.tables import Cell, Column, Group, Table, number_cell, spaced, unit_text
from fastcal.report.words import Remark, Verdict
from fastcal.units import from_si

TONES = {"holds": "good", "changed": "bad", "cannot_tell": "caution", "alarm": "caution", "unchecked": "caution"}


_LEAST_P = 1e-4


@dataclass(frozen=True)
class Section:
    """One part of a page."""

    id: str
    title: str
    lead: str = ""
    drawings: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    facts: list[tuple[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def place(self) -> tuple[str, str]:
        """For the list of contents."""
        return self.id, self.title


def state_word(state: str) -> str:
    """A verdict or state for a reader."""
    return {
        "holds": _("holds"),
        "changed": _("changed"),
        "cannot_tell": _("cannot tell"),
        "alarm": _("alarm"),
        "unchecked": _("never checked"),
    }[state]


def translated(message: str, /, **values: Any) -> str:
    """`_` with the decimal sign of the page in its values."""
    sign = decimal_sign()
    return _(message, **{k: re.sub(r"(?<=\d)\.(?=\d)", sign, str(v)) for k, v in values.items()})


def check_sentence(found: CheckResult) -> str:
    """The verdict in the language of the page."""
    enough = found.degrees_of_freedom >= FEWEST_DEGREES
    given = (found.verdict, found.causes, found.within_tolerance, found.tolerance, found.largest, enough)
    return words.sentence(*given, translated)


def _reasons(found: CheckResult) -> list[str]:
    given = (found.rms, found.expected_rms, found.p_value, found.degrees_of_freedom, found.places, found.causes)
    return words.reasons(*given, translated)


def check_page(found: CheckResult, language: str = "en") -> str:
    """The HTML text of a check's page."""
    with in_language(language):
        sections = [
            Section("errors", _("Errors and changes"), drawings=present(drawings.errors(found), drawings.moved(found))),
            _causes(found),
            *_next_poses(found),
            _check_method(found),
        ]
        return page.render(
            "monitoring.html",
            title=_("Check of {robot}", robot=found.model.name),
            eyebrow=_("Does the calibration still hold?"),
            robot_name=found.model.name,
            simulated=False,
            meta=[
                PurePath(found.data.source.split(", ")[0]).name,
                plural(len(found.data), "pose"),
                *_who(found.made_by),
            ],
            verdict=Verdict(
                TONES[found.verdict],
                state_word(found.verdict).capitalize(),
                check_sentence(found),
                [
                    Remark(reason[:1].upper() + reason[1:] + ".", found.verdict != "holds", "errors")
                    for reason in _reasons(found)
                ],
            ),
            tiles=_check_tiles(found),
            sections=sections,
        )


def _check_tiles(found: CheckResult) -> list[tuple[str, str, str]]:
    return [
        (_("RMS error"), f"{significant(found.rms_mm)} mm", _("after fitting the base")),
        (_("Expected"), f"{significant(found.expected_rms_mm)} mm", _("noise and the model's uncertainty")),
        (
            _("Largest error"),
            f"{significant(from_si(found.largest, 'mm'))} mm",
            _("of {count} poses", count=len(found.data)),
        ),
        (_("p-value"), p_text(found.p_value), _("of an unchanged arm")),
    ]


def _causes(found: CheckResult) -> Section:
    columns = [Column(_("What"), numeric=False), Column(_("Number"), numeric=False), Column(_("Model"))]
    columns += [Column(_("Now")), Column(_("Change")), Column("±"), Column(_("Unit"), numeric=False)]
    rows = []
    for cause in found.causes:
        for change in cause.changes:
            name = bare(change.name, change.unit)
            rows.append(
                [
                    Cell(words.spoken(cause.label, translated)),
                    Cell(name),
                    *_numbers(change.was, change.value, change.change, change.std),
                    Cell(unit_text(change.unit)),
                ]
            )
    notes = [
        _(
            "As likely by these poses: {names}.",
            names=", ".join(words.spoken(label, translated) for label in cause.equivalents),
        )
        for cause in found.causes
        if cause.equivalents
    ]
    if found.blind:
        names = ", ".join(words.spoken(label, translated) for label in found.blind)
        notes.append(_("Before an instrument that was set up anew no pose shows: {names}.", names=names))
    if not rows:
        return Section("causes", _("What has changed"), _("Nothing that these poses show."), notes=notes)
    return Section("causes", _("What has changed"), tables=[Table(_("Changes"), columns, [Group(rows)])], notes=notes)


def _numbers(was: float, now: float, change: float, std: float | None) -> list[Cell]:
    """The model's value, the new one, the change and its standard deviation, to the same digits."""
    shown = with_uncertainty(std, was, now, change)
    return [
        number_cell(text, value) for text, value in zip((*shown[1:], shown[0]), (was, now, change, std), strict=True)
    ]


def _next_poses(found: CheckResult) -> list[Section]:
    if not found.next_poses:
        return []
    units = ["°" if kind == "revolute" else "mm" for kind in found.model.joint_types]
    columns = [Column(f"q{i + 1} ({unit})") for i, unit in enumerate(units)] + [Column(_("payload (kg)"))]
    rows = [[Cell(f"{v:.2f}", v) for v in (*pose.q, pose.payload_kg)] for pose in found.next_poses]
    return [
        Section(
            "next",
            _("What to measure next"),
            _("These poses decide it."),
            tables=[Table(_("Poses"), columns, [Group(rows)])],
        )
    ]


def _check_method(found: CheckResult) -> Section:
    facts = [
        (_("Degrees of freedom"), _("{count}: numbers less six for each set-up", count=found.degrees_of_freedom)),
        (_("Noise of a coordinate"), f"{significant(from_si(found.sigma, 'mm'), 2)} mm"),
    ]
    for place in found.places:
        block = place.to_json_dict()
        xyz, rpy = (", ".join(f"{v:.3f}" for v in block[key]) for key in ("xyz_mm", "rpy_deg"))
        name = _("Station {name}", name=place.name) if place.name else _("Instrument")
        facts.append(
            (name, _("the base has moved by xyz {xyz} mm, rpy {rpy}° in the measuring frame", xyz=xyz, rpy=rpy))
        )
    return Section("method", _("Method and data"), facts=facts + _origin(found.made_by), notes=found.notes)


def update_page(found: UpdateResult, language: str = "en") -> str:
    """The HTML text of an update's page."""
    with in_language(language):
        before, after = found.before.rms_mm, found.train.after.to_mm()["rms"] if found.train.after else float("nan")
        columns = [Column(_("Parameter"), numeric=False), Column(_("Before")), Column(_("Now")), Column(_("Change"))]
        columns += [Column("±"), Column(_("Unit"), numeric=False)]
        groups: dict[str, list[list[Cell]]] = {}
        for p in found.parameters:
            cells = _numbers(p.nominal, p.value, p.value - p.nominal, p.std)
            name = bare(p.name, p.unit)
            groups.setdefault(p.owner, []).append([Cell(name), *cells, Cell(unit_text(p.unit))])
        table = Table(_("Parameters"), columns, [Group(rows, spaced(owner)) for owner, rows in groups.items()], True)
        return page.render(
            "monitoring.html",
            title=_("Update of {robot}", robot=found.model.name),
            eyebrow=_("A calibrated model, brought up to date"),
            robot_name=found.model.name,
            simulated=False,
            meta=[plural(len(found.before.data), "pose"), *_who(found.model.spec["made_by"])],
            verdict=Verdict(
                "good",
                _("Up to date"),
                _(
                    "The model's RMS error on the new poses is {after} mm; it was {before} mm.",
                    after=f"{after:.3f}",
                    before=f"{before:.3f}",
                ),
                [Remark(check_sentence(found.before), found.before.verdict != "holds", "before")],
            ),
            tiles=[
                (_("RMS error"), f"{significant(after)} mm", _("was {before} mm", before=significant(before))),
                (_("Noise of a coordinate"), f"{significant(from_si(found.sigma, 'mm'), 2)} mm", _("pooled")),
                (_("Degrees of freedom"), str(found.degrees_of_freedom), _("those of the calibration with them")),
            ],
            sections=[
                Section(
                    "parameters",
                    _("Parameters"),
                    _("What was known counts as much as it was certain; what has changed is free."),
                    tables=[table],
                ),
                Section(
                    "before",
                    _("The old model on these poses"),
                    check_sentence(found.before),
                    drawings=present(drawings.errors(found.before), drawings.moved(found.before)),
                ),
                Section("method", _("Method and data"), facts=_origin(found.model.spec["made_by"]), notes=found.notes),
            ],
        )


def comparison_page(found: Comparison, language: str = "en") -> str:
    """The HTML text of a comparison's page."""
    with in_language(language):
        sizes, different = found.at_tool.to_mm(), found.significant
        headline = (
            _(
                "{count} of {all} parameters differ beyond noise: {size} mm at the tool on average.",
                count=len(different),
                all=len(found.parameters),
                size=f"{sizes['mean']:.3f}",
            )
            if different
            else _("No parameter differs beyond noise: {size} mm at the tool on average.", size=f"{sizes['mean']:.3f}")
        )
        columns = [Column(_("Parameter"), numeric=False), Column("A"), Column("B"), Column(_("B less A")), Column("±")]
        columns += [Column(_("Unit"), numeric=False), Column(_("p-value")), Column(_("Significant"), numeric=False)]
        rows = [_difference(d) for d in found.parameters]
        shares = [(_("distance"), from_si(found.distance, "mm"), figures.AFTER, "solid")]
        return page.render(
            "monitoring.html",
            title=_("Two models of {robot}", robot=found.first.name),
            eyebrow=_("Two models of one arm"),
            robot_name=found.first.name,
            simulated=False,
            meta=[_("A: {model}", model=_model(found.first.spec)), _("B: {model}", model=_model(found.second.spec))],
            verdict=Verdict(
                "caution" if different else "good",
                _("Different") if different else _("Alike"),
                headline,
                [Remark(note[:1].upper() + note[1:] + ".", True, "method") for note in found.notes],
            ),
            tiles=[
                (_("Mean at the tool"), f"{significant(sizes['mean'])} mm", _("bases and tools aligned")),
                (_("RMS"), f"{significant(sizes['rms'])} mm", _("over {count} postures", count=len(found.q))),
                (_("Largest"), f"{significant(sizes['max'])} mm", _("in the joint range of both")),
            ],
            sections=[
                Section("tool", _("At the tool"), drawings=[drawings.heat_map(found), _share(shares)]),
                Section(
                    "parameters",
                    _("Parameters"),
                    _(
                        "B is written in A's gauge: what no measurement shows is no difference. Base and tool are "
                        "left out."
                    ),
                    tables=[Table(_("Parameters"), columns, [Group(rows)], True)],
                ),
                Section(
                    "method",
                    _("Method"),
                    facts=[
                        (_("Not explained by any parameter"), f"{fixed(from_si(found.unexplained, 'mm'), 4)} mm RMS")
                    ],
                ),
            ],
        )


def _share(shares: list[tuple[str, np.ndarray, str, str]]) -> Figure:
    drawn = charts.cumulative(shares, "mm")
    alt = _("Share of postures within a distance between the two models.")
    return Figure(
        "shares", _("Share of postures within a distance"), alt, drawn.traces, drawn.layout, columns=3, height=360
    )


def _difference(d: object) -> list[Cell]:
    from fastcal.monitoring.compare import Difference

    if not isinstance(d, Difference):
        raise TypeError(type(d).__name__)
    name = spaced(f"{d.owner} {bare(d.name, d.unit)}")
    values = [v for v in (d.a, d.b, d.difference) if v is not None]
    shown = list(with_uncertainty(d.std, *values))
    std = shown.pop(0)
    texts = [shown.pop(0) if v is not None else "\N{EN DASH}" for v in (d.a, d.b, d.difference)]
    cells = [number_cell(text, v) for text, v in zip(texts, (d.a, d.b, d.difference), strict=True)]
    p = "" if d.p_value is None else p_text(d.p_value)
    word = {True: _("yes"), False: _("no"), None: _("unknown")}[d.significant]
    return [Cell(name), *cells, number_cell(std, d.std), Cell(unit_text(d.unit)), number_cell(p, d.p_value), Cell(word)]


def present(*drawn: Figure | None) -> list[Figure]:
    """Those that there are."""
    return [each for each in drawn if each is not None]


def _who(origin: dict[str, object]) -> list[str]:
    """Serial number, date and instrument, where they are known."""
    known = {key: str(origin[key]) for key in ("serial", "date", "instrument") if origin.get(key)}
    out = [_("serial number {text}", text=known["serial"])] if "serial" in known else []
    out += [_("measured {text}", text=known["date"])] if "date" in known else []
    return [*out, *([known["instrument"]] if "instrument" in known else [])]


def _model(spec: dict[str, object]) -> str:
    origin = spec.get("made_by") or {}
    known = [str(origin[key]) for key in ("serial", "date") if origin.get(key)] if isinstance(origin, dict) else []
    return ", ".join([str(spec["name"]), *known])


def p_text(p: float) -> str:
    """A p-value; what is smaller than a ten-thousandth says no more."""
    return significant(p, 2) if p >= _LEAST_P else f"< {fixed(_LEAST_P, 4)}"


def bare(name: str, unit: str) -> str:
    """The name of a number without the unit at its end."""
    return name.removesuffix(f"_{unit}")


def _origin(origin: dict[str, object]) -> list[tuple[str, str]]:
    names = {
        "serial": _("Serial number"),
        "date": _("Measured on"),
        "instrument": _("Instrument"),
        "operator": _("Operator"),
    }
    names |= {"data_sha256": _("Data, SHA-256"), "robot_sha256": _("Model, SHA-256")}
    return [(name, str(origin[key])) for key, name in names.items() if origin.get(key)]
