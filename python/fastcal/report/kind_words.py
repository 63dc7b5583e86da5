# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Kinds of reading as a page speaks of them."""

from __future__ import annotations

from fastcal.measurements.kinds import POINTS, Kind, KindNoise
from fastcal.report.formatting import significant
from fastcal.report.language import _
from fastcal.report.tables import Cell, after_number, capitalised, number_cell, unit_text


def kind_title(kind: Kind) -> str:
    """Positions, orientations, touches of a plane."""
    return capitalised(_(kind.plural))


def noise_title(kind: Kind) -> str:
    """What the noise is of."""
    return _("Noise per coordinate") if kind.name == POINTS else _("Noise of {kind}", kind=_(kind.plural))


def noise_text(noise: KindNoise) -> str:
    """Its size, as a page shows it."""
    return size_text(noise.kind, noise.value)


def beside_mm(value: float | None, unit: str) -> Cell:
    """A size in a column whose title says mm; what is in another unit says so."""
    text = "" if value is None else significant(value)
    return number_cell(text if unit == "mm" or not text else f"{text} {unit_text(unit)}", value)


def size_text(kind: Kind, value: float) -> str:
    """A standard deviation in SI in the kind's unit."""
    return f"{significant(kind.shown(value), 2)}{after_number(unit_text(kind.unit))}"
