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
from fastcal.cells.diagnose import CellDiagnosis, CellFinding, WayDiagnosis
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
from fastcal.report.sections import Section
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, number_cell, spaced, unit_text
from fastcal.report.words import Remark, Verdict

CALIBRATION_FILES = ("model.yaml", "result.json", "report.html")
DIAGNOSIS_FILES = ("model.yaml", "diagnosis.json", "report.html")
_COLOURS = ("#1f6fb4", "#c2571a", "#2b8a57", "#8a4fa0", "#937b10", "#4d5965")  # of views, in turn
_MOST_POINTS = 2000  # that a figure draws of one view
_TONES = {"converged": "good", "not_converged": "bad", "too_few_equations": "bad"}


def write_cell_calibration(found: CellResult, folder: str | os.PathLike[str]) -> None:
    """Writes result.json, report.html and, where something was identified, model.yaml, all or none."""
    with atomic_folder(folder, CALIBRATION_FILES) as place:
        write_json(place / "result.json", found.to_json_dict())
        if found.parameters:
            text = cell_text(found.cell, f"{found.cell.name}, identified by fastcal {fastcal.__version__}")
            write_text(place / "model.yaml", text)
        write_text(place / "report.html", calibration_page(found))


def write_cell_diagnosis(found: CellDiagnosis, folder: str | os.PathLike[str]) -> None:
    """Writes model.yaml, diagnosis.json and report.html, all or none, and a folder with each way's own page."""
    for each in found.ways:
        write_diagnosis(each.found, Path(folder) / each.way.name)
    with atomic_folder(folder, DIAGNOSIS_FILES) as place:
        write_json(place / "diagnosis.json", found.to_json_dict())
        text = cell_text(found.cell, f"{found.cell.name}, diagnosed by fastcal {fastcal.__version__}")
        write_text(place / "model.yaml", text)
        write_text(place / "report.html", diagnosis_page(found))


def calibration_page(found: CellResult) -> str:
    """The HTML text of a calibration's page."""
    main = next(iter(found.train.values()), None)
    sections = [
        Section("readings", "Errors of what was read", drawings=_drawings(found.views), tables=[_view_table(found)]),
        Section("places", "Where everything stands", tables=[_place_table(found.placements)]),
        *(_arm_section(name, own) for name, own in _by_arm(found)),
    ]
    if held := [spaced(of.direction) for of in found.unidentifiable]:
        lead = f"{len(held)} directions, held where the file has them"
        sections.append(Section("held", "What no reading shows", lead, notes=held, folded=True))
    if found.outliers:
        rows = ", ".join(map(str, found.outliers))
        text = f"Rows whose error the noise does not explain, counted from 0: {rows}."
        sections.append(Section("outliers", "Outliers", text))
    if notes := [*found.notes, *([found.held] if found.held else [])]:
        sections.append(Section("notes", "Notes", notes=notes))
    tone, word = _TONES.get(found.status, "caution"), capitalised(found.status.replace("_", " "))
    verdict = Verdict(tone, word, _headline(found), [])
    tiles = [] if main is None else _tiles(found, main)
    return cell_page(found.cell, ("Calibration", "Calibration of a cell"), verdict, tiles, sections)


def cell_page(
    cell: cells.Cell,
    title: tuple[str, str],
    verdict: Verdict,
    tiles: Sequence[tuple[str, str, str]],
    sections: Sequence[Section],
) -> str:
    """The HTML text of a page of a cell; the title is what was done, and the line above it."""
    what, eyebrow = title
    return page.render(
        "monitoring.html",
        title=f"{what} of {cell.name}",
        eyebrow=eyebrow,
        robot_name=cell.name,
        simulated=False,
        meta=[", ".join(arm.name for arm in cell.arms)],
        verdict=verdict,
        tiles=tiles,
        sections=sections,
        document=[("Software", f"fastcal {fastcal.__version__}")],
    )


