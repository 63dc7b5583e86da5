# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import pytest

from fastcal.calibration.calibrate import CalibrationResult
from fastcal.report.language import in_language
from fastcal.report.next_step import step
from fastcal.report.trends import Trend
from fastcal.report.view import Rows, Statistics, rows_of
from fastcal.report.words import Verdict, listed, trusted, verdict
from fastcal.said import failure, said

NBSP = "\N{NO-BREAK SPACE}"
QUIET = Trend(share=0.5, p_value=0.5)


def judge(result: CalibrationResult, trends: dict[str, Trend] | None = None, **sizes: float) -> Verdict:
    """The verdict; sizes such as test_after=0.2 (mm) replace mean and RMS of that set."""
    sets: dict[str, Rows | None] = {
        name.lower(): rows_of(name, part, ["revolute"] * 6)
        for name, part in (("Train", result.train), ("Test", result.test))
    }
    for key, size in sizes.items():
        name, state = key.split("_")
        rows = sets[name]
        assert rows is not None
        sets[name] = dataclasses.replace(rows, **{state: Statistics(rows.before.count, size, 0.0, size, size)})
    return verdict(result, sets["train"], sets["test"], trends or {"q1": QUIET})


@pytest.fixture
def clean(make_result: Callable[..., CalibrationResult]) -> CalibrationResult:
    return make_result(rows=60, test_rows=40, outlier_count=0, conditions=False, unidentifiable=[])


def test_a_good_calibration_is_described_in_one_sentence(clean: CalibrationResult) -> None:
    found = judge(clean, test_before=1.234, test_after=0.1012, train_after=0.1)
    assert found.tone == "good"
    assert found.headline == (
        f"Calibration reduced the mean error from 1.234{NBSP}mm to 0.101{NBSP}mm on 40 test poses not used in the fit, "
        "12 times less."
    )
    assert [remark.is_caution for remark in found.remarks] == [False, False, False]


def test_without_test_poses_that_is_a_remark(make_result: Callable[..., CalibrationResult]) -> None:
    found = judge(make_result(rows=60, test_rows=0, outlier_count=0))
    assert found.tone == "caution"
    assert "on the 60 poses of the fit" in found.headline
    assert found.remarks[0].text.startswith("No test poses were given")


def test_worse_on_test_is_a_remark(clean: CalibrationResult) -> None:
    found = judge(clean, test_before=1.0, test_after=0.2, train_after=0.1)
    assert found.remarks[0].is_caution
    assert "2.0 times that of the fit" in found.remarks[0].text


def test_no_gain_is_not_sold_as_one(clean: CalibrationResult) -> None:
    found = judge(clean, test_before=0.1, test_after=0.099, train_after=0.1)
    assert (found.tone, found.word) == ("caution", "Little gained")


@pytest.mark.parametrize(
    ("status", "word"), [("not_converged", "Not converged"), ("too_few_equations", "Too few measurements")]
)
def test_a_failure_comes_first(clean: CalibrationResult, status: str, word: str) -> None:
    failed: Any = dataclasses.replace(clean, status=status, message="12 equations for 30 parameters.")
    found = judge(failed)
    assert (found.tone, found.word) == ("bad", word)
    assert found.headline.startswith("The calibration failed: 12 equations for 30 parameters. The figures")


def test_a_fit_that_is_not_straight_lacks_no_effect(clean: CalibrationResult) -> None:
    bent = "over their intervals the fit is not straight"
    found: Any = dataclasses.replace(clean, caveats=[bent], bent=bent)
    assert [r.text for r in judge(found).remarks if r.is_caution] == ["Over their intervals the fit is not straight."]
    assert "effect is missing" not in step(found, ["arm.yaml", "poses.csv"])
    both: Any = dataclasses.replace(found, caveats=["the residuals depend on the posture", bent])
    assert "an effect is missing" in judge(both).remarks[0].text
    assert "an effect is missing" in step(both, ["arm.yaml", "poses.csv"])


