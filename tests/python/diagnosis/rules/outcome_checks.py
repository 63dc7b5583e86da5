# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What could have been seen, what to measure next, and how much of it a reader gets."""

from functools import cache
from types import SimpleNamespace
from unittest import mock

import numpy as np
from scipy import special

from fastcal.diagnosis import plan, row_projections, rules, sensitivity, unexplained, words
from fastcal.diagnosis.gap import Gap
from fastcal.diagnosis.result import Finding, NamedValue
from fastcal.diagnosis.search import Search, SearchNode

from .linear_world import World, columns, name
from .mutants import falls_with
from .small_arm import SIGMA, arm, measured, problem


@cache
def complete() -> Search:
    """Nothing is missing."""
    return Search(problem(measured([])))


@falls_with(DETECTION_POWER=0.2)
@falls_with(DETECTION_POWER=0.99)
@falls_with(MIN_GAIN=0.0)
def the_smallest_effect_is_seen_four_times_in_five() -> None:
    """Of one name alone: chi2_1(lambda) beyond its limit and a gain of sqrt(lambda) / 2 standard errors, both."""
    C = 1e4 * columns(1)  # a gap of 3e-4 rad, the plausible one, moves the rows by three times the noise
    world = World({name(1): C}, np.zeros(len(C)))
    world.problem.start.model = SimpleNamespace(robot=arm().core)
    world.problem.names = list(world.names)
    with world.search() as search:
        (found,) = sensitivity.smallest(search.start)
        with mock.patch.object(rules, "MIN_GAIN", -100.0):
            (detected,) = sensitivity.smallest(search.start)
        limit = special.chdtri(1, 0.005 / 2)
        length = search.start.blocks.tests.length[0]
    assert abs(detected.value * length / np.sqrt(special.chndtrinc(limit, 1, 0.2)) - 1) < 0.05
    s = found.value * length
    assert abs((1 - special.chndtr(limit, 1, s**2)) * special.ndtr(s / 2 - 2.0) - 0.8) < 0.01


@falls_with(MAX_PLAUSIBLE_SIZE=1e15)
@falls_with(MAX_PLAUSIBLE_SIZE=1.0)
def what_rounding_leaves_of_a_column_has_no_size() -> None:
    slack = name(2)
    assert list(sensitivity._sizes(slack, np.array([1e3]), np.array([4.0]), arm().core)) == [("gap_rad", 4e-3)]
    assert list(sensitivity._sizes(slack, np.array([1e-9]), np.array([4.0]), arm().core)) == []


@falls_with(RANKING_LENGTH=3)
@falls_with(CONFUSION_LENGTH=3)
@falls_with(RANKING_LENGTH=1000)
@falls_with(CONFUSION_LENGTH=1000)
def a_reader_gets_twelve_names_and_a_map_of_eight() -> None:
    search = complete()
    assert len(sensitivity.ranking(search, search.start)) == 12
    names, r = sensitivity.confusion(search)
    assert len(names) == 8
    assert r.shape == (8, 8)


@falls_with(CONFUSED_CORRELATION=0.0)
@falls_with(CONFUSED_CORRELATION=1.1)
def poses_confuse_causes_above_a_correlation_of_095() -> None:
    """An arm of three joints hardly tells a compliance from one that changes with the load."""
    found = plan.foresee(arm(), measured([]), SIGMA).confused
    assert found
    assert all(0.95 < r <= 1 for _, _, r in found)


@cache
def pair() -> tuple[SearchNode, list]:
    """A compliance of joint 2 and a tilt of its bearing: weak, and alike."""
    cause = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 1e-6}}
    search = Search(problem(measured([cause])))
    names = {n.key: n for n in search.problem.names}
    best = search.state([names["joint_compliance", "joint2"]], search.start)
    return best, [names["link_bending", "link2"]]


