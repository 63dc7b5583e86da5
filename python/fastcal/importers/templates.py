# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Empty measurement files: the columns of an arm, and in a workbook a sheet that explains each."""

from __future__ import annotations

import datetime
import io
import os
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_bytes, write_text
from fastcal.io.excel import EXPLANATIONS
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_OPTIONAL = (
    (
        "qw, qx, qy, qz",
        "measured orientation as a quaternion, or rx_deg, ry_deg, rz_deg: roll, pitch, yaw about fixed axes",
    ),
    (
        "distance_mm, anchor",
        "a measured length instead of a point, and the name of the anchor that it was measured from",
    ),
    ("sigma_mm", "standard deviation of each measured coordinate; it weights the row"),
    ("payload_kg", "mass at the tool; 0 where there is no column"),
    ("temperature_c, time_s", "conditions, for effects of heat and drift"),
    ("station, mount", "names of the instrument's and of the target's set-up, where one was moved"),
    ("approach1 ...", "+1 or -1: the direction in which that joint last moved, for backlash"),
)


def write_template(path: str | os.PathLike[str], robot: Robot) -> list[str]:
    """Writes an empty measurement file: CSV, or a workbook where the name ends in .xlsx. Returns its columns.

    Raises:
        InvalidInput: The name has another ending, or the file can't be written.
    """
    columns = _columns(robot)
    suffix = Path(path).suffix.lower()
    if suffix == ".xlsx":
        write_bytes(path, _workbook(robot, columns))
    elif suffix in (".csv", ".txt"):
        write_text(path, ",".join(columns) + "\n")
    else:
        raise InvalidInput(f"{os.fspath(path)}: expected a name that ends in .csv or .xlsx")
    return list(columns)


def _columns(robot: Robot) -> dict[str, str]:
    """The columns that every measurement of points has, and what they hold."""
    out = {}
    shown = {entry.joint for entry in robot.description.pendant or ()}
    letter = "q" if robot.pendant.is_chain else "j"
    for number, (joint, (low, high)) in enumerate(zip(robot.joints, robot.limits.tolist(), strict=True), start=1):
        if joint.mimic is not None or joint.passive:
            continue
        unit, counted = joint.unit, robot.pendant.axis(number - 1)
        shows = number if counted is None else counted + 1
        reach = f"{from_si(low, unit):.6g} to {from_si(high, unit):.6g} {unit}"
        told = f", {reach}" if number not in shown else ", as the controller shows it"
        out[f"{letter}{shows}_{unit}"] = f"joint {number}: the position that was commanded{told}"
    for axis in "xyz":
        out[f"{axis}_mm"] = f"{axis} of the measured point in the instrument's frame; empty where it was not measured"
    return out


def _workbook(robot: Robot, columns: dict[str, str]) -> bytes:
    import openpyxl  # takes long to import
    from openpyxl.styles import Alignment, Font

    book = openpyxl.Workbook()
    book.properties.created = book.properties.modified = datetime.datetime(2000, 1, 1)
    sheet = book.active
    assert sheet is not None  # noqa: S101 - a new workbook has a sheet
    sheet.title = "Measurements"
    sheet.append(list(columns))
    for cell in sheet[1]:
        cell.font = Font(bold=True)
    sheet.freeze_panes = "A2"
    words = book.create_sheet(EXPLANATIONS)
    words.append(["column", "what it holds"])
    rows = [*columns.items(), ("", f"One row a pose of {robot.name}. Optional columns:"), *_OPTIONAL]
    for row in rows:
        words.append(list(row))
    words.column_dimensions["A"].width, words.column_dimensions["B"].width = 26, 90
    for row in words.iter_rows():
        row[0].font = Font(bold=True)
        row[1].alignment = Alignment(wrap_text=True, vertical="top")
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()
