# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The project's exports as they are understood now: roles of columns, the joined list, and how well the arm fits it."""

from __future__ import annotations

import re
from collections.abc import Mapping as Map
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import yaml
from numpy.typing import NDArray

from fastcal.calibration.realign import realign
from fastcal.errors import FastcalError, InvalidInput
from fastcal.importers import Mapping, import_measurements, imported_dataset, map_text, write_imported
from fastcal.importers.importing import GIVE_JOINTS, GIVE_POINTS, GIVE_POINTS_OR_NAME, open_exports
from fastcal.importers.joining import ROBOT_GIVEN
from fastcal.importers.programs import is_program
from fastcal.importers.reading import Reading
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.plausibility import plausible
from fastcal.place import joint_position
from fastcal.robot.robot import Robot
from fastcal.said import Said, said, sentence_of
from fastcal.studio.project import MAP, MEASUREMENTS, ROBOT, Project
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

LEAVE_OUT = ""
_SHOWN = 3  # cells of a column
GOOD_SHARE, BAD_SHARE = 2e-3, 1e-2  # of the reach: as any nominal arm fits, and as none does
# What a command line says, and what the screen says instead.
_ON_SCREEN: dict[str, str] = {
    GIVE_JOINTS: said("drop the controller's log or program"),
    GIVE_POINTS: said("drop the instrument's points too"),
    GIVE_POINTS_OR_NAME: said("drop the instrument's points too, or say above which columns they are"),
    ROBOT_GIVEN: said("the arm, once chosen,"),
}
_UNIT = re.compile(r"^((?:[qj]\d+|[xyz])(?:_read)?)_(\w+)$")


@dataclass(frozen=True)
class FileColumn:
    """A column of an export: its file, title, number from 1, first cells, and its role by the contract's name."""

    file: str
    title: str
    number: int
    cells: tuple[str, ...]
    role: str

    @property
    def theirs(self) -> str | int:
        """As a map names it."""
        return self.title or self.number


@dataclass(frozen=True)
class Understood:
    """What was made of the exports.

    Attributes:
        reading: The joined rows; None where they could not be read.
        data: The same in SI; None where they could not be checked.
        misfit: (N,) distance of each point from the nominal arm, base and tool fitted [m]; None where it has no place.
        problem: What stands in the way, a sentence; empty where nothing does.
        suspicion: What the columns were probably meant to be; empty where they fit.
        notes: What was recognized and left out.
    """

    reading: Reading | None = None
    data: Dataset | None = None
    misfit: FloatArray | None = None
    problem: str = ""
    suspicion: str = ""
    notes: tuple[str, ...] = field(default=())

    @property
    def rms(self) -> float | None:
        """Of the misfit [m]."""
        return None if self.misfit is None else float(np.sqrt(np.nanmean(self.misfit**2)))

    def grade(self, reach: float) -> str:
        """good, doubtful or bad, by the robot's reach [m]; empty where there is no misfit."""
        if self.rms is None:
            return ""
        share = self.rms / reach
        return "good" if share < GOOD_SHARE else "doubtful" if share < BAD_SHARE else "bad"


def columns_of(project: Project) -> list[FileColumn]:
    """The columns of the project's files with the roles that they have now."""
    out = []
    chosen: Map[str, str | int] = project.answers.get("columns") or {}
    for file in _files(project):
        path = project.path(file)
        own = yaml.safe_load(map_text([path], sheet=project.answers.get("sheet")))["columns"]
        # A map keeps the names that a file has by itself.
        names = {"name": own["name"]} if "name" in own else {}
        by_column = {theirs: ours for ours, theirs in (names | dict(chosen) if chosen else own).items()}
        by_column |= {theirs: ours for ours, theirs in names.items() if theirs not in by_column}
        for export in open_exports(path, Mapping(), project.answers.get("sheet")):
            if isinstance(export, InvalidInput):
                continue
            for place, title in enumerate(export.titles):
                cells = tuple(str(row[place]) for row in export.rows[:_SHOWN])
                role = by_column.get(title) or by_column.get(place + 1) or LEAVE_OUT
                out.append(FileColumn(file, title, place + 1, cells, role))
    return out


def kind_of(project: Project, path: str, dropped: str) -> str:
    """Whose a file is by its columns: the controller's of joints alone, else the instrument's; `dropped` if unknown."""
    if is_program(project.path(path)):
        return "controller"
    try:
        own = yaml.safe_load(map_text([project.path(path)], sheet=project.answers.get("sheet")))["columns"]
    except FastcalError:
        return dropped
    joints = any(re.match(r"[qj]\d", name) for name in own)
    points = any(re.match(r"[xyz]_", name) for name in own)
    return "controller" if joints and not points else "instrument" if points else dropped


