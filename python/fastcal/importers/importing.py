# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From exports to one table of the contract: sheets chosen, joints and points joined, files put one after the other."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fastcal.errors import InvalidInput, ParseError
from fastcal.importers import programs, rosbag
from fastcal.importers.bag_path import is_bag
from fastcal.importers.controller_joints import named_by_their_owner
from fastcal.importers.dialects import read_export
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.joining import confirmed, joined
from fastcal.importers.joint_names import check_named, is_named, motors_of, notes_on_names, renumbered, with_joint_names
from fastcal.importers.label_columns import LabelColumn
from fastcal.importers.mapping import Mapping
from fastcal.importers.mapping import map_text as text_of_map
from fastcal.importers.orientation import check_convention
from fastcal.importers.reading import Column, Reading, interpret, unknown_note
from fastcal.importers.sources import read_grids
from fastcal.io.text_encoding import asked_codec
from fastcal.robot.robot import Robot
from fastcal.said import said

Path_ = str | os.PathLike[str]
GIVE_JOINTS = said("give the controller's log or program with --joints FILE")
GIVE_POINTS = said("give the instrument's points, and this file with --joints")
GIVE_POINTS_OR_NAME = said(
    "give the instrument's export, and this file with --joints, or name the columns of the points with --map"
)


def import_measurements(
    exports: Sequence[Path_],
    *,
    joints: Path_ | None = None,
    robot: Robot | None = None,
    sheet: str | None = None,
    orientation: str | None = None,
    mapping: Mapping | None = None,
    encoding: str | None = None,
) -> Reading:
    """Reads exports of instruments and controllers into columns of a measurement file.

    Args:
        exports: Files that hold measured points, with or without the joints; one after the other.
        joints: A log or a program with the joints, where the exports have none.
        robot: The arm; it says how many joints there are, and tries a join.
        sheet: The sheet of a workbook.
        orientation: What the exports' angles are, by `importers.orientation.CONVENTIONS`.
        mapping: Answers kept in a file.
        encoding: Of the files' texts; None: as they say, or the likeliest.

    Raises:
        InvalidInput, ParseError: Something can't be read or decided; one sentence with the option that decides.
    """
    mapping = mapping or Mapping()
    if orientation is not None:
        check_convention(orientation)
    asked = partial(
        read,
        mapping=mapping,
        robot=robot,
        sheet=sheet or mapping.sheet,
        orientation=orientation or mapping.orientation,
        encoding=asked_encoding(encoding, mapping),
    )
    readings = [reading for path in exports for reading in asked(path, wanted="points" if joints else "any")]
    poses = None if joints is None else stacked(asked(joints, wanted="joints"))
    _check_map(mapping, [*readings, *([poses] if poses else [])])
    found = _complete(readings, poses, robot)
    notes = [*found.notes, *unknown_note(found.unknown, found.path)]
    return replace(found, notes=notes, target=mapping.target)


def _complete(readings: list[Reading], poses: Reading | None, robot: Robot | None) -> Reading:
    points = [reading for reading in readings if reading.measured and not reading.joints]
    bare = [reading for reading in readings if reading.joints and not reading.measured]
    whole = [reading for reading in readings if reading.joints and reading.measured]
    if poses is None and points and bare and not whole:
        poses, readings = stacked(bare), points  # the joints were given among the exports
    if poses is not None:
        missing = next((reading for reading in readings if not reading.measured), None)
        if missing is not None:
            raise InvalidInput(_without_points(missing))
        return joined(stacked(readings), poses, robot)
    for reading in readings:
        if not reading.measured:
            raise InvalidInput(_without_points(reading))
        if not reading.joints:
            raise InvalidInput(
                said(
                    "{path}: holds {count} measured points and no joints: {act}",
                    path=reading.path,
                    count=len(reading),
                    act=GIVE_JOINTS,
                )
            )
    if robot is not None:
        readings = [confirmed(r, robot) if r.dialect == rosbag.DIALECT.name else r for r in readings]
    return stacked(readings)


