# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which rows of two lists have the same name: capitals, blanks, padding zeros and a prefix don't matter."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence

import numpy as np

Pair = tuple[int, int]  # pose, point
_MOST = 0.5  # of the shorter list that must have a partner, or the names mean different things


def pairs_by_name(poses: Sequence[str], points: Sequence[str], *, counted: tuple[bool, bool]) -> list[Pair] | None:
    """The pairs (pose, point) of equal names, in the order of the poses; None where the names don't belong together.

    A name that comes several times in both lists is paired in order; where one pose was measured several times, all its
    points go to it. Names that agree in their numbers alone are taken only if the numbers name the rows: one list that
    counts its rows without a gap says nothing about which rows the other list lacks, or from where that one counts.

    Args:
        poses: The names of the poses.
        points: The names of the points.
        counted: Whether each list's names are mere numbers.
    """
    if not any(counted):
        found = _paired(poses, points, _whole)
        if found is not None:
            return found
    if (_gapless(poses) or _gapless(points)) and {*map(_number, poses)} != {*map(_number, points)}:
        return None
    return _paired(poses, points, _number)


def _paired(poses: Sequence[str], points: Sequence[str], key: Callable[[str], str]) -> list[Pair] | None:
    at, to = _places(poses, key), _places(points, key)
    pairs: list[Pair] = []
    for name, rows in at.items():
        others = to.get(name, [])
        if len(rows) == 1:
            pairs += [(rows[0], other) for other in others]
        elif len(rows) == len(others):
            pairs += list(zip(rows, others, strict=True))
    return sorted(pairs) if len(pairs) >= _MOST * min(len(poses), len(points)) and pairs else None


def _places(names: Sequence[str], key: Callable[[str], str]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = defaultdict(list)
    for row, name in enumerate(names):
        if name and key(name):
            found[key(name)].append(row)
    return found


def _whole(name: str) -> str:
    """The name without capitals, blanks, marks and padding zeros."""
    bare = re.sub(r"[\W_]+", "", name.casefold())
    return re.sub(r"\d+", lambda digits: digits[0].lstrip("0") or "0", bare)


def _number(name: str) -> str:
    """The last number of a name."""
    digits = re.findall(r"\d+", name)
    return digits[-1].lstrip("0") or "0" if digits else ""


def _gapless(names: Sequence[str]) -> bool:
    """Whether the numbers of the names just count the rows."""
    numbers = [_number(name) for name in names]
    return all(numbers) and len(names) > 1 and bool((np.diff([int(number) for number in numbers]) == 1).all())
