# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns that could name the rows of a list, whatever their titles, and those of two lists that agree best."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from fastcal.errors import InvalidInput
from fastcal.importers.export import Export, number
from fastcal.importers.names import Pair, counts_rows, is_whole, pairs_by_name
from fastcal.io.table import Uncalculated
from fastcal.measurements.labels import LABEL_WORDS, title_words

_MOST_COLUMNS = 30  # of a list that are compared
_DISTINCT = 0.5  # of the rows that have a name of their own
_TIMES = frozenset({"time", "date"})


@dataclass(frozen=True)
class LabelColumn:
    """A column that could name the rows.

    Attributes:
        title: As a message names it.
        texts: One a row, "" where it is empty.
        read: Whether its title says that it names the rows.
        timed: Whether its title says that it tells the time.
    """

    title: str
    texts: Sequence[str]
    read: bool
    timed: bool = False

    def rows(self, chosen: Sequence[int]) -> LabelColumn:
        """Some of its rows."""
        return replace(self, texts=[self.texts[k] for k in chosen])

    @property
    def counts(self) -> bool:
        """Whether it but counts the rows of its list."""
        return all(number(text) is not None for text in self.texts) and counts_rows(self.texts)

    @property
    def is_clock(self) -> bool:
        """Whether it tells the time: a clock goes on, and that of another device has nothing in common with it."""
        numbers = [number(text) for text in self.texts if text]
        known = [value for value in numbers if value is not None]
        return self.timed and len(known) == len(numbers) and known == sorted(known)

    @property
    def is_reading(self) -> bool:
        """Whether it holds real numbers, and its title does not say that they are names."""
        numbers = [text for text in self.texts if number(text) is not None]
        return not self.read and not all(map(is_whole, numbers))

    @property
    def has_letters(self) -> bool:
        """Whether it holds more than numbers."""
        return any(number(text) is None for text in self.texts if text)


@dataclass(frozen=True)
class LabelMatch:
    """Columns of two lists that agree."""

    pairs: list[Pair]
    poses: LabelColumn
    points: LabelColumn


def label_columns(export: Export, rows: Sequence[int], used: Iterable[int]) -> list[LabelColumn]:
    """The columns of an export that could name its rows, those that say so by their titles first.

    Most of its texts or numbers are different.

    Args:
        export: The table.
        rows: Those that are taken.
        used: Places of columns that were read as something else.
    """
    found = []
    taken = set(used)
    for place, meaning in enumerate(export.meanings):
        cells = [export.rows[row][place] for row in rows]
        texts = ["" if isinstance(cell, Uncalculated) else cell.strip() for cell in cells]
        role = None if meaning is None else meaning.role
        if "name" in export.mapped and role != "name":
            continue
        if place in taken or not _could_name(texts):
            continue
        words = title_words(export.titles[place])
        read = role in ("name", "number") or (bool(words) and words <= LABEL_WORDS)
        found.append(LabelColumn(export.title(place), texts, read, role in _TIMES))
    return sorted(found, key=lambda column: (not column.read, column.is_reading))


def _could_name(texts: Sequence[str]) -> bool:
    """Whether texts are most of them different, and all of them or few are numbers."""
    filled = [text for text in texts if text]
    if len({*filled}) <= _DISTINCT * len(texts):
        return False
    numbers = sum(number(text) is not None for text in filled)
    return numbers == len(filled) or 2 * numbers <= len(filled)


def best_match(
    poses: Sequence[LabelColumn], points: Sequence[LabelColumn], path: str, *, ask: bool = True
) -> LabelMatch | None:
    """The two columns with the most rows in common; of as many, those whose names are the most alike.

    A column that counts its rows is a name only where no other is.

    Args:
        poses: Of the list of poses.
        points: Of the list of points.
        path: Of the points, for messages.
        ask: Refuse what could be read in two ways; else what says by its title that it is a name comes first.

    Raises:
        InvalidInput: Other columns agree as well and name other rows.
    """
    found: list[tuple[tuple[int, int, int, bool], bool, LabelMatch]] = []
    for pose in poses[:_MOST_COLUMNS]:
        for point in points[:_MOST_COLUMNS]:
            pairs = None if pose.is_clock and point.is_clock else pairs_by_name(pose.texts, point.texts)
            if pairs is not None:
                counters = int(pose.counts) + int(point.counts)
                letters = pose.has_letters and point.has_letters
                rank = (-counters, len(pairs.pairs), -pairs.coarseness, letters)
                found.append((rank, pose.read and point.read, LabelMatch(pairs.pairs, pose, point)))
    if not found:
        return None
    found.sort(key=lambda each: each[:2], reverse=True)
    rank, _, best = found[0]
    rival = next((other for order, _, other in found[1:] if order == rank and other.pairs != best.pairs), None)
    if rival is not None and ask:
        raise InvalidInput(
            f"{path}: {best.points.title} and {rival.points.title} could each name the points, and name different "
            f"ones by {best.poses.title} and {rival.poses.title}: say which does with --map, name: TITLE"
        )
    return best
