# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Exports of instruments and controllers as measurements; one file a dialect, and the list in `dialects.py`."""

from fastcal.importers.importing import import_measurements, map_text
from fastcal.importers.loading import load_measurements
from fastcal.importers.mapping import Mapping, read_map
from fastcal.importers.templates import write_template
from fastcal.importers.writing import imported_dataset, write_imported

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
