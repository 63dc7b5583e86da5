# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Exports of instruments and controllers as measurements; one file a dialect, and the list in `dialects.py`."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fastcal.importers.importing import import_measurements, map_text
    from fastcal.importers.loading import load_measurements
    from fastcal.importers.mapping import Mapping, read_map
    from fastcal.importers.templates import write_template
    from fastcal.importers.writing import imported_dataset, write_imported

# Found where they are asked for: a measurement file needs no dialect.
_HOMES = {
    "Mapping": "mapping",
    "import_measurements": "importing",
    "imported_dataset": "writing",
    "load_measurements": "loading",
    "map_text": "importing",
    "read_map": "mapping",
    "write_imported": "writing",
    "write_template": "templates",
}

__all__ = [
    "Mapping",
    "import_measurements",
    "imported_dataset",
    "load_measurements",
    "map_text",
    "read_map",
    "write_imported",
    "write_template",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastcal.importers' has no attribute '{name}'")
    return getattr(importlib.import_module(f"fastcal.importers.{_HOMES[name]}"), name)
