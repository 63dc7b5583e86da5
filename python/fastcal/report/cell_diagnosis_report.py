# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a diagnosed cell of several arms; nothing is fitted here."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import fastcal
from fastcal.cells.diagnosis import CellDiagnosis, CellFinding, WayDiagnosis
from fastcal.cells.gap import FOUND, GEOMETRY, CellStep
from fastcal.diagnosis.words import cause_in_words, reason_text
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.tree_file import cell_text
from fastcal.report import diagnosis_figures, shop
from fastcal.report.cell_report import cell_page, gap_of_kinds, scene_sections, size_cell
from fastcal.report.cell_scene import cell_scene
from fastcal.report.diagnosis_report import write_diagnosis
from fastcal.report.diagnosis_steps import acts, is_advice, look
from fastcal.report.diagnosis_words import VERDICTS, spoken
from fastcal.report.figures import Figure
from fastcal.report.formatting import significant
from fastcal.report.kind_words import kind_title
from fastcal.report.language import _, in_language, retold
from fastcal.report.sections import Section
from fastcal.report.tables import Cell, Column, Group, Table, places_in_words, unit_text
from fastcal.report.words import Remark, Verdict, listed
from fastcal.said import said

DIAGNOSIS_FILES = ("model.yaml", "diagnosis.json", "report.html")
_STEPS = {None: said("Places alone"), GEOMETRY: said("Geometry"), FOUND: said("With the effects found")}
_WITHOUT_EFFECTS = 2  # steps of the gap: places alone, and the geometry
_CHIPS = 6  # causes beside the verdict
_MOST_WAYS = 4  # of which other causes are drawn


