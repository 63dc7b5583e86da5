# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The parts that the pages of the months after have in common: sections, numbers before and now, who measured."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fastcal.calibration.result import IdentifiedParameter
from fastcal.monitoring.words import LEAST_P
from fastcal.report.figures import Figure
from fastcal.report.formatting import fixed, significant, with_uncertainty
from fastcal.report.language import _, decimal_sign
from fastcal.report.tables import Cell, Column, Group, Table, in_words, number_cell, unit_text

TONES = {"holds": "good", "changed": "bad", "cannot_tell": "caution", "alarm": "caution", "unchecked": "caution"}


@dataclass(frozen=True)
class Section:
    """One part of a page; `folded`: a click shows what is below its title."""

    id: str
    title: str
    lead: str = ""
    drawings: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    facts: list[tuple[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    on_paper: bool = True
    folded: bool = False

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
    """`_` with the signs of the page in its values: its decimal sign, ± and °."""
    return _(message, **{name: printed(str(value)) for name, value in values.items()})


def printed(text: str) -> str:
    """A text of the terminal with the signs of the page; between numbers with a comma in them stands another sign."""
    if decimal_sign() == ",":
        text = re.sub(r"(\.\d+), (?=-?\d+\.\d)", r"\1; ", text)
    text = re.sub(r"(?<=\d)\.(?=\d)", decimal_sign(), text.replace(" +- ", " ± "))
    return re.sub(r"(?<=\d) deg\b", "°", re.sub(r"(?<![\w.])-(?=\d)", "\N{MINUS SIGN}", text))


def present(*drawn: Figure | None) -> list[Figure]:
    """Those that there are."""
    return [each for each in drawn if each is not None]


def who_measured(origin: Mapping[str, Any]) -> list[str]:
    """Serial number, date and instrument, where they are known."""
    known = {key: str(origin[key]) for key in ("serial", "date", "instrument") if origin.get(key)}
    out = [_("serial number {text}", text=known["serial"])] if "serial" in known else []
    out += [_("measured {text}", text=known["date"])] if "date" in known else []
    return [*out, *([known["instrument"]] if "instrument" in known else [])]


def before_and_now(was: float, now: float, change: float, std: float | None) -> list[Cell]:
    """The model's value, the new one, the change and its standard deviation, to the same digits."""
    shown = with_uncertainty(std, was, now, change)
    return [
        number_cell(text, value) for text, value in zip((*shown[1:], shown[0]), (was, now, change, std), strict=True)
    ]


def updated_table(parameters: Iterable[IdentifiedParameter]) -> Table:
    """What an update makes of the parameters, by their owners."""
    columns = [Column(_("Parameter"), numeric=False), Column(_("Before")), Column(_("Now")), Column(_("Change"))]
    columns += [Column("±"), Column(_("Unit"), numeric=False)]
    groups: dict[str, list[list[Cell]]] = {}
    for p in parameters:
        cells = before_and_now(p.nominal, p.value, p.value - p.nominal, p.std)
        name = Cell(in_words(bare(p.name, p.unit)))
        groups.setdefault(p.owner, []).append([name, *cells, Cell(unit_text(p.unit))])
    return Table(_("Parameters"), columns, [Group(rows, in_words(owner)) for owner, rows in groups.items()], True)


def p_text(p: float) -> str:
    """A p-value; below a ten-thousandth only the bound is shown."""
    return significant(p, 2) if p >= LEAST_P else f"< {fixed(LEAST_P, 4)}"


def bare(name: str, unit: str) -> str:
    """The name of a number without the unit at its end."""
    return name.removesuffix(f"_{unit}")
