# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables of the page: columns with their unit, cells with a text to read and a value to sort by, rows in groups."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fastcal.report.formatting import is_known
from fastcal.report.language import _

_UNIT_TEXTS = {
    "1": "",
    "deg": "°",
    "um": "µm",
    "c": "°C",
    "k": "K",
    "n": "N",
    "nm": "N\N{NO-BREAK SPACE}m",
    "a": "A",
    "m_s": "m/s",
    "mm_s": "mm/s",
    "rad_s": "rad/s",
    "deg_s": "°/s",
    "m_s2": "m/s²",
    "n_m": "N/m",
    "rad_nm": "rad/(N\N{NO-BREAK SPACE}m)",
    "rad_a": "rad/A",
    "rad_k": "rad/K",
    "rad_rad": "rad/rad",
    "m_m": "m/m",
    "rad_m": "rad/m",
    "1_k": "1/K",
    "1_nm2": "1/(N\N{NO-BREAK SPACE}m²)",
    "m_n": "m/N",
    "m_a": "m/A",
    "m_k": "m/K",
    "1_rad": "1/rad",
    "1_rad2": "1/rad²",
    "1_m": "1/m",
    "1_m2": "1/m²",
    "kg_m": "kg\N{NO-BREAK SPACE}m",
    "kg_m2": "kg\N{NO-BREAK SPACE}m²",
    "m2": "m²",
    "m4": "m⁴",
    "pa": "Pa",
}


@dataclass(frozen=True)
class Cell:
    """What is read and what is sorted by: a number, or a text where `sort` is None; and where a click leads."""

    text: str
    sort: float | None = None
    link: str = ""


@dataclass(frozen=True)
class Column:
    """A column's heading; `numeric` columns are set right, with figures of equal width, `whole` ones never broken."""

    title: str
    numeric: bool = True
    whole: bool = False

    @property
    def style(self) -> str:
        """Its classes in the page."""
        return " ".join([*(["number"] if self.numeric else []), *(["whole"] if self.whole else [])])


@dataclass(frozen=True)
class Group:
    """Rows that belong together; a title makes them one that folds."""

    rows: list[list[Cell]]
    title: str = ""
    note: str = ""


@dataclass(frozen=True)
class Table:
    """A table; `caption` tells a reader who can't see the page what it holds.

    `rows_of` is the measured set, from 0, whose row a table's row is of by its first cell; None: its rows are no such.
    """

    caption: str
    columns: list[Column]
    groups: list[Group] = field(default_factory=list)
    is_sortable: bool = False
    rows_of: int | None = None

    @property
    def is_wordy(self) -> bool:
        """Is it too wide for a narrow screen, or do texts fill it? There its cells then stand below each other."""
        return len(self.columns) > 7 or sum(not column.numeric for column in self.columns) > 2


def unit_text(unit: str) -> str:
    """A unit of units.py as it is printed: `rad_nm` -> rad/(N m)."""
    return _UNIT_TEXTS.get(unit, unit)


def after_number(unit: str) -> str:
    """A unit as it is printed, behind a number: with the space before it, which degrees do not have."""
    return unit if unit in ("", "°") else f" {unit}"


def spaced(text: str) -> str:
    """A text of the core as it is printed: `joint2 theta` -> joint 2 theta, `station2_y` -> station 2 y."""
    text = re.sub(r"\bstation(\d+)_", "station\N{NO-BREAK SPACE}\\1 ", text)
    text = re.sub(r"\b(from|to)_([xyz])\b", "\\1 \\2", text)
    return re.sub(r"\b(joint|link)(\d+)\b", "\\1\N{NO-BREAK SPACE}\\2", text)


def places_in_words(text: str) -> str:
    """A text with places of a cell, right.joint2: the name of the arm as its file has it, the rest as the page says."""
    return re.sub(r"\b(joint|link)(\d+)\b", lambda found: f"{_(found[1])}\N{NO-BREAK SPACE}{found[2]}", text)


def in_words(text: str) -> str:
    """A parameter or a direction of the core as it is printed, its words in the language of the page."""
    known = {
        "joint": _("joint"),
        "link": _("link"),
        "base": _("base"),
        "board": _("board"),
        "camera": _("camera"),
        "station": _("station"),
        "tool": _("tool"),
        "compliance": _("compliance"),
        "and": _("and"),
        "more": _("more"),
        "move together": _("move together"),
        "turn together": _("turn together"),
        "is not observable": _("is not observable"),
    }
    return re.sub(r"is not observable|[a-z]{2,}( together)?", lambda word: known.get(word[0], word[0]), spaced(text))


def capitalised(text: str) -> str:
    """The text with its first letter large; the others stay as they are."""
    return text[:1].upper() + text[1:]


def number_cell(text: str, value: float | None) -> Cell:
    """A cell that is sorted by `value`, last where that is not known."""
    return Cell(text, value if value is not None and is_known(value) else None)
