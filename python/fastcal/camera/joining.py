# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which row of the poses a picture belongs to: by its name, the number in it, the time in it, or by order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fastcal.errors import InvalidInput
from fastcal.io.table import Table
from fastcal.units import parse_name

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp")
_STAMP = 9  # digits from which on a number is a time: seconds since 1970 have ten, nanoseconds nineteen
_TIME = re.compile(r"\d{9,19}(?:\.\d+)?")
_NEAR = 0.5  # of the least time between two poses: a picture that near to one is of it


@dataclass(frozen=True)
class Joined:
    """Rows of pictures.

    Attributes:
        rows: Of each picture, from 0; None where it is of no row.
        how: How they were found, as a sentence says it.
    """

    rows: tuple[int | None, ...]
    how: str


def picture_files(given: Sequence[Path]) -> list[Path]:
    """The pictures among files and in folders, each folder's in the order of their names and numbers.

    Raises:
        InvalidInput: One is not there, or a folder holds no picture.
    """
    out: list[Path] = []
    for path in given:
        if path.is_dir():
            found = [file for file in path.rglob("*") if file.suffix.lower() in SUFFIXES and file.is_file()]
            if not found:
                raise InvalidInput(f"{path}: holds no pictures; expected files that end in {', '.join(SUFFIXES)}")
            out += sorted(found, key=_natural)
        elif path.is_file():
            out.append(path)
        else:
            raise InvalidInput(f"{path}: there is no such picture")
    return list(dict.fromkeys(out))


def camera_of(path: Path, cameras: Sequence[str]) -> str:
    """The camera whose picture it is: the only one, or the one that its name or its folder's names.

    Raises:
        InvalidInput: None is named, or several are.
    """
    if len(cameras) == 1:
        return cameras[0]
    for part in (path.stem, *reversed(path.parent.parts)):
        words = set(re.split(r"[^A-Za-z0-9]+", part.lower()))
        named = [camera for camera in cameras if camera.lower() in words or camera.lower() == part.lower()]
        if len(named) == 1:
            return named[0]
    raise InvalidInput(
        f"{path}: which camera took it? expected one of {', '.join(cameras)} in the name of the picture or its folder"
    )


def joined(pictures: Sequence[Path], table: Table | None) -> Joined:
    """The rows of one camera's pictures.

    Args:
        pictures: Their files.
        table: The poses, one row a posture; None: the rows are those that the names say.

    Raises:
        InvalidInput: Nothing says which row is whose; the sentence says what would.
    """
    ways = [] if table is None else [_by_name(pictures, table), _by_time(pictures, table)]
    count = None if table is None else len(table)
    for way in (*ways, _by_number(pictures, count)):
        if way is not None:
            return way
    if count is None or count == len(pictures):
        order = sorted(range(len(pictures)), key=lambda k: _natural(pictures[k]))
        rows = dict(zip(order, range(len(order)), strict=True))
        return Joined(tuple(rows[k] for k in range(len(pictures))), "by the order of their names")
    raise InvalidInput(
        f"{len(pictures)} pictures and {count} poses, and nothing says which belong together; expected a column with "
        "the pictures' names, a number of the row or a time in each name, or as many pictures as poses"
    )


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sorts picture 10 behind picture 9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", str(path)) if part]


def _by_name(pictures: Sequence[Path], table: Table) -> Joined | None:
    """By the column that holds most names of the pictures; a number's part before its point is no name."""
    best: tuple[int, Joined | None] = (0, None)
    for place, title in enumerate(table.names):
        if isinstance(table.columns[place], np.ndarray):
            continue
        names = [Path(text.replace("\\", "/")) for text in table.labels(place)]
        for part in ("name", "stem"):
            places: dict[str, list[int]] = {}
            for row, name in enumerate(names):
                if part == "stem" and name.suffix and name.suffix.lower() not in SUFFIXES:
                    continue
                places.setdefault(str(getattr(name, part)), []).append(row)
            found = [places.get(str(getattr(path, part)), []) for path in pictures]
            count = sum(map(len, found))
            if count > best[0] and all(len(rows) <= 1 for rows in found):
                joined = tuple(rows[0] if rows else None for rows in found)
                best = count, Joined(joined, f"by the names in column '{title}'")
    return best[1]


def _by_number(pictures: Sequence[Path], count: int | None) -> Joined | None:
    """By the last number in each name, which counts rows from 0, or from 1 where it ends so or begins so."""
    numbers = [re.findall(r"\d+", path.stem) for path in pictures]
    if not all(numbers) or any(len(found[-1]) >= _STAMP for found in numbers):
        return None
    last = np.array([int(found[-1]) for found in numbers])
    if len(set(last.tolist())) < len(last):
        return None
    if last.min() == 0 or (count is not None and last.max() < count and last.min() > 1):
        first = 0
    elif last.min() == 1 or (count is not None and last.max() == count):
        first = 1
    else:
        return None
    if count is not None and last.max() - first >= count:
        return None
    return Joined(tuple((last - first).tolist()), f"by the numbers in their names, which count from {first}")


def _by_time(pictures: Sequence[Path], table: Table) -> Joined | None:
    """By the times in their names and in the column time_s."""
    column = next((place for place, name in enumerate(table.names) if parse_name(name) == ("time", "s")), None)
    found = [_TIME.findall(path.stem) for path in pictures]
    if column is None or not all(found):
        return None
    times = np.array([_seconds(each[-1]) for each in found])
    at = table.numbers(column)
    apart = np.diff(np.sort(at))
    reach = _NEAR * float(np.min(apart[apart > 0], initial=np.inf))
    nearest = np.array([int(np.argmin(np.abs(at - t))) for t in times])
    near = np.abs(at[nearest] - times) <= reach
    if not near.any():
        raise InvalidInput(
            f"{pictures[0].name} and the others are of other times than the poses: {times.min():.3f} to "
            f"{times.max():.3f} s, and time_s is {at.min():.3f} to {at.max():.3f} s"
        )
    rows = tuple(int(row) if ok else None for row, ok in zip(nearest, near, strict=True))
    return Joined(rows, "by the times in their names")


def _seconds(digits: str) -> float:
    """Seconds since 1970 of a number of seconds, milli-, micro- or nanoseconds, as its length says."""
    whole = len(digits.partition(".")[0])
    return float(digits) / 10.0 ** (0 if whole <= 10 else 3 if whole <= 13 else 6 if whole <= 16 else 9)
