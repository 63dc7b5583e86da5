# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Long work in a process of its own, which says how far it is and can be stopped; its files appear whole or not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import deque
from pathlib import Path
from threading import Thread
from typing import Any

from fastcal.report.language import LANGUAGE, language
from fastcal.said import said

_LAST_LINES = 20


class Job:
    """A task of `studio.tasks` that runs.

    Args:
        title: What a person reads.
        task: Its name.
        folder: Of the project, in which it runs.
        arguments: Of the task, as JSON takes them.

    Attributes:
        step: What it is doing.
        result: What it returned; None while it runs, and where it failed or was stopped.
        error: The one sentence of its failure.
    """

    def __init__(self, title: str, task: str, folder: Path, **arguments: Any) -> None:
        self.title, self.folder = title, folder
        self.step, self.error = said("starting"), ""
        self.result: Any = None
        self._said: deque[str] = deque(maxlen=_LAST_LINES)
        command = [sys.executable, "-m", "fastcal.studio.tasks", task, json.dumps(arguments)]
        environment = os.environ | {LANGUAGE: language.get()}
        self._process = subprocess.Popen(  # noqa: S603 - our own module
            command,
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        self._readers = [Thread(target=self._listen, daemon=True), Thread(target=self._collect, daemon=True)]
        for reader in self._readers:
            reader.start()

    @property
    def is_running(self) -> bool:
        """Is it still at work, or is what it said still being read?"""
        return self._process.poll() is None or any(reader.is_alive() for reader in self._readers)

    def stop(self) -> None:
        """Ends it; what it had not finished is not written."""
        if self._process.poll() is None:
            self.error = said("stopped")
            self._process.terminate()

    def wait(self, seconds: float) -> Any:
        """Its result, once it has ended."""
        self._process.wait(seconds)
        for reader in self._readers:
            reader.join(seconds)
        return self.result

    def _listen(self) -> None:
        assert self._process.stdout is not None  # noqa: S101 - a pipe was asked for
        with self._process.stdout as lines:
            for line in lines:
                told = json.loads(line)
                self.step = told.get("step", self.step)
                self.error = told.get("error", self.error)
                self.result = told.get("result", self.result)

    def _collect(self) -> None:
        assert self._process.stderr is not None  # noqa: S101 - a pipe was asked for
        with self._process.stderr as lines:
            self._said.extend(line.rstrip() for line in lines)
        if self._process.wait() and not self.error:
            self.error = self._said[-1] if self._said else said("ended with {code}", code=self._process.returncode)
