# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures of a cell and what was read in them, as the core takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.moving_rig import Postures, moving_rig
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell, Distance
from fastcal.cells.knocked import views_apart
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import has_rig, pictures
from fastcal.units import to_si


@dataclass(frozen=True, eq=False)
class Labels:
    """What was touched, or measured from, in each posture: codes (N,) of names, -1 none."""

    codes: NDArray[np.int32]
    names: tuple[str, ...]

    @staticmethod
    def of(texts: Sequence[str]) -> Labels:
        """Of N texts, empty where there is none."""
        names = {name: k for k, name in enumerate(dict.fromkeys(text for text in texts if text))}
        return Labels(np.array([names.get(text, -1) for text in texts], dtype=np.int32), tuple(names))

    @property
    def texts(self) -> list[str]:
        """(N,) names, empty where there is none."""
        return [self.names[code] if code >= 0 else "" for code in self.codes]


@dataclass(frozen=True, eq=False)
class Readings:
    """N postures of a cell.

    Attributes:
        q: (N, n) joint positions in the order of the tree [rad, m].
        tables: Of each field and view, such as `position@smr:camera`, (N, c) numbers, SI, NaN where not read; `corner`
            and `sigma_corner` are of all pictures of a posture.
        labels: Of each field of labels and target, such as `socket@smr`, which point, plane or anchor it is.
        source: The file.
        notes: What a reader should know, a sentence each.
        speed: (N, n) of the joints when a posture was read [rad/s, m/s], NaN where unknown.
        row: (N,) place in the order of measuring among the postures that a cell is fitted to; None: not known.
        arms: Of arms their conditions, such as payload, temperature and approach, in data sets that hold nothing read.
    """

    q: FloatArray
    tables: dict[str, FloatArray]
    source: str
    notes: tuple[str, ...] = ()
    speed: FloatArray | None = None
    row: IntArray | None = None
    arms: Mapping[str, Dataset] = field(default_factory=dict)
    labels: Mapping[str, Labels] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.q)

    @property
    def views(self) -> list[str]:
        """TARGET or TARGET:SENSOR of what was read, each once."""
        seen = [name.partition("@")[2] for name in self.tables if not name.startswith("sigma")]
        return list(dict.fromkeys(view for view in [*seen, *(_target(name) for name in self.labels)] if view))

    @property
    def is_read_from_world(self) -> bool:
        """Was something read from the instrument on the world, and not of what has an unknown place there itself?"""
        labelled = {f"{field}@{_target(name)}" for name in self.labels for field in _fields_beside(name)}
        read = (name for name in self.tables if not name.startswith("sigma") and name not in labelled)
        return any("@" in name and ":" not in name for name in read)

    def touched_by(self, kind: str) -> list[str]:
        """The targets of a kind of reading with labels, in the order in which the core has them."""
        fields = {field.name for field in _core.observation_entry(kind).fields if field.role == "label"}
        return sorted(_target(name) for name in self.labels if name.partition("@")[0] in fields)

    def pick(self, rows: NDArray[np.intp]) -> Readings:
        """Some rows."""
        tables = {name: np.ascontiguousarray(table[rows]) for name, table in self.tables.items()}
        speed = None if self.speed is None else np.ascontiguousarray(self.speed[rows])
        row = None if self.row is None else np.ascontiguousarray(self.row[rows])
        arms = {name: data.select(rows) for name, data in self.arms.items()}
        labels = {name: Labels(np.ascontiguousarray(of.codes[rows]), of.names) for name, of in self.labels.items()}
        q = np.ascontiguousarray(self.q[rows])
        return replace(self, q=q, tables=tables, speed=speed, row=row, arms=arms, labels=labels)

    @property
    def in_order(self) -> Readings:
        """As they were measured, one after the other."""
        return self if self.row is not None else replace(self, row=np.arange(len(self)))

    def without(self, rows: Mapping[str, Sequence[int]]) -> Readings:
        """Without what was read of some views in some rows."""
        tables, labels = dict(self.tables), dict(self.labels)
        for name, table in self.tables.items():
            if own := rows.get(name.partition("@")[2]):
                tables[name] = table.copy()
                tables[name][list(own)] = np.nan
        for name, of in self.labels.items():
            if own := rows.get(_target(name)):
                codes = of.codes.copy()
                codes[list(own)] = -1
                labels[name] = Labels(codes, of.names)
        return replace(self, tables=tables, labels=labels)

    def samples(self, cell: Cell) -> _core.Samples:
        """The postures for the core, each arm in its own conditions.

        Raises:
            InvalidInput: An effect of an arm needs a condition that is not known.
        """
        arms = {arm.name: arm for arm in cell.arms}
        out = []
        for branch in cell.core.branches:
            if not branch.joint_count:
                continue
            data = self.arms.get(branch.name)
            given = {"row": self.row} if data is None else {**condition_columns(data), "row": self.row}
            q = self.q[:, branch.first_joint : branch.first_joint + branch.joint_count]
            try:
                out.append(arms[branch.name].robot.conditions(q, **given))
            except InvalidInput as error:
                raise InvalidInput(f"arm {branch.name}: {error}") from None
        return _core.Samples.side_by_side(out)

    def measured(self, cell: Cell) -> _core.Measurements:
        """What was read, for the core. InvalidInput where it names a frame that the cell does not have."""
        there = self.of_frames(cell)
        tables = dict(there.tables)
        for known in cell.distances:
            tables |= known_tables(cell, known, len(self))
        labels = {name: (of.codes, list(of.names)) for name, of in there.labels.items()}
        return _core.Measurements(cell.core, len(self), tables, labels, self._rig(cell))

    def of_frames(self, cell: Cell) -> Readings:
        """The same by the frames of the tree: what was read of a point before it was knocked is of another frame."""
        rows = cell.knocked_rows
        if not rows or self.row is None:
            return self
        tables, labels = dict[str, FloatArray](), dict[str, Labels]()
        for name, table in self.tables.items():
            for there, own in _apart(name, rows, self.row):
                part = np.full_like(table, np.nan)
                part[own] = table[own]
                if there == name or np.isfinite(part).any():
                    tables[there] = part
        for name, of in self.labels.items():
            for there, own in _apart(name, rows, self.row):
                codes = np.full_like(of.codes, -1)
                codes[own] = of.codes[own]
                if there == name or (codes >= 0).any():
                    labels[there] = Labels(codes, of.names)
        return replace(self, tables=tables, labels=labels)

    def _rig(self, cell: Cell) -> _core.Rig:
        """The cameras and boards of a cell, as they stand or move in each posture."""
        if not has_rig(cell):
            return cell.rig
        postures = Postures(self.q, cell.gravity, cell.frames_at, self.speed, self.row)
        return moving_rig(cell.rig, cell, postures)

    def sights(self, cell: Cell) -> list[str]:
        """TARGET:SENSOR, frames of the cell, of all that tells one from the other: `views`, lengths and pictures."""
        return [*self.views, *(known.view for known in cell.distances), *self._pictures(cell)]

    def _pictures(self, cell: Cell) -> list[str]:
        uv = self.tables.get(CORNERS)
        if uv is None:
            return []
        return [
            f"{cell.boards[board]['on']}:{cell.cameras[camera]['on']}"
            for (camera, board), part in pictures(cell).items()
            if np.isfinite(uv[:, 2 * part.start : 2 * part.stop]).any()
        ]


