# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An installation whose compiled part does not load says so in one sentence, in the command and in Python."""

import ast
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


def test_instructions_that_the_processor_lacks_are_refused_in_one_line() -> None:
    ended = run({**os.environ, "FASTCAL_ISA": "avx1024"}, "-m", "fastcal", "predict", "ur5", "a.csv", "-o", "b.csv")
    assert ended.returncode == 2
    assert ended.stderr.startswith("fastcal: error: FASTCAL_ISA must be baseline, avx2 or avx512")
    assert ended.stderr.count("\n") == 1


def test_another_missing_module_is_left_as_it_is(broken: dict[str, str]) -> None:
    from fastcal.errors import unloaded

    error = ImportError("No module named 'yaml'", name="yaml")
    assert unloaded(error) is None


# Names of the standard library that Python 3.10, the oldest that is supported, does not have.
NEWER = {
    "asyncio": {"Runner", "TaskGroup", "timeout"},
    "contextlib": {"chdir"},
    "datetime": {"UTC"},
    "enum": {"EnumCheck", "ReprEnum", "StrEnum", "global_enum", "member", "nonmember", "verify"},
    "hashlib": {"file_digest"},
    "inspect": {"getmembers_static"},
    "itertools": {"batched"},
    "math": {"cbrt", "exp2", "fma", "sumprod"},
    "operator": {"call"},
    "tomllib": {"load", "loads"},
    "typing": {"LiteralString", "Never", "NotRequired", "Required", "Self", "TypeVarTuple", "Unpack", "assert_never"},
    "warnings": {"deprecated"},
}


def test_nothing_that_python_3_10_lacks_is_used() -> None:
    """The wheel for 3.10 failed once on `from datetime import UTC`, which no check of a newer Python sees."""
    package = Path(fastcal.__file__).parent
    found = []
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 10))):
            names: set[tuple[str, str]] = set()
            if isinstance(node, ast.ImportFrom) and node.module:
                names = {(node.module, alias.name) for alias in node.names}
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                names = {(node.value.id, node.attr)}
            found += [f"{path.name}:{node.lineno}: {m}.{n}" for m, n in names if n in NEWER.get(m, ())]
    assert found == []
