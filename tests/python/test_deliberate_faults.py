# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""tools/mutants: its list fits the sources, and its committed record and docs/reliability.md say the same."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
FAULTS: list[dict[str, Any]] = tomllib.loads((ROOT / "tools" / "mutants.toml").read_text())["mutant"]
RECORD = json.loads((ROOT / "tools" / "mutants.json").read_text())
DOCS = (ROOT / "docs" / "reliability.md").read_text()


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
