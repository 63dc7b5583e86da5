# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a calibrated cell of several arms, and what all pages of cells have in common; nothing is fitted here."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import fastcal
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.result import IdentifiedParameter
from fastcal.cells import cell as cells
from fastcal.cells.calibrate import CellResult
from fastcal.cells.placements import Placement
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.tree_file import cell_text
from fastcal.place import places_of
from fastcal.report import figures, page
from fastcal.report.cell_scene import cell_scene
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import fixed, plural, significant, with_uncertainty
from fastcal.report.gap import waterfall
from fastcal.report.kind_words import kind_title, noise_text
from fastcal.report.language import _, in_language, retold
from fastcal.report.parameter_sizes import moved_in_cell, sizes_figure
from fastcal.report.sections import Section
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, in_words, number_cell, unit_text
from fastcal.report.words import Verdict, ending
from fastcal.said import parts_of_failure, said

CALIBRATION_FILES = ("model.yaml", "result.json", "report.html")
_COLOURS = ("#1f6fb4", "#c2571a", "#2b8a57", "#8a4fa0", "#937b10", "#4d5965")  # of views, in turn
_MEMBERS = {
    "arm": said("arm"),
    "target": said("target"),
    "sensor": said("sensor"),
    "camera": said("camera"),
    "board": said("board"),
}
_MOST_POINTS = 2000  # that a figure draws of one view
_TONES = {
    "converged": ("good", said("Converged")),
    "not_converged": ("bad", said("Not converged")),
    "too_few_equations": ("bad", said("Too few equations")),
}


