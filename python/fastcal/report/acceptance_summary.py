# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What `fastcal accept` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance


def acceptance_lines(found: Acceptance, source: str) -> list[str]:
    """The verdict and the worst of each figure, a line each; `source` names the data."""
    verdict = (found.verdict or "not judged").replace("_", " ")
    lines = [f"{found.model.name} on {source}: {verdict}"]
    lines[0] += "" if found.probability is None else f", probability of keeping the limits {found.probability:.3f}"
    for symbol in dict.fromkeys(each.figure.symbol for each in found.figures if "_" not in each.figure.symbol):
        several = [each for each in found.figures if each.figure.symbol == symbol]
        worst = max(several, key=lambda each: abs(each.figure.value))
        value, expanded = (from_si(abs(v), "mm") for v in (worst.figure.value, worst.uncertainty.expanded))
        limit = "" if worst.limit is None else f", limit {from_si(worst.limit, 'mm'):g} mm"
        lines.append(f"{symbol}: at most {value:.4f} mm at {worst.figure.where}, +- {expanded:.4f} mm{limit}")
    for symbol in ("AP", "RP"):
        turned = [e for e in found.figures if e.figure.symbol.startswith(f"{symbol}_r")]
        if turned:
            worst = max(turned, key=lambda each: abs(each.figure.value))
            lines.append(
                f"{worst.figure.symbol}: at most {from_si(abs(worst.figure.value), 'deg'):.4f} deg at "
                f"{worst.figure.where}, +- {from_si(worst.uncertainty.expanded, 'deg'):.4f} deg"
            )
    return lines