def _headline(found: CellResult) -> str:
    if found.status != "converged":
        return f"{capitalised(found.message)}."
    sizes = []
    for of in found.train.values():
        before, after = of.statistics
        if before is not None and after is not None:
            sizes.append(f"{of.kind.plural} from {_size(of, before.rms)} to {_size(of, after.rms)}")
    return f"RMS errors fell: {'; '.join(sizes)}."


def _tiles(found: CellResult, main: KindErrors) -> list[tuple[str, str, str]]:
    after = main.statistics[1]
    tested = None if found.test is None else found.test.get(main.kind.name)
    on_test = None if tested is None else tested.statistics[1]
    noise = found.noise.get(main.kind.name)
    tiles = [("RMS error", "" if after is None else _size(main, after.rms), f"of {main.kind.plural}")]
    if on_test is not None:
        tiles.append(("RMS on test poses", _size(main, on_test.rms), plural(on_test.count, "reading")))
    if noise is not None:
        tiles.append(("Noise", str(noise), "of one number"))
    return [*tiles, ("Parameters", str(len(found.parameters)), f"{len(found.unidentifiable)} held")]


def _size(of: KindErrors, value: float) -> str:
    return f"{significant(of.kind.shown(value), 3)} {unit_text(of.kind.unit)}"


def _view_table(found: CellResult) -> Table:
    """RMS before and after, and on the test poses, of each target, sensor and camera."""
    columns = [Column("Reading", numeric=False), Column("Target", numeric=False), Column("From", numeric=False)]
    columns += [Column(title) for title in ("Count", "RMS before", "RMS after", "Largest", "RMS on test poses")]
    rows = []
    for name, of in found.views.items():
        kind, _, view = name.partition("@")
        target, _, sensor = view.partition(":")
        tested = (found.test_views or {}).get(name)
        before, after = of.statistics
        on_test = None if tested is None else tested.statistics[1]
        sizes = [None if own is None else own.rms for own in (before, after)]
        sizes += [None if after is None else after.max, None if on_test is None else on_test.rms]
        rows.append(
            [
                Cell(f"{kind} ({unit_text(of.kind.unit)})"),
                Cell(target),
                Cell(sensor or "world"),
                number_cell("" if after is None else str(after.count), None if after is None else float(after.count)),
                *(_number(None if size is None else of.kind.shown(size)) for size in sizes),
            ]
        )
    return Table("Errors of each target as each sensor reads it", columns, [Group(rows)], is_sortable=len(rows) > 1)


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
            traces.append(figures.points(rows, sizes, colour, 6, hover=f"row %{{x}}: %{{y:.4g}} {kind.unit}"))
            key.append(Key(label, colour, "point"))
        drawn = figures.layout("row", f"largest error ({unit_text(kind.unit)})", yaxis={"rangemode": "tozero"})
        alt = f"Largest error of each row after calibration, {kind.plural}, by target and sensor."
        out.append(Figure(f"errors-{kind.name}", f"Errors of {kind.plural} by row", alt, traces, drawn, key=key))
    return out


def _place_table(places: Sequence[Placement]) -> Table:
    columns = [Column(title, numeric=False) for title in ("Member", "Kind", "Stands on")]
    columns += [Column(f"{axis} (mm)") for axis in "xyz"] + [Column(f"{axis} (°)") for axis in ("rx", "ry", "rz")]
    rows = []
    for of in places:
        cells = [
            number_cell(_with(std, value), value)
            for value, std in zip((*of.xyz_mm, *of.rpy_deg), (*of.std_mm, *of.std_deg), strict=True)
        ]
        rows.append([Cell(of.name), Cell(of.kind), Cell(of.on), *cells])
    caption = "Where each member stands, with the standard deviation of what was identified, along and about its axes"
    return Table(caption, columns, [Group(rows)])


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
    columns = [Column(title, numeric=False) for title in ("Place", "Parameter")]
    columns += [Column(title) for title in ("Value", "Std", "Before", "Change")]
    rows = []
    for of in parameters:
        numbers = (of.std, of.value, of.nominal, of.value - of.nominal)
        shown = zip(with_uncertainty(*numbers), numbers, strict=True)
        std, value, before, change = (number_cell(text, number) for text, number in shown)
        rows.append([Cell(spaced(of.owner)), Cell(of.name), value, std, before, change])
    table = Table(f"Identified numbers of {name}", columns, [Group(rows)])
    return Section(f"arm-{name}", f"Arm {name}", tables=[table], folded=True)


