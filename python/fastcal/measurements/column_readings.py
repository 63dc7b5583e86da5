# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every other way in which the columns of joints and points may have been meant: one thing changed at a time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.dataset import Dataset
from fastcal.units import factor, to_si, unit_names

FloatArray = NDArray[np.float64]
Rows = NDArray[np.int64]

MIRROR = np.array([1.0, 1.0, -1.0])
TURNS = tuple((f"shifted by {degrees:g} deg", to_si(degrees, "deg")) for degrees in (90.0, -90.0, 2 * 90.0))


class Reading(NamedTuple):
    """One way to read the columns.

    Attributes:
        rank: 0 the simplest; of readings that fit alike the simplest is named.
        words: What was meant, as it stands after "with".
        scale: Ratio of the points so read to those read; negative where they are mirrored.
        q: (M, n) joint positions so read [rad or m].
        position: (M, 3) points so read [m].
        rows: (M,) rows of the data set that these are.
    """

    rank: int
    words: str
    scale: float
    q: FloatArray
    position: FloatArray
    rows: Rows


def other_readings(dataset: Dataset, rows: Rows, joint_types: list[str]) -> Iterator[Reading]:
    """Every other reading of `rows`; one that moves points by a row, or takes read-back joints, drops incomplete rows.

    Without points the joints alone are read otherwise, and `position` is NaN.
    """
    q = dataset.q[rows]
    whole = dataset.position if dataset.position is not None else np.full((len(dataset), 3), np.nan)
    position = whole[rows]
    for rank, words, meant in _joint_readings(joint_types, q):
        yield Reading(rank, words, 1.0, meant, position, rows)
    if dataset.q_read is not None:
        read = ~np.isnan(dataset.q_read[rows]).any(axis=1)
        words = "the joint positions read back in place of those commanded"
        yield Reading(0, words, 1.0, dataset.q_read[rows][read], position[read], rows[read])
    if dataset.position is None:
        return
    for words, ratio in unit_slips("length"):
        yield Reading(0, f"the points in {words}", ratio, q, position * ratio, rows)
    words = "one axis of the points turned round or two of them swapped (they are left-handed)"
    yield Reading(0, words, -1.0, q, position * MIRROR, rows)
    for step, words in ((1, "the points one row lower than the joints"), (-1, "the points one row higher")):
        kept = rows[(rows + step >= 0) & (rows + step < len(dataset))]
        kept = kept[~np.isnan(whole[kept + step]).any(axis=1)]
        yield Reading(0, words, 1.0, dataset.q[kept], whole[kept + step], kept)


def unit_slips(kind: str) -> Iterator[tuple[str, float]]:
    """Pairs of units of a kind: which was meant and which was read, and the ratio; one pair for each ratio."""
    seen: set[str] = set()
    for meant, read in permutations(unit_names(kind), 2):
        ratio = factor(meant) / factor(read)
        if f"{ratio:.6g}" not in seen:
            seen.add(f"{ratio:.6g}")
            yield f"{meant} where they were read in {read}", ratio


def _joint_readings(joint_types: list[str], q: FloatArray) -> Iterator[tuple[int, str, FloatArray]]:
    """Rank, words and joint positions (N, n) of every slip in the joints' columns."""
    for joint_type, kind in (("revolute", "angle"), ("prismatic", "length")):
        joints = [joint for joint, found in enumerate(joint_types) if found == joint_type]
        for words, ratio in unit_slips(kind):
            if len(joints) > 1:
                yield 0, f"all {joint_type} joints in {words}", _changed(q, joints, ratio)
            for joint in joints:
                yield 0, f"joint {joint + 1} in {words}", _changed(q, [joint], ratio)
        for first, second in combinations(joints, 2):
            swapped = q.copy()
            swapped[:, [first, second]] = q[:, [second, first]]
            yield 0, f"the columns of joints {first + 1} and {second + 1} swapped", swapped
        for joint in joints:
            yield 0, f"the sign of joint {joint + 1} turned", _changed(q, [joint], -1.0)
            for words, shift in TURNS if joint_type == "revolute" else ():
                yield 1, f"joint {joint + 1} {words}", _changed(q, [joint], 1.0, shift)
                yield 2, f"the sign of joint {joint + 1} turned and it {words}", _changed(q, [joint], -1.0, shift)
    if len(set(joint_types)) == 1 and len(joint_types) > 2:
        yield 1, "the signs of all joints turned", -q
        yield 0, "the joints in reverse order", q[:, ::-1]


def _changed(q: FloatArray, joints: list[int], ratio: float, shift: float = 0.0) -> FloatArray:
    meant = q.copy()
    meant[:, joints] = ratio * q[:, joints] + shift
    return meant
