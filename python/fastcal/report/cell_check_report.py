# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of checks of cells: of several arms, and by pictures; nothing is fitted here."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

import fastcal
from fastcal.calibration.evaluation import Evaluation
from fastcal.cells.check import CellCheck, WayCheck
from fastcal.cells.next_postures import posture_json
from fastcal.cells.whole_check import WholeCheck
from fastcal.io.atomic import write_text
from fastcal.io.results import write_json
from fastcal.monitoring.picture_check import Moved, PictureCheck
from fastcal.monitoring.words import spoken
from fastcal.report import figures, page
from fastcal.report.arm import checked_arm, joined_arms
from fastcal.report.cell_report import cell_page, scene_sections
from fastcal.report.cell_scene import ARMS, cell_scene, pictures_scene
from fastcal.report.check_report import check_act, check_reasons, check_sentence
from fastcal.report.formatting import fixed, plural, significant
from fastcal.report.language import _, in_language, retold
from fastcal.report.sections import TONES, Section, p_text, printed, state_word, translated
from fastcal.report.tables import (
    Cell,
    Column,
    Group,
    Table,
    capitalised,
    in_words,
    number_cell,
    places_in_words,
    unit_text,
)
from fastcal.report.words import Remark, Verdict, listed
from fastcal.report.workspace import scene
from fastcal.robot.robot import Robot