def write_cell_diagnosis(found: CellDiagnosis, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes model.yaml, diagnosis.json and report.html, all or none, and a folder with each way's own page."""
    for each in found.ways:
        write_diagnosis(each.found, Path(folder) / each.way.folder, language=language)
    with atomic_folder(folder, DIAGNOSIS_FILES) as place:
        write_json(place / "diagnosis.json", found.to_json_dict())
        text = cell_text(found.cell, f"{found.cell.name}, diagnosed by fastcal {fastcal.__version__}")
        write_text(place / "model.yaml", text)
        write_text(place / "report.html", diagnosis_page(found, language))


def diagnosis_page(found: CellDiagnosis, language: str = "en") -> str:
    """The HTML text of a diagnosis' page."""
    with in_language(language):
        return _diagnosis_page(found)


def _diagnosis_page(found: CellDiagnosis) -> str:
    word, tone = VERDICTS[found.verdict]
    if tone == "good" and any(of.finding.grade != "A" for of in found.effects):
        tone = "caution"
    sections = []
    if found.readings is not None:
        sections += scene_sections(cell_scene(found.cell, found.readings, found.gap[0].cell if found.gap else None))
    if found.effects:
        lead = _(
            "Owners are prefixed with their arm. A joint that several chains share is judged by the readings of each."
        )
        sections.append(Section("found", _("What is missing"), lead, tables=[_cause_table(found)]))
    sections.append(
        Section("ways", _("Readings taken"), tables=[_way_table(found.ways)], notes=[*map(_numbering, found.ways)])
    )
    if found.gap:
        sections.append(Section("gap", _("Errors of readings"), tables=[_gap_table(found.gap)]))
    if others := _other_causes(found):
        lead = _("What each cause explains alone, for each chain")
        sections.append(Section("ranking", _("Other causes"), lead, drawings=others, folded=True))
    if reasons := [line for of in found.effects for line in _reasons(found, of)]:
        sections.append(Section("reasons", _("Why no grade is better"), notes=reasons, folded=True))
    if found.notes:
        sections.append(Section("notes", _("Notes"), notes=[*map(retold, found.notes)]))
    verdict = Verdict(tone, _(word), _missing(found), _remarks(found.effects))
    tiles = [*_gap_tiles(found.gap)]
    tiles += [(each.way.name, _(VERDICTS[each.found.verdict][0]), _arms(each)) for each in found.ways]
    return cell_page(
        found.cell,
        (_("Diagnosis of {cell}", cell=found.cell.name), _("Diagnosis of a cell")),
        verdict,
        tiles,
        sections,
        steps=_steps(found),
        chips=[(of.finding.grade, _name(of), "found") for of in found.told[0][:_CHIPS]],
        drawings=gap_figures(found),
    )


def _name(of: CellFinding) -> str:
    """A cause in short words, its owner as the file writes it."""
    return _(cause_in_words(of.finding.effect, of.finding.owner)).partition(" (")[0]


def _steps(found: CellDiagnosis) -> list[str]:
    """What to do now, a sentence each."""
    if found.verdict == "none":
        return [_("Nothing has to be added: model.yaml is {what}.", what=_("the calibrated geometry"))]
    out = [
        f"{each.way.name}: {each.way.words(look(rest))}"
        for each in found.ways
        if (rest := each.found.unexplained) is not None
    ]
    if found.verdict == "one_of":
        of = found.effects[0].finding
        causes = [_(cause_in_words(*cause)) for cause in ((of.effect, of.owner), *of.equivalents)]
        out.append(_("Do not repair anything yet: {causes} fit these data equally well.", causes=listed(causes)))
    else:
        out += acts([of.finding for of in found.effects], undo=False)
    for each in found.ways:
        if is_advice(each.found.plan):
            told = _(
                "Measure the poses that tell causes apart: they are on the page of {target}.", target=each.way.name
            )
            out.append(told)
    return out


def gap_figures(found: CellDiagnosis) -> list[Figure]:
    """Of each kind of reading the error with places alone, what the geometry and what was found take, and the noise."""
    noise = {
        name: float(
            np.sqrt(np.mean([each.found.noise[name].value ** 2 for each in found.ways if name in each.found.noise]))
        )
        for name in {name for each in found.ways for name in each.found.noise}
    }
    steps = found.gap if found.effects else found.gap[:_WITHOUT_EFFECTS]
    kinds = [step.test or step.train for step in steps]
    return gap_of_kinds(kinds, noise, on_test=bool(found.gap) and found.gap[-1].test is not None)


def _other_causes(found: CellDiagnosis) -> list[Figure]:
    """Of each way the leading causes by what each explains alone."""
    out = []
    for k, each in enumerate(found.ways[:_MOST_WAYS]):
        drawn = diagnosis_figures.alternatives(each.found, each.way.words)
        if drawn is not None:
            title = f"{drawn.title}: {each.way.name}"
            out.append(replace(drawn, id=f"alternatives-{k}", title=title))
    return out


def _reasons(found: CellDiagnosis, of: CellFinding) -> list[str]:
    """Why the grade of a cause is not better."""
    way = next(each.way for each in found.ways if each.way.name == of.seen_by[0])
    out = [way.words(_(reason_text(because, spoken))) for because in of.finding.limits]
    out += [_(doubt) for doubt in of.doubts]
    return [f"{_name(of)}: {line}" for line in dict.fromkeys(out)]


def _gap_tiles(gap: Sequence[CellStep]) -> list[tuple[str, str, str]]:
    """Of each kind the RMS before and of the cell that is written, on the test where there is one."""
    out = []
    for kind, last in ({} if not gap else gap[-1].test or gap[-1].train).items():
        first = (gap[0].test or gap[0].train).get(kind)
        if first is None or first.rms is None or last.rms is None:
            continue
        unit = unit_text(last.kind.unit)
        was = _("was {before} {unit}", before=significant(first.rms, 3), unit=unit)
        title = _("RMS on test poses") if gap[-1].test else _("RMS error")
        out.append((title, f"{significant(last.rms, 3)} {unit}", f"{_(last.kind.plural)}, {was}"))
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
            rows.append([named, Cell(title), *(size_cell(size) for size in sizes)])
    return Table(
        _("RMS before, with the geometry of all arms, and of the cell that is written"), columns, [Group(rows)]
    )


def _missing(found: CellDiagnosis) -> str:
    """`found.sentence` in the language of the page."""
    listed, more = found.told
    named = [_("{cause} (grade {grade})", cause=_name(of), grade=of.finding.grade) for of in listed]
    named += [_("{count} more that are merely possible (grade C)", count=more)] if more else []
    rest = [
        _(
            "An unexplained error remains in the readings of {target}, most of it at {place}.",
            target=each.way.name,
            place=each.way.owner(each.found.unexplained.owner),
        )
        for each in found.ways
        if each.found.unexplained is not None
    ]
    if not named and not rest:
        return _("No missing effect is detectable above the noise of these readings.")
    return " ".join([*([f"{'; '.join(named)}."] if named else []), *rest])


def _remarks(effects: Sequence[CellFinding]) -> list[Remark]:
    return [
        Remark(
            _(
                "{cause}: not in the readings of {targets}",
                cause=_name(of),
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


def _cause_table(found: CellDiagnosis) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Grade"), _("Cause"), _("Size"))]
    has_others = any(of.finding.equivalents for of in found.effects)
    columns += [Column(title, numeric=False) for title in (*([_("As well")] if has_others else []), _("Seen by"))]
    rows = []
    for of in found.effects:
        f = of.finding
        sizes = "; ".join(f"{name} {text}" for name, text in shop.estimate_lines(f.effect, f.parameters))
        others = "; ".join(_(cause_in_words(effect, owner)) for effect, owner in f.equivalents)
        cause = _(cause_in_words(f.effect, f.owner))
        as_well = [Cell(others)] if has_others else []
        rows.append([Cell(f.grade), Cell(cause), Cell(sizes), *as_well, Cell(", ".join(of.seen_by))])
    return Table(_("Causes that the readings indicate"), columns, [Group(rows)])


def _numbering(each: WayDiagnosis) -> str:
    """What a way's own page calls its joints."""
    listed = ", ".join(
        f"{k}\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{places_in_words(joint)}"
        for k, joint in enumerate(each.joints, start=1)
    )
    return _("{target}: joints on its own page are {joints}", target=each.way.name, joints=listed)


def _way_table(ways: Sequence[WayDiagnosis]) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Target"), _("Arms"), _("Found"))]
    columns += [Column(title) for title in (_("RMS, geometry alone"), _("RMS, with all"), _("Noise alone"))]
    columns += [Column(title, numeric=False) for title in (_("Unit"), _("Page"))]
    rows = []
    for each in ways:
        gap = each.found.judged_gap
        rows.append(
            [
                Cell(each.way.name),
                Cell(_arms(each)),
                Cell(_(VERDICTS[each.found.verdict][0])),
                *(size_cell(size) for size in (gap.sizes[0], gap.sizes[-1], gap.floor)),
                Cell(unit_text(gap.unit)),
                Cell(_("its own page"), link=f"{each.way.folder}/report.html"),
            ]
        )
    caption = _("Each chain from a sensor to its target, judged on held-out poses")
    return Table(caption, columns, [Group(rows)])
