# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The runs of a path in what a tracker sent while it was driven, and the instrument's frame.

A stream is resampled by arc length: points evenly along its way, so that neither the rate nor a stop weighs, and noise
while the arm stands is no way. Where it stands are the places at which a run may begin and end; a run is a stretch
between two of them that is as long as the commanded path and has its shape.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fastcal.acceptance.path_figures import MOVE, PathRun, arc_length, path_figures
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import best_motion, nearest_rotation
from fastcal.units import from_si

_STANDS = 8  # times the usual number of points a step, and ...
_FEWEST = 10  # ... points at least: there the arm stands
_LENGTH, _SHAPE = 0.1, 0.03  # of the commanded length: how far a run may differ in length, and in shape (RMS)
_SHARES = 200  # points along a way that are compared
_ROUNDS = 5  # of the frame: planes are square to the commanded lines, and say nothing along them


@dataclass(frozen=True, eq=False)
class _Way:
    """Arc length [m] at each point of a stream (N,), and a point of each place where the arm stands."""

    far: FloatArray
    stands: list[int]


def runs_of(streams: Sequence[PathRun], corners: FloatArray, *, align: bool = False) -> list[PathRun]:
    """Each run of the path in the streams, in their order, as it was recorded.

    Args:
        streams: As recorded: a run each, or several, with the ways back between them.
        corners: (K, 3) of the commanded path [m].
        align: The instrument stands elsewhere, and the first run says where; False: points are in the corners' frame.

    Raises:
        InvalidInput: A stream holds no run of the path.
    """
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    length = float(lengths.sum())
    wanted = _evenly(corners, np.concatenate([[0.0], np.cumsum(lengths)]))
    T: FloatArray | None = None if align else np.eye(4)
    found: list[PathRun] = []
    for number, stream in enumerate(streams):
        way = _way(stream.points, MOVE * length)
        own = []
        last = 0
        for begin, end in _candidates(way, length):
            if begin < last:
                continue
            cut = slice(begin, end + 1)
            here = _evenly(stream.points[cut], way.far[cut])
            tried = best_motion(here, wanted) if T is None else T
            off = here @ tried[:3, :3].T + tried[:3, 3] - wanted
            if np.sqrt(np.mean(np.sum(off**2, axis=1))) <= _SHAPE * length:
                T, last = tried, end
                own.append(PathRun(stream.points[cut], None if stream.rotations is None else stream.rotations[cut]))
        if not own and not way.stands and not align:
            own = [stream]  # a run that was cut by hand, as long as it may be
        if not own:
            got = from_si(float(way.far[-1]), "mm")
            frame = "" if align else ", in the frame of the corners"
            raise InvalidInput(
                f"recording {number + 1} holds no run of this path: expected {from_si(length, 'mm'):.0f} mm of its "
                f"shape between two places where the arm stands{frame}; got {got:.0f} mm of way"
            )
        found += own
    return found


def aligned(runs: Sequence[PathRun], corners: FloatArray, rotation: FloatArray | None = None) -> list[PathRun]:
    """The runs in the frame in which their mean path is nearest to the commanded one.

    With `rotation` (3, 3), the orientation that is commanded, also with the target as if it were mounted so that it is
    attained on average: how it is mounted, measured paths do not show. A path on one line does not show how the
    instrument is turned about it: there turns drop out.
    """
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    wanted = _evenly(corners, np.concatenate([[0.0], np.cumsum(lengths)]))
    here = [_evenly(run.points, arc_length(run.points, MOVE * float(lengths.sum()))[0]) for run in runs]
    T = best_motion(np.concatenate(here), np.tile(wanted, (len(runs), 1)))
    straight = np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)[1] < MOVE * float(lengths.sum())
    points = [PathRun(run.points) for run in runs]
    for _ in range(_ROUNDS):
        found = path_figures(corners, [_moved(run, T) for run in points])
        T = best_motion(found.mean, found.commanded) @ T
    moved = [_moved(run, T) for run in runs]
    if straight:
        return [PathRun(run.points) for run in moved]
    turned = [run.rotations for run in moved if run.rotations is not None]
    if rotation is None or len(turned) < len(moved):
        return moved
    mounted = nearest_rotation(rotation.T @ np.concatenate(turned).mean(axis=0))
    return [PathRun(run.points, own @ mounted.T) for run, own in zip(moved, turned, strict=True)]


def _way(points: FloatArray, step: float) -> _Way:
    """The way along a stream, and where the arm stands."""
    far, at = arc_length(points, step)
    counts = np.diff(at)
    bound = max(_FEWEST, _STANDS * float(np.median(counts)))
    stands = [(int(a) + int(b)) // 2 for a, b in pairwise(at) if b - a > bound]
    return _Way(far, stands)


def _candidates(way: _Way, length: float) -> Iterator[tuple[int, int]]:
    """Stretches (first point, last point) as long as the path, by where they begin, then by their length."""
    places = sorted({0, *way.stands, len(way.far) - 1})
    for k, begin in enumerate(places):
        off = {end: abs(way.far[end] - way.far[begin] - length) for end in places[k + 1 :]}
        for end in sorted(off, key=lambda end: off[end]):
            if off[end] <= _LENGTH * length:
                yield begin, end


def _evenly(points: FloatArray, far: FloatArray) -> FloatArray:
    """(_SHARES, 3) points evenly along a way, by arc length."""
    at = np.linspace(far[0], far[-1], _SHARES)
    return np.column_stack([np.interp(at, far, column) for column in points.T])


def _moved(run: PathRun, T: FloatArray) -> PathRun:
    """The run in another frame."""
    turned = None if run.rotations is None else T[:3, :3] @ run.rotations
    return PathRun(run.points @ T[:3, :3].T + T[:3, 3], turned)
