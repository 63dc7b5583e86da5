# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Path accuracy and repeatability of measured paths, and what happens at corners (ISO 9283:1998, 8 and 9).

The commanded path is cut by planes square to it. x_ij is where the j-th of n attained paths passes the i-th plane, c_i
where the commanded one does, m_i the mean of x_ij over j, l_ij = |x_ij - m_i|:

    AT = max_i |m_i - c_i|,   RT = max_i (mean_j l_ij + 3 S_j(l_ij)),   S with n - 1

and for each angle a about an axis AT_a = max_i |mean_j a_ij - a_ci|, RT_a = max_i 3 S_j(a_ij). At a corner e, v the
direction in which the path arrives there and w that in which it leaves:

    CR = max_j min |x_j - e|                                      rounding
    CO = max_j max (distance of x_j from the leaving line, of points that lie beyond it along v less its part in w)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.repeatability import turns_between
from fastcal.errors import InvalidInput
from fastcal.units import from_si

FEWEST_RUNS = 2
_STRAIGHT = 0.02  # rad; a bend below this is no corner
_SAME_POINT = 1e-6  # m
MOVE = 1 / 400  # of the commanded length: noise of a point that stands is no move


@dataclass(frozen=True, eq=False)
class PathRun:
    """One attained path: points (N, 3) [m] in the base, in their order, and rotations (N, 3, 3) where measured."""

    points: FloatArray
    rotations: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class CornerFigures:
    """Rounding and overshoot [m] at one corner of the commanded path, the greatest of all runs; 0: no overshoot."""

    corner: int
    rounding: float
    overshoot: float


@dataclass(frozen=True, eq=False)
class PathFigures:
    """What measured paths show.

    Attributes:
        length: Of the commanded path [m].
        along: (M,) length of the commanded path up to each plane [m].
        commanded: (M, 3) c_i [m].
        crossings: (n, M, 3) x_ij [m] of each run.
        turns: (n, M, 3) from the commanded orientation, about the tool's axes [rad]; None: not measured.
        corners: One each.
    """

    length: float
    along: FloatArray
    commanded: FloatArray
    crossings: FloatArray
    turns: FloatArray | None
    corners: tuple[CornerFigures, ...]

    @property
    def runs(self) -> int:
        """Their number n."""
        return len(self.crossings)

    @property
    def mean(self) -> FloatArray:
        """(M, 3) m_i [m]."""
        return np.asarray(self.crossings.mean(axis=0))

    @property
    def accuracy(self) -> FloatArray:
        """(M,) |m_i - c_i| [m]; its greatest is AT."""
        return np.asarray(np.linalg.norm(self.mean - self.commanded, axis=1))

    @property
    def repeatability(self) -> FloatArray:
        """(M,) mean l + 3 S(l) [m]; its greatest is RT."""
        return repeatability(self.crossings)

    @property
    def turn_accuracy(self) -> FloatArray | None:
        """(M, 3) sizes of the mean turns [rad]."""
        return None if self.turns is None else np.abs(self.turns.mean(axis=0))

    @property
    def turn_repeatability(self) -> FloatArray | None:
        """(M, 3) 3 S of the turns [rad]."""
        return None if self.turns is None else np.asarray(3 * self.turns.std(axis=0, ddof=1))

    def to_json_dict(self) -> dict[str, Any]:
        """The content of path.json, in mm and degrees."""
        out: dict[str, Any] = {
            "runs": self.runs,
            "planes": len(self.along),
            "length_mm": from_si(self.length, "mm"),
            "AT_mm": from_si(float(self.accuracy.max()), "mm"),
            "AT_at_mm": from_si(float(self.along[self.accuracy.argmax()]), "mm"),
            "RT_mm": from_si(float(self.repeatability.max()), "mm"),
            "RT_at_mm": from_si(float(self.along[self.repeatability.argmax()]), "mm"),
        }
        if self.turn_accuracy is not None and self.turn_repeatability is not None:
            for symbol, each in (("AT", self.turn_accuracy), ("RT", self.turn_repeatability)):
                for name, value in zip("xyz", each.max(axis=0), strict=True):
                    out[f"{symbol}_r{name}_deg"] = from_si(float(value), "deg")
        out["corners"] = [
            {
                "corner": each.corner,
                "CR_mm": from_si(each.rounding, "mm"),
                "CO_mm": from_si(each.overshoot, "mm"),
            }
            for each in self.corners
        ]
        return out


