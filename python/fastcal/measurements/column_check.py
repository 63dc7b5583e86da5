# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finds columns that were meant otherwise: units, signs, zeros, exchanged columns and rows, conventions of orientation.

The nominal robot, laid onto the data by the best base and tool, misses them by its own errors. Other readings of the
columns are tried, with one thing changed and, where the data fit badly, with several. One that explains the data at
least five times better is what was probably meant; it is given with both figures, and nothing is changed. Points are
judged first; orientations where the points fit.

Bounds (`frame_fit`) cost some ten microseconds a reading and leave few to be fitted. Zeros of the joints are fitted
too, to as-read columns as to all others, since a badly mastered joint is what a calibration is for: it makes no other
reading better, and is none as long as it stays below `MASTERED`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.column_readings import Reading, Source, known_scale, sources
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.frame_fit import Frames, Poses, base_matrix, fitted, point_bounds
from fastcal.measurements.joint_maps import Change, JointMap, JointMaps, Joints, is_quarter, joints_of
from fastcal.said import Said, chained, joined, said
from fastcal.units import from_si, to_si

NEGLIGIBLE_SHARE = 1e-4  # of the reach; what misses by less has been read as it was meant
SEVERAL_SHARE = 2e-3  # of the reach; what misses by more is read with several things changed as well
NEGLIGIBLE_TURN = 3e-3  # [rad] the same for orientations
SEVERAL_TURN = 0.1  # [rad]
FITS = 0.01  # of the reach; a reading that leaves more explains nothing
MASTERED = to_si(15.0, "deg")  # zeros nearer than this are for the calibration to identify
DETERMINED = to_si(1.0, "deg")  # to which points must show a zero that is named
BETTER_BY = 5.0
BETTER_AT_ONCE = 2.0  # the same before any zero is moved
SIMILAR = 1.5  # readings this close to the best one can't be distinguished from it
FEWEST_OFF = 4  # rows off that another reading must explain, more than the tool has numbers
FEWEST_ROWS = 8  # of different postures; base and tool alone adapt to 9 numbers, three rows
MOST_ROWS = 60
MOST_STRETCHED = 1.5  # a base that fits must be, one direction beside another
_BOUND_ROWS = 30
_SAME = to_si(0.2, "deg")  # postures that differ by less are one
_FITTED = 32  # readings of the least bounds
_MOST_TWICE = 20_000  # readings that are tried on two parts of the rows, as one of them may hold gross rows
_AT_ONCE = 512
_AWAY = 5.0  # medians of the distances from the middle of all points
_EXACT = 1e-6  # share below which readings fit alike
_MORE_COMPLEX = 2.0  # changes by which a reading that fits alike may exceed the simplest and still be told
_OTHERS = 3


def in_mm(size: float) -> Said:
    """A misfit [m] in words."""
    return said("{size:.4g} mm", size=float(from_si(size, "mm")))


def in_deg(size: float) -> Said:
    """A misfit [rad] in words."""
    return said("{size:.4g} deg", size=float(from_si(size, "deg")))


@dataclass(frozen=True)
class Suspicion:
    """What the columns were probably meant to be.

    Attributes:
        meant: The reading that explains the data.
        others: Further readings that explain them about as well.
        read: RMS misfit between nominal robot and data as read, with its unit in words.
        better: The same with the columns as they were probably meant.
        reach: The robot's reach [m].
        what: What was held against the robot: points or orientations.
        write: What to write in place of each joint.
        refused: The data are not to be used so; else a robust fit does without the rows concerned.
        where: The rows that are spoken of, where it is not all.
        advice: What to do, where it is not to write the columns as they were meant.
    """

    meant: str
    others: tuple[str, ...]
    read: str
    better: str
    reach: float
    what: str = "points"
    write: tuple[str, ...] = ()
    refused: bool = True
    where: str = ""
    advice: str = ""

    @property
    def message(self) -> Said:
        """The suspicion and its evidence in one sentence."""
        head = said(
            "the {what} do not fit this robot: as read, it misses {them} by {read} RMS after the best fit of base and "
            "tool",
            what=said("points") if self.what == "points" else said("orientations"),
            them=said("them in {where}", where=self.where) if self.where else said("them"),
            read=self.read,
        )
        if self.what == "points":
            head = said("{head}, with a reach of {reach:.4g} mm", head=head, reach=float(from_si(self.reach, "mm")))
        better = said("with {meant} it would be {better}", meant=self.meant, better=self.better)
        if self.others:
            others = chained("{first}; or: {second}", self.others)
            better = said("{better} (or: {others})", better=better, others=others)
        parts: list[str] = [head, better]
        if self.write:
            parts.append(said("the chain's joints would be {joints}", joints=", ".join(self.write)))
        if self.where:
            parts.append(said("the rows beside {where} do not go with these as well", where=self.where))
        parts += [self.advice] if self.advice else []
        return joined("; ", [*parts, said("nothing was changed")])


