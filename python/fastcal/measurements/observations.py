# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What can be measured, as the core's registry of observations knows it: fields of a data set, columns of a file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset


@dataclass(frozen=True)
class Table:
    """One field of a data set and the columns of a file that it is read from.

    Attributes:
        name: Of the field: `position`, `tilt@link2`.
        role: measured, sigma or label.
        columns: Titles without their units: `x`, `tilt_x@link2`.
        quantity: length, angle ...; None: plain numbers or labels.
        unit: In which it is written; None: plain numbers or labels.
    """

    name: str
    role: str
    columns: tuple[str, ...]
    quantity: str | None
    unit: str | None


@cache
def tables_of(joint_count: int) -> dict[str, Table]:
    """All fields that a data set of an arm may have, by their names."""
    out: dict[str, Table] = {}
    for kind in _as_written():
        for field in _core.observation_entry(kind).fields:
            for place in [f"@link{joint}" for joint in range(1, joint_count + 1)] if field.each_link else [""]:
                columns = tuple(column + place for column in field.columns)
                quantity, unit = field.quantity or None, field.written_unit or None
                out[field.name + place] = Table(field.name + place, field.role, columns, quantity, unit)
    return out


def _as_written() -> list[str]:
    """Kinds of observation in the order of a file's columns: points, others of the tool, then those of each link."""

    def place(kind: str) -> tuple[bool, bool]:
        return any(field.each_link for field in _core.observation_entry(kind).fields), kind != "position"

    backwards = _core.observation_names()[::-1]
    return sorted(backwards, key=place)


def expected_columns() -> str:
    """What a file may hold that is measured, in words."""
    names = []
    for kind in _as_written():
        entry = _core.observation_entry(kind)
        fields = [f for f in entry.fields if f.role == "measured"] or [f for f in entry.fields if f.role == "label"]
        if not fields[0].columns:
            continue  # it has a file of its own
        place = "@linkN" if fields[0].each_link else ""
        unit = f"_{fields[0].written_unit}" if fields[0].written_unit else ""
        names.append(" ".join(f"{column}{unit}{place}" for column in fields[0].columns))
    return f"{', '.join(names[:-1])} or {names[-1]}"


def kinds_of(data: Dataset) -> list[str]:
    """Kinds of observation that a data set has, sorted."""
    return list(data.kinds)


def found_kinds(data: Dataset) -> dict[str, list[str]]:
    """Of each kind of observation that a data set has, sorted, the fields that say what was measured."""
    return {kind: own for kind in _core.observation_names() if (own := _measured_fields(data, kind))}


def sharing(data: Dataset, field: str) -> int:
    """Kinds of observation in the data that read a field: one standard deviation then stands for all of them."""
    return sum(any(f.name == field for f in _core.observation_entry(kind).fields) for kind in kinds_of(data))


def kind_of(observation: _core.Observation) -> str:
    """Its kind in the registry: what it is of stands behind that, "tilt of link3", "position@smr:camera"."""
    return observation.name.partition(" of link")[0].partition("@")[0]


def sigma_field(kind: str) -> str:
    """The field of the standard deviations of a kind of observation."""
    return next(field.name for field in _core.observation_entry(kind).fields if field.role == "sigma")


def sigma_column(kind: str) -> str:
    """The title of the column of the standard deviations of a kind of observation."""
    field = next(field for field in _core.observation_entry(kind).fields if field.role == "sigma")
    title = field.columns[0] if len(field.columns) == 1 else "sigma"
    return f"{title}_{field.written_unit}"


def plurals(data: Dataset) -> list[str]:
    """What a data set has, in words: positions, lengths ..."""
    return [_core.observation_entry(kind).plural for kind in kinds_of(data)]


def measured_rows(data: Dataset) -> NDArray[np.bool_]:
    """(N,) true in rows that hold at least one measured number."""
    known = np.zeros(len(data), dtype=bool)
    for kind in _core.observation_names():
        for field in _measured_fields(data, kind):
            values = data.table(field)
            known |= data.label_codes(field)[0] >= 0 if values is None else ~np.isnan(values).all(axis=1)
    return known


def without_measured(data: Dataset, rows: NDArray[np.intp] | NDArray[np.int64]) -> Dataset:
    """The same rows, as if nothing had been measured in some of them (indices)."""
    observed, labels, own = dict(data.observed), dict(data.observed_labels), dict[str, FloatArray]()
    gone = set(rows.tolist())
    for field in (field for kind in kinds_of(data) for field in _measured_fields(data, kind)):
        if field in labels:
            labels[field] = ["" if i in gone else label for i, label in enumerate(labels[field])]
            continue
        into = observed if field in observed else own
        into[field] = np.array(getattr(data, field) if into is own else observed[field])
        into[field][rows] = np.nan
    return replace(data, observed=observed, observed_labels=labels, **own)  # type: ignore[arg-type]


def without_kinds(data: Dataset, kinds: Collection[str]) -> Dataset:
    """The same rows, as if some kinds of observation had not been measured in them."""
    gone = {field for kind in kinds for field in data.kinds.get(kind, [])}
    observed = {name: values for name, values in data.observed.items() if name not in gone}
    labels = {name: values for name, values in data.observed_labels.items() if name not in gone}
    own: dict[str, None] = dict.fromkeys(gone - {*data.observed, *data.observed_labels})
    return replace(data, observed=observed, observed_labels=labels, **own)  # type: ignore[arg-type]


def present_numbers(data: Dataset, kind: str, width: int) -> NDArray[np.bool_]:
    """(N, width) which standard deviations of a kind are needed: of each coordinate where it has `width`, else one."""
    out = np.zeros((len(data), width), dtype=bool)
    for field in _measured_fields(data, kind):
        values = data.table(field)
        known = (data.label_codes(field)[0] >= 0)[:, np.newaxis] if values is None else ~np.isnan(values)
        if known.shape[1] == width:
            out |= known
        else:
            out[:, 0] |= known.any(axis=1)
    return out


def core_tables(data: Dataset) -> tuple[dict[str, FloatArray], dict[str, tuple[NDArray[np.int32], list[str]]]]:
    """The fields that a data set has, as the core takes them: numbers (N, k) and labels."""
    numbers, labels = {}, {}
    for field in tables_of(data.q.shape[1]).values():
        if field.role == "label":
            codes, names = data.label_codes(field.name)
            if len(codes):
                labels[field.name] = (codes.astype(np.int32), list(names))
        elif (values := data.table(field.name)) is not None:
            numbers[field.name] = values
    if data.instrument is not None:
        numbers["instrument"] = data.instrument
    return numbers, labels


def _measured_fields(data: Dataset, kind: str) -> list[str]:
    """Names of the fields of a kind that say what was measured and that the data have."""
    role, names = _fields_of(kind, data.q.shape[1])
    return [name for name in names if (data.table(name) is not None if role == "measured" else data.has_labels(name))]


@cache
def _fields_of(kind: str, joint_count: int) -> tuple[str, list[str]]:
    """The role and the names of the fields of a kind that say what was measured."""
    fields = _core.observation_entry(kind).fields
    role = "measured" if any(field.role == "measured" for field in fields) else "label"
    return role, [
        field.name + place
        for field in fields
        if field.role == role
        for place in ([f"@link{j}" for j in range(1, joint_count + 1)] if field.each_link else [""])
    ]
