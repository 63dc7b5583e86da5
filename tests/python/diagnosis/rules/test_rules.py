# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every rule of the diagnosis is held: some check falls when it is turned off or pushed hard."""

import pytest

from fastcal.diagnosis import rules

from . import (  # noqa: F401
    column_checks,
    fit_checks,
    grade_checks,
    held_out_checks,
    noise_checks,
    outcome_checks,
    rig_checks,
    scan_checks,
    search_checks,
    surrogate_checks,
    tested_checks,
    unnamed_checks,
    wave_checks,
)
from .mutants import MUTANTS, Check

CHECKS = list(dict.fromkeys(check for _, _, check in MUTANTS))


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_rules_hold(check: Check) -> None:
    check()


@pytest.mark.parametrize(("rule", "value", "check"), MUTANTS, ids=lambda x: x.__name__ if callable(x) else str(x)[:16])
def test_a_mutant_falls(rule: str, value: object, check: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    assert getattr(rules, rule) != value
    monkeypatch.setattr(rules, rule, value)
    with pytest.raises(AssertionError):
        check()


def test_every_rule_has_a_mutant() -> None:
    named = {rule for rule in vars(rules) if rule.isupper()}
    assert {rule for rule, _, _ in MUTANTS} == named
