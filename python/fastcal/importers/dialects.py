# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""All dialects, in the order in which they are tried; what none of them knows is read as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fastcal.importers import (
    api,
    delmia,
    fanuc,
    faro,
    feature_table,
    kuka,
    labelled,
    leica,
    metrolog,
    optitrack,
    polyworks,
    robodk,
    ros,
    rosbag,
    spatial_analyzer,
    universal_robots,
    vicon,
)
from fastcal.importers.dialect import Dialect
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table

# What is known by its shape comes before what is known by a word.
DIALECTS: Sequence[Dialect] = (
    rosbag.DIALECT,
    optitrack.DIALECT,
    vicon.DIALECT,
    faro.DIALECT,
    feature_table.DIALECT,
    labelled.DIALECT,
    ros.DIALECT,
    universal_robots.DIALECT,
    spatial_analyzer.DIALECT,
    polyworks.DIALECT,
    metrolog.DIALECT,
    api.DIALECT,
    delmia.DIALECT,
    robodk.DIALECT,
    fanuc.DIALECT,
    kuka.DIALECT,
    leica.DIALECT,
)


def read_export(grid: Grid) -> Export:
    """The export in a grid, by the first dialect that recognizes it.

    Raises:
        ParseError: It holds no table.
    """
    dialect = next((dialect for dialect in DIALECTS if dialect.recognizes(grid)), None)
    found = read_table(grid) if dialect is None else dialect.export(grid)
    return replace(found, notes=(*found.grid.notes, *found.notes))