def _without_points(reading: Reading) -> str:
    if reading.computed is not None:
        return said(
            "{path}: '{column}' is what the controller computes from its joints and no measurement: {act}",
            path=reading.path,
            column=reading.computed,
            act=GIVE_POINTS,
        )
    if reading.joints:
        return said(
            "{path}: holds {joints} joints in {count} rows and no measured points: {act}",
            path=reading.path,
            joints=reading.joints,
            count=len(reading),
            act=GIVE_POINTS_OR_NAME,
        )
    return said("{path}: holds no measured points: {act}", path=reading.path, act=GIVE_POINTS_OR_NAME)


def read(
    path: Path_,
    *,
    mapping: Mapping,
    robot: Robot | None = None,
    sheet: str | None = None,
    orientation: str | None = None,
    encoding: str | None = None,
    wanted: str = "any",
) -> list[Reading]:
    """What a file holds: one reading, or the joints and the points of two sheets.

    Raises:
        InvalidInput, ParseError: It can't be read, or several sheets could be it.
    """
    kinds = None if robot is None else robot.joint_types
    names = [] if robot is None else [joint.name for joint in robot.joints if joint.name is not None]
    found: list[tuple[Grid, Reading]] = []
    problems: list[tuple[int, InvalidInput]] = []  # and how many titles of the sheet are known
    count = None if kinds is None else len(kinds)
    for export in open_exports(path, mapping, sheet, wanted, encoding, names, count):
        if isinstance(export, InvalidInput):
            problems.append((-1, export))
            continue
        known = sum(meaning is not None for meaning in export.meanings)
        try:
            export, own = with_joint_names(export, names), None
            if robot is not None and len(motors := motors_of(robot)) < len(names) and not is_named(export):
                export = with_joint_names(export, [names[i] for i in motors])
                own = motors if is_named(export) else None  # what others drive has no column
            if robot is not None and not is_named(export):
                check_named(export, [names[i] for i in motors_of(robot)] if len(names) == robot.joint_count else [])
            asked = kinds if own is None or kinds is None else [kinds[i] for i in own]
            reading = interpret(export, convention=orientation, joint_kinds=asked, wanted=wanted)
            reading = reading if own is None else renumbered(reading, own)
            reading = named_by_their_owner(reading, export, robot)
            reading = replace(reading, notes=[*reading.notes, *notes_on_names(export, names, reading.joints)])
        except InvalidInput as problem:
            problems.append((known, problem))
            continue
        if reading.joints or (wanted != "joints" and (reading.measured or reading.computed)):
            found.append((export.grid, reading))
        elif wanted == "joints":
            sentence = f"{reading.path}: holds no joint positions that are known; name them with --map"
            problems.append((known, InvalidInput(sentence)))
        else:
            problems.append((known, InvalidInput(_without_points(reading))))
    if not found:
        raise _best(problems)
    return _chosen(os.fspath(path), found, several=len(found) + len(problems) > 1)


def _best(problems: list[tuple[int, InvalidInput]]) -> InvalidInput:
    """The problem of the sheet that came farthest: of which the most titles are known, and one that asks before others.

    A cover sheet has hardly any.
    """
    return max(problems, key=lambda each: (each[0], "--" in str(each[1])))[1]


def asked_encoding(encoding: str | None, mapping: Mapping) -> str | None:
    """Python's name of the encoding that the user gives, or else the map."""
    given = encoding or mapping.encoding
    return None if given is None else asked_codec(given)


def open_exports(
    path: Path_,
    mapping: Mapping,
    sheet: str | None,
    wanted: str = "any",
    encoding: str | None = None,
    joint_names: Sequence[str] = (),
    joint_count: int | None = None,
) -> list[Export | InvalidInput]:
    """The exports in a file, a sheet each, with the map applied; a sheet that can't be read is its problem."""
    name = os.fspath(path)
    if programs.is_program(path):
        return [mapping.applied(programs.read_joints(name))]
    if is_bag(path):
        alone = wanted == "joints"
        grids = rosbag.bag_grids(path, sheet, joints_alone=alone, names=joint_names, count=joint_count)
    else:
        grids = read_grids(path, encoding)
    if sheet is not None and grids[0].sheet is not None:
        chosen = [grid for grid in grids if str(grid.sheet).lower() == sheet.lower()]
        if not chosen:
            raise ParseError(f"has no sheet '{sheet}'; it has {', '.join(repr(grid.sheet) for grid in grids)}", name)
        grids = chosen
    out: list[Export | InvalidInput] = []
    for grid in grids:
        try:
            out.append(mapping.applied(read_export(replace(grid, rows=grid.rows[mapping.skip_rows :]))))
        except ParseError as problem:
            out.append(problem)
    return out


