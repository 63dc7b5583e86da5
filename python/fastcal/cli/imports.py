# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal import` and `fastcal template`: from an instrument's own file to a measurement file, or to an empty one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import emit, progress, say
from fastcal.cli.options import OutFile, RobotFile

if TYPE_CHECKING:
    from fastcal.importers import Mapping
    from fastcal.importers.picture_set import PictureSet
    from fastcal.importers.pose_pairs import PosePairs


def import_(
    exports: Annotated[list[Path], typer.Argument(metavar="EXPORT...", help="Exports of an instrument, in order.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="The measurement file to write, CSV.")
    ] = None,
    joints: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The controller's log or program with the joint positions, if EXPORT has none."
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="The arm; used to check the match and to find missing and shifted rows."),
    ] = None,
    sheet: Annotated[str | None, typer.Option(metavar="NAME", help="The sheet of a workbook.")] = None,
    orientation: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Convention of the angles: rpy, abc, wpr, zyz, xyz_moving, rotation_vector ..."
        ),
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="FILE", help="YAML file that says what each column is.")
    ] = None,
    encoding: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Text encoding, if it cannot be detected: cp932, gbk, cp1252, utf-16 ..."),
    ] = None,
    hand_eye: Annotated[
        bool,
        typer.Option(
            "--hand-eye",
            help="EXPORT holds poses of the flange and of a board seen by a camera, for hand-eye calibration.",
        ),
    ] = False,
    print_map: Annotated[
        bool, typer.Option("--print-map", help="Write a map to start from, to FILE or the terminal.")
    ] = False,
) -> None:
    """Turn exports of instruments into a measurement file.

    Joints and points from two files are matched by name, else by time, else by order. If something cannot be decided,
    you are asked to state it.
    """
    from fastcal.errors import InvalidInput
    from fastcal.importers import import_measurements, map_text, read_map, write_imported
    from fastcal.importers.industrial_calibration import read_industrial_set
    from fastcal.importers.numbered_pictures import read_numbered_pictures
    from fastcal.importers.picture_set import write_picture_set
    from fastcal.importers.pose_pairs import read_pose_pairs
    from fastcal.importers.pose_pairs_out import write_pose_pairs
    from fastcal.importers.robot_calibration import read_calibration_data
    from fastcal.io.atomic import write_text
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell, load_cell

    mapping: Mapping | None = None if map_ is None else read_map(map_)
    arm = None if robot is None else load_cell(robot).only_arm if is_cell(robot) else load_robot(robot)
    if print_map:
        text = map_text([*exports, *([joints] if joints else [])], mapping, sheet, encoding)
        if output is None:
            for line in text.splitlines():
                say(line)
        else:
            write_text(output, text)
        emit({"map": text} | ({} if output is None else {"file": str(output)}))
        return
    if output is None:
        raise InvalidInput("expected -o FILE, the measurement file to write")
    if (taken := read_industrial_set(exports) or read_numbered_pictures(exports)) is not None:
        _say_set(taken, output, write_picture_set(output, taken, arm, robot or ""))
        return
    pairs = read_pose_pairs(exports, asked=hand_eye, orientation=orientation) or read_calibration_data(exports, arm)
    if pairs is not None:
        _say_pairs(pairs, output, write_pose_pairs(output, pairs, arm, robot or ""))
        return
    with progress() as show:
        show("reading")
        found = import_measurements(
            exports,
            joints=joints,
            robot=arm,
            sheet=sheet,
            orientation=orientation,
            mapping=mapping,
            encoding=encoding,
        )
        rows = write_imported(output, found, arm)
    for note in found.notes:
        say(note)
    measured = [
        text
        for text, given in (("points", "x"), ("orientations", "r"), ("lengths", "distance"))
        if _has(found.columns, given)
    ]
    say(f"{output}: {rows} rows, {found.joints} joints, {', '.join(measured)}; read as {found.dialect}")
    emit(
        {
            "file": str(output),
            "rows": rows,
            "joints": found.joints,
            "measured": measured,
            "read_as": found.dialect,
            "notes": list(found.notes),
        }
    )


def _say_set(taken: PictureSet, output: Path, cell: Path) -> None:
    folder = taken.pictures[0].parent
    for note in taken.notes:
        say(note)
    say(f"{output}: {len(taken.pictures)} poses with pictures; read as {taken.read_as}")
    say(f"next: fastcal detect {folder} --cell {cell} --joints {output} -o corners.csv")
    say(f"then: fastcal calibrate {cell} {output} --corners corners.csv -o out --hand-eye camera.calib")
    emit({"file": str(output), "cell": str(cell), "rows": len(taken.pictures), "read_as": taken.read_as})


def _say_pairs(pairs: PosePairs, output: Path, cell: Path) -> None:
    for note in pairs.notes:
        say(note)
    say(f"{output}: {len(pairs.flange)} pairs of poses; read as {pairs.read_as}")
    say(f"next: fastcal calibrate {cell} {output} -o out --hand-eye camera.calib")
    emit({"file": str(output), "cell": str(cell), "rows": len(pairs.flange), "read_as": pairs.read_as})


def _has(columns: object, given: str) -> bool:
    names = {"x": ("x_",), "r": ("rx_", "qw"), "distance": ("distance_",)}[given]
    return any(str(name).startswith(names) for name in columns)  # type: ignore[attr-defined]


def template(robot: RobotFile, output: OutFile) -> None:
    """Write an empty measurement file for a robot.

    CSV, or Excel (xlsx) with a sheet that explains each column.
    """
    from fastcal.importers import write_template
    from fastcal.io.robot_file import load_robot

    arm = load_robot(robot)
    columns = write_template(output, arm)
    say(f"{output}: an empty measurement file for {arm.name}")
    emit({"file": str(output), "robot": arm.name, "columns": columns})
