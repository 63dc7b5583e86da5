# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of cells of several arms, calibrated and diagnosed; nothing is fitted here."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

import fastcal
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.result import IdentifiedParameter
from fastcal.cells import cell as cells
from fastcal.cells.calibrate import CellResult
from fastcal.cells.diagnosis import CellDiagnosis, CellFinding, WayDiagnosis
from fastcal.cells.gap import FOUND, GEOMETRY, CellStep
from fastcal.cells.placements import Placement
from fastcal.diagnosis.words import cause_in_words
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.tree_file import cell_text
from fastcal.place import place_of
from fastcal.report import figures, page
from fastcal.report.diagnosis_report import write_diagnosis
from fastcal.report.diagnosis_words import VERDICTS
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import fixed, plural, significant, with_uncertainty
from fastcal.report.kind_words import kind_title, noise_text
from fastcal.report.language import _, in_language
from fastcal.report.sections import Section
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, number_cell, spaced, unit_text
from fastcal.report.words import Remark, Verdict
from fastcal.said import said

CALIBRATION_FILES = ("model.yaml", "result.json", "report.html")
DIAGNOSIS_FILES = ("model.yaml", "diagnosis.json", "report.html")
_COLOURS = ("#1f6fb4", "#c2571a", "#2b8a57", "#8a4fa0", "#937b10", "#4d5965")  # of views, in turn
_MEMBERS = {
    "arm": said("arm"),
    "target": said("target"),
    "sensor": said("sensor"),
    "camera": said("camera"),
    "board": said("board"),
}
_MOST_POINTS = 2000  # that a figure draws of one view
_STEPS = {None: said("Places alone"), GEOMETRY: said("Geometry"), FOUND: said("With what was found")}
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


def write_cell_diagnosis(found: CellDiagnosis, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes model.yaml, diagnosis.json and report.html, all or none, and a folder with each way's own page."""
    for each in found.ways:
        write_diagnosis(each.found, Path(folder) / each.way.folder, language=language)
    with atomic_folder(folder, DIAGNOSIS_FILES) as place:
        write_json(place / "diagnosis.json", found.to_json_dict())
        text = cell_text(found.cell, f"{found.cell.name}, diagnosed by fastcal {fastcal.__version__}")
        write_text(place / "model.yaml", text)
        write_text(place / "report.html", diagnosis_page(found, language))


def calibration_page(found: CellResult, language: str = "en") -> str:
    """The HTML text of a calibration's page."""
    with in_language(language):
        return _calibration_page(found)


def _calibration_page(found: CellResult) -> str:
    main = next(iter(found.train.values()), None)
    sections = [
        Section("readings", _("Errors of what was read"), drawings=_drawings(found.views), tables=[_view_table(found)]),
        Section("places", _("Where everything stands"), tables=_place_tables(found.placements)),
        *(_arm_section(name, own) for name, own in _by_arm(found)),
    ]
    if held := [spaced(of.direction) for of in found.unidentifiable]:
        lead = _("{count} directions, held where the file has them", count=len(held))
        sections.append(Section("held", _("What no reading shows"), lead, notes=held, folded=True))
    if found.outliers:
        rows = ", ".join(map(str, found.outliers))
        text = _("Rows whose error the noise does not explain, counted from 0: {rows}.", rows=rows)
        sections.append(Section("outliers", _("Outliers"), text))
    if notes := [*found.notes, *([found.held] if found.held else [])]:
        sections.append(Section("notes", _("Notes"), notes=notes))
    tone, word = _TONES[found.status][0], _(_TONES[found.status][1])
    verdict = Verdict(tone, word, _headline(found), [])
    if found.moved is not None:
        names = ", ".join(found.moved)
        told = _("{names} moved since the calibration.", names=names) if names else _("Nothing moved.")
        sections.insert(0, Section("moved", _("What may have moved"), told))
    tiles = [] if main is None else _tiles(found, main)
    return cell_page(
        found.cell,
        (_("Calibration of {cell}", cell=found.cell.name), _("Calibration of a cell"))
        if found.moved is None
        else (_("Update of {robot}", robot=found.cell.name), _("Update of a cell")),
        verdict,
        tiles,
        sections,
    )


def cell_page(
    cell: cells.Cell,
    title: tuple[str, str],
    verdict: Verdict,
    tiles: Sequence[tuple[str, str, str]],
    sections: Sequence[Section],
) -> str:
    """The HTML text of a page of a cell, in the language of the caller; its title, and the line above that."""
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
    )


