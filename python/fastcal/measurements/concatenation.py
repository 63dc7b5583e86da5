# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Several data sets of one arm as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset

_MAY_BE_EMPTY = ("q_read", "position", "rotation", "distance", "sigma_position", "instrument", "sigma_rotation")
_WHOLE = ("wrench", "current", "speed", "temperature", "time")  # a row without them can't be


def concatenated(sets: Sequence[Dataset], labels: Sequence[str] | None) -> Dataset:
    """See `Dataset.concatenate`."""
    _check(sets, labels)
    notes = list(dict.fromkeys(note for data in sets for note in data.notes))
    fields: dict[str, Any] = {name: _filled(sets, name) for name in _MAY_BE_EMPTY}
    for name in _WHOLE:
        lacking = [data.source for data in sets if getattr(data, name) is None]
        if not lacking:
            fields[name] = np.concatenate([getattr(data, name) for data in sets])
        elif len(lacking) < len(sets):
            notes.append(f"{name} is left out, as {', '.join(lacking)} does not have it")
    if any(data.approach is not None for data in sets):
        fields["approach"] = np.concatenate([np.zeros_like(d.q) if d.approach is None else d.approach for d in sets])
    for name in ("station", "mount"):
        fields[name] = _labels(sets, name, labels)
    if any(data.distance is not None for data in sets):
        fields["anchor"] = [text for data in sets for text in _texts(data, "anchor", "")]
    whole = Dataset.from_arrays(
        np.concatenate([data.q for data in sets]),
        payload=np.concatenate([data.payload for data in sets]),
        **fields,
        observed=_columns(sets, "observed"),
        observed_labels=_texts_by_name(sets, "observed_labels"),
        extra=_columns(sets, "extra"),
        extra_labels=_texts_by_name(sets, "extra_labels"),
        notes=notes,
        source=", ".join(data.source for data in sets),
    )
    return replace(whole, rotation_angles=_filled(sets, "rotation_angles"))


def _columns(sets: Sequence[Dataset], mapping: str) -> dict[str, FloatArray]:
    """Columns by name, NaN in the rows of those that lack one."""
    shapes = {name: values.shape[1:] for data in sets for name, values in getattr(data, mapping).items()}
    return {
        name: np.concatenate([getattr(d, mapping).get(name, np.full((len(d), *shape), np.nan)) for d in sets])
        for name, shape in shapes.items()
    }


def _texts_by_name(sets: Sequence[Dataset], mapping: str) -> dict[str, list[str]]:
    """Columns of text by name, empty in the rows of those that lack one."""
    names = dict.fromkeys(name for data in sets for name in getattr(data, mapping))
    return {name: [text for d in sets for text in getattr(d, mapping).get(name, [""] * len(d))] for name in names}


def _check(sets: Sequence[Dataset], labels: Sequence[str] | None) -> None:
    if not sets:
        raise InvalidInput("expected at least one data set")
    if labels is not None and len(labels) != len(sets):
        raise InvalidInput(f"expected {len(sets)} labels, one a data set, got {len(labels)}")
    joints = {data.q.shape[1] for data in sets}
    if len(joints) > 1:
        counts = ", ".join(f"{data.q.shape[1]} in {data.source}" for data in sets)
        raise InvalidInput(f"expected data sets of one arm, got different numbers of joints: {counts}")


def _filled(sets: Sequence[Dataset], name: str) -> FloatArray | None:
    """A field with NaN in the rows of those that lack it; None where all do."""
    shapes = [part.shape[1:] for data in sets if (part := getattr(data, name)) is not None]
    if not shapes:
        return None
    parts = [getattr(data, name) for data in sets]
    return np.concatenate(
        [np.full((len(d), *shapes[0]), np.nan) if p is None else p for d, p in zip(sets, parts, strict=True)]
    )


def _labels(sets: Sequence[Dataset], name: str, labels: Sequence[str] | None) -> list[str] | None:
    """Stations or mounts: a set's own, else its label, else its source."""
    if labels is None and all(getattr(data, name) is None for data in sets):
        return None
    names = [data.source for data in sets] if labels is None else labels
    return [text for data, own in zip(sets, names, strict=True) for text in _texts(data, name, own)]


def _texts(data: Dataset, name: str, missing: str) -> list[str]:
    codes, names = getattr(data, name), getattr(data, f"{name}_names")
    return [missing] * len(data) if codes is None else ["" if code < 0 else names[code] for code in codes.tolist()]