def roles(joint_count: int) -> list[str]:
    """What a column can be, each with its unit."""
    joints = [f"{letter}{k}_{unit}" for letter in "qj" for unit in ("deg", "rad") for k in range(1, joint_count + 1)]
    points = [f"{axis}_{unit}" for unit in ("mm", "m", "in") for axis in "xyz"]
    turns = [*(f"{axis}_{unit}" for unit in ("deg", "rad") for axis in ("rx", "ry", "rz")), "qw", "qx", "qy", "qz"]
    more = ["payload_kg", "temperature_c", "time_s", "sigma_mm", "station", "mount"]
    return [LEAVE_OUT, "name", *joints, *points, *turns, *more]


def assign(project: Project, column: FileColumn, role: str) -> None:
    """Gives a column a role; one that had it loses it. All roles are kept from then on, as a map needs them all."""
    columns = {c.role: c.theirs for c in columns_of(project) if c.role}
    columns = {ours: theirs for ours, theirs in columns.items() if theirs != column.theirs and ours != role}
    if role:
        columns[role] = column.theirs
    project.answer("columns", columns)


def in_unit(project: Project, quantity: str, unit: str) -> None:
    """Takes all joints (`q`) or points (`x`) to be in a unit."""
    columns: dict[str, str | int] = {}
    for column in columns_of(project):
        match = _UNIT.match(column.role)
        if column.role and match and (match[1][0] in "qj") == (quantity == "q"):
            columns[f"{match[1]}_{unit}"] = column.theirs
        elif column.role:
            columns[column.role] = column.theirs
    project.answer("columns", columns)


def unit_of(columns: Sequence[FileColumn], quantity: str) -> str:
    """The unit that all joints (`q`) or points (`x`) have now; empty where they have none or several."""
    found = {m[2] for c in columns if (m := _UNIT.match(c.role)) and (m[1][0] in "qj") == (quantity == "q")}
    return found.pop() if len(found) == 1 else ""


def count_joints(project: Project, signs: Sequence[int], third: str) -> None:
    """Writes into robot.yaml how the controller counts: the sign of each joint, and what its joint 3 is counted from.

    Args:
        project: Whose arm.
        signs: 1 or -1 of each joint.
        third: own, plus (q3 = J3 + J2, as FANUC shows it) or minus (q3 = J3 - J2, as parallelogram arms do).
    """
    robot = project.robot()
    entries = [
        {"joint": k + 1, "sign": sign, "plus": [2] if k == 2 and third == "plus" else [],
         "minus": [2] if k == 2 and third == "minus" else []}
        for k, sign in enumerate(signs)
        if sign < 0 or (k == 2 and third != "own")
    ]  # fmt: skip
    units = {"revolute": "deg", "prismatic": "mm"}
    for entry in entries:
        entry[f"zero_{units[robot.joint_types[int(str(entry['joint'])) - 1]]}"] = 0.0
    robot.with_(pendant=entries or None).save(project.path(ROBOT))
    letter = "j" if entries else "q"
    columns: dict[str, str | int] = {}
    for column in columns_of(project):
        if column.role:
            columns[re.sub(r"^[qj](\d)", rf"{letter}\1", column.role)] = column.theirs
    if entries or project.answers.get("columns"):
        project.answer("columns", columns)


def understand(project: Project) -> Understood:
    """Reads, joins and holds against the arm what the project has."""
    exports, controller = _exports(project)
    if not exports:
        return Understood(problem=said("drop the instrument's file to begin"))
    robot = project.robot() if project.has_robot else None
    answers = project.answers
    read = partial(import_measurements, exports, joints=controller, mapping=_mapping(project),
                   sheet=answers.get("sheet"), orientation=answers.get("orientation"))  # fmt: skip
    problem = ""
    try:
        reading = read(robot=robot)
    except FastcalError as error:
        problem = _plain(sentence_of(error), project)
        try:  # by names or order alone, so that there is a misfit to see
            reading = read()
        except FastcalError:
            return Understood(problem=problem)
    try:
        data = imported_dataset(reading, robot)
    except FastcalError as error:
        problem = problem or _plain(sentence_of(error), project)
        try:  # as it is, so that there is a misfit to see
            data = _unchecked(reading, robot)
        except FastcalError:
            return Understood(reading, problem=problem, notes=tuple(reading.notes))
    notes = tuple(dict.fromkeys(_plain(note, project) for note in (*reading.notes, *data.notes)))
    if robot is None or data.position is None:
        return Understood(reading, data, None, problem or said("choose the arm to see how well it fits"), notes=notes)
    return _held_against(robot, reading, data, problem, notes)


