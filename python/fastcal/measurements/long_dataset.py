# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measured poses in more rows than memory should hold: columns in temporary files, read part by part."""

from __future__ import annotations

import math
import os
import tempfile
import weakref
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IntArray
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.last_moves import directions, last_moves

PART_ROWS = 30_720  # that are read at once
_FOUND = frozenset({"move", "direction_before"})  # from the rows before
LABELLED = ("anchor", "station", "mount")  # fields of a Dataset that are indices into names


class ColumnOnDisk:
    """One column of all rows, in a file without a name, which goes with it.

    Attributes:
        dtype: Of the numbers.
        width: Numbers of a row; () is one.
        count: Rows.
        names: What the numbers of a column of labels stand for, in the order of first appearance; None: they are
            numbers. -1 is no label.
    """

    def __init__(self, dtype: np.dtype[Any], width: tuple[int, ...], names: list[str] | None = None) -> None:
        self.dtype, self.width, self.names, self.count = dtype, width, names, 0
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed by close() or with this object
        self.close = weakref.finalize(self, self._file.close)

    @property
    def shape(self) -> tuple[int, ...]:
        """(N, ...)."""
        return (self.count, *self.width)

    def append(self, values: NDArray[Any]) -> None:
        """Adds rows."""
        self._file.seek(0, os.SEEK_END)
        self._file.write(np.ascontiguousarray(values, self.dtype).data)
        self._file.flush()
        self.count += len(values)

    def read(self, begin: int, end: int) -> NDArray[Any]:
        """Rows begin ... end - 1."""
        row = math.prod(self.width)
        self._file.seek(begin * row * self.dtype.itemsize)
        return np.fromfile(self._file, self.dtype, (end - begin) * row).reshape(-1, *self.width)

    def parts(self) -> Iterator[NDArray[Any]]:
        """All rows, PART_ROWS at a time."""
        for begin in range(0, self.count, PART_ROWS):
            yield self.read(begin, min(self.count, begin + PART_ROWS))

    def texts(self, codes: NDArray[Any]) -> list[str]:
        """The labels that codes stand for, "" where there is none."""
        return [(self.names or [])[code] if code >= 0 else "" for code in codes.tolist()]


