# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""tools/mutants: its list fits the sources, and its committed record and docs/reliability.md say the same."""

import ast
import json
import re
import tomllib
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
FAULTS: list[dict[str, Any]] = tomllib.loads((ROOT / "tools" / "mutants.toml").read_text())["mutant"]
RECORD = json.loads((ROOT / "tools" / "mutants.json").read_text())
DOCS = (ROOT / "docs" / "reliability.md").read_text()


def tool() -> ModuleType:
    """tools/mutants as a module."""
    path = ROOT / "tools" / "mutants"
    loader = SourceFileLoader("mutants", str(path))
    module = module_from_spec(ModuleSpec("mutants", loader, origin=str(path)))
    module.__file__ = str(path)
    loader.exec_module(module)
    return module


def test_files_with_their_faults_are_python() -> None:
    """Nine were not, and had never been run: a fault that ends in a syntax error is no fault.

    Three others stood for a part of an expression, and changed the file while they were switched off.
    """
    numbered = {n: fault for n, fault in enumerate(FAULTS, start=1) if fault["file"].endswith(".py")}
    for name, text in tool().with_faults(numbered).items():
        ast.parse(text, name)
    for fault in numbered.values():
        right = ast.dump(ast.parse(fault["right"].strip(), mode="eval").body)
        nodes = ast.walk(ast.parse((ROOT / fault["file"]).read_text()))
        assert right in (ast.dump(node) for node in nodes if isinstance(node, ast.expr)), fault["name"]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault["name"])
def test_a_fault_has_one_place_and_tests_that_are_there(fault: dict[str, Any]) -> None:
    assert (ROOT / fault["file"]).read_text().count(fault["right"]) == 1
    assert fault["wrong"] != fault["right"]
    for text in (fault["right"], fault["wrong"]):  # each becomes an expression or a statement of its own
        assert all(text.count(a) == text.count(b) for a, b in ("()", "[]", "{}")), text
    assert fault["tests"]
    for test in fault["tests"]:
        name = test.split()[0]
        assert (ROOT / name).exists() or (ROOT / "tests" / "cpp" / name.removesuffix("_test")).is_dir(), name


def test_the_record_is_of_this_list_and_the_page_of_the_record() -> None:
    names = [fault["name"] for fault in FAULTS]
    recorded = [entry["name"] for entry in RECORD["mutants"]]
    assert recorded == [name for name in names if name in recorded]
    survivors = {entry["name"] for entry in RECORD["mutants"] if entry["caught_by"] is None}
    assert RECORD["caught"] == len(recorded) - len(survivors)
    assert len(recorded) >= 60
    assert len(survivors) <= 2 * len(recorded) / 60
    assert survivors <= {fault["name"] for fault in FAULTS if "survives" in fault}
    text = re.sub(r"\s+", " ", DOCS)
    assert f"of the {len(FAULTS)} faults {len(recorded)} have been run, and {RECORD['caught']} are caught" in text
    assert all(name in DOCS for name in survivors)
