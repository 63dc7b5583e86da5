# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measured poses of a robot as SI arrays, one row a pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray, IntArray
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.errors import InvalidInput
from fastcal.measurements.checks import BadRow, RobotFacts, check_values
from fastcal.measurements.instrument import with_tracker
from fastcal.measurements.labels import sensors
from fastcal.measurements.last_moves import directions, last_moves
from fastcal.measurements.observations import found_kinds, measured_rows, tables_of
from fastcal.measurements.splits import random_rows, region_rows
from fastcal.measurements.whole_turns import unwrapped

if TYPE_CHECKING:
    import pandas as pd

Labels = Sequence[str | int] | NDArray[np.str_] | NDArray[np.int64]

SPLITS = {"random": random_rows, "region": region_rows}


@dataclass(frozen=True, eq=False, repr=False)
class Dataset(Shown):
    """N poses of an arm with n joints; a field is None where nothing of it is known.

    Attributes:
        q: (N, n) commanded joint positions [rad or m].
        payload: (N,) mass at the tool [kg].
        q_read: (N, n) joint positions read back [rad or m], NaN where not read. Never used to fit.
        position: (N, 3) measured point in the measuring frame [m], NaN where a coordinate was not measured.
        rotation: (N, 4) measured orientation as a unit quaternion w, x, y, z, NaN in rows where it was not.
        rotation_angles: (N, 3) roll, pitch and yaw as a file gave them [rad], only to check their convention.
        distance: (N,) measured length from an anchor to the point [m], NaN where it was not.
        anchor: (N,) index into `anchor_names`, -1 where a row has none.
        sigma_position: (N, 3) standard deviation of each coordinate [m]; column 0 is that of a length too.
        instrument: (N, 3) where the instrument stood in the measuring frame [m], NaN where not known. Where it is,
            sigma_position is along its beam, across it level and across it upright, in place of x, y and z.
        sigma_rotation: (N,) standard deviation of the orientation about each axis [rad].
        wrench: (N, 6) fx fy fz [N] mx my mz [N m] at the tool.
        current: (N, n) motor currents [A].
        speed: (N, n) speeds of the joints when the row was read [rad/s or m/s].
        temperature: (N,) [K].
        time: (N,) [s].
        station, mount: (N,) index into `station_names`, `mount_names`: set-ups of the instrument and the target.
        approach: (N, n) +1 or -1, the direction in which the joint last moved; 0 where unknown.
        move: (N, n) last move of each joint [rad or m], from the order of rows; 0 where unknown (`last_moves`).
        row: (N,) place in the order of measuring among the rows that a model is fitted to, -1 where unknown.
        direction_before: n times +1 or -1, how the joints moved before the first row; empty where unknown.
        observed: Measured numbers of other kinds and their standard deviations by field, (N, k), NaN where not
            measured: `tilt@link2` (N, 2) [rad], `sigma_tilt` (N, 1) [rad].
        observed_labels: Labels of other kinds of observation by field, N strings, empty where a row has none: `plane`.
        observed_label_names: Those that count from 0 on, whether these rows have them or not; the others follow.
        extra: Unknown columns that hold numbers, as they are: name to (N,), NaN where empty.
        extra_labels: Unknown columns that hold text: name to N strings.
        notes: What a reader should know, a sentence each.
        source: Where the data came from.
        joint_types: `revolute` or `prismatic`, one a joint; empty where no robot was named.
    """

    q: FloatArray
    payload: FloatArray
    q_read: FloatArray | None = None
    position: FloatArray | None = None
    rotation: FloatArray | None = None
    rotation_angles: FloatArray | None = None
    distance: FloatArray | None = None
    anchor: IntArray | None = None
    anchor_names: tuple[str, ...] = ()
    sigma_position: FloatArray | None = None
    instrument: FloatArray | None = None
    sigma_rotation: FloatArray | None = None
    wrench: FloatArray | None = None
    current: FloatArray | None = None
    speed: FloatArray | None = None
    temperature: FloatArray | None = None
    time: FloatArray | None = None
    station: IntArray | None = None
    station_names: tuple[str, ...] = ()
    mount: IntArray | None = None
    mount_names: tuple[str, ...] = ()
    approach: FloatArray | None = None
    move: FloatArray | None = None
    row: IntArray | None = None
    direction_before: tuple[float, ...] = ()
    observed: Mapping[str, FloatArray] = field(default_factory=dict)
    observed_labels: Mapping[str, list[str]] = field(default_factory=dict)
    observed_label_names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    extra_labels: Mapping[str, list[str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    source: str = "arrays"
    joint_types: tuple[str, ...] = ()

    @cached_property
    def sensors(self) -> dict[str, FloatArray]:
        """Of `extra` what an error may depend on: readings, and no names, serial numbers or counters."""
        return sensors(self.extra, self.q)

    def __len__(self) -> int:
        return len(self.q)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(N,) true in rows that hold at least one measured number."""
        return measured_rows(self)

    @cached_property
    def directions(self) -> FloatArray | None:
        """(N, n) +1 or -1 of each joint's last known move, from `move`; None where no moves are known."""
        return None if self.move is None else directions(self.move, self.direction_before)

    @cached_property
    def kinds(self) -> dict[str, list[str]]:
        """Kinds of observation that it has, sorted, and the fields of each that say what was measured."""
        return found_kinds(self)

    def __getstate__(self) -> dict[str, Any]:  # the fields: what follows from them is no part of a copy, nor of a hash
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def table(self, field: str) -> FloatArray | None:
        """A field of numbers as (N, k), one of the data set's own or of `observed`; None where there is none."""
        values = getattr(self, field, None) if field in _OWN else self.observed.get(field)
        return None if values is None else np.asarray(values, dtype=np.float64).reshape(len(self), -1)

    def label_codes(self, field: str) -> tuple[IntArray, tuple[str, ...]]:
        """A field of labels as indices into its names, -1 where a row has none; both empty where there is none."""
        if field in _OWN:
            codes = getattr(self, field)
            return (np.zeros(0, dtype=np.int64), ()) if codes is None else (codes, getattr(self, f"{field}_names"))
        known = self.observed_label_names.get(field, ())
        codes, names = _codes(field, self.observed_labels.get(field), len(self), known)
        return (np.zeros(0, dtype=np.int64) if codes is None else codes), names

    def has_labels(self, field: str) -> bool:
        """Is there a label in any row?"""
        return bool((self.label_codes(field)[0] >= 0).any())

    def __getitem__(self, rows: ArrayLike | slice) -> Dataset:
        """`select`; one number gives a data set of one row."""
        if isinstance(rows, int | np.integer):
            if not -len(self) <= rows < len(self):
                raise IndexError(f"row {rows} of a data set of {len(self)} rows")
            rows = [int(rows)]
        chosen = self.select(rows)
        if len(chosen) == 0:
            raise InvalidInput(f"none of the {len(self)} rows is chosen; a data set has at least one")
        return chosen

    def select(self, rows: ArrayLike | slice) -> Dataset:
        """The given rows (indices, a mask or a slice) in that order; all label names and notes are kept.

        Raises:
            InvalidInput: A mask of another length, or an index beyond the rows.
        """
        chosen = _chosen(rows, len(self))
        parts: dict[str, Any] = {
            f.name: value[chosen] for f in fields(self) if isinstance(value := getattr(self, f.name), np.ndarray)
        }
        return replace(
            self,
            **parts,
            observed={name: values[chosen] for name, values in self.observed.items()},
            observed_labels={name: [labels[i] for i in chosen] for name, labels in self.observed_labels.items()},
            extra={name: values[chosen] for name, values in self.extra.items()},
            extra_labels={name: [labels[i] for i in chosen] for name, labels in self.extra_labels.items()},
        )

    @property
    def points(self) -> FloatArray:
        """(N, 3) measured points [m], NaN where none was measured."""
        return np.full((len(self), 3), np.nan) if self.position is None else self.position

    def with_tracker(self, sigma_range: float, sigma_angle: float, instrument: ArrayLike = (0.0, 0.0, 0.0)) -> Dataset:
        """The same, as a tracker measured it that is surer along its beam than across it.

        Args:
            sigma_range: Standard deviation of its lengths [m].
            sigma_angle: Of its angles [rad]: across the beam it makes that much times the distance.
            instrument: (3,) or (N, 3) where it stood in the measuring frame [m]; the default is its own frame.

        Raises:
            InvalidInput: There are no points, a number is not above 0, or a point lies where the instrument stood.
        """
        return with_tracker(self, sigma_range, sigma_angle, instrument)

    def split(self, test: float = 0.25, *, by: str = "random", seed: int = 0) -> tuple[Dataset, Dataset]:
        """(rows to fit, rows to hold out), each in the order of the data.

        Args:
            test: Share to hold out, above 0 and below 1.
            by: `random`: any postures, all visits of one together. `region`: those nearest to one posture in joint
                space, where a model has to extrapolate.
            seed: The same seed gives the same rows.

        Raises:
            InvalidInput: Another word, or a share that leaves nothing on one side.
        """
        if by not in SPLITS:
            raise InvalidInput(f"by must be one of {', '.join(SPLITS)}, got '{by}'")
        held = SPLITS[by](self.q, test, seed)
        return self.select(~held), self.select(held)

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, robot: RobotFacts, *, require_measured: bool = True) -> Dataset:
        """A pandas table with the columns of a measurement file, such as q1_deg and x_mm, as a data set in SI.

        Args:
            frame: One row a pose; its index is not read.
            robot: The arm that was measured.
            require_measured: Refuse a table without any measured number.

        Raises:
            ParseError: Something in it is invalid; names the column and the row.
        """
        data: Dataset = late.call("dataset_of_frame", frame, robot, require_measured=require_measured)
        return data

    @classmethod
    def concatenate(cls, sets: Sequence[Dataset], *, labels: Sequence[str] | None = None) -> Dataset:
        """Several data sets of one arm as one, in the order given.

        What some of them did not measure is empty in their rows. A condition that only some of them know (temperature,
        time, wrench, current, speed) can't be: it is left out, and a note says so. Where a set has no stations or no
        mounts, `labels` names it; without `labels` it is named by its source, if another set has them.

        Args:
            sets: At least one; all with the same number of joints.
            labels: A name a set, for its station and its mount.

        Raises:
            InvalidInput: There is no set, or they are of different arms.
        """
        from fastcal.measurements.concatenation import concatenated

        return concatenated(sets, labels)

    @classmethod
    def from_arrays(  # noqa: D417 - the class says what the fields are
        cls,
        q: ArrayLike,
        *,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        distance: ArrayLike | None = None,
        anchor: Labels | None = None,
        q_read: ArrayLike | None = None,
        sigma_position: ArrayLike | None = None,
        instrument: ArrayLike | None = None,
        sigma_rotation: ArrayLike | None = None,
        payload: ArrayLike = 0.0,
        wrench: ArrayLike | None = None,
        current: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
        time: ArrayLike | None = None,
        station: Labels | None = None,
        mount: Labels | None = None,
        approach: ArrayLike | None = None,
        observed: Mapping[str, ArrayLike] | None = None,
        observed_labels: Mapping[str, Labels] | None = None,
        extra: Mapping[str, ArrayLike] | None = None,
        extra_labels: Mapping[str, Sequence[str]] | None = None,
        notes: Sequence[str] = (),
        source: str = "arrays",
        robot: RobotFacts | None = None,
    ) -> Dataset:
        """Checks arrays in SI and makes a data set of copies of them; shapes as in the class.

        One number stands for all rows in payload, temperature and time; sigma_position may also be (N,).
        Labels (anchor, station, mount) are given as one text or whole number a row. Lengths without an anchor belong
        to one and the same. Quaternions are brought to length 1.

        Args:
            robot: Where given, q is held against its joints and limits, angles modulo a turn are brought within these
                (a note says so), and the points are held against its reach.

        Raises:
            InvalidInput: A shape, a type or a value is invalid; names the field, the row and the value.
        """
        joints = _array("q", q, (None, None if robot is None else len(robot.joint_types)))
        rows, count = joints.shape
        if rows == 0 or count == 0:
            raise InvalidInput(f"q must hold at least one row and one joint, got shape {joints.shape}")
        joints, turned = (joints, []) if robot is None else unwrapped(joints, robot)

        def one(name: str, value: ArrayLike | None, *shape: int) -> FloatArray | None:
            return None if value is None else _array(name, value, (rows, *shape))

        sigma = sigma_position
        if sigma is not None and np.ndim(sigma) == 1:
            sigma = np.asarray(sigma)[:, np.newaxis]
        lengths = one("distance", distance)
        one_anchor = None if lengths is None else ["1"] * rows
        anchors, anchor_names = _codes("anchor", one_anchor if anchor is None else anchor, rows)
        stations, station_names = _codes("station", station, rows)
        mounts, mount_names = _codes("mount", mount, rows)
        approaches = one("approach", approach, count)
        data = cls(
            q=joints,
            q_read=one("q_read", q_read, count),
            position=one("position", position, 3),
            rotation=one("rotation", rotation, 4),
            distance=lengths,
            anchor=anchors,
            anchor_names=anchor_names,
            sigma_position=None if sigma is None else _array("sigma_position", sigma, (rows, 3), spread=True),
            instrument=None if instrument is None else _array("instrument", instrument, (rows, 3), spread=True),
            sigma_rotation=None if sigma_rotation is None else _spread("sigma_rotation", sigma_rotation, rows),
            payload=_spread("payload", payload, rows),
            wrench=one("wrench", wrench, 6),
            current=one("current", current, count),
            speed=one("speed", speed, count),
            temperature=None if temperature is None else _spread("temperature", temperature, rows),
            time=None if time is None else _spread("time", time, rows),
            station=stations,
            station_names=station_names,
            mount=mounts,
            mount_names=mount_names,
            approach=approaches,
            move=last_moves(joints, approaches),
            observed=_observed(observed or {}, rows, count),
            observed_labels={
                name: [str(label) for label in labels] for name, labels in (observed_labels or {}).items()
            },
            extra={name: _array(name, values, (rows,)) for name, values in (extra or {}).items()},
            extra_labels={name: [str(label) for label in labels] for name, labels in (extra_labels or {}).items()},
            notes=(*notes, *turned),
            source=source,
            joint_types=() if robot is None else tuple(robot.joint_types),
        )
        check_values(data, robot)
        if data.rotation is not None:
            data.rotation[:] /= np.linalg.norm(data.rotation, axis=1, keepdims=True)
        return data


def _observed(tables: Mapping[str, ArrayLike], rows: int, joints: int) -> dict[str, FloatArray]:
    """Tables of further observations as (N, k); (N,) is a single column."""
    out = {}
    for name, values in tables.items():
        known = tables_of(joints).get(name)
        if known is None or known.role == "label":
            raise InvalidInput(f"there is no field '{name}' to observe; there are {', '.join(tables_of(joints))}")
        given = np.asarray(values)
        out[name] = _array(name, given[:, np.newaxis] if given.ndim == 1 else given, (rows, len(known.columns)))
    return out


def _chosen(rows: ArrayLike | slice, count: int) -> IntArray:
    """Indices of the chosen rows."""
    if isinstance(rows, slice):
        chosen = np.arange(count)[rows]
    else:
        given = np.asarray(rows)
        if given.dtype == bool and given.shape != (count,):
            raise InvalidInput(f"a mask of rows must have shape ({count},), got {given.shape}")
        if given.dtype.kind not in "bui" and given.size:
            raise InvalidInput(f"rows must be whole numbers, a mask or a slice, got {given.dtype}")
        try:
            chosen = np.arange(count)[given.astype(bool if given.dtype == bool else np.int64)]
        except IndexError:
            raise InvalidInput(f"rows must lie between 0 and {count - 1}, got {given.min()} to {given.max()}") from None
    return np.atleast_1d(chosen)


def _array(name: str, value: ArrayLike, shape: tuple[int | None, ...], *, spread: bool = False) -> FloatArray:
    """A float64 copy in C order of real numbers; None in `shape` is any size; with `spread`, ones are repeated."""
    try:
        given = np.asarray(value)
    except ValueError:
        raise InvalidInput(f"{name} must hold real numbers in rows of one length") from None
    if given.dtype.kind not in "fiu":
        raise InvalidInput(f"{name} must hold real numbers, got {given.dtype}")
    if spread:
        with suppress(ValueError):  # the sentence below says it
            given = np.broadcast_to(given, [size or 0 for size in shape])
    if given.ndim != len(shape) or any(size not in (None, got) for size, got in zip(shape, given.shape, strict=True)):
        sizes = ["Nn"[axis] if size is None else str(size) for axis, size in enumerate(shape)]
        expected = f"({sizes[0]},)" if len(sizes) == 1 else f"({', '.join(sizes)})"
        raise InvalidInput(f"{name} must have shape {expected}, got {given.shape}")
    return np.array(given, dtype=np.float64, order="C")


def _spread(name: str, value: ArrayLike, rows: int) -> FloatArray:
    return _array(name, value, (rows,), spread=np.ndim(value) == 0)


def _codes(
    name: str, labels: Labels | None, rows: int, known: Sequence[str] = ()
) -> tuple[IntArray | None, tuple[str, ...]]:
    """Labels as indices into their names: those `known`, then in the order of first appearance; an empty text is -1."""
    if labels is None:
        return None, ()
    texts = [str(label) for label in labels]
    if len(texts) != rows:
        raise InvalidInput(f"{name} must hold {rows} labels, one a row, got {len(texts)}")
    if name in ("station", "mount") and "" in texts:
        raise BadRow(name, texts.index(""), 0, "a label", "''")
    names = {text: index for index, text in enumerate(dict.fromkeys([*known, *(text for text in texts if text)]))}
    return np.array([names.get(text, -1) for text in texts], dtype=np.int64), tuple(names)


_OWN = frozenset(f.name for f in fields(Dataset))  # fields of its own; all others are in `observed`
