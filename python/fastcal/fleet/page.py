# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The table and the page of a fleet."""

from __future__ import annotations

import os
import re
from pathlib import Path
from statistics import median
from urllib.parse import quote

from fastcal.fleet.in_space import shared_errors
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.io.atomic import write_text
from fastcal.io.tables import write_csv
from fastcal.report import figures, page
from fastcal.report.diagnosis_words import VERDICTS, short_name
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import significant
from fastcal.report.kind_words import beside_mm
from fastcal.report.language import _, in_language, retold
from fastcal.report.tables import Cell, Column, Group, Table
from fastcal.report.words import Remark, Verdict, listed
from fastcal.said import first_few, said

_MOST_ROWS = 2000  # of the page's table, the worst first; fleet.csv has all
_MOST_NOTES = 50
STATUSES = {
    "converged": said("converged"),
    "refused": said("refused"),
    "not_converged": said("not converged"),
    "too_few_equations": said("too few equations"),
}
_MOST_TOLD = 6  # arms that the verdict names
OUTSTANDING = 2  # times the error of the median arm, beyond which an arm is named
_EACH_TICKED = 12  # arms: with more, Plotly finds whole numbers by itself


def write_fleet(found: Fleet, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes fleet.csv and report.html, in that language, into the folder that has those of the arms."""
    columns = {name: ["" if value is None else value for value in column] for name, column in found.columns().items()}
    write_csv(Path(folder) / "fleet.csv", columns)
    write_text(Path(folder) / "report.html", fleet_page(found, Path(folder), language))


def fleet_page(found: Fleet, folder: Path | None = None, language: str = "en") -> str:
    """The HTML text of the page, which leads to those of the arms where they are in `folder`."""
    with in_language(language):
        return _rendered(found, folder)


def _rendered(found: Fleet, folder: Path | None) -> str:
    numbers = {"some": len(found) - len(found.failed), "all": len(found)}
    diagnosed = found.is_diagnosed
    return page.render(
        "fleet.html",
        title=_("Fleet"),
        simulated=False,
        count=len(found),
        heading=_("{some} of {all} arms diagnosed", **numbers)
        if diagnosed
        else _("{some} of {all} arms calibrated", **numbers),
        failed=[
            (arm.name, _(STATUSES[arm.status]), _without_folders(arm.message)) for arm in found.failed[:_MOST_ROWS]
        ],
        verdict=_verdict(found),
        tiles=_tiles(found),
        table=_table(found, folder),
        notes=_notes(found)[:_MOST_NOTES],
        left_out=max(0, len(found) - _MOST_ROWS),
        drawing=_drawing(found, folder),
        scene=shared_errors(found),
    )


def _worst_first(found: Fleet) -> list[ArmResult]:
    """Those of one unit together, lengths first; last those without a model."""

    def place(arm: ArmResult) -> tuple[bool, str, float]:
        return arm.after is None, "" if arm.unit == "mm" else arm.unit, -(arm.after or 0.0)

    return sorted(found, key=place)


def _verdict(found: Fleet) -> Verdict:
    """How many arms have a model, and which ask for attention."""
    done = len(found) - len(found.failed)
    worst = next((arm for arm in _worst_first(found) if arm.after is not None), None)
    numbers = {"some": done, "all": len(found)}
    if worst is None:
        text = _("{some} of {all} arms have a model.", **numbers)
    else:
        text = _(
            "{some} of {all} arms have a model; the largest error is {size} {unit} RMS, of {arm}.",
            size=significant(worst.after, 3),
            unit=worst.unit,
            arm=worst.name,
            **numbers,
        )
    told = [Remark(f"{arm.name}: {_without_folders(arm.message)}", True, "failed") for arm in found.failed[:_MOST_TOLD]]
    outstanding = _outstanding(found)
    if outstanding:
        names = listed([f"{arm.name} ({significant(arm.after or 0.0, 3)} mm)" for arm in outstanding[:_MOST_TOLD]])
        text_of = _("More than {times} times the error of the median arm: {arms}.", times=OUTSTANDING, arms=names)
        told.append(Remark(text_of, True, "arms"))
    caused = [arm for arm in _worst_first(found) if arm.causes]
    told += [Remark(f"{arm.name}: {_spoken(arm.causes)}", True, "arms") for arm in caused[:_MOST_TOLD]]
    if found.failed or outstanding:
        acts = _acts(found, outstanding)
        return Verdict("bad" if done == 0 else "caution", _("Attention"), text, told, acts)
    return Verdict("good", _("All done"), text, told)


def _acts(found: Fleet, outstanding: list[ArmResult]) -> list[str]:
    """What to do now about arms without a model, and about those that are much worse than the others."""
    out = []
    if found.failed:
        names = first_few([arm.name for arm in found.failed], _MOST_TOLD)
        out.append(_("Mend the files of {names}, then run the list again.", names=names))
    if outstanding:
        names = first_few([arm.name for arm in outstanding], _MOST_TOLD)
        if found.is_diagnosed:
            out.append(_("Follow what the pages of {names} say.", names=names))
        else:
            out.append(_("Find out what is missing on {names}: `fastcal diagnose`.", names=names))
    return out


def _outstanding(found: Fleet) -> list[ArmResult]:
    """Arms that are much worse than the middle one, the worst first."""
    limit = _limit(found)
    return [arm for arm in _worst_first(found) if arm.after_mm is not None and arm.after_mm > limit]


def _limit(found: Fleet) -> float:
    """The error beyond which an arm is much worse than the middle one [mm]."""
    sizes = [arm.after_mm for arm in found if arm.after_mm is not None]
    return OUTSTANDING * median(sizes) if sizes else 0.0


def _spoken(causes: str) -> str:
    """What "A backlash@joint4; B ..." names, as "joint 4 backlash (A)"."""
    parts = (cause.partition(" ") for cause in causes.split("; "))
    return "; ".join(f"{short_name(*label.split('@'))} ({grade})" for grade, _space, label in parts)


def _without_folders(message: str) -> str:
    """A message in the page's language, with the names of files alone: where they are is private."""
    return re.sub(r"(?:[A-Za-z]:)?[/\\](?:[^/\\\s:]+[/\\])+(?=[^/\\\s:]+:)", "", retold(message))


def _tiles(found: Fleet) -> list[tuple[str, str, str]]:
    """Middle error before and after, and arms without a model."""
    tiles = [(_("Arms"), str(len(found)), "")]
    for title, field in ((_("Nominal, median arm"), "before_mm"), (_("Calibrated, median arm"), "after_mm")):
        sizes = [size for arm in found if (size := getattr(arm, field)) is not None]
        tiles += [(title, f"{significant(median(sizes), 3)} mm", _("RMS"))] if sizes else []
    return [*tiles, (_("Without a model"), str(len(found.failed)), "")]


def _page_of(arm: ArmResult, folder: Path | None) -> str:
    """Where the page of an arm is, beside that of the fleet; empty where there is none."""
    there = folder is not None and (folder / arm.name / "report.html").is_file()
    return f"{quote(arm.name)}/report.html" if there else ""


def _table(found: Fleet, folder: Path | None) -> Table:
    told = (_("verdict"), _("what is missing")) if found.is_diagnosed else ()
    is_tested = any(arm.test is not None for arm in found)
    titles = [
        _("poses"),
        _("nominal (mm)"),
        _("calibrated (mm)"),
        *([_("other poses (mm)")] if is_tested else []),
        _("noise (mm)"),
        _("outliers"),
    ]
    titles += [] if told else [_("undetermined")]
    columns = [*(Column(title, numeric=False) for title in (_("arm"), *told)), *map(Column, titles)]
    rows = []
    for arm in _worst_first(found)[:_MOST_ROWS]:
        causes = [Cell(_verdict_word(arm)), Cell(_spoken(arm.causes) if arm.causes else "")] if told else []
        sizes = (arm.before, arm.after, *([arm.test] if is_tested else []), arm.noise)
        cells = [beside_mm(size, arm.unit) for size in sizes]
        counts = [arm.outliers] if told else [arm.outliers, arm.unidentifiable]
        numbers = [Cell(str(arm.rows), float(arm.rows)), *cells, *(Cell(str(count), float(count)) for count in counts)]
        rows.append([Cell(arm.name, link=_page_of(arm, folder)), *causes, *numbers])
    caption = _("Root mean square of the error of every arm, of points where they were measured.")
    return Table(caption, columns, [Group(rows)], is_sortable=True)


def _verdict_word(arm: ArmResult) -> str:
    """That of a diagnosis; empty where there was none."""
    return _(VERDICTS[arm.verdict][0]) if arm.verdict in VERDICTS else arm.verdict


def _notes(found: Fleet) -> list[tuple[str, str]]:
    """What was noticed of arms that have a model."""
    return [(arm.name, retold(arm.message)) for arm in _worst_first(found) if arm.status == "converged" and arm.message]


def _drawing(found: Fleet, folder: Path | None) -> Figure:
    """Errors of all arms, the worst first, and the limit beyond which the verdict names them."""
    arms = [arm for arm in _worst_first(found) if arm.unit == "mm" and None not in (arm.before, arm.after)]
    place = list(range(1, len(arms) + 1))
    names = [quote(arm.name, safe=" ") for arm in arms]
    limit = _limit(found)
    traces = []
    key = [Key(_("nominal"), figures.BEFORE, "point"), Key(_("calibrated"), figures.AFTER, "point")]
    for entry, field in zip(key, ("before", "after"), strict=True):
        values = [getattr(arm, field) for arm in arms]
        trace = figures.points(place, values, entry.colour, 6, hover=f"{entry.label}: %{{y:.3g}} mm, %{{text}}")
        traces.append(trace | {"text": names})
    if len(arms) > 1:
        key.append(Key(_("{times} times the median arm", times=OUTSTANDING), figures.ALERT, "dash"))
        traces.append(figures.line([0.5, len(arms) + 0.5], [limit, limit], figures.ALERT, "dash"))
    sizes = [float(size) for arm in arms for size in (arm.before, arm.after) if size]
    sizes += [limit] if len(arms) > 1 else []
    steps = {"dtick": 1} if len(arms) <= _EACH_TICKED else {}
    drawn = figures.layout(
        _("arms, the worst first"),
        _("RMS error (mm), logarithmic"),
        xaxis=steps | {"range": [0.3, len(arms) + 0.7]},
        yaxis={"type": "log", "exponentformat": "none"} | figures.log_ticks(sizes),
    )
    alt = _("Root mean square error of every arm, nominal and calibrated, sorted by the latter.")
    pages = [_page_of(arm, folder) for arm in arms]
    note = _("A click on an arm opens its page.") if any(pages) else ""
    return Figure(
        "fleet", _("Error of every arm"), alt, traces, drawn, note, columns=6, height=380, key=key, pages=pages
    )