def test_trends_are_named_strongest_first(clean: CalibrationResult) -> None:
    shares = {"q1": 0.1, "q2": 0.3, "q3": 0.2, "q4": 0.05, "q5": 0.0}
    found = judge(clean, {name: Trend(share, 0.0) for name, share in shares.items()})
    thin = "\N{NARROW NO-BREAK SPACE}"
    named = f"joint 2 (30{thin}%), joint 3 (20{thin}%), joint 1 (10{thin}%) and 1 more variable"
    said = f"The remaining error is not all noise: it depends on {named}; fastcal diagnose looks for the cause."
    assert found.remarks[1].text == said


def test_the_planted_gear_error_of_joint_4_is_found(make_result: Callable[..., CalibrationResult]) -> None:
    result = make_result(conditions=False)
    rows = rows_of("Training", result.train, ["revolute"] * 6)
    assert rows is not None
    trends = rows.trends
    assert [name for name, found in trends.items() if found.is_flagged(len(trends))] == ["q4"]
    # the wave's variance over three components against the noise's: WAVE^2 / 2 to 3 SIGMA^2
    assert trends["q4"].share == pytest.approx((7e-5**2 / 2) / (7e-5**2 / 2 + 3 * 4e-5**2), abs=0.06)
    # The page's remark says so; the console, which has no remark, says it with what to do.
    assert step(result, is_why_told=True) == "find the cause with: fastcal diagnose"
    assert step(result).startswith("the remaining error is not all noise: it depends on joint 4 (")


def test_many_outliers_and_what_is_held_are_reported(make_result: Callable[..., CalibrationResult]) -> None:
    found = judge(make_result(rows=60, test_rows=40, outlier_count=6))
    assert found.remarks[3].is_caution
    assert found.remarks[3].text.startswith("6 rows of 60 (10")
    assert found.remarks[2].text.startswith("2 combinations of parameters")


def test_lists_read_as_english() -> None:
    assert [listed([]), listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]


def test_outliers_of_the_fit_are_no_errors_of_the_model(make_result: Callable[..., CalibrationResult]) -> None:
    result = make_result(rows=60, test_rows=0, outlier_count=4)
    rows = rows_of("Training", result.train, ["revolute"] * 6)
    assert rows is not None
    assert "on 56 of the 60 poses of the fit, the others being outliers" in judge(result).headline
    before, after = trusted(result, rows, is_test=False)
    assert (before.count, after.count) == (56, 56)
    assert after.max < rows.after.max
    for changed in ({"loss": "none"}, {"status": "not_converged"}):  # a fit that failed does not say what an outlier is
        assert trusted(dataclasses.replace(result, **changed), rows, is_test=False) == (rows.before, rows.after)


def test_what_a_reader_must_know_first_comes_first(clean: CalibrationResult) -> None:
    doubts = ["from row 45 on the points lie elsewhere, by 3.7 mm: the tracker moved", "is it the right robot?"]
    found = judge(dataclasses.replace(clean, doubts=doubts))
    assert found.tone == "caution"
    assert [remark.text for remark in found.remarks[:2]] == [
        "From row 45 on the points lie elsewhere, by 3.7 mm: the tracker moved.",
        "Is it the right robot?",
    ]


def test_a_failure_claims_nothing_good(clean: CalibrationResult) -> None:
    failed = dataclasses.replace(clean, status="not_converged", doubts=["is it the right robot?"])
    assert [remark.is_caution for remark in judge(failed).remarks] == [True]
    assert step(failed) == "resolve the warnings, then calibrate again"
    assert step(dataclasses.replace(failed, doubts=[])).startswith("measure more poses")


def test_what_a_failure_asks_for_is_the_one_thing_to_do(clean: CalibrationResult) -> None:
    message = failure(said("only {count} of 9 agree", count=4), said("measure again, or leave the bad rows out"))
    failed = dataclasses.replace(clean, status="not_converged", message=message)
    assert message == "only 4 of 9 agree; measure again, or leave the bad rows out"
    assert judge(failed).headline.startswith("The calibration failed: only 4 of 9 agree. ")
    assert step(failed) == "measure again, or leave the bad rows out"
    with in_language("de"):
        assert step(failed) == "erneut messen oder die falschen Zeilen weglassen"
