# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a diagnosis makes of a study's arms: names held against what is hidden, the rest against plain calibrations."""

from types import SimpleNamespace
from typing import Any

from fastcal_studies.diagnosed import sample
from fastcal_studies.diagnoses import hidden, judged, section
from fastcal_studies.exhibits import Table


def finding(label: str, grade: str, *equivalents: tuple[str, str]) -> Any:
    return SimpleNamespace(label=label, grade=grade, equivalents=equivalents)


def test_names_are_right_wrong_or_open() -> None:
    found: Any = SimpleNamespace(
        effects=[
            finding("backlash@joint2", "A"),
            finding("base_step@base", "B", ("zero_step", "joint1")),
            finding("base_drift@base", "B"),
            finding("gravity_sag@joint3", "C"),
        ]
    )
    assert judged(found, ["backlash@joint2", "zero_step@joint1"]) == ["right", "right", "wrong", "open"]


def test_what_is_hidden_is_that_of_the_study() -> None:
    assert hidden(sample("spray_7dof", 0)) == ["beam_gravity@structure"]


def test_the_section_counts_answers_and_what_is_missed_by_more() -> None:
    run = {"seed": 0, "verdict": "named", "hidden": ["a@b"], "plain": "geometry, none", "plain_mm": 0.5}
    named = [{"name": "a@b", "grade": "A", "in_model": True, "told": "right"}]
    runs = [
        run | {"names": named, "after_mm": 0.4},
        run | {"seed": 1, "names": [], "after_mm": 0.6},
        run | {"seed": 2, "names": [], "after_mm": None, "verdict": "no answer"},
    ]
    told = section(runs)
    assert "2 of 3 arms answer, and 1 are missed by more than 1.05 times" in told.lead
    (table,) = told.exhibits
    assert isinstance(table, Table)
    assert [list(row)[:3] for row in table.rows] == [
        ["0", "named", "a@b (A)"],
        ["1", "named", "none"],
        ["2", "no answer", "none"],
    ]
