# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Budget files: what is known beforehand of the instrument and of the conditions.

level: 0.95
instrument: {xyz_mm: [0, 0, 0]}              # in the measuring frame
inputs:
  - {name: range, kind: range, half_width_um_m: 5}
  - {name: angles, kind: angle, expanded_um_m: 12, coverage_factor: 2}
  - {name: reflector, kind: target, half_width_um: 6}
  - {name: room, kind: temperature, half_width_k: 1, expansion_1_k: 11.5e-6}
  - {name: load, kind: payload, standard_kg: 0.1}
"""

from __future__ import annotations

import math
import os
import re
from typing import Any

import numpy as np

from fastcal.budget.inputs import DISTRIBUTIONS, HALF_WIDTHS, KINDS, OF_EACH_POSE, Budget, Input
from fastcal.io.fields import Fields
from fastcal.io.yaml_file import read_yaml
from fastcal.units import to_si

# Unit of a size: its quantity and its SI value. A temperature is a difference here, so degrees C have no place.
_UNITS: dict[str, tuple[str, float]] = {
    **{unit: ("length", float(to_si(1.0, unit))) for unit in ("m", "mm", "um")},
    **{unit: ("angle", float(to_si(1.0, unit))) for unit in ("rad", "mrad", "deg")},
    **{unit: ("mass", float(to_si(1.0, unit))) for unit in ("kg", "g")},
    "urad": ("angle", 1e-6),
    "um_m": ("per_length", 1e-6),
    "mm_m": ("per_length", 1e-3),
    "ppm": ("per_length", 1e-6),
    "k": ("temperature", 1.0),
    "percent": ("share", 1e-2),
}
_SIZE = re.compile(r"(standard|half_width|expanded)_(\w+)")
_MOST_INPUTS = 100


def load_budget(path: str | os.PathLike[str]) -> Budget:
    """Reads such a file; `inputs` must be there.

    Raises:
        ParseError: Something is unknown or invalid; one sentence with file and key.
    """
    top = Fields(read_yaml(path), "", path)
    level = top.number("level", 0.95)
    if not 0.5 <= level < 1:
        top.fail("level", "a probability from 0.5 to below 1", level)
    place = top.inner("instrument", {})
    instrument = to_si(np.array(place.quantities("xyz", "mm", 3, [0.0, 0.0, 0.0])), "mm")
    place.done()
    entries = top.take("inputs")
    if not isinstance(entries, list) or not 0 < len(entries) <= _MOST_INPUTS:
        top.fail("inputs", f"a list of 1 to {_MOST_INPUTS} inputs", entries)
    top.done()
    inputs = tuple(_input(entry, f"inputs[{i}]", path) for i, entry in enumerate(entries))
    names = [each.name for each in inputs]
    if twice := next((name for name in names if names.count(name) > 1), None):
        top.refuse("inputs", f"'{twice}' is the name of two inputs; expected a name of its own for each")
    return Budget(inputs, instrument, level)


def _input(entry: Any, where: str, path: str | os.PathLike[str]) -> Input:
    fields = Fields(entry, where, path)
    kind = fields.choice("kind", tuple(KINDS))
    quantity, standard, distribution = _size(fields, entry, kind)
    freedom = fields.number("degrees_of_freedom", math.inf) if fields.has("degrees_of_freedom") else math.inf
    if not freedom >= 1:
        fields.fail("degrees_of_freedom", "a number of at least 1", freedom)
    common = fields.truth("common", kind not in OF_EACH_POSE)
    expansion = fields.number("expansion_1_k") if kind == "temperature" else 0.0
    found = Input(fields.text("name"), kind, quantity, standard, distribution, freedom, common, expansion)
    fields.done()
    return found


def _size(fields: Fields, entry: dict[str, Any], kind: str) -> tuple[str, float, str]:
    """Quantity, standard uncertainty and distribution of the one key that gives an input's size."""
    units = [unit for unit, (quantity, _) in _UNITS.items() if quantity in KINDS[kind]]
    would_do = f"one of standard_, half_width_ or expanded_ with {', '.join(units)}"
    sizes = [(key, *match.groups()) for key in entry if (match := _SIZE.fullmatch(str(key)))]
    if len(sizes) != 1:
        got = ", ".join(key for key, _, _ in sizes) or "none"
        fields.refuse("", f"the size of {kind} is {would_do}; expected one such key, got {got}")
    key, form, unit = sizes[0]
    if unit not in units:
        fields.refuse(key, f"the size of {kind} is {would_do}")
    value = fields.number(key)
    if not value > 0:
        fields.fail(key, "a number above 0", value)
    quantity, factor = _UNITS[unit]
    if form == "half_width":
        distribution = fields.choice("distribution", tuple(HALF_WIDTHS), "rectangular")
        return quantity, value * factor / HALF_WIDTHS[distribution], distribution
    if form == "expanded":
        cover = fields.number("coverage_factor", 2.0)
        if not cover >= 1:
            fields.fail("coverage_factor", "a number of at least 1", cover)
        return quantity, value * factor / cover, "normal"
    return quantity, value * factor, fields.choice("distribution", DISTRIBUTIONS, "normal")
