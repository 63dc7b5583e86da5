# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Parameters of effects in the units used on the shop floor: arcmin of lost motion, µm/(m K), N m per arcmin."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fastcal.effects.entries import traits_of
from fastcal.report.formatting import rough, significant, with_uncertainty
from fastcal.report.language import _
from fastcal.report.tables import after_number, unit_text
from fastcal.said import said
from fastcal.units import UNITS, ShopUnit, factor, parse_name, shop_unit, unit_names

if TYPE_CHECKING:
    from fastcal.diagnosis.result import NamedValue

_MOST = 3  # numbers that are listed one by one
_NUMBERS = {"inverse_ei": "1/EI", "inverse_gj": "1/GJ", "extra": said("mass"), "error": said("relative error")}
_NUMBERS |= {"excess_inverse_ei": said("excess 1/EI"), "excess_compliance": said("excess compliance")}
_NUMBERS |= {
    word.replace(" ", "_"): word
    for word in (
        *(said("amplitude"), said("coefficient"), said("compliance"), said("cosine"), said("even"), said("gap")),
        *(said("offset"), said("order"), said("phase"), said("ratio"), said("sine"), said("size"), said("scale")),
        *(said("turn per moment"), said("turn per current"), said("turn per load"), said("turn per kelvin")),
        *(said("share of the last move"), said("change"), said("share"), said("height"), said("motion")),
        *(said("delay"), said("readout"), said("hardening"), said("cubic"), said("critical"), said("width")),
    )
}
_AXES = re.compile(r"(rate|step|shift|turn|way|moment)_(r?)([xyz])")
_NUMBERED = re.compile(r"(shape|knot|distortion)(\d+)")
_SHAPES = {"shape": said("shape"), "knot": said("knot"), "distortion": said("distortion")}
_MOVED = {  # with and without its axis, by what moves and whether it turns
    ("rate", "r"): ("turn rate about {axis}", "turn rate"),
    ("rate", ""): ("shift rate along {axis}", "shift rate"),
    ("moment", ""): ("moment along {axis}", "moment"),
    ("", "r"): ("turn about {axis}", "turn"),
    ("", ""): ("shift along {axis}", "shift"),
}


def number_in_words(name: str, *, with_axis: bool = True) -> str:
    """A parameter without its unit: `rate_rx` to "turn rate about x", `step_x` to "shift along x"."""
    found = _AXES.fullmatch(name)
    if found is None:
        numbered = _NUMBERED.fullmatch(name)
        if numbered:
            return f"{_(_SHAPES[numbered[1]])}{numbered[2]}"
        return _(_NUMBERS[name]) if name in _NUMBERS else name.replace("_", " ")
    kind, turning, axis = found.groups()
    known = kind if kind in ("rate", "moment") else ""
    message, alone = _MOVED[known, turning if known != "moment" else ""]
    return _(message, axis=axis) if with_axis else _(alone)


def kind_in_words(effect: str, name: str) -> str:
    """The same without the axis, for statements about all axes at once."""
    return number_in_words(name, with_axis=False) or _number_of(effect)


def _number_of(effect: str) -> str:
    """What the parameter without a name of an effect is."""
    return _(traits_of(effect).number or "size")


def split_name(name: str) -> tuple[str, str]:
    """`gap_rad` to ("gap", "rad"), `rad_nm` to ("", "rad_nm"), `ratio` to ("ratio", "1")."""
    if name in UNITS:
        return "", name
    base, unit = parse_name(name)
    return base, unit or "1"


def in_si(value: float, unit: str) -> float:
    """A size in a unit of a file, in SI; of a temperature its difference."""
    return value * factor(unit)


def spoken_unit(unit: str, size: float) -> ShopUnit:
    """The unit in which a size [SI] is shown, by the unit in the file."""
    si = unit_names(UNITS[unit].kind)[0]
    found = shop_unit(si, size)
    return found if found.text != si else ShopUnit(unit_text(si))


def value_text(name: str, value: float, std: float | None) -> str:
    """`gap_rad` 4.3e-4 with 2e-5 to "1.478 ± 0.069 arcmin"."""
    unit = split_name(name)[1]
    size, deviation = in_si(value, unit), None if std is None else in_si(std, unit)
    spoken = spoken_unit(unit, max(abs(size), deviation or 0.0))
    shown = spoken.of(size)
    if deviation is None or not deviation > 0:
        return f"{significant(shown)}{after_number(spoken.text)}"
    texts = with_uncertainty(spoken.of(deviation), shown)
    return f"{texts[1]} ± {texts[0]}{after_number(spoken.text)}"


def size_text(unit: str, size: float) -> str:
    """A size [in `unit`] with two digits and the unit in common use."""
    si = in_si(size, unit)
    spoken = spoken_unit(unit, si)
    return f"{rough(spoken.of(si))}{after_number(spoken.text)}"


def estimate_lines(effect: str, parameters: Mapping[str, NamedValue]) -> list[tuple[str, str]]:
    """(what, how much) of an identified effect, a line for each parameter."""
    lines = []
    for name, found in parameters.items():
        what = number_in_words(split_name(name)[0]) or _number_of(effect)
        if name == "order":
            lines.append((_("cycles per turn"), f"{found.value:g}"))
        elif name == "phase_rad":
            lines.append((_("phase"), value_text(name, found.value, found.std)))
        elif name == "at_s":
            lines.append((_("at"), f"{found.value:.0f} s"))
        elif name in ("at_deg", "at_mm"):
            lines.append((_("at"), value_text(name, found.value, found.std)))
        elif name == "at_row":
            lines.append((_("from row"), _("{row} on", row=f"{found.value:.0f}")))
        else:
            lines.append((what, value_text(name, found.value, found.std)))
    compliance = parameters.get("compliance_rad_nm")
    if compliance is not None and compliance.value > 0:
        minute = shop_unit("rad", 3e-4)
        stiffness = 1 / minute.of(compliance.value)
        lines.append((_("as a stiffness"), f"{significant(stiffness)} N\N{NO-BREAK SPACE}m/{minute.text}"))
    return lines


def estimate_text(estimate: Mapping[str, float]) -> str:
    """Parameters without deviations, briefly: one by one where they are few, else the largest of each unit."""
    waves = [value for name, value in estimate.items() if name.startswith(("sine", "cosine"))]
    if waves:
        return size_text("rad", float(np.linalg.norm(waves[:2])))
    known = {name: value for name, value in estimate.items() if not name.startswith("critical")}
    sizes = [(split_name(name)[1], value) for name, value in known.items()]
    if len(sizes) <= _MOST:
        return ", ".join(_signed(unit, value) for unit, value in sizes)
    return _("up to {sizes}", sizes=", ".join(size_text(unit, size) for unit, size in _largest(sizes)))


def _signed(unit: str, value: float) -> str:
    return ("\N{MINUS SIGN}" if value < 0 else "") + size_text(unit, abs(value))


def _largest(sizes: Sequence[tuple[str, float]]) -> list[tuple[str, float]]:
    units = dict.fromkeys(unit for unit, _ in sizes)
    return [(unit, max(abs(value) for u, value in sizes if u == unit)) for unit in units]