def diagnosis_page(found: CellDiagnosis) -> str:
    """The HTML text of a diagnosis' page."""
    word, tone = VERDICTS[found.verdict]
    sections = [Section("ways", "What was read", tables=[_way_table(found.ways)], notes=[*map(_numbering, found.ways)])]
    if found.effects:
        lead = "Owners carry their arm. A joint that several ways have in common is judged by the readings of each."
        notes = [f"{of.finding.label}: {reason}" for of in found.effects for reason in of.reasons]
        sections.insert(0, Section("found", "What is missing", lead, tables=[_cause_table(found.effects)], notes=notes))
    if found.notes:
        sections.append(Section("notes", "Notes", notes=found.notes))
    verdict = Verdict(tone, word, found.sentence, _remarks(found.effects))
    tiles = [(each.way.name, VERDICTS[each.found.verdict][0], _arms(each)) for each in found.ways]
    return cell_page(found.cell, ("Diagnosis", "Diagnosis of a cell"), verdict, tiles, sections)


def _remarks(effects: Sequence[CellFinding]) -> list[Remark]:
    return [
        Remark(f"{of.finding.label}: not in the readings of {', '.join(of.not_seen_by)}", True, "found")
        for of in effects
        if of.not_seen_by
    ]


def _arms(each: WayDiagnosis) -> str:
    return " + ".join(arm.name for arm in each.way.arms)


def _cause_table(effects: Sequence[CellFinding]) -> Table:
    columns = [Column(title, numeric=False) for title in ("Grade", "Cause", "Size", "As well", "Seen by")]
    rows = []
    for of in effects:
        f = of.finding
        sizes = "; ".join(
            f"{name} {value.value:.4g}" + (f" ± {value.std:.2g}" if value.std else "")
            for name, value in f.parameters.items()
        )
        others = "; ".join(cause_in_words(effect, owner) for effect, owner in f.equivalents)
        rows.append(
            [
                Cell(f.grade),
                Cell(cause_in_words(f.effect, f.owner)),
                Cell(sizes),
                Cell(others),
                Cell(", ".join(of.seen_by)),
            ]
        )
    return Table("Causes that the readings ask for", columns, [Group(rows)])


def _numbering(each: WayDiagnosis) -> str:
    """What a way's own page calls its joints."""
    listed = ", ".join(f"{k} is {joint}" for k, joint in enumerate(each.joints, start=1))
    return f"{each.way.name}: joint {listed} on its own page"


def _way_table(ways: Sequence[WayDiagnosis]) -> Table:
    columns = [Column(title, numeric=False) for title in ("Target", "Arms", "Found")]
    columns += [Column(title) for title in ("RMS, geometry alone", "RMS, with all", "Noise makes")]
    columns.append(Column("Unit", numeric=False))
    columns.append(Column("Page", numeric=False))
    rows = []
    for each in ways:
        gap = each.found.judged_gap
        rows.append(
            [
                Cell(each.way.name),
                Cell(_arms(each)),
                Cell(VERDICTS[each.found.verdict][0]),
                *(_number(size) for size in (gap.sizes[0], gap.sizes[-1], gap.floor)),
                Cell(unit_text(gap.unit)),
                Cell("its own page", link=f"{each.way.name}/report.html"),
            ]
        )
    return Table("Each way from the world to a target, judged on poses that were held out", columns, [Group(rows)])
