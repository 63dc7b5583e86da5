# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The sentences of checks, updates, comparisons and histories; every text for a person comes from here."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from fastcal.effects.entries import traits_of
from fastcal.monitoring.evidence import Evidence
from fastcal.monitoring.result import Cause, Change
from fastcal.monitoring.setups import SetUp
from fastcal.units import from_si

VERDICTS = {"holds": "holds", "changed": "changed", "cannot_tell": "cannot tell"}


def sentence(
    verdict: str, causes: Sequence[Cause], within: bool | None, tolerance: float | None, largest: float, enough: bool
) -> str:
    """The verdict in a sentence."""
    if verdict == "holds":
        text = "The model still holds: its errors are those of the measurement and of its own uncertainty."
    elif verdict == "changed":
        text = "The arm has changed: " + "; ".join(cause_text(cause) for cause in causes) + "."
    elif not enough:
        text = "Too few poses to tell: what remains beside the base could hide any change."
    elif causes:
        rows = ", ".join(cause.label for cause in causes)
        text = f"Cannot tell: everything fits but {rows}; measure that pose again."
    else:
        text = "Cannot tell: the largest error is too near the tolerance."
    if tolerance is None:
        return text
    limit, found = from_si(tolerance, "mm"), from_si(largest, "mm")
    inside = {True: "within", False: "beyond", None: "too near to decide to"}[within]
    return f"{text} The largest error, {found:.3f} mm, is {inside} the tolerance of {limit:g} mm."


def cause_text(cause: Cause) -> str:
    """What changed and by how much: "joint 3 zero by 0.018 +- 0.002 deg"."""
    if cause.kind == "noise":
        change = cause.changes[0]
        return f"the noise has grown from {change.was:.3f} to {change.value:.3f} mm"
    parts = [size_text(change) for change in cause.changes]
    text = (
        f"{spoken(cause.label)} by {', '.join(parts)}"
        if len(parts) == 1
        else f"{spoken(cause.label)} ({', '.join(parts)})"
    )
    if cause.equivalents:
        text += f", or {' or '.join(spoken(label) for label in cause.equivalents[:4])}"
    return text


def size_text(change: Change) -> str:
    """As in: 0.018 +- 0.002 deg; with its name where it is one of several."""
    digits = _digits(change.std)
    size = (
        f"{change.change:+.{digits}f} +- {change.std:.{digits}f}"
        if digits <= 6
        else f"{change.change:+.3g} +- {change.std:.1g}"
    )
    unit = "" if change.unit == "1" else f" {change.unit}"
    text = f"{size}{unit}"
    if change.owner.startswith("joint") and change.name in ("theta_deg", "zero_deg"):
        return text
    if change.was != 0 and not change.unit.startswith(("mm", "deg")):
        return f"{text} ({change.change / abs(change.was):+.0%})"
    return f"{change.name.rpartition('_')[0] or change.name} {text}"


def spoken(label: str) -> str:
    """A label as one says it: "joint 3 zero", "compliance of joint 2"."""
    effect, at, owner = label.partition("@")
    if at:
        label = f"{traits_of(effect).phrase.partition(' (')[0]} of {owner}"
    return re.sub(r"\b(joint|link)(\d)", r"\1 \2", label)


def reasons(
    rms: float, expected: float, p_value: float, evidence: Evidence, places: Sequence[SetUp], causes: Sequence[Cause]
) -> list[str]:
    """The evidence, a sentence each."""
    found, wanted = from_si(rms, "mm"), from_si(expected, "mm")
    out = [
        f"RMS {found:.3f} mm after fitting the base, {wanted:.3f} mm expected from noise and the model's uncertainty "
        f"({evidence.degrees} degrees of freedom, p = {p_value:.2g})"
    ]
    for place in places:
        motion = place.to_json_dict()
        where = f"station {place.name}" if place.name else "the instrument"
        xyz = ", ".join(f"{v:.2f}" for v in motion["xyz_mm"])
        rpy = ", ".join(f"{v:.3f}" for v in motion["rpy_deg"])
        out.append(f"{where}: the base has moved by xyz {xyz} mm, rpy {rpy} deg in the measuring frame; fitted anew")
    for cause in causes:
        if cause.equivalents:
            names = ", ".join(spoken(label) for label in cause.equivalents)
            out.append(f"these poses do not tell {spoken(cause.label)} from {names}")
    return out


def _digits(std: float) -> int:
    """Decimals that show one or two digits of a standard deviation."""
    if not (math.isfinite(std) and std > 0):
        return 3
    return max(0, 1 - math.floor(math.log10(std)))
