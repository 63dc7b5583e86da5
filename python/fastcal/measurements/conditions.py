# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a data set or a caller says of N postures, as the core reads it, held against what the robot's effects need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects import registered
from fastcal.effects.entries import (
    LAGGED,
    MOVE,
    SINCE,
    Spec,
    conditions_read,
    extra_columns,
    label,
    options_of,
    traits_of,
)
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.measuring_order import since
from fastcal.measurements.thermal_lag import lagged

NUMBERS = ("temperature", "time")  # one a row
TABLES = ("wrench", "approach", "current")
LABELLED = {"station": "stations", "mount": "mounts"}  # a column of labels: the option that lists those an effect knows
_TITLES = {"temperature": "temperature_c", "time": "time_s", "wrench": "fx_n ... mz_nm"}


def build_samples(
    entries: Sequence[Spec],
    effects: Sequence[_core.Effect],
    core: _core.RobotModel,
    q: FloatArray,
    given: Mapping[str, Any],
) -> _core.Samples:
    """The core's conditions of N postures.

    Args:
        entries: The robot's effects as in its file.
        effects: The same as the core has them.
        core: The robot.
        q: (N, n) joint positions, checked.
        given: payload, wrench, temperature ... in SI, `station` and `mount` as labels, `extra` as name to (N,); None
            where there is none. One number or label stands for all rows.
    """
    known = {name: value for name, value in given.items() if value is not None and name not in ("extra", "move", "row")}
    names = ["payload", *NUMBERS, *TABLES, *LABELLED]
    for name in known:
        if name not in names:
            raise InvalidInput(f"no condition is called '{name}'; there are {', '.join(names)}, extra")
    extra = {name: np.asarray(values, dtype=float) for name, values in (given.get("extra") or {}).items()}
    arrays = _arrays(known, q)
    labels = {
        name: np.broadcast_to(np.asarray(known[name]).astype(str), (len(q),)) for name in LABELLED if name in known
    }
    for entry, effect in zip(entries, effects, strict=True):
        _check_columns(entry, effect, {**arrays, **labels}, extra, len(q))
    for name, values in labels.items():
        there, place = np.unique(values, return_inverse=True)
        arrays[name] = place.astype(np.int32)
        for entry in entries:
            if traits_of(entry["effect"]).labels == LABELLED[name] and LABELLED[name] in options_of(entry):
                arrays[name] = _numbers_of(there, place, entry, name)
    if columns := extra_columns(entries):
        arrays["extra"] = np.column_stack([_column(name, arrays, given, extra, q) for name in columns])
    table = _table(entries, core, q, arrays, extra)
    return _core.Samples(q, **arrays, **({} if table is None else {"table": table}))


def condition_columns(data: Dataset) -> dict[str, Any]:
    """The conditions of a data set as `Robot.forward` takes them: name to values, None where there are none."""
    return {
        "payload": data.payload,
        "wrench": data.wrench,
        "temperature": data.temperature,
        "time": data.time,
        "station": None if data.station is None else np.array(data.station_names)[data.station],
        "mount": None if data.mount is None else np.array(data.mount_names)[data.mount],
        "approach": data.directions if data.approach is None else data.approach,
        "move": data.move,
        "row": data.row,
        "current": data.current,
        "extra": data.extra,
    }


def _arrays(known: Mapping[str, Any], q: FloatArray) -> dict[str, Any]:
    """Numbers of every row, (N,) or (N, k)."""
    arrays: dict[str, Any] = {}
    for name in ("payload", *NUMBERS):
        if name in known:
            arrays[name] = _spread(name, known[name], (len(q),))
    for name in TABLES:
        if name in known:
            width = 6 if name == "wrench" else q.shape[1]
            arrays[name] = np.ascontiguousarray(_spread(name, known[name], (len(q), width)))
    return arrays


def real_array(name: str, value: ArrayLike) -> FloatArray:
    """Real numbers as float64. InvalidInput where they are none: text, complex numbers, truth values, ragged rows."""
    try:
        given = np.asarray(value)
        if given.dtype.kind in "fiuO":
            return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name} must hold real numbers in rows of one length") from None
    raise InvalidInput(f"{name} must hold real numbers, got {given.dtype}")


