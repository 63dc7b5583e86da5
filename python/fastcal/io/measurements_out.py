# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data sets as measurement files, which `load_measurements` reads back."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.io.tables import write_csv
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.instrument import range_and_angle
from fastcal.measurements.observations import sharing, tables_of
from fastcal.units import from_si

if TYPE_CHECKING:
    import pandas as pd

_UNITS = {"revolute": "deg", "prismatic": "mm"}
Columns = dict[str, Sequence[float | str] | NDArray[np.generic]]


def write_measurements(
    path: str | os.PathLike[str],
    data: Dataset,
    joint_types: Sequence[str] | None = None,
    passive: Sequence[int] = (),
) -> None:
    """Writes a data set as CSV in mm, deg, kg, N, A and degrees Celsius; what was not measured is left empty.

    Args:
        path: The file; written whole or not at all.
        data: What it is to hold. Orientations are written as quaternions.
        joint_types: `revolute` or `prismatic`, one a joint; may be left out where the data know their robot.
        passive: Joints, from 0, that closed loops move: they get no column.

    Raises:
        InvalidInput: The file cannot be written, or the kinds of the joints are not known.
    """
    write_csv(path, file_columns(data, joint_types, passive))


def frame_of(data: Dataset) -> pd.DataFrame:
    """The same columns as a pandas table; where the kinds of the joints are not known, q1 ... without a unit."""
    import pandas as pd

    return pd.DataFrame(file_columns(data, data.joint_types or ("unknown",) * data.q.shape[1]))


def file_columns(data: Dataset, joint_types: Sequence[str] | None = None, passive: Sequence[int] = ()) -> Columns:
    """The columns of a measurement file by their names; arguments and errors of `write_measurements`."""
    columns: Columns = {}
    joint_types = joint_types or data.joint_types
    if len(joint_types) != data.q.shape[1]:
        raise InvalidInput(f"expected the type of each of the {data.q.shape[1]} joints, got {list(joint_types)}")

    def add(names: Sequence[str], values: FloatArray | None, unit: str | None = None) -> None:
        if values is not None:
            edge = values if unit is None else from_si(values, unit)
            for name, column in zip(names, edge.reshape(len(data), -1).T, strict=True):
                base, at, place = name.partition("@")
                columns[name if unit is None else f"{base}_{unit}{at}{place}"] = column

    units = [_UNITS.get(joint_type) for joint_type in joint_types]
    joints = range(1, len(units) + 1)
    moved = [joint for joint in joints if joint - 1 not in passive]
    for suffix, values in (("", data.q), ("_read", data.q_read)):
        for joint in moved:
            add([f"q{joint}{suffix}"], None if values is None else values[:, joint - 1], units[joint - 1])
    for names, values, unit in _observed(data):
        add(names, values, unit)
    add(["payload"], data.payload if data.payload.any() else None, "kg")
    for places, names, unit in ((slice(3), ("fx", "fy", "fz"), "n"), (slice(3, 6), ("mx", "my", "mz"), "nm")):
        add(names, None if data.wrench is None else data.wrench[:, places], unit)
    add([f"current{joint}" for joint in joints], data.current, "a")
    for joint, unit in enumerate(units, start=1):
        add([f"qd{joint}"], None if data.speed is None else data.speed[:, joint - 1], unit and f"{unit}_s")
    add(["temperature"], data.temperature, "c")
    add(["time"], data.time, "s")
    columns.update(_labels(data))
    approach = data.approach
    add(
        [f"approach{joint}" for joint in moved],
        None if approach is None else np.where(approach == 0, np.nan, approach)[:, [joint - 1 for joint in moved]],
    )
    columns.update(data.extra)
    columns.update(data.extra_labels)
    return columns


def _labels(data: Dataset) -> dict[str, list[str]]:
    """The columns of labels, empty where a row has none."""
    fields = [table.name for table in tables_of(data.q.shape[1]).values() if table.role == "label"]
    coded = {name: data.label_codes(name) for name in (*fields, "station", "mount")}
    return {
        name: ["" if code < 0 else labels[code] for code in codes.tolist()]
        for name, (codes, labels) in coded.items()
        if len(codes)
    }


def _observed(data: Dataset) -> Iterator[tuple[Sequence[str], FloatArray | None, str | None]]:
    """Names without units, numbers and unit of all that was measured; one sigma where it is one for all coordinates."""
    polar = range_and_angle(data)
    if polar is not None:
        yield ["sigma_range"], polar[0], "mm"
        yield ["sigma_angle"], polar[1], "mrad"
        place = data.instrument
        if place is not None and np.nan_to_num(place).any():
            yield ["instrument_x", "instrument_y", "instrument_z"], np.nan_to_num(place), "mm"
    elif data.instrument is not None:
        raise InvalidInput("some rows have standard deviations along a beam, others of x, y and z: no file holds both")
    for table in tables_of(data.q.shape[1]).values():
        if polar is not None and table.name == "sigma_position":
            continue
        values = None if table.role == "label" else data.table(table.name)
        if (
            table.name == "sigma_position"
            and values is not None
            and (sharing(data, table.name) > 1 or (values == values[:, :1]).all())
        ):
            yield ["sigma"], values[:, :1], table.unit
        else:
            yield table.columns, values, table.unit