def _chosen(path: str, found: list[tuple[Grid, Reading]], *, several: bool) -> list[Reading]:
    """Of several sheets the only one with poses and points, or one with joints and one with points."""
    whole = [(grid, reading) for grid, reading in found if reading.joints and reading.measured]
    fits = whole or found
    if len(fits) > 1 and not whole:
        joints = [reading for _, reading in fits if reading.joints]
        points = [reading for _, reading in fits if reading.measured]
        if len(joints) == 1 and len(points) == 1:
            return [points[0], joints[0]]
    if len(fits) > 1:
        names = ", ".join(f"'{grid.sheet}'" for grid, _ in fits)
        raise InvalidInput(f"{path}: the sheets {names} could each hold the data; choose one with --sheet NAME")
    grid, reading = fits[0]
    if several and grid.sheet is not None:
        reading = replace(reading, notes=[f"sheet '{grid.sheet}' is read", *reading.notes])
    return [reading]


def stacked(readings: Sequence[Reading]) -> Reading:
    """Readings one after the other; a column that some lack is empty there.

    Raises:
        InvalidInput: Two give a quantity in different units or different numbers of joints.
    """
    if len(readings) == 1:
        return readings[0]
    names = list(dict.fromkeys(name for reading in readings for name in reading.columns))
    columns: dict[str, Column] = {}
    for name in names:
        parts = [reading.columns.get(name) for reading in readings]
        if any(isinstance(part, list) for part in parts):
            columns[name] = [
                text for p, r in zip(parts, readings, strict=True) for text in (p if p is not None else [""] * len(r))
            ]
        else:
            columns[name] = np.concatenate(
                [np.full(len(r), np.nan) if p is None else np.asarray(p) for p, r in zip(parts, readings, strict=True)]
            )
    first = readings[0]
    if len({reading.joints for reading in readings}) > 1:
        counts = " and ".join(f"{reading.joints} in {reading.path}" for reading in readings[:3])
        raise InvalidInput(f"the files hold different numbers of joints: {counts}")
    all_named = all(reading.names is not None for reading in readings)
    return replace(
        first,
        columns=columns,
        names=[name for reading in readings for name in reading.names or []] if all_named else None,
        counted=any(reading.counted for reading in readings),
        labels=_labels(readings),
        unknown=list(dict.fromkeys(title for reading in readings for title in reading.unknown)),
        times=None,
        lines=[line for reading in readings for line in reading.lines],
        notes=list(dict.fromkeys(note for reading in readings for note in reading.notes)),
    )


def _labels(readings: Sequence[Reading]) -> list[LabelColumn]:
    """The columns that could name the rows, of those that all readings have."""
    first, *others = [{column.title: column for column in reading.labels} for reading in readings]
    common = [column for title, column in first.items() if all(title in other for other in others)]
    return [
        replace(column, texts=[text for each in (first, *others) for text in each[column.title].texts])
        for column in common
    ]


def _check_map(mapping: Mapping, readings: Sequence[Reading]) -> None:
    """Refuses a map of which a column is in none of the files: a slip of the pen would else be passed over."""
    for ours, theirs in mapping.columns.items():
        if not any(ours in reading.mapped for reading in readings):
            raise ParseError(f"columns.{ours}: no file has the column {theirs!r}", mapping.path)


def map_text(
    paths: Sequence[Path_], mapping: Mapping | None = None, sheet: str | None = None, encoding: str | None = None
) -> str:
    """A map of the columns of some files, as YAML, to start from.

    Raises:
        ParseError: A file can't be read.
    """
    answers = mapping or Mapping()
    asked = asked_encoding(encoding, answers)
    return text_of_map([each for path in paths for each in open_exports(path, answers, sheet, encoding=asked)])