def _headline(found: CellResult) -> str:
    if found.status != "converged":
        return f"{capitalised(found.message)}."
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
    columns.append(Column(_("RMS on test poses")))
    rows = []
    for name, of in found.views.items():
        view = name.partition("@")[2]
        target, sensor = (*view.split(":", 1), "")[:2]
        tested = (found.test_views or {}).get(name)
        before, after = of.statistics
        on_test = None if tested is None else tested.statistics[1]
        sizes = [None if own is None else own.rms for own in (before, after)]
        sizes += [None if after is None else after.max, None if on_test is None else on_test.rms]
        rows.append(
            [
                Cell(f"{kind_title(of.kind)} ({unit_text(of.kind.unit)})"),
                Cell(target),
                Cell(sensor or _("world")),
                number_cell("" if after is None else str(after.count), None if after is None else float(after.count)),
                *(_number(None if size is None else of.kind.shown(size)) for size in sizes),
            ]
        )
    return Table(_("Errors of each target as each sensor reads it"), columns, [Group(rows)], is_sortable=len(rows) > 1)


def _number(value: float | None) -> Cell:
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
        _("Where each member stands on its frame, with the standard deviation of what was identified"),
        _("How each member is turned there"),
    ]
    out = []
    for k, (titles, caption) in enumerate(zip(axes, captions, strict=True)):
        words = (_("Member"), _("Kind"), _("Stands on")) if k == 0 else (_("Member"),)
        columns = [*(Column(title, numeric=False) for title in words), *map(Column, titles)]
        rows = []
        for of in places:
            values, stds = (of.xyz_mm, of.std_mm) if k == 0 else (of.rpy_deg, of.std_deg)
            own = [number_cell(_with(std, value), value) for value, std in zip(values, stds, strict=True)]
            named = [Cell(of.name), Cell(_(_MEMBERS[of.kind])), Cell(of.on)][: len(words)]
            rows.append([*named, *own])
        out.append(Table(caption, columns, [Group(rows)]))
    return out


def _with(std: float | None, value: float) -> str:
    if std is None or not np.isfinite(std):
        return fixed(value, 3)
    size, shown = with_uncertainty(std, value)
    return f"{shown} ± {size}"


def _by_arm(found: CellResult) -> list[tuple[str, list[IdentifiedParameter]]]:
    """Parameters of each arm's joints and links."""
    own: dict[str, list[IdentifiedParameter]] = {arm.name: [] for arm in found.cell.arms}
    for parameter in found.parameters:
        place = place_of(parameter.owner)
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
        rows.append([Cell(spaced(of.owner)), Cell(of.name), value, std, before, change])
    table = Table(_("Identified numbers of {arm}", arm=name), columns, [Group(rows)])
    return Section(f"arm-{name}", _("Arm {name}", name=name), tables=[table], folded=True)


def diagnosis_page(found: CellDiagnosis, language: str = "en") -> str:
    """The HTML text of a diagnosis' page."""
    with in_language(language):
        return _diagnosis_page(found)


def _diagnosis_page(found: CellDiagnosis) -> str:
    word, tone = VERDICTS[found.verdict]
    sections = [
        Section("ways", _("What was read"), tables=[_way_table(found.ways)], notes=[*map(_numbering, found.ways)])
    ]
    if found.effects:
        lead = _("Owners carry their arm. A joint that several ways have in common is judged by the readings of each.")
        reasons = [f"{of.finding.label}: {reason}" for of in found.effects for reason in of.reasons]
        sections.insert(0, Section("found", _("What is missing"), lead, tables=[_cause_table(found.effects)]))
        if reasons:
            sections.append(Section("reasons", _("Why no grade is better"), notes=reasons, folded=True))
    if found.gap:
        sections.insert(0, Section("gap", _("How far readings are off"), tables=[_gap_table(found.gap)]))
    if found.notes:
        sections.append(Section("notes", _("Notes"), notes=found.notes))
    verdict = Verdict(tone, _(word), _missing(found), _remarks(found.effects))
    tiles = [*_gap_tiles(found.gap)]
    tiles += [(each.way.name, _(VERDICTS[each.found.verdict][0]), _arms(each)) for each in found.ways]
    return cell_page(
        found.cell, (_("Diagnosis of {cell}", cell=found.cell.name), _("Diagnosis of a cell")), verdict, tiles, sections
    )