def _unchecked(reading: Reading, robot: Robot | None) -> Dataset:
    """The rows whatever the arm's limits and reach say of them."""
    data = imported_dataset(reading, None)
    counted = robot is not None and any(name.startswith("j1_") for name in reading.columns)
    return replace(data, q=robot.pendant.chain(data.q)) if counted and robot is not None else data


def _held_against(robot: Robot, reading: Reading, data: Dataset, problem: str, notes: tuple[str, ...]) -> Understood:
    bare = robot.with_(effects=[])
    try:
        placed = realign(bare, data)
    except FastcalError as error:
        return Understood(reading, data, None, problem or sentence_of(error), notes=notes)
    misfit = np.linalg.norm(placed.poses(data)[:, :3, 3] - data.points, axis=1)
    found = None if robot.passive else plausible(data, bare, bare.forward)
    suspicion = ""
    if found is not None and found.refused:
        suspicion = said(
            "With {meant} the misfit would be {better} instead of {read}.",
            meant=found.meant,
            better=found.better,
            read=found.read,
        )
    return Understood(reading, data, misfit, problem, suspicion, notes)


def save(project: Project, found: Understood, place: str = MEASUREMENTS) -> tuple[str, int]:
    """Writes a measurement file, and map.yaml where columns were named; the command that does the same, and the rows.

    Raises:
        InvalidInput: There is nothing that could be written.
    """
    if found.reading is None or found.data is None:
        raise InvalidInput(found.problem or said("there is nothing to save yet"))
    exports, controller = _files_of(project)
    words = ["import", *exports, *(["--joints", controller] if controller else [])]
    if project.has_robot and not found.problem:
        words += ["--robot", ROBOT]
    if columns := project.answers.get("columns"):
        text = yaml.safe_dump({"columns": dict(columns)}, allow_unicode=True, sort_keys=False)
        write_text(project.path(MAP), "# Which column of the exports is which: ours: theirs.\n" + text)
        words += ["--map", MAP]
    for option in ("sheet", "orientation"):
        if value := project.answers.get(option):
            words += [f"--{option}", str(value)]
    robot = project.robot() if project.has_robot else None
    rows = write_imported(project.path(place), found.reading, robot)
    return project.remember([*words, "-o", place]), rows


def table(found: Understood) -> list[dict[str, str | float | None]]:
    """The joined list, a row a pose: its name, the point, the joints, the misfit in mm."""
    if found.reading is None or found.data is None:
        return []
    data, rows = found.data, []
    edge = data.joint_types or ["revolute"] * data.q.shape[1]
    for k in range(len(data)):
        row: dict[str, str | float | None] = {"row": k, "name": found.reading.label(k)}
        for j, kind in enumerate(edge):
            row[joint_position(j)] = round(float(from_si(data.q[k, j], "mm" if kind == "prismatic" else "deg")), 3)
        if data.position is not None:
            row |= {axis: round(float(from_si(v, "mm")), 3) for axis, v in zip("xyz", data.position[k], strict=True)}
        row["misfit"] = None if found.misfit is None else round(float(from_si(found.misfit[k], "mm")), 3)
        rows.append(row)
    return rows


def _mapping(project: Project) -> Mapping | None:
    columns = project.answers.get("columns")
    return Mapping(MAP, dict(columns)) if columns else None


def files_of(project: Project, kind: str) -> list[str]:
    """The files that are the instrument's, or the controller's (one at most)."""
    given = project.answers.get(kind) or []
    return [given] if isinstance(given, str) else list(given)


def _files_of(project: Project) -> tuple[list[str], str | None]:
    return files_of(project, "instrument"), project.answers.get("controller")


def _files(project: Project) -> list[str]:
    exports, controller = _files_of(project)
    return [*exports, *([controller] if controller else [])]


def _exports(project: Project) -> tuple[list[str], str | None]:
    exports, controller = _files_of(project)
    return [str(project.path(name)) for name in exports], None if controller is None else str(project.path(controller))


def _plain(text: str, project: Project) -> str:
    """A sentence with the project's files as a person knows them, and the screen's words in place of an option's."""
    if text in _ON_SCREEN:
        return _ON_SCREEN[text]
    if isinstance(text, Said):
        parts = {key: _plain(part, project) if isinstance(part, str) else part for key, part in text.values.items()}
        return type(text)(text.message, **parts)
    return text.replace(f"{project.folder}/inputs/", "").replace(f"{project.folder}/", "")