@dataclass(frozen=True)
class Found:
    """A reading that was fitted: what it changes, and how well it explains the data.

    Attributes:
        changes: In words; empty as read.
        share: What readings are compared by.
        misfit: RMS in m or rad.
        write: What to write for the joints.
        unmoved: The share without any zero that is fitted.
    """

    changes: list[Change]
    share: float
    misfit: float
    write: tuple[str, ...] = ()
    unmoved: float = np.inf

    @property
    def cost(self) -> float:
        """How far from simple it is."""
        return sum(change.cost for change in self.changes)

    @property
    def parts(self) -> frozenset[tuple[object, ...]]:
        """What it changes."""
        return frozenset().union(*(change.parts for change in self.changes))

    @property
    def words(self) -> str:
        """As it stands after "with"."""
        *first, last = [change.words for change in self.changes]
        return said("{first} and {last}", first=joined(", ", first), last=last) if first else last


class Points:
    """The points of a data set beside the nominal arm."""

    def __init__(self, dataset: Dataset, robot: RobotFacts, poses: Poses, joints: Joints | None = None) -> None:
        """`joints`: whose columns can be read otherwise; None: all of the robot's."""
        self.robot, self.poses, self._rough = robot, poses, False
        self.rows = one_set_up(dataset)
        self.dataset = dataset = dataset if len(self.rows) == len(dataset) else dataset.select(self.rows)
        self.joints = joints_of(tuple(robot.joint_types)) if joints is None else joints
        rows = None if dataset.position is None else chosen_rows(dataset.position, dataset.q)
        self.sources = [] if rows is None else [s for s in sources(dataset, rows) if len(s.q) >= FEWEST_ROWS]

    @cached_property
    def as_read(self) -> Frames | None:
        """Base and tool of the columns as they are; None where there are too few points."""
        return self.frames(Reading(self.sources[0], self.joints.as_read)) if self.sources else None

    def frames(self, reading: Reading, free: Sequence[int] = ()) -> Frames:
        """Base and tool of a reading, and the zeros of the joints `free`."""
        return fitted(self.poses, reading.q, reading.position, free)

    def suspicion(self, *, several: bool = False) -> Suspicion | None:
        """What was probably meant, where it is another reading; with `several`, one with more than two changes too."""
        if self.as_read is None or self.as_read.rms <= NEGLIGIBLE_SHARE * self.robot.reach:
            return None
        as_read, spread = self.as_read.rms, spread_of(self.sources[0].position)
        reach = self.robot.reach
        worth = self._worth_fitting(self.joints.simple, None, min(1.0, as_read / spread) / BETTER_BY)
        if not worth and as_read <= SEVERAL_SHARE * reach:
            return None
        plain = Reading(self.sources[0], self.joints.as_read)
        least = min(as_read, self.frames(plain, self.joints.shiftable).rms)
        to_beat = min(1.0, least / spread) / BETTER_BY
        self._rough = as_read > SEVERAL_SHARE * reach
        worth = self._worth_fitting(self.joints.near, None, to_beat, better=self._rough)
        if several:
            worth += self._worth_fitting(self.joints.several, self.joints.pairs, to_beat, better=True)
        found = [each for reading in worth if (each := self._fitted(reading)) is not None]
        if least < as_read / BETTER_BY:  # zeros alone explain the points, and a reading must do so better than these
            to_beat = min(1.0, as_read / spread) / BETTER_BY
            found = [each for each in found if each.share < least / spread / BETTER_BY or each.unmoved < to_beat]
            found.append(self._moved(plain))
        most = min(FITS * reach, as_read / BETTER_AT_ONCE)
        found = [each for each in found if each.misfit < most]
        return best(found, to_beat, in_mm, as_read, reach, "points")

    def by_rows_off(self) -> Suspicion | None:
        """A reading with one change by which all points fit, where as read some are far off and the most are not.

        Rows in which a joint stands at its zero hide how that is read, as where one joint is moved after the other.
        """
        reach, frames = self.robot.reach, self.as_read
        if frames is None or frames.rms > SEVERAL_SHARE * reach:
            return None
        off = frames.distances > FITS * reach
        if off.sum() < FEWEST_OFF:
            return None
        as_read, spread = _rms(frames.distances), spread_of(self.sources[0].position)
        to_beat = min(1.0, as_read / spread) / BETTER_BY
        found = []
        for reading in self._worth_fitting(self.joints.simple, None, to_beat, better=True):
            distances = self.frames(reading).distances
            if reading.scale == 1.0 and not (distances > FITS * reach).any():
                left = _rms(distances)
                write = tuple(self.joints.formulas(reading.joints))
                found.append(Found(reading.changes(self.joints), left / spread, left, write))
        return best(found, to_beat, lambda rms: f"{from_si(rms, 'mm'):.4g} mm", as_read, reach, "points")

    @property
    def far_off(self) -> bool:
        """Are the points, as read, farther off than any nominal arm is?"""
        return self.as_read is not None and self.as_read.rms > FITS * self.robot.reach

    def _worth_fitting(
        self, own: JointMaps, others: JointMaps | None, to_beat: float, better: bool = False
    ) -> list[Reading]:
        """Readings of which bounds leave it possible that they beat, or are similar to, one that beats what is read.

        Args:
            own: Readings of the joints.
            others: The same where points and joints stand otherwise beside each other; None: as read.
            to_beat: A share of the points' spread.
            better: Those too of which the bound is below that of what is read: gross rows may lie in all bounds alike.
        """
        bounds, readings = [], []
        plain = one_map(self.joints.as_read)
        as_read = self._bounds(self.sources[0], plain)[0] if better else 0.0
        for source in self.sources:
            maps = plain.and_(own if source is self.sources[0] else others)
            found = self._bounds(source, maps)
            for k in np.argsort(found, kind="stable")[:_FITTED].tolist():
                if found[k] <= max(SIMILAR * to_beat, float(as_read)):
                    bounds.append(float(found[k]))
                    readings.append(Reading(source, maps[k]))
        order = np.argsort(bounds, kind="stable").tolist()
        return [readings[k] for k in order[:_FITTED]]

    def _bounds(self, source: Source, maps: JointMaps) -> FloatArray:
        """(S,) bounds of all readings of the joints, of some of a source's rows: the lower of two parts' of these."""
        near = within(source.position)
        halves = [near[:_BOUND_ROWS]]
        if len(maps) <= _MOST_TWICE and len(near) >= 2 * _BOUND_ROWS:
            halves.append(near[_BOUND_ROWS : 2 * _BOUND_ROWS])
        bounds = [self._bounds_of(source.q[rows], source.position[rows], maps) for rows in halves]
        return np.asarray(np.min(bounds, axis=0))

    def _bounds_of(self, q: FloatArray, position: FloatArray, maps: JointMaps) -> FloatArray:
        parts = []
        for some in maps.parts(_AT_ONCE):
            there = some.read(q)
            T = self.poses(there.reshape(-1, q.shape[1])).reshape(*there.shape[:2], 4, 4)
            parts.append(point_bounds(T, position))
        return np.concatenate(parts)

    def _fitted(self, reading: Reading) -> Found | None:
        """A reading in the unit that fits; None where only a base that is no rotation makes it fit."""
        G = base_matrix(self.poses(reading.q), reading.position)
        lengths = np.linalg.svd(G, compute_uv=False)
        if lengths[1] < lengths[0] / MOST_STRETCHED:  # the third is open where points lie in a plane
            return None
        size = float(np.sqrt(lengths[0] * lengths[1])) * (-1.0 if np.linalg.det(G) < 0 else 1.0)
        return self._moved(reading._replace(scale=known_scale(size)))

    def _moved(self, reading: Reading) -> Found:
        """A reading with zeros that are far off nominal moved, and what is then left."""
        free = self.frames(reading, self.joints.shiftable if self._rough else ())
        far = (np.abs(free.zero) >= MASTERED) | ~is_quarter(reading.joints.zero)
        far &= free.zero_std < DETERMINED
        moved = JointMap(reading.joints.matrix, reading.joints.zero + np.where(far, free.zero, 0.0))
        reading = reading._replace(joints=moved)
        plain = self.frames(reading) if self._rough else free
        spread = spread_of(reading.position)
        share, unmoved = min(plain.rms, free.rms) / spread, np.inf if far.any() else plain.rms / spread
        return Found(reading.changes(self.joints), share, plain.rms, tuple(self.joints.formulas(moved)), unmoved)


