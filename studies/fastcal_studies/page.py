# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a study: paper beside its method here beside fastcal's best, drawn from the content of paper.json."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from fastcal.report import figures, page
from fastcal.report.figures import Figure, Key, Trace
from fastcal.report.formatting import MISSING, is_known, plural, powered, significant
from fastcal.report.language import _, decimal_sign, in_language, messages_of, retold
from fastcal.report.tables import Cell, Column, Group, Table, in_words, number_cell

_COLOURS = (*figures.COMPONENT_COLOURS, figures.MUTED, figures.ALERT)
_DASHES = ("solid", "dash", "dot", "dashdot", "solid", "dash")
_ROLES = {
    "paper": (figures.INK, "dot"),
    "before": (figures.BEFORE, "dash"),
    "method": (figures.AFTER, "solid"),
    "best": (figures.COMPONENT_COLOURS[1], "solid"),
    **{str(k): look for k, look in enumerate(zip(_COLOURS, _DASHES, strict=True))},
}
_BAR_OPACITY = 0.75
_MINUS = "\N{MINUS SIGN}"
_WRITTEN_NUMBER = re.compile(r"NUM( \(NUM \w+ NUM\))?".replace("NUM", rf"[-{_MINUS}]?[\d.,]+"))
_PARAMETERS = re.compile(r"(joint|link)\d+ |(base|tool) \w\b")  # or a list of them
_KEPT = {"robot", "reference", "number", "kind", "role", "mark"}  # keys of paper.json that no language changes
_UNIT = " (mm)"
_NO_BREAK = "\N{NO-BREAK SPACE}"  # a range and a unit stay on one line; before it a narrow column breaks


def paper_page(content: Mapping[str, Any], language: str = "en") -> str:
    """The HTML text of the page from what paper.json holds; nothing is simulated or fitted here."""
    with in_language(language), messages_of("fastcal_studies"):
        return _page(content)


def _page(given: Mapping[str, Any]) -> str:
    content = _again({key: value for key, value in given.items() if key != "runs"})
    arms = int(content["arms"])
    simulated = bool(content.get("simulated", True))
    sections = [
        {
            "id": f"part-{k}",
            "title": section["title"],
            "lead": section["lead"],
            "parts": [_part(exhibit) for exhibit in section["exhibits"]],
        }
        for k, section in enumerate(content["sections"], start=1)
    ]
    headlines, worlds = content["headlines"], _worlds(given["sections"])
    return page.render(
        "paper.html",
        title=_("Study of {robot}", robot=content["paper"]["robot"]),
        simulated=simulated,
        robot_name=content["paper"]["robot"],
        reference=content["paper"]["reference"],
        arms=plural(arms, "simulated arm") if simulated else plural(arms, "random split"),
        full=content["full"],
        tone="good" if all(h["reached"] and h["bettered"] for h in headlines) and all(worlds) else "caution",
        sentence=content.get("sentence") or f"{_sentence(headlines, arms)}{_in_worlds(worlds, arms)}",
        behind=[_behind(h) for h in headlines if not h["reached"]],
        headlines=_headlines(headlines) if headlines else None,
        remarks=content["remarks"],
        how=content["paper"]["arm"],
        sections=sections,
        contents=[
            *([("headlines", _("Headline measures"))] if headlines else []),
            *((s["id"], s["title"]) for s in sections),
            ("arms", _("The arms")),
        ],
    )


def _sentence(headlines: Sequence[Mapping[str, Any]], arms: int) -> str:
    """What the measures show; of one arm there is no median and no range."""
    reached, bettered = (sum(bool(h[key]) for h in headlines) for key in ("reached", "bettered"))
    counts = {"reached": reached, "bettered": bettered, "measures": plural(len(headlines), "headline measure")}
    if arms == 1:
        return _(
            "On {reached} of {measures} the paper's method reaches the paper's figure on this one arm; on {bettered} "
            "fastcal's best on the same data leaves less.",
            **counts,
        )
    return _(
        "On {reached} of {measures} the paper's method reaches the paper's figure here; on {bettered} the median of "
        "fastcal's best on the same data is lower, on {apart} of these the ranges over the arms do not overlap.",
        apart=sum(h["best"]["high"] < h["method"]["low"] for h in headlines),
        **counts,
    )