class LongDataset:
    """N measured poses of an arm, of which memory holds some at a time; `calibrate` takes it as it takes a Dataset.

    Its columns lie in temporary files (in the folder that TMPDIR names), which go with it, when it is closed or no
    longer referred to. Columns of text that no field of a Dataset is for are left out.

    Attributes:
        source, notes, joint_types: As in a Dataset.
    """

    def __init__(self, *, source: str = "arrays", joint_types: Sequence[str] = ()) -> None:
        self.source, self.joint_types = source, tuple(joint_types)
        self.notes: tuple[str, ...] = ()
        self._columns: dict[tuple[str, str], ColumnOnDisk] = {}  # by the field and the name in it, "" where it has none
        self._dropped: set[tuple[str, str]] = set()
        self._count = 0
        self._turned: list[tuple[float, ...]] = []  # how each joint moved before each part, as far as it was asked for

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f"<LongDataset: {PurePath(self.source).name}, {self._count} poses>"

    def __enter__(self) -> LongDataset:
        return self

    def __exit__(self, *reason: object) -> None:
        self.close()

    def close(self) -> None:
        """Frees the place that the rows take; nothing can be read any more."""
        for column in self._columns.values():
            column.close()

    def append(self, part: Dataset) -> None:
        """Adds rows behind the others; every part must have the same columns.

        Raises:
            InvalidInput: It has other columns, or there is no place for them on the disk.
        """
        found = dict(_columns_of(part))
        if self._count:
            self._drop_extra(set(found) ^ set(self._columns))
            differing = [" ".join(key).strip() for key in sorted((set(found) ^ set(self._columns)) - self._dropped)]
            if differing:
                raise InvalidInput(f"{part.source}: expected the same columns in all rows, got {', '.join(differing)}")
        try:
            for key, (values, names) in ((k, v if isinstance(v, tuple) else (v, None)) for k, v in found.items()):
                if key not in self._dropped:
                    self._append_column(key, values, names)
        except OSError as error:
            raise InvalidInput(
                f"{part.source}: its rows do not fit into {tempfile.gettempdir()} ({error.strerror or error}); TMPDIR "
                "names another folder for them"
            ) from None
        self._count += len(part)

    def read(self, begin: int, end: int, *, moves: bool = True) -> Dataset:
        """Rows begin ... end - 1 as arrays; `moves`: with how each joint came there."""
        arrays = {key: column.read(begin, end) for key, column in self._columns.items()}
        if not moves:
            return self._dataset(arrays)
        return self._dataset(arrays, self._moves(begin, end), self._direction_before(begin))

    def pick(self, rows: Sequence[int] | IntArray) -> Dataset:
        """The given rows, in ascending order, as arrays."""
        asked = np.asarray(rows, dtype=np.int64)
        arrays: dict[tuple[str, str], list[NDArray[Any]]] = {key: [] for key in self._columns}
        moves = []
        for begin in range(0, self._count, PART_ROWS):
            end = min(self._count, begin + PART_ROWS)
            here = asked[np.searchsorted(asked, begin) : np.searchsorted(asked, end)] - begin
            if len(here):
                moves.append(self._moves(begin, end)[here])
                for key, column in self._columns.items():
                    arrays[key].append(column.read(begin, end)[here])
        return self._dataset({key: np.concatenate(parts) for key, parts in arrays.items()}, np.concatenate(moves))

    def parts(self, *, moves: bool = True) -> Iterator[Dataset]:
        """All rows, some at a time."""
        for begin in range(0, self._count, PART_ROWS):
            yield self.read(begin, min(self._count, begin + PART_ROWS), moves=moves)

    def column(self, field: str) -> ColumnOnDisk | dict[str, ColumnOnDisk] | None:
        """What a field of a Dataset would hold of all rows: a column, or columns by name; None: nothing."""
        if field in ("observed", "observed_labels", "extra", "extra_labels"):
            return {name: column for (of, name), column in self._columns.items() if of == field}
        return self._columns.get((field, ""))

    def names(self, field: str) -> tuple[str, ...]:
        """What the indices in a column of labels stand for, in the order of first appearance."""
        column = self._columns.get((field, ""))
        return () if column is None else tuple(column.names or ())

    def _moves(self, begin: int, end: int) -> FloatArray:
        first = max(begin - 1, 0)  # how a row was reached, the one before it says
        approach = self._columns.get(("approach", ""))
        q = self._columns["q", ""].read(first, end)
        return last_moves(q, None if approach is None else approach.read(first, end))[begin - first :]

    def _direction_before(self, row: int) -> tuple[float, ...]:
        """Each joint's direction at the end of its last known move before a row."""
        part = row // PART_ROWS
        while len(self._turned) <= part:
            begin = PART_ROWS * (len(self._turned) - 1)
            self._turned.append(self._turned_at(begin, begin + PART_ROWS) if self._turned else ())
        begin = part * PART_ROWS
        return self._turned[part] if begin == row else self._turned_at(begin, row)

    def _turned_at(self, begin: int, end: int) -> tuple[float, ...]:
        before = self._turned[begin // PART_ROWS]
        return tuple(directions(self._moves(begin, end), before)[-1].tolist())

    def _drop_extra(self, differing: set[tuple[str, str]]) -> None:
        """Columns of the user's own that are numbers in some rows alone are text."""
        self._dropped |= {key for key in differing if key[0] == "extra"}
        for key in self._dropped & set(self._columns):
            self._columns.pop(key).close()

    def _append_column(self, key: tuple[str, str], values: NDArray[Any], names: Sequence[str] | None) -> None:
        if key not in self._columns:
            self._columns[key] = ColumnOnDisk(values.dtype, values.shape[1:], None if names is None else [])
        column = self._columns[key]
        if names is not None and column.names is not None:
            known = {name: code for code, name in enumerate(column.names)}
            codes = [known.setdefault(name, len(known)) for name in names]
            column.names = list(known)
            values = np.where(values >= 0, np.array([*codes, -1], dtype=np.int64)[values], -1)
        if values.shape[1:] != column.width:
            raise InvalidInput(f"{self.source}: {' '.join(key).strip()} changes its width from row {self._count} on")
        column.append(values)

    def _dataset(
        self,
        arrays: Mapping[tuple[str, str], NDArray[Any]],
        move: FloatArray | None = None,
        before: tuple[float, ...] = (),
    ) -> Dataset:
        """The data set of columns as they were read."""
        given: dict[str, Any] = {"observed": {}, "observed_labels": {}, "extra": {}}
        label_names: dict[str, tuple[str, ...]] = {}
        for (field, name), values in arrays.items():
            column = self._columns[field, name]
            if field == "observed_labels":
                given[field][name] = column.texts(values)
                label_names[name] = tuple(column.names or ())
            elif name:
                given[field][name] = values
            else:
                given[field] = values
                if column.names is not None:
                    given[f"{field}_names"] = tuple(column.names)
        return Dataset(
            **given,
            observed_label_names=label_names,
            move=move,
            direction_before=before,
            notes=self.notes,
            source=self.source,
            joint_types=self.joint_types,
        )


def _columns_of(part: Dataset) -> Iterator[tuple[tuple[str, str], Any]]:
    """The columns of a data set by field and name: numbers, or (codes, names) of labels."""
    for field in fields(part):
        value = getattr(part, field.name)
        if field.name in _FOUND or value is None:
            continue
        if field.name in LABELLED:
            yield (field.name, ""), (value, getattr(part, f"{field.name}_names"))
        elif field.name in ("observed", "extra"):
            yield from (((field.name, name), values) for name, values in value.items())
        elif field.name == "observed_labels":
            yield from (((field.name, name), part.label_codes(name)) for name in value)
        elif isinstance(value, np.ndarray):
            yield (field.name, ""), value