def best(
    found: Iterable[Found], to_beat: float, text: Callable[[float], str], as_read: float, reach: float, what: str
) -> Suspicion | None:
    """The simplest of the readings that fit best, where their share beats `to_beat`, and others that fit alike."""
    changed = [each for each in found if each.changes]
    least = min((each.share for each in changed), default=np.inf)
    if not least < to_beat:
        return None
    alike = [each for each in changed if each.share <= max(SIMILAR * least, _EXACT)]
    told: list[Found] = []
    for each in sorted(alike, key=lambda each: (each.cost, each.share)):
        # One that holds another and something more says nothing new.
        if not any(other.parts <= each.parts for other in told):
            told.append(each)
    meant = told[0]
    others = [each.words for each in told[1:] if each.cost <= meant.cost + _MORE_COMPLEX][:_OTHERS]
    return Suspicion(meant.words, tuple(others), text(as_read), text(meant.misfit), reach, what, meant.write)


def one_set_up(dataset: Dataset) -> NDArray[np.int64]:
    """The rows of the station and mount that have most of them: one base and one tool."""
    labels = [codes for codes in (dataset.station, dataset.mount) if codes is not None]
    if not labels:
        return np.arange(len(dataset))
    group = np.unique(np.stack(labels), axis=1, return_inverse=True)[1].reshape(-1)
    return np.flatnonzero(group == np.argmax(np.bincount(group)))


