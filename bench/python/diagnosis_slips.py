# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns that are not what their title says, as hands and exports make them: what `bench_diagnosis` asks about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fastcal.measurements.dataset import Dataset

Random = np.random.Generator

POUND_KG = 0.45359237


def _pounds(data: Dataset, random: Random) -> Dataset:
    return replace(data, payload=data.payload / POUND_KG)


def _every_second(data: Dataset, random: Random) -> Dataset:
    return replace(data, payload=np.where(np.arange(len(data)) % 2 == 1, 0.0, data.payload))


def _late_payload(data: Dataset, random: Random) -> Dataset:
    return replace(data, payload=np.concatenate([data.payload[:1], data.payload[:-1]]))


def _exchanged(data: Dataset, random: Random) -> Dataset:
    """The two loads that are there most often, in a third of the rows."""
    loads, counts = np.unique(data.payload, return_counts=True)
    a, b = loads[np.argsort(-counts, kind="stable")[:2]]
    first = int(random.integers(3)) * len(data) // 3
    rows = np.arange(len(data)) - first
    inside = (rows >= 0) & (rows < len(data) // 3)
    other = np.where(data.payload == a, b, np.where(data.payload == b, a, data.payload))
    return replace(data, payload=np.where(inside, other, data.payload))


def _late_approach(data: Dataset, random: Random) -> Dataset:
    assert data.approach is not None
    return replace(data, approach=np.vstack([data.approach[:1], data.approach[:-1]]))


def _fahrenheit(data: Dataset, random: Random) -> Dataset:
    assert data.temperature is not None
    return replace(data, temperature=(data.temperature - 273.15) * 1.8 + 32 + 273.15)


def _late_temperature(data: Dataset, random: Random) -> Dataset:
    """By a twentieth of the rows."""
    assert data.temperature is not None
    late = max(1, len(data) // 20)
    return replace(data, temperature=np.concatenate([np.full(late, data.temperature[0]), data.temperature[:-late]]))


# Name of the slip: the column, and what it makes of the rows.
SLIPS: dict[str, tuple[str, Callable[[Dataset, Random], Dataset]]] = {
    "payload in pounds": ("payload", _pounds),
    "payload 0 in every second row": ("payload", _every_second),
    "payload a row late": ("payload", _late_payload),
    "payloads exchanged in a third": ("payload", _exchanged),
    "approach a row late": ("approach", _late_approach),
    "temperature in Fahrenheit": ("temperature", _fahrenheit),
    "temperature late": ("temperature", _late_temperature),
}
NEEDS = {"payload": "joint_compliance", "approach": "backlash", "temperature": "thermal_expansion"}
