# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of the data that were tested as causes, and those that were not, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal.measurements.dataset import Dataset


@dataclass(frozen=True)
class DataColumns:
    """Columns by their titles.

    Attributes:
        tried: Conditions and the user's own readings that vary.
        labels: Names, serial numbers and counters, which are never a cause.
        unvaried: Readings that are the same in all rows, or empty in some.
    """

    tried: tuple[str, ...]
    labels: tuple[str, ...]
    unvaried: tuple[str, ...]


def columns_of(data: Dataset) -> DataColumns:
    """The columns of a data set as a diagnosis takes them."""
    conditions = {
        "payload_kg": data.payload,
        "time_s": data.time,
        "temperature_c": data.temperature,
        "station": data.station,
        "mount": data.mount,
        "approach": data.approach,
        "current_a": data.current,
    }
    varied = [name for name, values in conditions.items() if values is not None and _varies(values)]
    own = [name for name, values in data.sensors.items() if _varies(values)]
    labels = [*(name for name in data.extra if name not in data.sensors), *data.extra_labels]
    return DataColumns((*varied, *own), tuple(labels), tuple(name for name in data.sensors if name not in own))


def _varies(values: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> bool:
    numbers = np.asarray(values, dtype=np.float64)
    return bool(np.isfinite(numbers).all() and (np.ptp(numbers, axis=0) > 0).any())