@falls_with(PLAN_POSES=2)
@falls_with(PLAN_POSES=40)
@falls_with(PLAN_POWER=0.1)
def a_plan_asks_for_a_dozen_poses_unless_fewer_are_as_good() -> None:
    best, others = pair()
    found = plan.separating_plan(best, [others])
    assert found is not None
    assert 2 < len(found.poses) <= 12
    assert found.power_after > 0.99 or len(found.poses) == 12


@falls_with(MIN_PLAN_POWER=0.0)
@falls_with(MIN_PLAN_POWER=1.1)
def a_plan_that_is_not_enough_says_so() -> None:
    poses = mock.MagicMock(payload=np.array([0.0, 5.0]))
    causes = (name(1).label, name(2).label)
    assert "not enough" in plan.SeparatingPlan(poses, 0.3, 0.7, causes).sentence
    assert "not enough" not in plan.SeparatingPlan(poses, 0.3, 0.9, causes).sentence


@falls_with(PLAN_CANDIDATES=20)
@falls_with(PLAN_PAYLOADS=1)
@falls_with(PLAN_PAYLOADS=20)
def a_plan_chooses_from_the_whole_range_and_three_payloads() -> None:
    """The largest gap in a joint's range is less than 5 % of it."""
    data = measured([]).select(np.arange(60))
    levels = np.linspace(0.0, 10.0, 60)
    pool = plan._candidates(arm(), SimpleNamespace(q=data.q, payload=levels), [name(2, "joint_compliance")])
    assert set(pool.payload) == {levels[0], levels[30], levels[-1]} or len(set(pool.payload)) == 3
    gaps = np.diff(np.sort(pool.q, axis=0), axis=0) / np.ptp(data.q, axis=0)
    assert gaps.max() < 0.05


@falls_with(MIN_LEVERAGE=0.0)
@falls_with(MIN_LEVERAGE=10.0)
def poses_that_show_next_to_nothing_are_not_drawn() -> None:
    lever = np.r_[np.ones(40), 0.01]
    fit = SimpleNamespace(near=SimpleNamespace(row=np.arange(41)), problem=SimpleNamespace(kept=np.zeros(41)))
    one = np.ones((41, 1))
    effect = row_projections.Effect(fit, one, np.ones(1), np.eye(1), np.zeros(41))
    assert list(effect.along(lever).kept) == list(range(40))


def orders_of(curve: np.ndarray) -> list[int]:
    entry = {"effect": "joint_profile", "owner": "joint1", "low_rad": -3.0, "high_rad": 3.0}
    model = SimpleNamespace(entries=[entry], joint_count=1)
    with mock.patch.object(unexplained, "profile_curve", return_value=curve):
        return sorted(order for order, _ in unexplained.main_orders(model, entry))


@falls_with(PROFILE_ORDERS=2)
@falls_with(MAIN_ORDER_SHARE=0.0)
@falls_with(MAIN_ORDER_SHARE=0.6)
def a_curve_is_described_by_its_main_orders() -> None:
    q = np.linspace(-3.0, 3.0, 200)
    assert orders_of(3e-4 * np.sin(2 * q) + 4e-4 * np.sin(5 * q) + 3e-5 * np.cos(3 * q)) == [2, 5]


@falls_with(MAX_WAVES_LISTED=2)
@falls_with(MAX_WAVES_LISTED=100)
def up_to_four_waves_are_listed_one_by_one() -> None:
    def sentence(count: int) -> str:
        waves = [
            Finding("gear_harmonic", f"joint{k + 1}", "A", {"order": NamedValue(2.0, 0.0)}, 30.0, 0.0)
            for k in range(count)
        ]
        return words._causes(SimpleNamespace(effects=waves, few=""))

    assert sentence(4).count("30 times the noise") == 4
    assert "joint 5 2 times per turn" in sentence(5)


@falls_with(MAX_RISE=2.0)
@falls_with(MAX_RISE=0.5)
def an_error_that_a_user_would_see_rise_rises() -> None:
    for after, rises in ((1.05, True), (1.005, False), (0.8, False)):
        assert Gap("held out", [1.0, after], 0.1, "mm").rises is rises
