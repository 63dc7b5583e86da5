# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""All dialects, in the order in which they are tried; what none of them knows is read as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fastcal.importers import (
    fanuc,
    faro,
    feature_table,
    kuka,
    labelled,
    optitrack,
    ros,
    rosbag,
    spatial_analyzer,
    vicon,
)
from fastcal.importers.dialect import Dialect, signed
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table

# Dialects that words in their first lines tell, and whose exports are plain tables. Units and angles where a file names
# none are those of the maker's documentation.
UNIVERSAL_ROBOTS = Dialect(  # actual_TCP_pose is what the controller computes
    "Universal Robots RTDE",
    signed(r"\b(actual|target)_(q|TCP_pose)_?\d|\bRTDE\b"),
    units={"length": ("m", 1.0), "angle": ("rad", 1.0)},
    controller=True,
)
POLYWORKS = Dialect("PolyWorks|Inspector", signed(r"PolyWorks|\bMeas\.? X\b.*\bNom\.? X\b"))
METROLOG = Dialect("Metrolog", signed(r"Metrolog|X mesuré|X th[ée]orique"))
API = Dialect("API tracker", signed(r"\bAPI (Radian|OT2|iLT|Tracker|T3)\b|\bRadian (Pro|Plus|Core)\b"))
DELMIA = Dialect(
    "DELMIA",
    signed(r"DELMIA|\bTag name\b.*\bRoll\b.*\bJoint"),
    units={"length": ("mm", 1.0), "angle": ("deg", 1.0)},
    orientation="rpy",
)
ROBODK = Dialect(
    "RoboDK", signed(r"RoboDK|\bId\b.*\bValid\b.*\bJoint"), units={"length": ("mm", 1.0), "angle": ("deg", 1.0)}
)
LEICA = Dialect("Leica tracker", signed(r"emScon|Tracker Pilot|Measurement Mode|RMS Total"))

# What is known by its shape comes before what is known by a word.
DIALECTS: Sequence[Dialect] = (
    rosbag.DIALECT,
    optitrack.DIALECT,
    vicon.DIALECT,
    faro.DIALECT,
    feature_table.DIALECT,
    labelled.DIALECT,
    ros.DIALECT,
    UNIVERSAL_ROBOTS,
    spatial_analyzer.DIALECT,
    POLYWORKS,
    METROLOG,
    API,
    DELMIA,
    ROBODK,
    fanuc.DIALECT,
    kuka.DIALECT,
    LEICA,
)


def read_export(grid: Grid) -> Export:
    """The export in a grid, by the first dialect that recognizes it.

    Raises:
        ParseError: It holds no table.
    """
    dialect = next((dialect for dialect in DIALECTS if dialect.recognizes(grid)), None)
    found = read_table(grid) if dialect is None else dialect.export(grid)
    return replace(found, notes=(*found.grid.notes, *found.notes))
