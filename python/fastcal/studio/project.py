# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A project: a folder of plain files. `studio.yaml` holds the answers, `commands.txt` the commands that do the same."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from fastcal.errors import InvalidInput, ParseError
from fastcal.io.atomic import write_bytes, write_text
from fastcal.io.robot_file import load_robot
from fastcal.io.yaml_file import read_yaml
from fastcal.robot.robot import Robot
from fastcal.said import said

ANSWERS, COMMANDS, ROBOT, MAP = "studio.yaml", "commands.txt", "robot.yaml", "map.yaml"
MEASUREMENTS, TEST, INPUTS, LIVE = "measurements.csv", "test.csv", "inputs", "live"
_HEAD = "# A project of fastcal studio; paths are relative to this folder.\n"


class Project:
    """A folder, which is made where it is not there.

    Raises:
        InvalidInput: It is a file, or cannot be made. ParseError: Its studio.yaml is damaged.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).resolve()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InvalidInput(f"{folder}: expected a folder for the project: {error.strerror}") from error
        self.answers: dict[str, Any] = {}
        if self.path(ANSWERS).exists():
            found = read_yaml(self.path(ANSWERS))
            if not isinstance(found, dict):
                raise ParseError("expected a mapping of answers", self.path(ANSWERS))
            self.answers = found

    @property
    def name(self) -> str:
        """Of the folder."""
        return self.folder.name

    def beside(self) -> list[str]:
        """The names of the projects in the folder that this one lies in, its own too."""
        found = {path.parent.name for path in self.folder.parent.glob(f"*/{ANSWERS}")}
        return sorted(found | {self.name})

    def path(self, name: str) -> Path:
        """A file of the project.

        Raises:
            InvalidInput: The name leads out of the folder.
        """
        path = (self.folder / name).resolve()
        if path != self.folder and self.folder not in path.parents:
            raise InvalidInput(said("{name}: lies outside the project", name=name))
        return path

    def answer(self, key: str, value: Any) -> None:
        """Keeps an answer; None takes it away."""
        self.answers[key] = value
        if value is None:
            del self.answers[key]
        write_text(self.path(ANSWERS), _HEAD + yaml.safe_dump(self.answers, allow_unicode=True, sort_keys=False))

    @staticmethod
    def plain_name(name: str) -> str:
        """The name of a dropped file without any folder.

        Raises:
            InvalidInput: There is none, or it is that of a hidden file.
        """
        plain = Path(name.replace("\\", "/")).name
        if not plain or plain.startswith("."):
            raise InvalidInput(said("expected a file with a name, got {name}", name=f"{name!r:.60}"))
        return plain

    def receive(self, name: str, content: bytes) -> str:
        """Keeps a file that was dropped into the window; returns its path in the project."""
        plain = self.plain_name(name)
        self.path(INPUTS).mkdir(exist_ok=True)
        write_bytes(self.path(f"{INPUTS}/{plain}"), content)
        return f"{INPUTS}/{plain}"

    @property
    def has_robot(self) -> bool:
        """Was an arm chosen?"""
        return self.path(ROBOT).exists()

    def robot(self) -> Robot:
        """The nominal arm.

        Raises:
            InvalidInput: None was chosen yet.
        """
        if not self.has_robot:
            raise InvalidInput(said("choose the arm first, on the screen Data"))
        return load_robot(self.path(ROBOT))

    def choose_robot(self, source: str) -> Robot:
        """Takes a shipped arm or a file as the project's arm, kept as robot.yaml."""
        given = self.path(source) if (self.folder / source).is_file() else source
        robot = load_robot(given)
        robot.save(self.path(ROBOT))
        self.answer("robot", source)
        return robot

    def models(self) -> list[str]:
        """The calibrated robots in the project, newest first."""
        found = [path for path in self.folder.glob("*/model.yaml") if path.is_file()]
        found.sort(key=lambda path: path.stat().st_mtime, reverse=True)
        return [str(path.relative_to(self.folder)) for path in found]

    def data_files(self) -> list[str]:
        """The measurement files in the project."""
        return [name for name in (MEASUREMENTS, f"{LIVE}/{MEASUREMENTS}", TEST) if self.path(name).exists()]

    def remember(self, words: Sequence[str]) -> str:
        """Keeps the command that does what was just done, and returns its line."""
        line = shlex.join(["fastcal", *words])
        path = self.path(COMMANDS)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        if line not in lines:
            write_text(path, "\n".join([*lines, line, ""]))
        return line
