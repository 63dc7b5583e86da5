# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of a session: what came, as it came, on the disk before the answer; and what is kept of it.

`arrived.csv` holds the header and every row as it came, good or not. `measurements.csv` holds the rows that are kept
and is what the commands read. `decisions.csv` holds what a person decided against the session.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_text

ARRIVED, KEPT, DECISIONS = "arrived.csv", "measurements.csv", "decisions.csv"
CHOICES = ("keep", "leave")


class Journal:
    """The files in a folder, which is made."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.arrived, self.kept, self._decisions = folder / ARRIVED, folder / KEPT, folder / DECISIONS

    def read(self) -> tuple[str | None, list[str], dict[int, str]]:
        """The header, the rows and the decisions of an earlier run; a line that a kill cut short is taken away."""
        lines = _whole_lines(self.arrived)
        decisions = {}
        for line in _whole_lines(self._decisions)[1:]:
            row, _, choice = line.partition(",")
            if row.isdigit() and choice in CHOICES:
                decisions[int(row)] = choice
        return (lines[0] if lines else None), lines[1:], decisions

    def append(self, line: str) -> None:
        """A header or a row, on the disk when the call returns."""
        _append(self.arrived, line)

    def decide(self, row: int, choice: str) -> None:
        """What a person decided of a row, counted from 0."""
        if not self._decisions.exists():
            _append(self._decisions, "row,decision")
        _append(self._decisions, f"{row},{choice}")

    def keep(self, header: str, rows: Sequence[str]) -> None:
        """Writes the measurement file anew, whole or not at all."""
        write_text(self.kept, "\n".join([header, *rows, ""]))


def _append(path: Path, line: str) -> None:
    try:
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(line + "\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be written: {error.strerror}") from error


def _whole_lines(path: Path) -> list[str]:
    """The lines of a file that end; what follows the last end is cut off, as a row that was never answered."""
    if not path.exists():
        return []
    content = path.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        with path.open("r+b") as file:
            file.truncate(len(whole))
    return whole.decode("utf-8").splitlines()
