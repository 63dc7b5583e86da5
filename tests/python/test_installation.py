# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An installation whose compiled part does not load says so in one sentence, in the command and in Python."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fastcal

SENTENCE = "fastcal's compiled part does not load"


@pytest.fixture
def broken(tmp_path: Path) -> dict[str, str]:
    """Environment in which the package is found with an extension that is no library."""
    package = Path(fastcal.__file__).parent
    copy = tmp_path / "fastcal"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("_core*.so", "__pycache__"))
    (copy / "_core.abi3.so").write_bytes(b"no library")
    return {**os.environ, "PYTHONPATH": str(tmp_path)}


def run(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False)


def test_the_command_ends_with_one_line(broken: dict[str, str]) -> None:
    ended = run(broken, "-m", "fastcal", "template", "ur5", "-o", "empty.csv")
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.count("\n") == 1
    assert SENTENCE in ended.stderr
    assert "pip install" in ended.stderr


def test_a_call_raises_the_sentence(broken: dict[str, str]) -> None:
    ended = run(broken, "-c", "import fastcal; fastcal.calibrate")
    assert ended.returncode == 1
    assert SENTENCE in ended.stderr.splitlines()[-1]


def test_another_missing_module_is_left_as_it_is(broken: dict[str, str]) -> None:
    from fastcal.errors import unloaded

    error = ImportError("No module named 'yaml'", name="yaml")
    assert unloaded(error) is None