def _worlds(sections: Sequence[Mapping[str, Any]]) -> list[bool]:
    """Of each world of hidden errors: is the median of fastcal's best, the last column, below every other line's?"""
    tables = [e for section in sections for e in section["exhibits"] if e["number"] == "Three worlds"]
    medians = [[cell["median"] for cell in row[1:]] for table in tables for row in table["rows"]]
    return [line[-1] < min(line[:-1]) for line in medians]


def _in_worlds(leads: Sequence[bool], arms: int) -> str:
    """In how many it leads; nothing of a study without worlds."""
    if not leads:
        return ""
    by = _(", by the medians") if arms > 1 else ""
    told = "It leaves less than every other line in {count} of {worlds} of hidden errors{by}."
    return " " + _(told, count=sum(leads), worlds=plural(len(leads), "world"), by=by)


def _behind(headline: Mapping[str, Any]) -> str:
    here, measure = significant(headline["method"]["median"]), headline["measure"]
    paper = significant(headline["paper"])
    told = _("{measure}: {here} here, {paper} in the paper.", measure=measure, here=here, paper=paper)
    return f"{told[0].upper()}{told[1:]} {headline['why']}"


def _headlines(headlines: Sequence[Mapping[str, Any]]) -> Table:
    titles = ("", "paper", "paper's method here", "fastcal's best")
    columns = [Column(_(title), numeric=k > 0) for k, title in enumerate(titles)]
    columns.append(Column(_("what is best"), numeric=False))
    rows = [
        [Cell(h["measure"]), *(_cell(h[key]) for key in ("paper", "method", "best")), Cell(h["best_is"])]
        for h in headlines
    ]
    return Table(_("Headline measures: the paper, its method here, fastcal's best."), columns, [Group(rows)])


def _part(exhibit: Mapping[str, Any]) -> dict[str, Any]:
    """An exhibit as the template takes it."""
    place = re.sub(r"\W+", "-", f"{exhibit['number']}-{exhibit.get('title', '')}").strip("-").lower()[:60]
    if exhibit["kind"] == "absent":
        several = re.match(r"(Figures|Tables)\b", exhibit["number"])
        absent = _("are not shown:") if several else _("is not shown:")
        return {"kind": "absent", "number": _numbered(exhibit), "verb": absent, "text": exhibit["why"]}
    if exhibit["kind"] == "table":
        drawn = {"kind": "table", "id": f"table-{place}", "table": _table(exhibit), "note": exhibit["note"]}
        return drawn | {"number": _numbered(exhibit), "title": exhibit["title"]}
    return {"kind": "chart", "figure": _chart(exhibit, place)}


def _numbered(exhibit: Mapping[str, Any]) -> str:
    """Its number in the paper, or another name: Table 5."""
    word, _space, rest = exhibit["number"].partition(" ")
    known = {"Table": _("Table {number}", number=rest), "Figure": _("Figure {number}", number=rest)}
    whole = retold(exhibit["number"])
    return known[word] if word in known and whole == exhibit["number"] else whole


