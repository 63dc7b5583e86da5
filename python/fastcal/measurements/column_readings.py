# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every other way in which the columns of joints and points may have been meant, one or several things changed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.joint_maps import Change, JointMap, Joints, unit_slips
from fastcal.measurements.orientation_readings import inverse, of_quaternion
from fastcal.said import said

Rows = NDArray[np.int64]

MIRROR = np.array([1.0, 1.0, -1.0])
MIRRORED = Change(
    1.0,
    frozenset({("mirror",)}),
    said("one axis of the points turned round or two of them swapped (they are left-handed)"),
)
SAME_UNIT = 1.25  # of a ratio: no two units are nearer to each other
_FURTHEST = 3  # rows by which a whole list is tried late or early


class Source(NamedTuple):
    """Joints and points of some rows, before the joints are read otherwise and the points in another unit.

    Attributes:
        changes: What was changed; none as read.
        q: (M, n) [rad or m].
        position: (M, 3) [m].
        rows: (M,) of the data set.
    """

    changes: list[Change]
    q: FloatArray
    position: FloatArray
    rows: Rows


class Reading(NamedTuple):
    """One way to read joints and points.

    Attributes:
        source: Which rows and which columns.
        joints: How the joints' columns are read.
        scale: Ratio of the points so read to those read; negative where they are mirrored.
    """

    source: Source
    joints: JointMap
    scale: float = 1.0

    @property
    def q(self) -> FloatArray:
        """(M, n) joint positions so read."""
        return self.joints.read(self.source.q)

    @property
    def position(self) -> FloatArray:
        """(M, 3) points so read [m]."""
        return np.asarray(self.source.position * abs(self.scale) * (MIRROR if self.scale < 0 else 1.0))

    def changes(self, of: Joints) -> list[Change]:
        """What it changes."""
        out = [
            Change(1.0, frozenset({("unit of points", words)}), said("the points in {unit}", unit=words))
            for words, ratio in unit_slips("length")
            if np.isclose(abs(self.scale), ratio)
        ]
        return [*self.source.changes, *out, *([MIRRORED] if self.scale < 0 else []), *of.changes(self.joints)]


def sources(dataset: Dataset, rows: Rows) -> Iterator[Source]:
    """The rows as read, and as they would be with points and joints otherwise beside each other."""
    if dataset.position is None:
        return
    q, position = dataset.q, dataset.position
    yield from _late([], q, position, rows)
    if dataset.q_read is not None:
        read = rows[~np.isnan(dataset.q_read[rows]).any(axis=1)]
        words = said("the joint positions read back in place of those commanded")
        yield Source([_one("read back", words)], dataset.q_read[read], position[read], read)
    if dataset.rotation is not None:
        known = ~np.isnan(dataset.rotation).any(axis=1)
        seen_from = np.full_like(position, np.nan)
        R = inverse(of_quaternion(dataset.rotation[known]))
        seen_from[known] = -np.einsum("nij,nj->ni", R, position[known])
        words = said("every pose inverted, the point with the orientation (as a camera in the hand sees its target)")
        yield from _late([_one("inverse", words)], q, seen_from, rows)


def _late(changes: list[Change], q: FloatArray, position: FloatArray, rows: Rows) -> Iterator[Source]:
    """The points in the rows of their joints, some rows late or early, and in reverse order."""
    count = len(position)
    shifted = [(0, "")]
    for step in range(1, _FURTHEST + 1):
        lower = said("the points {count} rows lower than the joints", count=step)
        higher = said("the points {count} rows higher", count=step)
        if step == 1:
            lower, higher = said("the points one row lower than the joints"), said("the points one row higher")
        shifted += [(step, lower), (-step, higher)]
    for step, words in shifted:
        kept = rows[(rows + step >= 0) & (rows + step < count)]
        kept = kept[~np.isnan(position[kept + step]).any(axis=1)]
        more = [_one(("late", step), words)] if step else []
        yield Source([*changes, *more], q[kept], position[kept + step], kept)
    kept = rows[~np.isnan(position[count - 1 - rows]).any(axis=1)]
    backwards = _one("reverse", said("the points in reverse order"))
    yield Source([*changes, backwards], q[kept], position[count - 1 - kept], kept)


def known_scale(scale: float) -> float:
    """The ratio of two units that a scale is, 1 where it is none; negative as the scale."""
    ratios = [1.0, *(ratio for _, ratio in unit_slips("length"))]
    nearest = min(ratios, key=lambda ratio: abs(np.log(max(abs(scale), 1e-12) / ratio)))
    near = abs(np.log(max(abs(scale), 1e-12) / nearest)) < np.log(SAME_UNIT)
    return (nearest if near else 1.0) * (-1.0 if scale < 0 else 1.0)


def _one(part: object, words: str) -> Change:
    return Change(1.0, frozenset({(part,)}), words)
