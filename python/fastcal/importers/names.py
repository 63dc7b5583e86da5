# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which rows of two lists have the same name: capitals, blanks, padding zeros and a prefix don't matter."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

Pair = tuple[int, int]  # pose, point
_MOST = 0.5  # of the shorter list that must have a partner, or the names mean different things
_WHOLE_NUMBER = re.compile(r"([-+]?\d+)(?:[.,]0*)?")
_REAL = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")
_LONGEST_NUMBER = 15  # digits of a number that counts something


@dataclass(frozen=True)
class NamePairs:
    """Rows of equal names.

    Attributes:
        pairs: (pose, point), in the order of the poses.
        coarseness: 0: the names are the same; 1: but for padding zeros and marks; 2: in their numbers alone.
    """

    pairs: list[Pair]
    coarseness: int


def pairs_by_name(poses: Sequence[str], points: Sequence[str]) -> NamePairs | None:
    """The rows of equal names; None where the names don't belong together.

    A name that comes several times in both lists is paired in order; where one pose was measured several times, all its
    points go to it. Names that agree in their numbers alone are taken only if the numbers name the rows: two lists that
    count their rows without a gap do not say which rows one of them lacks, or from where it counts. They add none to
    pairs of like names where both hold several numbers that are not the same: 1-1 is not 2-1.

    Args:
        poses: The names of the poses.
        points: The names of the points.
    """
    numeric = _are_numbers(poses) or _are_numbers(points)
    found: NamePairs | None = None
    for coarseness, key in enumerate(_KEYS):
        if coarseness and (_are_real(poses) or _are_real(points)):
            break  # 1.2 is not 12, nor any point 2
        if (coarseness == len(_KEYS) - 1 or numeric) and _counts_otherwise(poses, points):
            continue
        pairs = _paired(poses, points, key)
        if pairs is None or (found is not None and len(pairs) <= len(found.pairs)):
            continue
        if found is None or not any(_differ(poses[i], points[j]) for i, j in {*pairs} - {*found.pairs}):
            found = NamePairs(pairs, coarseness)
    return found


def is_whole(name: str) -> bool:
    """Whether a name is a whole number, such as 12, 012 or 12.0."""
    return _WHOLE_NUMBER.fullmatch(name.strip()) is not None


def counts_rows(names: Sequence[str]) -> bool:
    """Whether the numbers of the names just count the rows."""
    numbers = [_number(name) for name in names]
    if not all(numbers) or len(names) < 2 or max(map(len, numbers)) > _LONGEST_NUMBER:
        return False
    first = int(numbers[0])
    return all(int(number) == first + row for row, number in enumerate(numbers))


def _counts_otherwise(poses: Sequence[str], points: Sequence[str]) -> bool:
    """Whether one list counts its rows, and the numbers of the other are none of these, or count rows too."""
    first, second = {*map(_number, poses)}, {*map(_number, points)}
    if counts_rows(poses):
        return first != second if counts_rows(points) else not second <= first
    return counts_rows(points) and not first <= second


def _are_numbers(names: Sequence[str]) -> bool:
    return all(_WHOLE_NUMBER.fullmatch(name) for name in names if name)


def _are_real(names: Sequence[str]) -> bool:
    """Whether all names are numbers, and not all of them whole."""
    filled = [name.strip() for name in names if name.strip()]
    return all(map(_REAL.fullmatch, filled)) and not all(map(is_whole, filled))


def _paired(poses: Sequence[str], points: Sequence[str], key: Callable[[str], Hashable]) -> list[Pair] | None:
    at, to = _places(poses, key), _places(points, key)
    if at is None or to is None:
        return None
    pairs: list[Pair] = []
    for name, rows in at.items():
        others = to.get(name, [])
        if len(rows) == 1:
            pairs += [(rows[0], other) for other in others]
        elif len(rows) == len(others):
            pairs += list(zip(rows, others, strict=True))
    return sorted(pairs) if len(pairs) >= _MOST * min(len(poses), len(points)) and pairs else None


def _places(names: Sequence[str], key: Callable[[str], Hashable]) -> dict[Hashable, list[int]] | None:
    """The rows of each name; None where the key makes one of names that differ."""
    found: dict[Hashable, list[int]] = defaultdict(list)
    meant: dict[Hashable, str] = {}
    for row, name in enumerate(names):
        known = key(name) if name else ""
        if known:
            if meant.setdefault(known, _same(name)) != _same(name):
                return None
            found[known].append(row)
    return found


def _same(name: str) -> str:
    """The name without capitals and blanks; the whole number 1.0 of a sheet is 1."""
    bare = "".join(unicodedata.normalize("NFKC", name).casefold().split())
    number = _WHOLE_NUMBER.fullmatch(bare)
    return number[1] if number else bare


def _parts(name: str) -> tuple[str, ...]:
    """Its words and numbers, without marks and padding zeros."""
    parts = re.findall(r"\d+|[^\W\d_]+", _same(name))
    return tuple(part.lstrip("0") or "0" if part.isdigit() else part for part in parts)


def _differ(pose: str, point: str) -> bool:
    """Whether both names hold several numbers that are not the same: 1-1 is not 2-1."""
    both = [[part for part in _parts(name) if part.isdigit()] for name in (pose, point)]
    return min(map(len, both)) > 1 and both[0] != both[1]


def _number(name: str) -> str:
    """The last number of a name."""
    digits = re.findall(r"\d+", _same(name))
    return digits[-1].lstrip("0") or "0" if digits else ""


_KEYS: Sequence[Callable[[str], Hashable]] = (_same, _parts, _number)  # the finer ones first