def _gap_tiles(gap: Sequence[CellStep]) -> list[tuple[str, str, str]]:
    """Of each kind the RMS before and of the cell that is written, on the test where there is one."""
    out = []
    for kind, last in ({} if not gap else gap[-1].test or gap[-1].train).items():
        first = (gap[0].test or gap[0].train).get(kind)
        if first is None or first.rms is None or last.rms is None:
            continue
        size = f"{significant(first.rms, 3)} → {significant(last.rms, 3)} {unit_text(last.kind.unit)}"
        out.append((_("RMS on test poses") if gap[-1].test else _("RMS error"), size, _(last.kind.plural)))
    return out


def _gap_table(gap: Sequence[CellStep]) -> Table:
    """RMS of each kind at each step, of the fitted postures and of the test."""
    columns = [Column(_("Reading"), numeric=False), Column(_("Of"), numeric=False)]
    columns += [Column(_(_STEPS[step.added])) for step in gap]
    rows = []
    for title, kinds in ((_("fitted postures"), [s.train for s in gap]), (_("test postures"), [s.test for s in gap])):
        for kind, of in (kinds[-1] or {}).items():
            sizes = [None if step is None or kind not in step else step[kind].rms for step in kinds]
            named = Cell(f"{kind_title(of.kind)} ({unit_text(of.kind.unit)})")
            rows.append([named, Cell(title), *(_number(size) for size in sizes)])
    return Table(
        _("RMS before, with the geometry of all arms, and of the cell that is written"), columns, [Group(rows)]
    )


def _missing(found: CellDiagnosis) -> str:
    """`found.sentence` in the language of the page."""
    listed, more = found.told
    named = [_("{cause} (grade {grade})", cause=of.finding.label, grade=of.finding.grade) for of in listed]
    named += [_("{count} more that are no more than possible (grade C)", count=more)] if more else []
    rest = [
        _(
            "Something remains in what was read of {target}, most of it at {place}.",
            target=each.way.name,
            place=each.way.owner(each.found.unexplained.owner),
        )
        for each in found.ways
        if each.found.unexplained is not None
    ]
    if not named and not rest:
        return _("Nothing is missing that these readings could show above their noise.")
    return " ".join([*([_("Missing: {causes}.", causes=", ".join(named))] if named else []), *rest])


def _remarks(effects: Sequence[CellFinding]) -> list[Remark]:
    return [
        Remark(
            _(
                "{cause}: not in the readings of {targets}",
                cause=of.finding.label,
                targets=", ".join(of.not_seen_by),
            ),
            True,
            "found",
        )
        for of in effects
        if of.not_seen_by
    ]


def _arms(each: WayDiagnosis) -> str:
    return " + ".join(arm.name for arm in each.way.arms)


def _cause_table(effects: Sequence[CellFinding]) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Grade"), _("Cause"), _("Size"))]
    columns += [Column(title, numeric=False) for title in (_("As well"), _("Seen by"))]
    rows = []
    for of in effects:
        f = of.finding
        sizes = "; ".join(
            f"{name} {value.value:.4g}" + (f" ± {value.std:.2g}" if value.std else "")
            for name, value in f.parameters.items()
        )
        others = "; ".join(_(cause_in_words(effect, owner)) for effect, owner in f.equivalents)
        rows.append(
            [
                Cell(f.grade),
                Cell(_(cause_in_words(f.effect, f.owner))),
                Cell(sizes),
                Cell(others),
                Cell(", ".join(of.seen_by)),
            ]
        )
    return Table(_("Causes that the readings ask for"), columns, [Group(rows)])


def _numbering(each: WayDiagnosis) -> str:
    """What a way's own page calls its joints."""
    listed = ", ".join(f"{k} = {joint}" for k, joint in enumerate(each.joints, start=1))
    return _("{target}: joints on its own page are {joints}", target=each.way.name, joints=listed)


def _way_table(ways: Sequence[WayDiagnosis]) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Target"), _("Arms"), _("Found"))]
    columns += [Column(title) for title in (_("RMS, geometry alone"), _("RMS, with all"), _("Noise makes"))]
    columns += [Column(title, numeric=False) for title in (_("Unit"), _("Page"))]
    rows = []
    for each in ways:
        gap = each.found.judged_gap
        rows.append(
            [
                Cell(each.way.name),
                Cell(_arms(each)),
                Cell(_(VERDICTS[each.found.verdict][0])),
                *(_number(size) for size in (gap.sizes[0], gap.sizes[-1], gap.floor)),
                Cell(unit_text(gap.unit)),
                Cell(_("its own page"), link=f"{each.way.folder}/report.html"),
            ]
        )
    caption = _("Each way from what reads to what is read, judged on poses that were held out")
    return Table(caption, columns, [Group(rows)])
