# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The values of a name are those of a model that has it."""

from types import SimpleNamespace
from typing import Any
from unittest import mock

import pytest

from fastcal.diagnosis import adaptation, grading
from fastcal.diagnosis.found import Found
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.reasons import Reason
from fastcal.diagnosis.result import Diagnosis, Finding, NamedValue, Unexplained


@pytest.mark.parametrize(
    ("name", "unsure", "model"),
    [("wave 3", {}, "written"), ("wave 5", {}, "of all names"), ("wave 3", {"'wave 3'": "doubt"}, "of all names")],
)
def test_a_name_that_curves_of_the_written_model_stand_for_has_its_values_from_the_fit_of_all_names(
    monkeypatch: pytest.MonkeyPatch, name: Any, unsure: dict[str, str], model: str
) -> None:
    monkeypatch.setattr(adaptation, "robot_of", lambda fit, sigma: fit)
    found: Any = SimpleNamespace(
        told=SimpleNamespace(unsure=unsure),
        model=SimpleNamespace(state=SimpleNamespace(names=("wave 3",))),
        told_fit="of all names",
        level=SimpleNamespace(sigma=1e-4),
    )
    assert Found._having(found, name, "written") == model  # type: ignore[arg-type]


def test_a_wave_that_is_told_and_not_written_is_drawn_by_the_fit_that_has_its_order() -> None:
    written: Any = [{"effect": "gear_harmonic", "owner": "joint2", "order": 3.0}]
    told = [*written, {"effect": "gear_harmonic", "owner": "joint2", "order": 5.0}]
    found: Any = SimpleNamespace(
        final=SimpleNamespace(fit=SimpleNamespace(entries=written)),
        state=SimpleNamespace(fit=SimpleNamespace(entries=told)),
    )
    for order, fitted in ((3.0, found.final), (5.0, found.state)):
        wave = Finding("gear_harmonic", "joint2", "C", {"order": NamedValue(order, None)}, 5.0, 1e-3)
        assert Diagnosis.fitted_with(found, wave) is fitted
    other = Finding("backlash", "joint2", "C", {"gap_rad": NamedValue(1e-4, 1e-5)}, 5.0, 1e-3)
    assert Diagnosis.fitted_with(found, other) is found.state


@pytest.mark.parametrize(
    ("effect", "curve", "remaining", "is_part"),
    [
        ("gear_harmonic", "joint2", None, True),
        ("gear_harmonic", "joint3", None, False),
        ("joint_compliance", "joint2", None, False),
        ("gear_harmonic", None, Unexplained("joint2", 0.1, ("q2", "load2")), True),
        ("gear_harmonic", None, Unexplained("joint2", 0.1, ("load2",)), False),
        ("gear_harmonic", None, Unexplained("joint3", 0.1, ("q2",)), False),
    ],
)
def test_a_wave_beside_a_curve_of_its_joint_is_no_cause_by_itself(
    effect: str, curve: str | None, remaining: Unexplained | None, is_part: bool
) -> None:
    """An axis that jumps was named a gear error and had a curve besides."""
    profiles = [] if curve is None else [{"effect": "joint_profile", "owner": curve}]
    found: Any = SimpleNamespace(model=SimpleNamespace(profiles=profiles))
    name = Hypothesis({"effect": effect, "owner": "joint2"})
    assert Found._is_part_of_a_curve(found, name, remaining) is is_part


@pytest.mark.parametrize(("is_part", "grade"), [(True, "C"), (False, "A")])
def test_however_clear_it_is(monkeypatch: pytest.MonkeyPatch, is_part: bool, grade: str) -> None:
    """Else what made it less sure afterwards, another name beside it, left it a cause of grade B."""
    wave = Hypothesis({"effect": "gear_harmonic", "owner": "joint2", "order": 6.0}, "order=6")
    monkeypatch.setattr(grading, "grade", lambda *_: ("A", ()))
    monkeypatch.setattr(grading, "may_be_another", lambda *_: ())
    monkeypatch.setattr(adaptation, "values", lambda *_: {})
    monkeypatch.setattr("fastcal.diagnosis.found.is_beyond_bounds", lambda *_: False)
    monkeypatch.setattr("fastcal.diagnosis.found.over_claim", lambda *_: 1.0)
    found: Any = mock.MagicMock()
    found.best.names, found.told.unsure, found.written.is_plain = [wave], {}, False
    found.best.fit.effect.return_value.data_columns = []
    found.asked.library.excluded, found.search.most = frozenset(), 4
    found._is_part_of_a_curve.return_value, found._chance.return_value = is_part, 0.0
    proof = SimpleNamespace(statistic=2500.0, rank=2, gain=(0.5, 0.1), stability=1.0)
    finding = Found._finding(found, 0, [proof], [], found, None)  # type: ignore[list-item]
    assert finding.grade == grade
    assert [because.reason for because in finding.limits] == [Reason.CURVE_WITHOUT_NAME] * is_part
