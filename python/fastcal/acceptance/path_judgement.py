# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do measured paths keep their limits? With guard bands, as the figures of poses do.

Of AT, RT and the turns each plane is a figure, whose u is the jackknife's over the n runs, with n - 1 degrees of
freedom; a frame that was fitted to the paths is taken as it is. CR and CO are by definition the greatest of the runs
that were driven, and are held against their limits as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal.acceptance.figures import AXES, Figure, jackknife
from fastcal.acceptance.judgement import PATH_LIMITS, Judged, Verdict, judged, least_sure, overall, parsed_limits
from fastcal.acceptance.path_figures import PathFigures, repeatability
from fastcal.arrays import FloatArray
from fastcal.budget.evaluation import combined
from fastcal.errors import InvalidInput
from fastcal.said import said
from fastcal.units import from_si

FEWEST_JUDGED = 3  # runs: without one of them two must still show how the arm repeats


@dataclass(frozen=True, eq=False)
class PathVerdict:
    """What follows for measured paths from limits.

    Attributes:
        verdict: pass where each plane and corner keeps its limit, fail where one does not; None where none was given.
        figures: Of each symbol that has a limit the figure that keeps it least surely.
        missing: Limits that nothing measured shows.
    """

    verdict: Verdict | None = None
    figures: tuple[Judged, ...] = ()
    missing: tuple[str, ...] = ()

    def to_json_dict(self) -> dict[str, Any]:
        """The verdict's part of path.json, in mm and degrees."""
        figures = [each.to_json_dict() for each in self.figures]
        return {"verdict": self.verdict, "figures": figures, "missing": list(self.missing)}


def judged_path(found: PathFigures, limits: Mapping[str, float]) -> PathVerdict:
    """Holds measured paths against limits by name, in their unit: at_mm, rt_mm, cr_mm, co_mm, at_deg, rt_deg.

    Raises:
        InvalidInput: An unknown limit, one that is not above 0, or fewer than three runs.
    """
    asked = parsed_limits(limits, PATH_LIMITS)
    if not asked:
        return PathVerdict()
    if found.runs < FEWEST_JUDGED:
        raise InvalidInput(f"limits of a path need at least {FEWEST_JUDGED} runs of it, got {found.runs}")
    figures = [figure for figure in _figures(found) if figure.symbol in asked]
    every = [judged(figure, combined(figure.spread, figure.freedom, []), asked) for figure in figures]
    known = {figure.symbol for figure in figures}
    missing = [name for name in limits if not known.intersection(PATH_LIMITS[name])]
    return PathVerdict(overall(every, missing), tuple(least_sure(every)), tuple(missing))


def _figures(found: PathFigures) -> Iterator[Figure]:
    """All figures of all planes and corners."""

    def accuracy(x: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(x.mean(axis=0) - found.commanded, axis=1))

    yield from _at_planes(found, "AT", "m", accuracy, found.crossings)
    yield from _at_planes(found, "RT", "m", repeatability, found.crossings)
    if found.turns is not None:
        for axis, name in enumerate(AXES):
            own = found.turns[:, :, axis]
            yield from _at_planes(found, f"AT_r{name}", "rad", lambda t: np.asarray(t.mean(axis=0)), own)
            yield from _at_planes(found, f"RT_r{name}", "rad", lambda t: np.asarray(3 * t.std(axis=0, ddof=1)), own)
    for each in found.corners:
        where = said("corner {corner}", corner=each.corner)
        yield Figure("CR", where, "m", each.rounding)
        yield Figure("CO", where, "m", each.overshoot)


def _at_planes(
    found: PathFigures, symbol: str, unit: str, of: Callable[[FloatArray], FloatArray], runs: FloatArray
) -> Iterator[Figure]:
    """A figure a plane: `of` the runs (n, M, ...) gives (M,)."""
    for along, value, u in zip(found.along, of(runs), jackknife(of, runs), strict=True):
        where = said("{along:.1f} mm of the path", along=float(from_si(float(along), "mm")))
        yield Figure(symbol, where, unit, float(value), None, float(u), len(runs) - 1)