def _rms(distances: FloatArray) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def one_map(of: JointMap) -> JointMaps:
    """A single one as many."""
    return JointMaps(of.matrix[np.newaxis], of.zero[np.newaxis])


def chosen_rows(values: FloatArray, q: FloatArray) -> NDArray[np.int64] | None:
    """Up to 60 rows that are whole, of as many postures q (N, n); None where there are too few to judge by."""
    rows = np.flatnonzero(~np.isnan(values).any(axis=1))
    # Scattered and not at equal steps, which may fall in with the steps of a grid.
    rows = np.random.default_rng(0).permutation(rows)
    first = np.unique(np.round(q[rows] / _SAME), axis=0, return_index=True)[1]
    return rows[np.sort(first)][:MOST_ROWS] if len(first) >= FEWEST_ROWS else None


def spread_of(position: FloatArray) -> float:
    """RMS distance of points (N, 3) from their median [m], rows far off left out."""
    near = position[within(position)]
    distances = np.linalg.norm(near - np.median(position, axis=0), axis=1)
    return max(float(np.sqrt(np.mean(distances**2))), float(np.finfo(np.float64).tiny))


def within(position: FloatArray) -> NDArray[np.int64]:
    """Rows of points (N, 3) that do not lie far away from all others."""
    distances = np.linalg.norm(position - np.median(position, axis=0), axis=1)
    return np.flatnonzero(distances <= _AWAY * np.median(distances))
