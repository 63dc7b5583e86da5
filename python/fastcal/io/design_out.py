# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A design as a table: order, qN_deg (jN_deg where a controller counts otherwise), payload_kg, approachN, plane.

And, beside it, as a program in the arm's language that drives to the poses.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fastcal.design.candidates import Candidates
from fastcal.design.result import PoseDesign
from fastcal.design.surroundings import COLLISIONS, Surroundings
from fastcal.errors import InvalidInput
from fastcal.io.atomic import atomic_paths
from fastcal.io.programs import program_files, write_documents
from fastcal.io.tables import check_csv_name, csv_text, write_csv
from fastcal.programs import SUFFIXES, language_of_arm
from fastcal.programs.measuring import LANGUAGES, check_axes, language_for
from fastcal.programs.visiting import visiting_program
from fastcal.robot.pendant import controller_columns
from fastcal.robot.robot import Robot

NONE = "none"
_TITLE = "poses to measure by fastcal"
_LOOKED_AT = 1_000_000  # bytes; KRL and RAPID say it at the beginning or behind the targets
_LONGEST_NAME = 24

Columns = dict[str, list[float] | list[int] | list[str]]


@dataclass(frozen=True)
class ProgramPlace:
    """The program that will lie beside a table.

    Attributes:
        language: A key of LANGUAGES; None: no program is written.
        path: Its file.
        note: Why none is written, in a sentence; empty where nobody has to know.
    """

    language: str | None
    path: Path = Path()
    note: str = ""


def program_beside(table: str | os.PathLike[str], robot: Robot, language: str | None = None) -> ProgramPlace:
    """Which program goes with a table, before there are any poses.

    Args:
        table: The file of the poses; the program has its name, in what controllers take for one.
        robot: Whose name tells its maker.
        language: `rapid`, `krl`, `fanuc`, `urscript` or `none`; None: the arm's own, where it is known.

    Raises:
        InvalidInput: The language cannot hold this arm, or another file lies in the program's place.
    """
    if Path(table).suffix.lower() in SUFFIXES:
        raise InvalidInput(f"{table}: expected the name of a table, such as poses.csv; the program goes beside it")
    if language == NONE:
        return ProgramPlace(None)
    if language is None:
        language = language_for(robot.name)
        if language is None:
            spoken = language_of_arm(robot.name)
            why = f"{robot.name} speaks {spoken}" if spoken else f"which language {robot.name} speaks is not known"
            names = f"{', '.join(list(LANGUAGES)[:-1])} or {list(LANGUAGES)[-1]}"
            return ProgramPlace(None, note=f"no program beside the table: {why}; --language {names} writes one")
        try:
            check_axes(robot.axis_types)
        except InvalidInput as reason:
            return ProgramPlace(None, note=f"no program beside the table: {reason}")
    check_axes(robot.axis_types)
    name = re.sub(r"\W", "_", Path(table).stem, flags=re.ASCII)
    name = (name if name[:1].isalpha() else f"p{name}")[:_LONGEST_NAME]
    path = Path(table).with_name(name + LANGUAGES[language][0])
    if path.is_file() and not _is_own(path):
        raise InvalidInput(f"{path}: is there and was not written by this command; give the table another name")
    return ProgramPlace(language, path)


def design_candidates(design: PoseDesign) -> Candidates:
    """The poses of a design as they are driven and written."""
    planes = None if design.plane is None else np.array(design.plane, dtype=object)
    return Candidates(design.q, design.payload, design.approach, planes)


def write_poses(path: str | os.PathLike[str], poses: Candidates, robot: Robot) -> None:
    """Writes the poses as CSV in the order of visiting; `load_measurements` reads the file.

    Raises:
        InvalidInput: The file cannot be written.
    """
    write_csv(path, _columns(poses, robot))


def write_poses_and_program(
    path: str | os.PathLike[str],
    poses: Candidates,
    robot: Robot,
    place: ProgramPlace,
    *,
    surroundings: Surroundings | None = None,
    dwell_s: float = 3.0,
    speed: float = 0.2,
) -> tuple[list[Path], list[str]]:
    """Writes the table and the program beside it, all or none; returns their files and what a reader should know.

    The table's joints are those of the program, digit for digit. Poses that touch a plane are not in the program:
    nobody knows how far the surface is.

    Raises:
        InvalidInput: A file cannot be written.
    """
    notes = [place.note] if place.note else []
    touching = poses.touching
    if place.language is not None and touching.all():
        notes.append("no program beside the table: all poses touch a plane, and nothing drives there without looking")
    if place.language is None or touching.all():
        write_poses(path, poses, robot)
        return [Path(path)], notes
    made = visiting_program(
        robot,
        poses.q,
        poses.payload,
        poses.approach,
        ~touching,
        language=place.language,
        program=place.path.name,
        title=_TITLE,
        dwell_s=dwell_s,
        speed=speed,
        is_clear=_clear(robot, surroundings),
    )
    if touching.any():
        notes.append(f"not in the program: poses that touch a plane, {int(touching.sum())}; drive to them by hand")
    check_csv_name(path)
    programs = program_files(place.path, made.documents)
    # A program never lies beside the poses of another: killed amid its work, this leaves the table alone.
    with atomic_paths([path, *programs]) as (temporary, *temporaries):
        content = csv_text(_columns(replace(poses, q=made.q), robot))
        temporary.write_text(content, encoding="utf-8", newline="\n")
        write_documents(temporaries, made.documents)
    return [Path(path), *programs], [*notes, *made.notes]


def _is_own(path: Path) -> bool:
    """Was a program written by this module? It may be replaced, and nobody's work is lost."""
    with path.open("rb") as file:  # not `read_bytes`: what a command reads it does not replace
        return _TITLE.encode() in file.read(_LOOKED_AT)


def _columns(poses: Candidates, robot: Robot) -> Columns:
    columns: Columns = {"order": list(range(1, len(poses) + 1))}
    for name, values in controller_columns(robot.description, poses.q).items():
        columns[name] = np.round(values, 6).tolist()
    columns["payload_kg"] = poses.payload.tolist()
    if poses.approach is not None:
        for index in np.setdiff1d(np.flatnonzero(poses.approach.any(axis=0)), robot.passive):
            columns[f"approach{index + 1}"] = poses.approach[:, index].astype(int).tolist()
    if poses.plane is not None:
        columns["plane"] = [str(name) for name in poses.plane]
    return columns


def _clear(robot: Robot, surroundings: Surroundings | None) -> Callable[[NDArray[np.float64]], NDArray[np.bool_]]:
    """Of postures: may the arm be there?"""
    around = surroundings or Surroundings()
    return lambda q: ~np.isin(around.obstacles(robot, np.ascontiguousarray(q)), COLLISIONS)
