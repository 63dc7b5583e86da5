# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows from a watched folder: an instrument's or a controller's program writes or lengthens CSV files in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Thread

from fastcal.errors import FastcalError, InvalidInput
from fastcal.live.session import LiveSession


@dataclass
class _File:
    """A file that is read as it grows."""

    read: int = 0  # bytes
    headed: bool = False
    refused: str = ""


@dataclass
class WatchedFolder:
    """Feeds a session with the whole lines of the folder's CSV files, each with its own header.

    Attributes:
        session: What takes the rows.
        folder: What is watched.
        every: How often [s].
        said: What was wrong with which file.
    """

    session: LiveSession
    folder: Path
    every: float = 0.5
    said: dict[str, str] = field(default_factory=dict)
    _files: dict[Path, _File] = field(default_factory=dict)
    _ended: Event = field(default_factory=Event)
    _thread: Thread | None = None

    def start(self) -> WatchedFolder:
        """Begins to watch.

        Raises:
            InvalidInput: There is no such folder, or the session's own files are in it.
        """
        if not self.folder.is_dir():
            raise InvalidInput(f"{self.folder}: expected a folder to watch")
        if self.folder.resolve() == self.session.journal.arrived.parent.resolve():
            raise InvalidInput(f"{self.folder}: holds the session's own files; choose another folder to watch")
        self._thread = Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def stop(self) -> None:
        """Ends."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def look(self) -> int:
        """Reads what is new, file after file by name; returns how many rows came."""
        return sum(self._read(path) for path in sorted(self.folder.glob("*.csv")))

    def _watch(self) -> None:
        while not self._ended.wait(self.every):
            self.look()

    def _read(self, path: Path) -> int:
        state = self._files.setdefault(path, _File())
        if state.refused or path.stat().st_size <= state.read:
            return 0
        with path.open("rb") as file:
            file.seek(state.read)
            content = file.read()
        whole = content[: content.rfind(b"\n") + 1]  # the rest is being written
        state.read += len(whole)
        rows = 0
        for line in whole.decode("utf-8", errors="replace").splitlines():
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            try:
                if state.headed:
                    self.session.add(line)
                    rows += 1
                else:
                    self.session.begin(line)
                    state.headed = True
            except FastcalError as error:
                state.refused = self.said[path.name] = str(error)
                break
        return rows