def _again(value: Any, key: str = "") -> Any:
    """What paper.json says in the language of the page; the paper's own name, places and roles stay."""
    if isinstance(value, Mapping):
        return {name: _again(each, name) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_again(each, key) for each in value]
    if not isinstance(value, str) or key in _KEPT:
        return value
    if _WRITTEN_NUMBER.fullmatch(value):
        return value.replace(".", decimal_sign()).replace(" to ", f" {_('to')} ")
    if (told := retold(value)) != value:
        return told
    if count := re.fullmatch(r"(\d+) of (\d+)", value):
        return _("{some} of {all}", some=count[1], all=count[2])
    text, unit = (value.removesuffix(_UNIT), _UNIT) if value.endswith(_UNIT) else (value, "")
    told = retold(text)
    for comma in re.finditer(", ", text) if told == text else ():  # a line of a table, of two names
        parts = [retold(part) for part in (text[: comma.start()], text[comma.end() :])]
        if parts[1] != text[comma.end() :] or parts[0] != text[: comma.start()]:
            told = ", ".join(parts)
            break
    return told + unit


def _table(exhibit: Mapping[str, Any]) -> Table:
    rows = exhibit["rows"]
    numeric = [k > 0 and not any(_is_text(row[k]) for row in rows) for k in range(len(exhibit["columns"]))]
    columns = [Column(title, numeric=number) for title, number in zip(exhibit["columns"], numeric, strict=True)]
    return Table(
        f"{_numbered(exhibit)}: {exhibit['title']}", columns, [Group([[_cell(v) for v in row] for row in rows])]
    )


def _is_text(value: Any) -> bool:
    """Words, not a number that comes with its own digits, its range behind it."""
    return isinstance(value, str) and not _WRITTEN_NUMBER.fullmatch(value)


def _cell(value: Any) -> Cell:
    if value is None:
        return Cell(MISSING)
    if isinstance(value, str):
        value = in_words(value) if _PARAMETERS.match(value) else value
        return Cell(re.sub(r"(?<![\w.)])-(?=\d)", _MINUS, value).replace("N m", f"N{_NO_BREAK}m"))
    if isinstance(value, Mapping):
        if not is_known(value["median"]):
            return Cell(MISSING)
        middle, low, high = (_number(value[key]) for key in ("median", "low", "high"))
        text = middle if low == high else f"{middle} ({low}{_NO_BREAK}{_('to')}{_NO_BREAK}{high})"
        return number_cell(text, value["median"])
    return number_cell(_number(value), float(value))


def _number(value: float) -> str:
    """Three digits; whole numbers as they are, sizes far from one with a power of ten."""
    if float(value).is_integer() and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", _MINUS)
    size = abs(math.log10(abs(value)))
    return powered(value) if size >= 4 else significant(value)


def _chart(exhibit: Mapping[str, Any], place: str) -> Figure:
    traces: list[Trace] = []
    key: list[Key] = []
    for series in exhibit["series"]:
        colour, dash = _ROLES[series["role"]]
        x, y, mark = series["x"], series["y"], series["mark"]
        hover = _("{name}: %{{y:.3g}} at %{{x}}", name=series["name"])
        if mark == "bars":
            style = {"color": figures.translucent(colour, _BAR_OPACITY)}
            traces.append({"type": "bar", "x": x, "y": y, "marker": style, "hovertemplate": hover + "<extra></extra>"})
        elif mark == "points":
            traces.append(figures.points(x, y, colour, 6, 0.8, hover=hover))
        else:
            traces.append(figures.line(x, y, colour, dash, hover=hover))
        key.append(Key(series["name"], colour, {"bars": "solid", "points": "point"}.get(mark, dash)))
    scale = {"type": "log", "exponentformat": "power"} if exhibit["logarithmic"] else {"rangemode": "tozero"}
    drawn = figures.layout(exhibit["x"], exhibit["y"], yaxis=scale, barmode="group", bargap=0.1)
    of_paper = _(" of the paper") if exhibit["number"].startswith("Figure") else ""
    title = f"{_numbered(exhibit)}: {exhibit['title']}"
    alt = _("{what}; {y} against {x}.", what=f"{_numbered(exhibit)}{of_paper}: {exhibit['title']}", y=exhibit["y"],
            x=exhibit["x"])  # fmt: skip
    return Figure(place, title, alt, traces, drawn, exhibit["note"], columns=6, height=330, key=key)
