# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arms of a fleet, and the LIST that names them: a CSV file with the columns robot, data, test, name."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io.tables import read_table
from fastcal.robot.given import DataLike, RobotLike
from fastcal.robots import available

COLUMNS = ("robot", "data", "test", "name")


@dataclass(frozen=True)
class Arm:
    """One arm: its robot and its measurements, as `calibrate` takes them, and the name of its folder and its row."""

    name: str
    robot: RobotLike
    data: DataLike
    test: DataLike | None = None

    def __post_init__(self) -> None:
        if not self.name or self.name in (".", "..") or set(self.name) & set("/\\\0") or len(self.name) > 200:
            raise InvalidInput(f"the name of an arm is that of its folder, which {self.name!r} cannot be")


def read_list(path: str | os.PathLike[str]) -> list[Arm]:
    """The arms of a LIST; files are looked for beside it, and an arm without a name is called as its data.

    Raises:
        ParseError: The file can't be read, a column is missing or unknown, or a cell is empty.
        InvalidInput: Two arms have one name.
    """
    table = read_table(path)
    table = table.exact() if table.exact is not None else table
    places = {name.strip().lower(): place for place, name in enumerate(table.names)}
    unknown = [name for name in places if name not in COLUMNS]
    missing = [name for name in COLUMNS[:2] if name not in places]
    if unknown or missing:
        found = f"the unknown column '{unknown[0]}'" if unknown else f"no column '{missing[0]}'"
        raise table.error(f"expected the columns robot, data and, where wanted, test, name; got {found}")
    cells = {name: table.labels(place) for name, place in places.items()}
    folder = Path(path).parent

    def beside(name: str, row: int) -> str:
        text = cells[name][row]
        if not text:
            raise table.wrong_cell(places[name], row, "a file")
        return text if name == "robot" and text.lower() in available() else str(folder / text)

    arms = []
    for row in range(len(table)):
        test = beside("test", row) if cells.get("test", [""] * len(table))[row] else None
        name = cells.get("name", [""] * len(table))[row] or Path(cells["data"][row]).stem
        arms.append(Arm(name, beside("robot", row), beside("data", row), test))
    check_names(arms)
    return arms


def check_names(arms: Sequence[Arm]) -> None:
    """Refuses two arms of one name: they would share a folder.

    Raises:
        InvalidInput: There are none, or two have one name.
    """
    if not arms:
        raise InvalidInput("expected at least one arm")
    seen: set[str] = set()
    for arm in arms:
        if arm.name in seen:
            raise InvalidInput(f"two arms are called '{arm.name}': each needs a different name")
        seen.add(arm.name)
