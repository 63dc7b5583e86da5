# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm and its measurements as a user would have them, and ways to run the command."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from fastcal.cli import main

Edit = Callable[[list[list[str]]], object]


@dataclass(frozen=True)
class Said:
    """What a run of `fastcal` left behind."""

    code: int
    out: str
    err: str

    @property
    def error(self) -> str:
        """The one line of an error, without its head."""
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("fastcal: error: ")
        return lines[0].removeprefix("fastcal: error: ")


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished demonstration; only to be read."""
    folder = tmp_path_factory.mktemp("demo")
    assert main(["demo", "-o", str(folder)]) == 0
    return folder


@pytest.fixture
def fastcal(capsys: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """Runs the command inside this process, as its entry point does."""

    def run(*arguments: object) -> Said:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return Said(code, said.out, said.err)

    return run


@pytest.fixture(scope="session")
def process() -> Callable[..., Said]:
    """Runs the command as a process in the folder `cwd`, its output into pipes."""

    def run(*arguments: object, cwd: Path) -> Said:
        command = [sys.executable, "-m", "fastcal", *map(str, arguments)]
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120, check=False)
        return Said(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope="session")
def rewritten() -> Callable[[Path, Path, Edit], Path]:
    """Copies a CSV whose cells are edited in place on the way; the first row is the header."""

    def copy(source: Path, target: Path, edit: Edit) -> Path:
        rows = [line.split(",") for line in source.read_text().splitlines()]
        edit(rows)
        target.write_text("\n".join(",".join(row) for row in rows) + "\n")
        return target

    return copy
