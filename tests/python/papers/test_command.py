# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal paper` joins by an entry point: its help, its refusals, and what is said where the studies are missing."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import fastcal

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    def process(*arguments: str, code: str = "") -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            "-c",
            f"{code}\nimport sys; from fastcal.cli import main; sys.exit(main())",
            *arguments,
        ]
        environment = {**os.environ, "COLUMNS": "100"}
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    return process


def test_the_command_is_listed_and_explained(run: Run) -> None:
    assert "  paper " in run("--help").stdout.split("Installed:")[1]
    text = run("paper", "--help").stdout
    assert "fastcal paper kuka_kr500 -o kr500\n" in text
    for option in ("--quiet", "--json", "--open", "--arms", "--cluster"):
        assert option in text


def test_the_list_of_commands_loads_no_study(run: Run) -> None:
    loaded = "{'numpy', 'fastcal_studies.study'} & set(sys.modules)"
    watch = f"import atexit, sys; atexit.register(lambda: print(sorted({loaded})))"
    assert run("--help", code=watch).stdout.rstrip().endswith("[]")


def test_an_unknown_paper_is_refused_before_anything_is_written(run: Run, tmp_path: Path) -> None:
    said = run("paper", "irb120", "-o", "out")
    assert said.returncode == 2
    assert "unknown paper 'irb120', expected one of siasun_sr210d, " in said.stderr
    assert list(tmp_path.iterdir()) == []


def test_without_the_studies_one_sentence_says_how_to_get_them(run: Run) -> None:
    none = "import importlib.metadata; importlib.metadata.entry_points = lambda **_: ()"
    said = run("paper", "kuka_kr500", "-o", "out", code=none)
    assert said.returncode == 2
    assert said.stderr.count("\n") == 1
    assert "'paper' is not installed: pip install 'fastcal[papers]'" in said.stderr


def test_no_name_of_the_studies_is_loaded_before_it_is_asked_for() -> None:
    import fastcal_studies

    assert "kuka_kr500" in fastcal_studies.NAMES
    with pytest.raises(AttributeError, match="no attribute 'run'"):
        fastcal_studies.run  # noqa: B018
    assert Path(fastcal.__file__).parent not in Path(fastcal_studies.__file__).parents
