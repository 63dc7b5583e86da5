# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Many rows and many candidates: a bounded amount of work, said where something was left untried."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from fastcal import Robot, _core, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import many_rows, rules, search
from fastcal.diagnosis.many_rows import searched_rows
from fastcal.measurements.dataset import Dataset

SIGMA = 4e-5  # [m]
GAP = 6e-4
BACKLASH = {"effect": "backlash", "owner": "joint4", "parameters": {"gap_rad": GAP}}
RATIO = {"effect": "reduction_ratio", "owner": "joint1", "parameters": {"error": 1e-4}}


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


def rows(count: int, effects: list[dict[str, Any]]) -> Dataset:
    true = perturbed(arm(), seed=1)
    true = Robot(dict(true.spec) | {"effects": effects})
    approach = np.random.default_rng(1).choice([-1.0, 1.0], (count, 6))
    poses = Dataset.from_arrays(random_poses(arm(), count, seed=1), robot=arm(), approach=approach)
    return simulate(true, poses, noise=SIGMA, seed=1)


def test_the_work_for_twenty_thousand_rows_is_that_for_a_few_and_a_handful_of_fits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(many_rows, "SEARCHED_NUMBERS", 360)
    numbers: list[int] = []
    linearize = _core.linearize

    def counted(*arguments: Any, **options: Any) -> Any:
        near = linearize(*arguments, **options)
        numbers.append(len(near.r))
        return near

    monkeypatch.setattr(_core, "linearize", counted)
    found = diagnose(arm(), rows(20_000, [BACKLASH]), sigma=SIGMA)
    assert [f.label for f in found.effects] == ["backlash@joint4"]
    few = 3 * (120 + 40)  # the rows of the stretches, and those of least and largest values
    on_all = [n for n in numbers if n > few]
    # Outliers, surrogate and noise look at all rows once or twice, the two models of the answer a few times.
    assert len(on_all) <= 15
    assert len(numbers) <= 120
    assert len(found.search.seen) <= 30
    value = found.effects[0].parameters["gap_rad"]
    assert value.std is not None
    assert abs(value.value - GAP) < 4 * value.std < 1e-5
    assert any("of 20000 measured rows" in note for note in found.notes)


def test_what_is_found_in_some_rows_is_fitted_to_all(monkeypatch: pytest.MonkeyPatch) -> None:
    data = rows(500, [BACKLASH])
    position = np.array(data.position)
    position[77] += 0.004
    data = Dataset(**{**vars(data), "position": position})
    whole = diagnose(arm(), data, sigma=SIGMA)
    monkeypatch.setattr(many_rows, "SEARCHED_NUMBERS", 480)
    some = diagnose(arm(), data, sigma=SIGMA)
    assert some.outliers == whole.outliers == [77]
    assert [f.label for f in some.effects] == [f.label for f in whole.effects] == ["backlash@joint4"]
    a, b = (f.effects[0].parameters["gap_rad"] for f in (some, whole))
    assert a.std is not None
    assert b.std is not None
    assert a.std == pytest.approx(b.std, rel=0.1)
    assert abs(a.value - b.value) < 0.1 * b.std  # the same rows and the same minimum
    assert some.gap[-1].train_rms_mm == pytest.approx(whole.gap[-1].train_rms_mm, rel=1e-3)


def test_rows_that_are_searched_are_stretches_over_all_and_the_extremes(monkeypatch: pytest.MonkeyPatch) -> None:
    data = rows(400, [])
    assert searched_rows(data, arm()) is None
    monkeypatch.setattr(many_rows, "SEARCHED_NUMBERS", 300)
    chosen = searched_rows(data, arm())
    assert chosen is not None
    assert 100 <= len(chosen) <= 140
    assert chosen.min() == 0
    assert chosen.max() == 399
    assert np.mean(np.diff(chosen) == 1) > 0.6  # neighbours stay neighbours
    np.testing.assert_array_equal(np.ptp(data.q[chosen], axis=0), np.ptp(data.q, axis=0))
    assert np.abs(np.histogram(chosen, bins=4)[0] - len(chosen) / 4).max() < 15


def test_a_search_that_is_cut_short_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    data = rows(110, [BACKLASH, RATIO])
    monkeypatch.setattr(search, "MAX_WORK", 1.0)
    found = diagnose(arm(), data, sigma=SIGMA)
    assert found.search.is_cut_short
    assert len(found.search.seen) <= search.BEAM_WIDTH + rules.CHILDREN_PER_NODE + 8
    assert any("cut short" in note for note in found.notes)
    assert found.verdict == "unexplained"
    assert all(f.grade != "A" for f in found.effects)


def test_a_search_that_ends_by_itself_says_nothing() -> None:
    found = diagnose(arm(), rows(110, [BACKLASH]), sigma=SIGMA)
    assert not found.search.is_cut_short
    assert not any("searched" in note or "search" in note for note in found.notes)
    assert 0 < found.search.work < 0.01 * search.MAX_WORK
