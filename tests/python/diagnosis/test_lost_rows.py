# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where something jumps is decided by rows that were left out as gross too, before it had a name."""

from typing import Any

import numpy as np
import pytest

from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.rules import MIN_ROWS_BESIDE_STEP
from fastcal.diagnosis.scans import at_best_moment, beside_lost_rows
from fastcal.diagnosis.search import Search
from fastcal.diagnosis.variants import from_moment, from_position

from .rules import small_arm

BELOW, ABOVE = 20, 23  # places along the course of the rows that are fitted; two more lie between them


def set_with(entry: dict[str, Any], course: np.ndarray[Any, Any]) -> tuple[Problem, np.ndarray[Any, Any]]:
    """A problem that was found without the two rows beside a step, and the course there."""
    data = small_arm.measured([entry], time=10.0 * np.arange(small_arm.ROWS))
    problem = small_arm.problem(data)
    order = np.argsort(course(data))
    used = problem.used.copy()
    used[order[BELOW + 1 : ABOVE]] = False
    return problem.with_rows(used), np.sort(course(data))[BELOW : ABOVE + 1]


def placed(problem: Problem, at: Hypothesis) -> Hypothesis:
    search = Search(problem)
    (name,) = beside_lost_rows(search, search.state((at,), search.start)).names
    return name


@pytest.mark.parametrize("cut", [0, 2])  # between the kept rows and those that were lost
def test_an_encoder_jumps_beside_the_row_that_says_so(cut: int) -> None:
    bare = {"effect": "encoder_jump", "owner": "joint2", "parameters": {}}

    def course(data: Any) -> Any:
        return data.q[:, 1]

    own = np.sort(course(small_arm.measured([])))[BELOW : ABOVE + 1]
    true = float(np.degrees(own[cut : cut + 2].mean()))
    problem, own = set_with(bare | {"at_deg": true, "parameters": {"jump_rad": 2e-3}}, course)
    name = placed(problem, from_position(bare, float(own[[0, -1]].mean()), problem.start.robot))
    assert np.degrees(own[cut]) < name.entry["at_deg"] < np.degrees(own[cut + 1])


@pytest.mark.parametrize("cut", [0, 2])  # between the kept rows and those that were lost
def test_a_base_steps_beside_the_row_that_says_so(cut: int) -> None:
    bare = {"effect": "base_step", "owner": "base", "parameters": {}}

    def course(data: Any) -> Any:
        return data.time

    true = 10.0 * (BELOW + cut) + 5.0
    problem, own = set_with(bare | {"at_s": true, "parameters": {"step_x_mm": 1.0}}, course)
    name = placed(problem, from_moment(bare, float(own[[0, -1]].mean()), problem.kept))
    assert own[cut] < name.entry["at_s"] < own[cut + 1]


@pytest.mark.parametrize("row", [0, small_arm.ROWS - 2])
def test_a_row_or_two_are_no_side_of_a_step(row: int) -> None:
    """Beside another step there, a jump of the range was the constant by which it was off in all rows but one."""
    bare = {"effect": "base_step", "owner": "base", "parameters": {}}
    stepped = bare | {"at_s": 10.0 * row + 5.0, "parameters": {"step_x_mm": 1.0}}
    problem = small_arm.problem(small_arm.measured([stepped], time=10.0 * np.arange(small_arm.ROWS)))
    name = at_best_moment(from_moment(bare, 205.0, problem.kept), Search(problem).start)
    before = int(np.sum(problem.kept.time < name.entry["at_s"]))
    assert min(before, len(problem.kept) - before) >= MIN_ROWS_BESIDE_STEP


@pytest.mark.parametrize(("apart", "is_possible"), [(0, True), (2, False), (MIN_ROWS_BESIDE_STEP, True)])
def test_no_two_things_step_around_a_row_or_two(apart: int, is_possible: bool) -> None:
    """A zero of joint 1 that jumped, and a base that turned back 186 s later, were two gross rows."""
    problem = small_arm.problem(small_arm.measured([], time=10.0 * np.arange(small_arm.ROWS)))
    steps = [
        from_moment({"effect": effect, "owner": owner, "parameters": {}}, at, problem.kept)
        for effect, owner, at in (("zero_step", "joint1", 195.0), ("base_step", "base", 195.0 + 10.0 * apart))
    ]
    assert Search(problem).state(tuple(steps), Search(problem).start).impossible != is_possible