def _apart(name: str, rows: Mapping[str, int], row: IntArray) -> list[tuple[str, IntArray]]:
    """The names of a table, or of labels, by the frames that it is of, each with its rows."""
    field, at, view = name.partition("@")
    if not at:  # of pictures
        return [(name, np.arange(len(row)))]
    return [(f"{field}{at}{there}", own) for there, own in views_apart(view, rows, row).items()]


def _target(name: str) -> str:
    """Of a table or of labels."""
    return name.partition("@")[2]


def _fields_beside(name: str) -> list[str]:
    """The fields of what is read with a field of labels: the lengths of anchors."""
    of = name.partition("@")[0]
    entries = [_core.observation_entry(kind) for kind in _core.observation_names()]
    own = [entry for entry in entries if any(field.name == of and field.role == "label" for field in entry.fields)]
    return [field.name for entry in own for field in entry.fields if field.role == "measured"]


def known_tables(cell: Cell, known: Distance, rows: int) -> dict[str, FloatArray]:
    """A known distance as readings, which count once together: its error is the same in all postures.

    Ends that stand on one frame are as far apart in the first posture as in any.
    """
    ends = [next((of.on for of in cell.points if of.name == end), end) for end in (known.start, known.end)]
    read = 1 if ends[0] == ends[1] else rows
    length = np.full((rows, 1), np.nan)
    length[:read] = to_si(known.mm, "mm")
    sigma = np.full((rows, 1), to_si(known.sigma_mm, "mm") * np.sqrt(max(read, 1)))
    return {f"known_distance@{known.view}": length, f"sigma_known_distance@{known.view}": sigma}
