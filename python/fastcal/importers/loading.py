# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurements for a command or a notebook: a measurement file, an export that needs no join, or several of them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fastcal.errors import InvalidInput, ParseError, TooLarge
from fastcal.importers.bag_path import is_bag
from fastcal.io import measurements
from fastcal.io.columns import JOINT_TITLE
from fastcal.io.text_tables import is_row_of_numbers
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.robot import Robot


def load_measurements(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    robot: Robot,
    *,
    require_measured: bool = True,
    joints: str | os.PathLike[str] | None = None,
    sheet: str | None = None,
    orientation: str | None = None,
    mapping: str | os.PathLike[str] | None = None,
    encoding: str | None = None,
) -> Dataset:
    """Reads measured poses into SI arrays.

    A measurement file (CSV, Parquet, Excel) is read as it is; an export of an instrument or a controller that holds
    joints and points is imported. Of several files, one after the other, each is a station and a mount of its own
    unless a column gives another one.

    Args:
        path: The file, or several.
        robot: The arm that was measured: its joints say which columns q must have, its limits and its reach what the
            numbers can mean.
        require_measured: Refuse a file without any measured number. Without it q and the conditions are enough.
        joints: The controller's log or program, where the export holds points alone; the join is tried on the arm.
        sheet: The sheet of a workbook.
        orientation: What an export's angles are, as `--orientation` of `fastcal import`.
        mapping: A mapping file, as `--map`.
        encoding: Of the text, as `--encoding`.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
        InvalidInput: Something can't be decided; the sentence names the option of `fastcal import` that decides it.
    """
    files = [path] if isinstance(path, str | os.PathLike) else list(path)
    if not files:
        raise InvalidInput("expected at least one file of measurements")
    if any(answer is not None for answer in (joints, sheet, orientation, mapping, encoding)):
        from fastcal.importers.mapping import read_map

        answers = None if mapping is None else read_map(mapping)
        more = {"sheet": sheet, "orientation": orientation, "mapping": answers, "encoding": encoding}
        return _imported(files, robot, joints=joints, **more)
    sets = [_load(file, robot, require_measured) for file in files]
    return sets[0] if len(sets) == 1 else Dataset.concatenate(sets, labels=_labels(files))


def load_or_open(
    files: Sequence[str | os.PathLike[str]], robot: Robot, seen: Callable[[Dataset], Dataset]
) -> Dataset | LongDataset:
    """`load_measurements`, or `open_measurements` of a file of very many rows; `seen` makes of them what is kept.

    Raises:
        ParseError, InvalidInput: As these; or such a file is one of several.
    """
    from fastcal.io.long_files import is_long, open_measurements

    if not any(is_long(file) for file in files):
        return seen(load_measurements(files, robot))
    if len(files) > 1:
        raise InvalidInput(
            f"{files[0]}: a file of so many rows is read alone; make one of the {len(files)} files, with columns "
            "station and mount"
        )
    return open_measurements(files[0], robot, seen=seen)


def _load(path: str | os.PathLike[str], robot: Robot, require_measured: bool) -> Dataset:
    own: ParseError | None = None
    letters: set[str] = set()
    try:
        if not is_bag(path):
            return measurements.load_measurements(path, robot, require_measured=require_measured)
    except TooLarge:
        raise
    except ParseError as error:
        letters = _joint_letters(path) if Path(path).is_file() else {"q"}
        if not require_measured or "q" in letters:
            raise
        own = error
    try:
        return _imported([path], robot)
    except TooLarge as problem:
        raise (own or problem) from None
    except InvalidInput as problem:
        if own is not None and "j" in letters:
            raise own from problem
        # What the file lacks as an export says more than what it lacks as a measurement file.
        raise _asking(problem) from own


def _imported(paths: Sequence[str | os.PathLike[str]], robot: Robot, **answers: Any) -> Dataset:
    """Exports as a data set, with what was recognized among its notes."""
    from fastcal.importers.importing import import_measurements  # most files are measurement files
    from fastcal.importers.writing import imported_dataset

    reading = import_measurements(paths, robot=robot, **answers)
    return imported_dataset(replace(reading, notes=[f"read as {reading.dialect}", *reading.notes]), robot)


def _asking(problem: InvalidInput) -> InvalidInput:
    """A question of the importer, with the command that takes the answer."""
    text = str(problem)
    hint = "these are options of fastcal import, and arguments of load_measurements"
    return InvalidInput(f"{text}; {hint}") if " --" in text else problem


def _joint_letters(path: str | os.PathLike[str]) -> set[str]:
    """How a file's header names joints, as far as fastcal does: q1_deg, only its own files; j1_deg, exports too."""
    from fastcal.importers.grid import export_text

    with Path(path).open("rb") as file:
        content = file.read(20_000)
    if b"\0" not in content and b"\n" in content:
        content = content[: content.rindex(b"\n")]  # what is cut within a letter is no text
    if content.startswith((b"PK\x03\x04", b"PAR1")):
        return set()
    try:
        text, _ = export_text(content, os.fspath(path))
    except ParseError:
        return set()
    first = next((line for line in re.split(r"[\r\n]+", text) if line.strip()), "")
    if is_row_of_numbers(first.encode()):
        return set()  # numbers behind a name: a table with a column a pose
    return {title[0][0].lower() for title in JOINT_TITLE.finditer(first)}


def _labels(files: Sequence[str | os.PathLike[str]]) -> list[str]:
    """A name a file: without folder and ending, where that tells them apart."""
    short = [Path(file).stem for file in files]
    return short if len(set(short)) == len(short) else [os.fspath(file) for file in files]
