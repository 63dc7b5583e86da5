# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What `fastcal accept` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fastcal.acceptance.judgement import UNITS
from fastcal.report.language import _
from fastcal.said import said
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance, PathVerdict

_VERDICTS = {
    "": said("not judged"),
    "pass": said("pass"),
    "fail": said("fail"),
    "cannot_tell": said("cannot tell"),
}


def acceptance_lines(found: Acceptance, source: str) -> list[str]:
    """The verdict and the worst of each figure, a line each; `source` names the data."""
    names = {"arm": found.model.name, "data": source, "verdict": _(_VERDICTS[found.verdict or ""])}
    if found.probability is None:
        lines = [_("{arm} on {data}: {verdict}", **names)]
    else:
        chance = float(found.probability)
        lines = [
            _("{arm} on {data}: {verdict}, probability of keeping the limits {chance:.3f}", chance=chance, **names)
        ]
    for symbol in dict.fromkeys(each.figure.symbol for each in found.figures if "_" not in each.figure.symbol):
        several = [each for each in found.figures if each.figure.symbol == symbol]
        worst = max(several, key=lambda each: abs(each.figure.value))
        value, expanded = (from_si(abs(v), "mm") for v in (worst.figure.value, worst.uncertainty.expanded))
        numbers: dict[str, Any] = {"symbol": symbol, "value": value, "where": worst.figure.where, "expanded": expanded}
        if worst.limit is None:
            lines.append(_("{symbol}: at most {value:.4f} mm at {where}, +- {expanded:.4f} mm", **numbers))
        else:
            numbers |= {"limit": float(from_si(worst.limit, "mm"))}
            lines.append(
                _("{symbol}: at most {value:.4f} mm at {where}, +- {expanded:.4f} mm, limit {limit:g} mm", **numbers)
            )
    for symbol in ("AP", "RP"):
        turned = [e for e in found.figures if e.figure.symbol.startswith(f"{symbol}_r")]
        if turned:
            worst = max(turned, key=lambda each: abs(each.figure.value))
            lines.append(
                _(
                    "{symbol}: at most {value:.4f} deg at {where}, +- {expanded:.4f} deg",
                    symbol=worst.figure.symbol,
                    value=float(from_si(abs(worst.figure.value), "deg")),
                    where=worst.figure.where,
                    expanded=float(from_si(worst.uncertainty.expanded, "deg")),
                )
            )
    return lines


def path_verdict_lines(found: PathVerdict) -> list[str]:
    """What follows from a path's limits, a line each figure; nothing without limits."""
    if found.verdict is None:
        return []
    lines = [_("limits of the path: {verdict}", verdict=_VERDICTS[found.verdict])]
    for each in found.figures:
        unit = UNITS[each.figure.unit]
        value, expanded, limit = (
            float(from_si(v, unit)) for v in (abs(each.figure.value), each.uncertainty.expanded, each.limit or 0.0)
        )
        text = _(
            "{symbol}: {value:.4f} {unit} at {where}, +- {expanded:.4f} {unit}, limit {limit:g} {unit}: {verdict}",
            symbol=each.figure.symbol,
            value=value,
            unit=unit,
            where=each.figure.where,
            expanded=expanded,
            limit=limit,
            verdict=_VERDICTS[each.verdict or ""],
        )
        lines.append(text)
    return lines + [_("{name}: no measurement determines it", name=name) for name in found.missing]