def write_cell_check(found: CellCheck, path: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes check.json, or the page where the path ends in .html; whole or not at all."""
    if Path(path).suffix.lower() in (".html", ".htm"):
        write_text(path, check_page(found, language))
    else:
        write_json(path, found.to_json_dict())


def check_page(found: CellCheck, language: str = "en") -> str:
    """The HTML text of the page."""
    with in_language(language):
        return _check_page(found)


def _check_page(found: CellCheck) -> str:
    state = "changed" if found.within_tolerance is False else found.verdict
    notes = [_of_way(each, reason) for each in found.ways for reason in check_reasons(each.found)]
    sections = [
        *scene_sections(_scene(found)),
        Section("ways", _("Readings taken"), tables=[_way_table(found)], notes=notes),
    ]
    if any(each.found.causes for each in found.ways):
        sections.append(Section("causes", _("What explains it"), tables=[_cause_table(found)]))
    told = {each.way.name: _of_way(each, check_sentence(each.found)) for each in found.ways}
    acts = [(each, act) for each in found.ways if each.state != "holds" and (act := check_act(each.found))]
    remarks = [Remark(_of_way(each, act), True, "ways") for each, act in acts]
    remarks += [Remark(told[each.way.name], False, "ways") for each in found.ways if each.state == "holds"]
    other = [told[each.way.name] for each in found.ways if each.state != "holds"]
    headline = " ".join(other) or _(
        "The cell's model still holds: the readings of each target agree with it to within the noise."
    )
    verdict = Verdict(TONES[state], capitalised(state_word(state)), headline, remarks)
    tiles = [_tile(each) for each in found.ways]
    return cell_page(
        found.cell,
        (_("Check of {robot}", robot=found.cell.name), _("Does the calibration still hold?")),
        verdict,
        tiles,
        sections,
    )


def _of_way(each: WayCheck, text: str) -> str:
    """What is said of a way's own arm, with the cell's names."""
    return f"{each.way.name}: {places_in_words(each.way.words(text))}"


def _scene(found: CellCheck) -> figures.Figure | None:
    """The arms of all ways, each where its own readings say that its base is now, and the errors."""
    parts, key = [], []
    for k, each in enumerate(found.ways):
        if (seen := checked_arm(each.found, beside=False)) is not None:
            positions, errors, arm = seen
            colour = ARMS[k % len(ARMS)]
            own = [(of, index) for of, index in each.way.joints if of in each.way.arms]
            joints = [f"{of.name} {_('joint {number}', number=index + 1)}" for of, index in own]
            runs = [replace(run, colour=colour) for run in arm.runs]
            parts.append((positions, errors, replace(arm, names=joints, runs=runs)))
            key.append(figures.Key(each.way.name, colour, "solid"))
    if not parts:
        return None
    positions, errors, arm, of = joined_arms(parts)
    told = _("Each arrow goes from where a target was measured towards where it is predicted.")
    title = _("The cell, and the errors in it")
    drawn = scene(positions, errors, None, None, _("the measuring frame"), arm, told=told, title=title, of=of)
    return replace(drawn, key=key if len(key) > 1 else [])


def _tile(each: WayCheck) -> tuple[str, str, str]:
    return each.way.name, capitalised(state_word(each.state)), plural(len(each.found.data), "pose")


def _way_table(found: CellCheck) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Target"), _("Arms"), _("State"), _("Unit"))]
    columns += [Column(title) for title in (_("RMS"), _("Expected"), _("Largest"))]
    rows = []
    for each in found.ways:
        kind, of = each.found.main.kind, each.found
        sizes = [kind.shown(size) for size in (of.rms, of.expected_rms, of.largest)]
        arms = " + ".join(arm.name for arm in each.way.arms)
        words = [Cell(each.way.name), Cell(arms), Cell(state_word(each.state)), Cell(unit_text(kind.unit))]
        rows.append([*words, *(number_cell(significant(size, 4), size) for size in sizes)])
    return Table(_("Each chain from the world to a target"), columns, [Group(rows)])


def _cause_table(found: CellCheck) -> Table:
    has_others = any(cause.equivalents for each in found.ways for cause in each.found.causes)
    titles = (_("Target"), _("Cause"), _("Change"), *([_("As well")] if has_others else []))
    columns = [Column(title, numeric=False) for title in titles]
    rows = []
    for each in found.ways:
        for cause in each.found.causes:
            sizes = printed("; ".join(f"{of.name} {of.change:+.4g} +- {of.std:.2g}" for of in cause.changes))
            causes = (each.way.words(spoken(of, translated)) for of in (cause.label, *cause.equivalents))
            label, *others = map(places_in_words, causes)
            label = each.way.name if cause.label == "tool" else label
            as_well = [Cell(", ".join(others))] if has_others else []
            rows.append([Cell(each.way.name), Cell(label), Cell(sizes), *as_well])
    return Table(_("Causes that explain the new readings"), columns, [Group(rows)])


def write_whole_check(found: WholeCheck, path: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes check.json, or the page where the path ends in .html; whole or not at all."""
    if Path(path).suffix.lower() in (".html", ".htm"):
        with in_language(language):
            write_text(path, _whole_page(found))
    else:
        write_json(path, found.to_json_dict())


def _whole_page(found: WholeCheck) -> str:
    state = "changed" if found.within is False else found.verdict
    notes = [*map(retold, found.notes)]
    if found.blind:
        blind = ", ".join(in_words(name) for name in found.blind)
        notes.append(_("These readings do not show whether this moved: {what}.", what=blind))
    sections = scene_sections(cell_scene(found.there, found.readings))
    sections.append(Section("kinds", _("Readings taken"), tables=[_kind_table(found)], notes=notes))
    if found.moved:
        sections.append(Section("causes", _("What explains it"), tables=[_member_table(found)]))
    if len(found.next):
        lead = _("These poses decide it.")
        sections.append(Section("next", _("What to measure next"), lead, tables=[_next_table(found)]))
    tiles = [(_("Poses"), str(found.postures), ""), (_("Chance"), p_text(found.p_value), _("of residuals this large"))]
    title = (_("Check of {robot}", robot=found.cell.name), _("Does the calibration still hold?"))
    acts = [] if TONES[state] == "good" else [_act(found)]
    verdict = Verdict(TONES[state], capitalised(state_word(state)), _(found.sentence), [], acts)
    return cell_page(found.cell, title, verdict, tiles, sections)


def _act(found: WholeCheck) -> str:
    """What to do where the cell may have changed."""
    if len(found.next):
        return _("Measure the poses listed below and check again with all rows.")
    if found.moved:
        what = listed([in_words(of.label) for of in found.moved])
        return _("Check {what}, then adopt the change with `fastcal update`, or calibrate again.", what=what)
    return _("Calibrate the cell again: no single move explains the readings.")


def _kind_table(found: WholeCheck) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Kind"), _("Unit"))]
    columns += [Column(title) for title in (_("Count"), _("RMS"), _("Expected"), _("Largest"), _("Noise"))]
    rows = []
    for name, of in found.kinds.items():
        after = of.statistics[1]
        if after is None:
            continue
        sizes = [of.kind.shown(size) for size in (after.rms, found.expected[name], after.max, found.noise[name].value)]
        words = [Cell(_(of.kind.plural)), Cell(unit_text(of.kind.unit)), number_cell(str(after.count), after.count)]
        rows.append([*words, *(number_cell(significant(size, 4), size) for size in sizes)])
    title = _("Errors relative to the model, and the noise per number that the calibration found")
    return Table(title, columns, [Group(rows)])


def _next_table(found: WholeCheck) -> Table:
    poses = [posture_json(found.cell, q) for q in found.next]
    columns = [Column(_("Joint"), numeric=False), *(Column(str(k)) for k in range(1, len(poses) + 1))]
    rows = [[Cell(name), *(number_cell(fixed(pose[name], 2), pose[name]) for pose in poses)] for name in poses[0]]
    return Table(_("Poses"), columns, [Group(rows)])


def _member_table(found: WholeCheck) -> Table:
    columns = [Column(title, numeric=False) for title in (_("Cause"), _("Change"), _("As well"))]
    rows = []
    for of in found.moved:
        sizes = "; ".join(f"{each.name} {each.change:+.4g} ± {each.std:.2g}" for each in of.changes)
        others = ", ".join(map(in_words, of.equivalents))
        rows.append([Cell(in_words(of.label)), Cell(sizes), Cell(others)])
    return Table(_("Causes that explain the new readings"), columns, [Group(rows)])


def write_picture_check(
    found: PictureCheck, path: str | os.PathLike[str], part: Evaluation, model: Robot, *, language: str = "en"
) -> None:
    """Writes check.json, or the page where the path ends in .html; whole or not at all.

    Args:
        found: The check.
        path: Where to.
        part: The pictures beside the model.
        model: That was checked.
        language: Of the page.
    """
    if Path(path).suffix.lower() in (".html", ".htm"):
        write_text(path, picture_check_page(found, part, model, language))
    else:
        write_json(path, found.to_json_dict())


def picture_check_page(found: PictureCheck, part: Evaluation, model: Robot, language: str = "en") -> str:
    """The HTML text of the page of a check by pictures; arguments as of `write_picture_check`."""
    with in_language(language):
        rms = float(np.sqrt(np.mean(np.square(list(found.rms_px.values())))))
        verdict = Verdict(TONES[found.verdict], capitalised(state_word(found.verdict)), _picture_headline(found), [])
        if found.verdict == "cannot_tell":
            act = _("Next: take pictures in postures like those of the calibration, or calibrate with these as well.")
            verdict.remarks.append(Remark(act, True, "pictures"))
        if len(found.moved) == 1:
            act = _(
                "Next: check {what}, then adopt the change with `fastcal update`, or calibrate again.",
                what=_owner(found.moved[0].owner),
            )
            verdict.remarks.append(Remark(act, True, "causes"))
        tiles = [
            (_("RMS error"), f"{significant(rms)} px", _("expected {size} px", size=significant(found.expected_px))),
            (_("Chance"), p_text(found.p_value), _("of errors this large if nothing moved")),
        ]
        sections = scene_sections(pictures_scene(model, None, part))
        sections.append(Section("pictures", _("Pictures"), drawings=[_pictures(found)]))
        if found.moved:
            sections.append(Section("causes", _("What explains it"), tables=[_moved_table(found.moved)]))
        if found.notes:
            sections.append(Section("notes", _("Notes"), notes=[*map(retold, found.notes)]))
        return page.render(
            "monitoring.html",
            title=_("Check of {robot}", robot=model.name),
            eyebrow=_("Does the calibration still hold?"),
            robot_name=model.name,
            simulated=False,
            meta=[plural(len(found.rms_px), "picture")],
            verdict=verdict,
            tiles=tiles,
            sections=sections,
            document=[(_("Software"), f"fastcal {fastcal.__version__}")],
        )


def _picture_headline(found: PictureCheck) -> str:
    if found.verdict == "holds":
        return _("The cell's model still holds: the pictures agree with it to within the noise.")
    if found.lens is not None:
        return _(
            "The lens of camera {camera} changed, its focal length by {size} %: calibrate again, including the lens.",
            camera=found.lens.camera,
            size=significant(found.lens.focal_percent),
        )
    if found.verdict == "cannot_tell":
        return _("The pictures fit worse than those of the calibration, and nothing that may have moved explains why.")
    what = f" {_('or')} ".join(_owner(of.owner) for of in found.moved)
    if len(found.moved) == 1:
        return _("{what} moved.", what=capitalised(what))
    return _("{what} moved; pictures from other postures tell them apart.", what=capitalised(what))


def _pictures(found: PictureCheck) -> figures.Figure:
    rows, sizes = list(found.rms_px), list(found.rms_px.values())
    ends = [min(rows) - 0.5, max(rows) + 0.5]
    hover = f"{_('row')} %{{x}}: %{{y:.2f}} px"
    traces = [
        figures.line(ends, [found.expected_px] * 2, figures.MUTED, "dash"),
        figures.points(rows, sizes, figures.AFTER, 8, hover=hover),
    ]
    drawn = figures.layout(_("row (number)"), _("RMS error (px)"), yaxis={"rangemode": "tozero"}, xaxis={"range": ends})
    key = [
        figures.Key(_("a picture"), figures.AFTER, "point"),
        figures.Key(_("expected from noise alone"), figures.MUTED, "dash"),
    ]
    alt = _("RMS error of the corners of each picture, and the level expected from noise alone.")
    return figures.Figure("pictures", _("Error of each picture"), alt, traces, drawn, height=260, key=key)


def _moved_table(moved: tuple[Moved, ...]) -> Table:
    columns = [Column(_("Cause"), numeric=False), Column(_("Shift (mm)")), Column(_("Turn (°)"))]
    rows = []
    for each in moved:
        sizes = [
            number_cell("" if size is None else significant(size), size) for size in (each.shift_mm, each.turn_deg)
        ]
        rows.append([Cell(capitalised(_owner(each.owner))), *sizes])
    return Table(_("Causes that explain the new readings"), columns, [Group(rows)])


def _owner(owner: str) -> str:
    """What moved: "camera wrist", "joint 2"."""
    kind, _space, name = owner.partition(" ")
    return f"{_(kind)} {name}" if kind in ("camera", "board") else in_words(owner)