def write_cell_calibration(found: CellResult, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes result.json, report.html and, where something was identified, model.yaml, all or none."""
    with atomic_folder(folder, CALIBRATION_FILES) as place:
        write_json(place / "result.json", found.to_json_dict())
        if found.parameters:
            text = cell_text(found.cell, f"{found.cell.name}, identified by fastcal {fastcal.__version__}")
            write_text(place / "model.yaml", text)
        write_text(place / "report.html", calibration_page(found, language))


def calibration_page(found: CellResult, language: str = "en") -> str:
    """The HTML text of a calibration's page."""
    with in_language(language):
        return _calibration_page(found)


def _calibration_page(found: CellResult) -> str:
    main = next(iter(found.train.values()), None)
    sections = [
        *scene_sections(cell_scene(found.cell, found.readings, found.nominal)),
        Section("readings", _("Errors of the readings"), drawings=_drawings(found.views), tables=[_view_table(found)]),
        Section("places", _("Where everything is located"), tables=_place_tables(found.placements)),
        *_sizes(found),
        *(_arm_section(name, own) for name, own in _by_arm(found)),
    ]
    if held := [in_words(of.direction) for of in found.unidentifiable]:
        lead = _("{directions}, held at the values in the file", directions=plural(len(held), "direction"))
        sections.append(Section("held", _("What no reading determines"), lead, notes=held, folded=True))
    if found.outliers:
        rows = ", ".join(map(str, found.outliers))
        text = _("Rows whose error the noise does not explain, counted from 0: {rows}.", rows=rows)
        sections.append(Section("outliers", _("Outliers"), text))
    if notes := [retold(note) for note in (*found.notes, found.held) if note]:
        sections.append(Section("notes", _("Notes"), notes=notes))
    tone, word = _TONES[found.status][0], _(_TONES[found.status][1])
    acts = (
        []
        if tone == "good"
        else [capitalised(parts_of_failure(found.message)[1] or _("Resolve the warnings, then calibrate again"))]
    )
    verdict = Verdict(tone, word, _headline(found), [], acts)
    if found.moved is not None:
        names = ", ".join(found.moved)
        told = _("{names} moved since the calibration.", names=names) if names else _("Nothing moved.")
        sections.insert(0, Section("moved", _("What may have moved"), told))
    tiles = [] if main is None else _tiles(found, main)
    drawn = gap_figures(found) if found.status == "converged" and found.moved is None else []
    return cell_page(
        found.cell,
        (_("Calibration of {cell}", cell=found.cell.name), _("Calibration of a cell"))
        if found.moved is None
        else (_("Update of {robot}", robot=found.cell.name), _("Update of a cell")),
        verdict,
        tiles,
        sections,
        drawings=drawn,
    )


def scene_sections(drawn: Figure | None) -> list[Section]:
    """The part of a page that shows the cell; none where nothing was drawn."""
    return [] if drawn is None else [Section("workspace", _("The cell"), drawings=[drawn])]


def cell_page(
    cell: cells.Cell,
    title: tuple[str, str],
    verdict: Verdict,
    tiles: Sequence[tuple[str, str, str]],
    sections: Sequence[Section],
    **verdict_box: Any,
) -> str:
    """The HTML text of a page of a cell, in the language of the caller; its title, and the line above that.

    `verdict_box`: steps, chips and drawings, as the macro of that name has them.
    """
    heading, eyebrow = title
    return page.render(
        "monitoring.html",
        title=heading,
        eyebrow=eyebrow,
        robot_name=cell.name,
        simulated=False,
        meta=[", ".join(arm.name for arm in cell.arms)],
        verdict=verdict,
        tiles=tiles,
        sections=sections,
        document=[(_("Software"), f"fastcal {fastcal.__version__}")],
        **verdict_box,
    )


def _headline(found: CellResult) -> str:
    if found.status != "converged":
        return f"{capitalised(ending(found.message))}."
    sizes = []
    for of in found.train.values():
        before, after = of.statistics
        if before is not None and after is not None:
            then, now = _size(of, before.rms), _size(of, after.rms)
            sizes.append(_("{kind} from {before} to {after}", kind=_(of.kind.plural), before=then, after=now))
    return _("RMS errors fell: {sizes}.", sizes="; ".join(sizes))


def _tiles(found: CellResult, main: KindErrors) -> list[tuple[str, str, str]]:
    after = main.statistics[1]
    tested = None if found.test is None else found.test.get(main.kind.name)
    on_test = None if tested is None else tested.statistics[1]
    noise = found.noise.get(main.kind.name)
    tiles = [(_("RMS error"), "" if after is None else _size(main, after.rms), _(main.kind.plural))]
    if on_test is not None:
        tiles.append((_("RMS on test poses"), _size(main, on_test.rms), plural(on_test.count, "reading")))
    if noise is not None:
        tiles.append((_("Noise"), noise_text(noise), _("of one number")))
    held = _("{count} held", count=len(found.unidentifiable))
    return [*tiles, (_("Parameters"), str(len(found.parameters)), held)]


def _size(of: KindErrors, value: float) -> str:
    return f"{significant(of.kind.shown(value), 3)} {unit_text(of.kind.unit)}"


def _view_table(found: CellResult) -> Table:
    """RMS before and after, and on the test poses, of each target, sensor and camera."""
    columns = [Column(title, numeric=False) for title in (_("Reading"), _("Target"), _("From"))]
    columns += [Column(title) for title in (_("Count"), _("RMS before"), _("RMS after"), _("Largest"))]
    if found.test_views:
        columns.append(Column(_("RMS on test poses")))
    rows = []
    for name, of in found.views.items():
        view = name.partition("@")[2]
        target, sensor = (*view.split(":", 1), "")[:2]
        tested = (found.test_views or {}).get(name)
        before, after = of.statistics
        on_test = None if tested is None else tested.statistics[1]
        sizes = [None if own is None else own.rms for own in (before, after)]
        sizes.append(None if after is None else after.max)
        if found.test_views:
            sizes.append(None if on_test is None else on_test.rms)
        rows.append(
            [
                Cell(f"{kind_title(of.kind)} ({unit_text(of.kind.unit)})"),
                Cell(target),
                Cell(sensor or _("world")),
                number_cell("" if after is None else str(after.count), None if after is None else float(after.count)),
                *(size_cell(None if size is None else of.kind.shown(size)) for size in sizes),
            ]
        )
    return Table(_("Errors of each target as each sensor reads it"), columns, [Group(rows)], is_sortable=len(rows) > 1)


def size_cell(value: float | None) -> Cell:
    """A number of a table; empty where it is not known."""
    return number_cell("" if value is None else significant(value, 4), value)


def _drawings(views: dict[str, KindErrors]) -> list[Figure]:
    """Of each kind the largest error of each row, a colour a view."""
    out = []
    for kind in {of.kind.name: of.kind for of in views.values()}.values():
        traces, key = [], []
        for k, (name, of) in enumerate((name, of) for name, of in views.items() if of.kind == kind):
            each = np.where(np.isnan(of.after), -1.0, of.after).max(axis=1)
            rows = np.flatnonzero(each >= 0)
            rows = rows[figures.spread_rows(len(rows), _MOST_POINTS)]
            colour, label = _COLOURS[k % len(_COLOURS)], name.partition("@")[2]
            sizes = np.array([kind.shown(size) for size in each[rows]])
            traces.append(
                figures.points(rows, sizes, colour, 6, hover=_("row %{{x}}: %{{y:.4g}} {unit}", unit=kind.unit))
            )
            key.append(Key(label, colour, "point"))
        drawn = figures.layout(
            _("row"), _("largest error ({unit})", unit=unit_text(kind.unit)), yaxis={"rangemode": "tozero"}
        )
        alt = _("Largest error of each row after calibration, {kind}, by target and sensor.", kind=_(kind.plural))
        title = _("Errors by row: {kind}", kind=_(kind.plural))
        out.append(Figure(f"errors-{kind.name}", title, alt, traces, drawn, key=key))
    return out


def _place_tables(places: Sequence[Placement]) -> list[Table]:
    """Where, and how turned: a table each, so that both have room on the page and on paper."""
    axes = [[f"{axis} (mm)" for axis in "xyz"], [f"{axis} (°)" for axis in ("rx", "ry", "rz")]]
    captions = [
        _("Position of each member on its frame, with the standard deviations of the identified values"),
        _("Orientation of each member on its frame"),
    ]
    out = []
    for k, (titles, caption) in enumerate(zip(axes, captions, strict=True)):
        words = (_("Member"), _("Kind"), _("Stands on")) if k == 0 else (_("Member"),)
        columns = [*(Column(title, numeric=False) for title in words), *map(Column, titles)]
        rows = []
        for of in places:
            values, stds = (of.xyz_mm, of.std_mm) if k == 0 else (of.rpy_deg, of.std_deg)
            own = [number_cell(_with(std, value), value) for value, std in zip(values, stds, strict=True)]
            named = [Cell(of.name), Cell(_(_MEMBERS[of.kind])), Cell(_(of.on))][: len(words)]
            rows.append([*named, *own])
        out.append(Table(caption, columns, [Group(rows)]))
    return out


def _with(std: float | None, value: float) -> str:
    if std is None or not np.isfinite(std):
        return fixed(value, 3)
    size, shown = with_uncertainty(std, value)
    return f"{shown} ± {size}"


def gap_of_kinds(
    steps: Sequence[Mapping[str, KindErrors]], noise: Mapping[str, float], *, on_test: bool
) -> list[Figure]:
    """A waterfall of each kind whose noise is known.

    Args:
        steps: Errors with places alone, with the geometry and, of a diagnosis, with what was found.
        noise: Of one number of each kind, SI.
        on_test: Are they of test poses?
    """
    names = (_("places alone"), _("the geometry of the arms"), _("the effects found"))
    out = []
    for name, last in steps[-1].items() if steps else []:
        sizes = [step[name].rms for step in steps if name in step]
        known = [(title, size) for title, size in zip(names, sizes, strict=False) if size is not None]
        if len(known) < len(steps) or name not in noise:
            continue
        floor = last.kind.shown(noise[name]) * last.width**0.5
        on = _("test poses") if on_test else _("fitted poses")
        drawn = waterfall(known, floor, on, last.kind.unit, first=names[0])
        title = f"{drawn.title}: {_(last.kind.plural)}"
        out.append(replace(drawn, id=f"gap-{name}", title=title))
    return out


def gap_figures(found: CellResult) -> list[Figure]:
    """Of each kind of reading the error with places alone, what the geometry takes of it, what remains, the noise."""
    judged = found.test or found.train
    before = {
        name: KindErrors(of.kind, of.numbers_before) for name, of in judged.items() if of.numbers_before is not None
    }
    noise = {name: of.value for name, of in found.noise.items()}
    return gap_of_kinds([before, judged] if before else [], noise, on_test=found.test is not None)


def _sizes(found: CellResult) -> list[Section]:
    """What the changes of the arms' numbers move, in one unit."""
    drawn = sizes_figure(moved_in_cell(found)) if found.status == "converged" and found.views else None
    return [] if drawn is None else [Section("parameters", _("Parameters"), drawings=[drawn])]


def _by_arm(found: CellResult) -> list[tuple[str, list[IdentifiedParameter]]]:
    """Parameters of each arm's joints and links."""
    own: dict[str, list[IdentifiedParameter]] = {arm.name: [] for arm in found.cell.arms}
    for parameter in found.parameters:
        place = places_of(parameter.owner)[0]
        if place.arm in own and place.kind in ("joint", "link"):
            own[place.arm].append(parameter)
    return [(name, parameters) for name, parameters in own.items() if parameters]


def _arm_section(name: str, parameters: Iterable[IdentifiedParameter]) -> Section:
    columns = [Column(title, numeric=False) for title in (_("Place"), _("Parameter"))]
    columns += [Column(title) for title in (_("Value"), _("Std"), _("Before"), _("Change"))]
    rows = []
    for of in parameters:
        numbers = (of.std, of.value, of.nominal, of.value - of.nominal)
        shown = zip(with_uncertainty(*numbers), numbers, strict=True)
        std, value, before, change = (number_cell(text, number) for text, number in shown)
        rows.append([Cell(in_words(of.owner)), Cell(of.name), value, std, before, change])
    table = Table(_("Identified numbers of {arm}", arm=name), columns, [Group(rows)])
    return Section(f"arm-{name}", _("Arm {name}", name=name), tables=[table], folded=True)
