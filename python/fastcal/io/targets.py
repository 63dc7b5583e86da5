# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables of target poses: x, y, z and an orientation, conditions, and joint positions as a seed."""

from __future__ import annotations

import os

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.io.columns import match_columns, would_do
from fastcal.io.measurements import Columns, quaternions_of_rpy, unknown_columns
from fastcal.io.table import Table
from fastcal.io.tables import read_table, write_csv
from fastcal.measurements.checks import QUATERNION_TOLERANCE, SCALE_LIMIT, BadRow
from fastcal.measurements.conditions import condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import rotations
from fastcal.measurements.targets import Targets
from fastcal.robot.pendant import controller_columns, joint_columns
from fastcal.robot.robot import Robot
from fastcal.units import from_si


def load_targets(path: str | os.PathLike[str], robot: Robot) -> Targets:
    """Reads a CSV, Parquet or Excel file of target poses.

    A row whose pose is not one (an empty cell, a quaternion of another length than 1) is kept and becomes a bad target.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
    """
    table = read_table(path)
    return _targets(table.exact() if table.exact is not None else table, robot)


def _targets(table: Table, robot: Robot) -> Targets:
    known, unknown = match_columns(table, robot.joint_types)
    columns = Columns(table, known)
    position = columns.numbers("position", ["x", "y", "z"])
    if position is None:
        raise table.error(f"holds no target points; expected {would_do('x', 'length')}, and y and z")
    far = np.nan_to_num(np.abs(position)).max(axis=1) > SCALE_LIMIT * robot.reach
    if far.any():
        reach = from_si(robot.reach, "mm")
        expected = f"a number that fits an arm with a reach of {reach:.4g} mm (is its unit right?)"
        raise table.wrong_cell(known["x"].place, int(np.argmax(far)), expected)
    letter = "j" if "j1" in known and "q1" not in known else "q"
    motors = [joint for joint in range(robot.joint_count) if joint not in robot.passive]
    numbers = motors if letter == "q" else sorted(axis for axis in map(robot.pendant.axis, motors) if axis is not None)
    joints = [f"{letter}{number + 1}" for number in numbers]
    try:
        data = Dataset.from_arrays(
            q=np.zeros((len(table), robot.joint_count)),
            payload=columns.payload(),
            wrench=columns.numbers("wrench", ["fx", "fy", "fz", "mx", "my", "mz"]),
            current=columns.numbers("current", [f"current{joint[1:]}" for joint in joints]),
            temperature=columns.number("temperature", "temperature"),
            time=columns.number("time", "time"),
            station=columns.labels("station"),
            mount=columns.labels("mount"),
            approach=columns.approach([f"approach{joint[1:]}" for joint in joints]),
        )
    except BadRow as bad:
        raise columns.wrong(bad) from None
    if 0 < len(given := [joint for joint in joints if joint in known]) < len(joints):
        missing = next(joint for joint in joints if joint not in known)
        raise table.error(f"holds {', '.join(given)} as a seed without {missing}; expected all joints or none")
    seed = columns.numbers("q", joints)
    if seed is not None:
        shown = np.zeros((len(seed), robot.joint_count if letter == "q" else robot.pendant.axis_count))
        shown[:, numbers] = seed
        seed = robot.follow(shown if letter == "q" else robot.pendant.chain(shown))
    extra, _ = unknown_columns(table, unknown)
    notes = [*table.notes, *(f"column '{table.names[place]}' is not known" for place in unknown), *columns.notes]
    conditions = {name: value for name, value in condition_columns(data).items() if value is not None}
    del conditions["move"]  # of joints that are still looked for
    if data.approach is None:
        del conditions["approach"]
    return Targets(_poses(table, columns, position), seed, conditions | {"extra": extra}, tuple(notes))


def _poses(table: Table, columns: Columns, position: FloatArray) -> FloatArray:
    """(N, 4, 4), NaN in rows that hold no pose."""
    angles = columns.numbers("rotation", ["rx", "ry", "rz"])
    wxyz = columns.numbers("rotation", ["qw", "qx", "qy", "qz"])
    if (angles is None) == (wxyz is None):
        came = "none" if angles is None else "both"
        raise table.error(f"expected one orientation a row, either qw qx qy qz or rx_deg ry_deg rz_deg; got {came}")
    quaternion = quaternions_of_rpy(angles) if angles is not None else np.asarray(wxyz)
    with np.errstate(over="ignore"):
        length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    fits = np.abs(length[:, 0] - 1) <= QUATERNION_TOLERANCE  # False where it is NaN
    fits &= np.isfinite(position).all(axis=1)
    T = np.full((len(position), 4, 4), np.nan)
    T[fits, :3, :3] = rotations(quaternion[fits] / length[fits])
    T[fits, :3, 3] = position[fits]
    T[fits, 3] = [0, 0, 0, 1]
    return T


def write_commands(
    path: str | os.PathLike[str],
    robot: Robot,
    q: FloatArray,
    residual: tuple[FloatArray, FloatArray],
    sigma: FloatArray,
    status: np.typing.NDArray[np.str_],
    weight: FloatArray | None = None,
) -> None:
    """Writes commands: qN_deg (qN_mm), residual_mm, residual_deg, sigma_mm, status; what is not known is left empty.

    Where the controller counts otherwise than the chain, jN_deg follow qN_deg. A trained correction's weight comes
    last, as correction_weight.

    Raises:
        InvalidInput: The file cannot be written.
    """
    columns: dict[str, object] = {**joint_columns(robot.description, q), **controller_columns(robot.description, q)}
    columns["residual_mm"], columns["residual_deg"] = from_si(residual[0], "mm"), from_si(residual[1], "deg")
    columns["sigma_mm"], columns["status"] = from_si(sigma, "mm"), status.tolist()
    if weight is not None:
        columns["correction_weight"] = weight
    write_csv(path, columns)  # type: ignore[arg-type]
