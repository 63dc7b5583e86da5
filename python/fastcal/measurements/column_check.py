# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Notices columns that were meant otherwise: a wrong unit, joints swapped, turned or shifted, left-handed points.

The nominal robot, laid onto the points by the best rigid base and tool, misses them by its own errors, a few
thousandths of its reach. Where it misses by far more, every single other reading of the columns is tried. One that
explains the data several times better is what was probably meant; it is told with both figures, and nothing is changed.

Readings are compared by RMS misfit / RMS spread of the points, which units of length leave as it is, so that shrinking
the points explains nothing; a ratio above 1 counts as 1, for the mean of the points does as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.dataset import Dataset
from fastcal.units import factor, from_si, to_si, unit_names

FloatArray = NDArray[np.float64]
Misfit = Callable[[FloatArray, FloatArray], float]
Reading = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

BAD_SHARE = 0.01  # of the reach; nominal arms miss by 0.001 to 0.005
BETTER_BY = 5.0
SIMILAR = 1.5  # readings this near to the best one can't be told from it
FEWEST_ROWS = 8  # base and tool alone adapt to 9 numbers, three rows
MOST_ROWS = 60
MIRROR = np.array([1.0, 1.0, -1.0])
TURNS = tuple((f"shifted by {degrees:g} deg", to_si(degrees, "deg")) for degrees in (90.0, -90.0, 2 * 90.0))


@dataclass(frozen=True)
class Suspicion:
    """What the columns were probably meant to be.

    Attributes:
        meant: The reading that explains the data.
        others: Further readings that explain them about as well.
        rms_read: RMS distance between nominal robot and points as read [m].
        rms_meant: The same with the columns as they were probably meant [m].
        reach: The robot's reach [m].
    """

    meant: str
    others: tuple[str, ...]
    rms_read: float
    rms_meant: float
    reach: float

    @property
    def message(self) -> str:
        """The suspicion and its evidence in one sentence."""
        read, meant = (f"{from_si(rms, 'mm'):.4g} mm" for rms in (self.rms_read, self.rms_meant))
        reach = f"{from_si(self.reach, 'mm'):.4g} mm"
        either = f" (or: {'; '.join(self.others)})" if self.others else ""
        return (
            f"the points do not fit this robot: as read, it misses them by {read} RMS after the best fit of base and "
            f"tool, with a reach of {reach}; with {self.meant} it would be {meant}{either}; nothing was changed"
        )


def plausible(dataset: Dataset, robot: RobotFacts, misfit: Misfit) -> Suspicion | None:
    """Holds measured points against the nominal robot; None where they fit it, or where no other reading fits better.

    Args:
        dataset: Its rows with a whole point are looked at, up to 60 of them.
        robot: The nominal arm's joint types and reach.
        misfit: RMS distance [m] between the nominal robot at q (N, n) and points (N, 3) after the best rigid fit of
            base and tool. Called once where the data fit, else about a hundred times.
    """
    if dataset.position is None:
        return None
    rows = np.flatnonzero(~np.isnan(dataset.position).any(axis=1))
    if len(rows) < FEWEST_ROWS:
        return None
    # Scattered and not at equal steps, which may fall in with the steps of a grid.
    rows = np.random.default_rng(0).permutation(rows)[:MOST_ROWS]
    q, position = dataset.q[rows], dataset.position[rows]
    as_read = misfit(q, position)
    if as_read <= BAD_SHARE * robot.reach:
        return None
    found = []
    for simplicity, meaning, reading in _readings(list(robot.joint_types)):
        q_meant, position_meant = reading(q, position)
        rms = misfit(q_meant, position_meant)
        found.append((simplicity, rms / _spread(position_meant), rms, meaning))
    best = min(share for _, share, _, _ in found)
    if not best * BETTER_BY < min(1.0, as_read / _spread(position)):
        return None
    # Where base or tool take up a shift of a joint, its sign turned and any shift do as well as the sign alone.
    similar = sorted(entry for entry in found if entry[1] <= SIMILAR * best)
    (simplest, _, rms_meant, meant), *rest = similar
    others = tuple(meaning for simplicity, _, _, meaning in rest if simplicity == simplest)
    return Suspicion(meant, others, as_read, rms_meant, robot.reach)


def _spread(position: FloatArray) -> float:
    """RMS distance of points (N, 3) from their mean [m]."""
    distances = np.linalg.norm(position - position.mean(axis=0), axis=1)
    return max(float(np.sqrt(np.mean(distances**2))), np.finfo(np.float64).tiny)


def _readings(joint_types: list[str]) -> Iterator[tuple[int, str, Reading]]:
    """Every other way in which one thing may have been meant: a rank (0 the simplest), words, the data so read."""
    for words, ratio in _unit_slips("length"):
        yield 0, f"the points in {words}", _scaled(np.full(3, ratio))
    yield 0, "one axis of the points turned round or two of them swapped (they are left-handed)", _scaled(MIRROR)
    for joint_type, kind in (("revolute", "angle"), ("prismatic", "length")):
        joints = [joint for joint, found in enumerate(joint_types) if found == joint_type]
        for words, ratio in _unit_slips(kind):
            if len(joints) > 1:
                yield 0, f"all {joint_type} joints in {words}", _changed(joints, ratio, 0.0)
            for joint in joints:
                yield 0, f"joint {joint + 1} in {words}", _changed([joint], ratio, 0.0)
        for first, second in combinations(joints, 2):
            yield 0, f"the columns of joints {first + 1} and {second + 1} swapped", _swapped(first, second)
        for joint in joints:
            yield 0, f"the sign of joint {joint + 1} turned", _changed([joint], -1.0, 0.0)
            for words, shift in TURNS if joint_type == "revolute" else ():
                yield 1, f"joint {joint + 1} {words}", _changed([joint], 1.0, shift)
                yield 2, f"the sign of joint {joint + 1} turned and it {words}", _changed([joint], -1.0, shift)


def _unit_slips(kind: str) -> Iterator[tuple[str, float]]:
    """Pairs of units of a kind: which was meant and which was read, and the ratio; one pair for each ratio."""
    seen: set[str] = set()
    for meant, read in permutations(unit_names(kind), 2):
        ratio = factor(meant) / factor(read)
        if f"{ratio:.6g}" not in seen:
            seen.add(f"{ratio:.6g}")
            yield f"{meant} where they were read in {read}", ratio


def _scaled(ratios: FloatArray) -> Reading:
    return lambda q, position: (q, position * ratios)


def _changed(joints: list[int], ratio: float, shift: float) -> Reading:
    def reading(q: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        meant = q.copy()
        meant[:, joints] = ratio * q[:, joints] + shift
        return meant, position

    return reading


def _swapped(first: int, second: int) -> Reading:
    def reading(q: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        meant = q.copy()
        meant[:, [first, second]] = q[:, [second, first]]
        return meant, position

    return reading