def _spread(name: str, value: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Numbers that stand for all rows, repeated."""
    given = real_array(name, value)
    try:
        return given if given.shape == shape else np.broadcast_to(given, shape)
    except ValueError:
        raise InvalidInput(f"{name} must be one number, or have shape {shape}, got {given.shape}") from None


def _check_columns(
    entry: Spec, effect: _core.Effect, given: Mapping[str, Any], extra: Mapping[str, FloatArray], rows: int
) -> None:
    """Raises InvalidInput where the data lack what the effect cannot do without."""
    own = registered.find(entry["effect"])
    for name in conditions_read(entry, effect):
        if name.startswith("extra:"):
            _check_extra(entry, name.removeprefix("extra:"), extra, rows)
        elif name.rstrip("0123456789") not in given:  # approach4: the column of a joint
            known = f" ({name}: one of {', '.join(map(str, labels))})" if (labels := _labels(entry, name)) else ""
            raise InvalidInput(f"{label(entry)} needs the column {_title(name)}{known}, which the data do not have")
    for name in own.extra if own else ():
        _check_extra(entry, name, extra, rows)


def _labels(entry: Spec, column: str) -> Sequence[str]:
    """Labels that the entry was fitted with, of a column that holds labels."""
    return entry.get(LABELLED[column], []) if column in LABELLED else []


def _title(name: str) -> str:
    """A column as a file has it."""
    return f"{name}_a" if name.startswith("current") else _TITLES.get(name, name)


def _check_extra(entry: Spec, name: str, extra: Mapping[str, FloatArray], rows: int) -> None:
    if name not in extra:
        raise InvalidInput(f"{label(entry)} needs the column {name} with numbers, which the data do not have")
    values = extra[name]
    if values.shape != (rows,):
        raise InvalidInput(f"the column {name} must have shape ({rows},), got {values.shape}")
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise InvalidInput(f"{label(entry)} needs the column {name}, and it holds no number in row {row}")


def _numbers_of(labels: NDArray[np.str_], place: NDArray[np.intp], entry: Spec, column: str) -> NDArray[np.int32]:
    """The labels of rows, `labels[place]`, as places in the entry's own list, which may be another file's."""
    known = [str(name) for name in entry.get(LABELLED[column], labels.tolist())]
    own = {name: number for number, name in enumerate(known)}
    numbers = np.array([own.get(name, -1) for name in labels.tolist()], dtype=np.int32)[place]
    if (numbers < 0).any():
        row, listed = int(np.argmax(numbers < 0)), ", ".join(known)
        name = labels[place[row]]
        raise InvalidInput(f"{column} '{name}' in row {row} is not one {label(entry)} was fitted with: {listed}")
    return numbers


def _column(
    name: str, arrays: Mapping[str, Any], given: Mapping[str, Any], extra: Mapping[str, FloatArray], q: FloatArray
) -> FloatArray:
    """(N,) a column of the user's own, or one that follows from several rows."""
    if name.startswith(LAGGED):
        if "time" not in arrays:
            raise InvalidInput("a thermal effect with lag_s needs the column time_s, which the data do not have")
        return lagged(arrays["temperature"], arrays["time"], float(name.removeprefix(LAGGED)))
    if name.startswith(MOVE):
        joint, move = int(name.removeprefix(MOVE)) - 1, given.get("move")
        return np.zeros(len(q)) if move is None else np.asarray(move, dtype=float)[:, joint]
    if name.startswith(SINCE):
        first, _, count = name.removeprefix(SINCE).partition(" of ")
        return since(given.get("row"), float(first), float(count), len(q))
    return extra[name]


def _table(
    entries: Sequence[Spec],
    core: _core.RobotModel,
    q: FloatArray,
    arrays: Mapping[str, Any],
    extra: Mapping[str, FloatArray],
) -> FloatArray | None:
    parts = []
    for entry in entries:
        own = registered.find(entry["effect"])
        if own is None:
            continue
        columns = {name: arrays[name] for name in ("payload", *NUMBERS, *TABLES, *LABELLED) if name in arrays}
        states = registered.States(
            owner=entry["owner"],
            robot=core,
            q=q,
            extra={name: extra[name] for name in own.extra},
            load=_rigid_loads(core, q, arrays) if own.follows_loads else None,
            **columns,
        )
        parts.append(own.table(states))
    return np.hstack(parts) if parts else None


def _rigid_loads(core: _core.RobotModel, q: FloatArray, arrays: Mapping[str, Any]) -> FloatArray:
    """(N, frames, 6) loads on the frames of the robot without effects [N, N m]."""
    rigid = _core.ErrorModel(core, [])
    return np.asarray(rigid.loads(_core.Samples(q, **arrays), rigid.start, False, 1))