def path_figures(
    corners: FloatArray, runs: Sequence[PathRun], *, planes: int = 50, rotation: FloatArray | None = None
) -> PathFigures:
    """AT, RT and the corners' figures of attained paths beside a commanded one of straight lines.

    Planes lie evenly within each line, and not at its ends, where the path has no direction: (k + 1/2) of equal parts.

    Args:
        corners: (K, 3) points of the commanded path in their order [m]; the last may be the first: a closed path.
        runs: Two at least; the standard asks for ten.
        planes: In all, shared by the lines as their lengths are, two a line at least.
        rotation: (3, 3) commanded orientation, kept along the path; None: turns are not judged.

    Raises:
        InvalidInput: Fewer than two points or runs, two equal points in a row, or a run that does not pass a plane.
    """
    corners = np.asarray(corners, dtype=float)
    if len(corners) < 2 or len(runs) < FEWEST_RUNS:
        raise InvalidInput(
            f"expected a path of at least 2 points and at least {FEWEST_RUNS} runs of it, got "
            f"{_counted(len(corners), 'point')} and {_counted(len(runs), 'run')}"
        )
    steps = np.diff(corners, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if lengths.min() < _SAME_POINT:
        raise InvalidInput(f"points {int(lengths.argmin()) + 1} and {int(lengths.argmin()) + 2} of the path are equal")
    directions = steps / lengths[:, np.newaxis]
    line, along, commanded = _planes(corners, lengths, directions, planes)
    parts = [_lines_of(j, run, corners, lengths, directions) for j, run in enumerate(runs)]
    turned = rotation is not None and all(run.rotations is not None for run in runs)
    x = np.empty((len(runs), len(line), 3))
    turns = np.empty_like(x)
    for j, (run, own) in enumerate(zip(runs, parts, strict=True)):
        for i, k in enumerate(line):
            at, share = _crossing(run.points[own[k]], commanded[i], directions[k], j, along[i])
            first, second = own[k].start + at, own[k].start + at + 1
            x[j, i] = (1 - share) * run.points[first] + share * run.points[second]
            if turned and rotation is not None and run.rotations is not None:
                two = turns_between(np.array([rotation, rotation]), run.rotations[[first, second]])
                turns[j, i] = (1 - share) * two[0] + share * two[1]
    return PathFigures(
        length=float(lengths.sum()),
        along=along,
        commanded=commanded,
        crossings=x,
        turns=turns if turned else None,
        corners=_corners(corners, directions, runs, parts),
    )


def repeatability(x: FloatArray) -> FloatArray:
    """(M,) mean l + 3 S(l) [m] of places x (n, M, 3), l their distances from their mean."""
    size = np.linalg.norm(x - x.mean(axis=0), axis=2)
    return np.asarray(size.mean(axis=0) + 3 * size.std(axis=0, ddof=1))


def arc_length(points: FloatArray, move: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """(N,) the way up to each point [m] along those that are a `move` [m] from the one before, and which these are."""
    kept = [0]
    x, y, z = points[0].tolist()
    for k, (u, v, w) in enumerate(points.tolist()):
        if (u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2 >= move**2:
            kept.append(k)
            x, y, z = u, v, w
    at = np.array(kept if kept[-1] == len(points) - 1 else [*kept, len(points) - 1])
    far = np.cumsum(np.append(0.0, np.linalg.norm(np.diff(points[at], axis=0), axis=1)))
    return np.interp(np.arange(len(points)), at, far), at


def _counted(count: int, noun: str) -> str:
    """1 to "1 run", 5 to "5 runs"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _planes(
    corners: FloatArray, lengths: FloatArray, directions: FloatArray, planes: int
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """(M,) the line of each plane, its length along the path and its point (M, 3)."""
    counts = np.maximum(2, np.round(planes * lengths / lengths.sum()).astype(np.int64))
    line = np.repeat(np.arange(len(lengths)), counts)
    own = np.concatenate([(np.arange(count) + 0.5) / count for count in counts]) * lengths[line]
    return (
        line,
        np.cumsum(np.append(0, lengths[:-1]))[line] + own,
        corners[line] + own[:, np.newaxis] * directions[line],
    )


def _lines_of(
    number: int, run: PathRun, corners: FloatArray, lengths: FloatArray, directions: FloatArray
) -> list[slice]:
    """The stretch of a run that belongs to each line: parted where the run is nearest to the corner between them.

    Corners are looked for one after the other, each among the points from the last corner on up to where the run has
    gone as far as half of the next line, so that a closed path is not parted where it began.
    """
    far, _ = arc_length(run.points, MOVE * float(lengths.sum()))
    ends = np.cumsum(lengths) * far[-1] / lengths.sum()
    cuts = [0]
    for k in range(1, len(corners) - 1):
        reach = 0.5 * min(lengths[k - 1], lengths[k]) * far[-1] / lengths.sum()
        near = np.flatnonzero((far >= max(ends[k - 1] - reach, far[cuts[-1]])) & (far <= ends[k - 1] + reach))
        if not len(near):
            raise InvalidInput(
                f"run {number + 1} has no point near corner {k + 1} of the path; expected points along the whole of it"
            )
        away = np.linalg.norm(run.points[near] - corners[k], axis=1)
        cuts.append(int(near[away.argmin()]))
    cuts.append(len(run.points) - 1)
    return [slice(a, b + 1) for a, b in pairwise(cuts)]


def _crossing(points: FloatArray, c: FloatArray, direction: FloatArray, run: int, along: float) -> tuple[int, float]:
    """Where points (N, 3) first pass the plane through c: the point before, and the share of the way to the next."""
    ahead = (points - c) @ direction
    passing = np.flatnonzero((ahead[:-1] < 0) & (ahead[1:] >= 0))
    if not len(passing):
        raise InvalidInput(f"run {run + 1} does not pass the plane at {from_si(along, 'mm'):.1f} mm of the path")
    at = int(passing[0])
    return at, float(ahead[at] / (ahead[at] - ahead[at + 1]))


def _corners(
    corners: FloatArray, directions: FloatArray, runs: Sequence[PathRun], parts: Sequence[Sequence[slice]]
) -> tuple[CornerFigures, ...]:
    """Rounding and overshoot where the path bends."""
    found = []
    for k in range(1, len(corners) - 1):
        arrives, leaves = directions[k - 1], directions[k]
        if arrives @ leaves > np.cos(_STRAIGHT):
            continue
        outward = arrives - (arrives @ leaves) * leaves
        rounding, overshoot = [], []
        for run, own in zip(runs, parts, strict=True):
            both = run.points[own[k - 1].start : own[k].stop] - corners[k]
            rounding.append(np.linalg.norm(both, axis=1).min())
            after = run.points[own[k]] - corners[k]
            off = after - np.outer(after @ leaves, leaves)
            beyond = off[off @ outward > 0] if np.linalg.norm(outward) > _SAME_POINT else off
            overshoot.append(np.linalg.norm(beyond, axis=1).max(initial=0.0))
        found.append(CornerFigures(k + 1, float(max(rounding)), float(max(overshoot))))
    return tuple(found)
