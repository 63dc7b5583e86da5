# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Damaged files in every reader: 200 each by a seed that is another every week, 2,000 each in ./test --full.

Of files that are read by a process of their own 12 and 2,000: to start it costs more than all else.
"""

import datetime
import os
import sys
from importlib import import_module
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

TOOL = Path(__file__).parents[3] / "tools" / "fuzz"
# Inputs that once failed, each cut to what it takes; the name begins with the reader's.
FAILED = sorted((Path(__file__).parents[1] / "data" / "failed_inputs").glob("*"))
IS_FULL = os.environ.get("FASTCAL_TEST_FULL") == "1"


def load_tool() -> ModuleType:
    loader = SourceFileLoader("fastcal_fuzz", str(TOOL))
    spec = spec_from_loader("fastcal_fuzz", loader)
    assert spec is not None
    sys.modules["fastcal_fuzz"] = module = module_from_spec(spec)
    loader.exec_module(module)
    return module


tool: Any = load_tool()
READERS = tool.NAMES
NEEDS = {"robot, xacro": "xacro", "export, ROS bag": "rosbags"}
IN_A_PROCESS = NEEDS


def count(reader: str) -> int:
    return 2000 if IS_FULL else 12 if reader in IN_A_PROCESS else 200


@pytest.mark.parametrize("reader", READERS)
def test_a_damaged_file_is_read_into_numbers_or_refused(reader: str, tmp_path: Path) -> None:
    if reader in NEEDS:
        pytest.importorskip(NEEDS[reader], reason="the extra [ros] is not installed")
    year, week, _ = datetime.datetime.now(datetime.UTC).isocalendar()
    found = tool.fuzz([reader], count(reader), 100 * year + week, tmp_path / "failed")
    failed = {kind: count for kind, count in found[reader].items() if kind not in ("read", "refused")}
    inputs = {path.name: path.read_bytes() for path in (tmp_path / "failed").glob("*")}
    assert not failed, f"{failed}; put these into {FAILED[0].parent}: {inputs}"
    assert found[reader]["read"] > 0 or reader in IN_A_PROCESS  # of few, all may be refused
    # Programs of a grammar are never refused: what is not understood of them is left as it is.
    assert found[reader]["refused"] > 0 or reader in ("program, .mod", "program, .src", "program, .script")


@pytest.mark.parametrize("path", FAILED, ids=lambda path: path.name)
def test_an_input_that_once_failed_is_read_or_refused(path: Path, tmp_path: Path) -> None:
    reader = next(name for name in READERS if path.name.startswith(tool.file_name(name)))
    if reader in NEEDS:
        pytest.importorskip(NEEDS[reader], reason="the extra [ros] is not installed")
    ending, _, read, _ = tool.corpus(tmp_path)[reader]
    assert tool.verdict(read, path.read_bytes(), tmp_path / f"input{ending}") in ("read", "refused")


def test_what_the_fuzzer_looks_for_is_found(tmp_path: Path) -> None:
    """A reader that fails, hangs, or reads an infinite number is not passed."""

    def broken(path: Path) -> None:
        raise KeyError("no such thing")

    def endless(path: Path) -> None:
        while True:
            pass

    assert tool.verdict(broken, b"x", tmp_path / "x").startswith("KeyError")
    with pytest.raises(AssertionError):
        import_module("fuzz_corpus").finite([1.0, float("inf")])
    tool.SECONDS, seconds = 0.05, tool.SECONDS
    try:
        assert tool.verdict(endless, b"x", tmp_path / "x") == "hang"
    finally:
        tool.SECONDS = seconds


def test_a_failing_input_is_cut_to_what_it_takes(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        assert b"bad" not in path.read_bytes()

    assert tool.smallest(read, b"some text that is bad somewhere", tmp_path / "x", "AssertionError") == b"bad"
