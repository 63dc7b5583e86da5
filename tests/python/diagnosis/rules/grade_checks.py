# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Grades: what keeps a name from grade A."""

from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import numpy as np

from fastcal.diagnosis import diagnose, doubts, grading, periodic
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.grading import Evidence
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.reasons import Because, BlockLabel, Label, Reason
from fastcal.diagnosis.search import Family, Search, SearchNode

from .linear_world import ROWS, World, columns, name
from .mutants import falls_with
from .small_arm import SIGMA, arm, measured, problem

SURE = Evidence(
    statistic=50.0**2,
    rank=1,
    gain=(0.5, 0.05),
    stability=1.0,
    rivals=(),
    is_richer_needed=True,
    is_plausible=True,
)


def grade(**changed: object) -> str:
    return grading.grade(replace(SURE, **changed), name(1), (), False)[0]


@falls_with(GRADE_A_SNR=0.0)
@falls_with(GRADE_A_SNR=1e9)
def a_weak_signal_is_not_sure() -> None:
    assert grade() == "A"
    assert grade(statistic=14.0**2) == "B"
    assert grade(statistic=16.0**2) == "A"


@falls_with(GRADE_A_SNR_LOADS=0.0)
@falls_with(GRADE_A_SNR_LOADS=1e9)
def what_follows_loads_needs_more() -> None:
    assert grade(follows_loads=True, statistic=38.0**2) == "B"
    assert grade(follows_loads=True, statistic=42.0**2) == "A"


@falls_with(GRADE_A_SNR_SLOW=0.0)
@falls_with(GRADE_A_SNR_SLOW=1e9)
def so_does_what_changes_with_time_or_temperature() -> None:
    for effect in ("base_drift", "thermal_offset"):
        grades = [grading.grade(replace(SURE, statistic=snr**2), name(1, effect), (), False)[0] for snr in (38.0, 42.0)]
        assert grades == ["B", "A"]


def place_only(snr: float, effect: str = "gear_harmonic", remains: float | None = None, **beside: float) -> bool:
    others = [(replace(SURE, statistic=s**2), name(2, other)) for other, s in beside.items()]
    return bool(grading.may_be_another(replace(SURE, statistic=snr**2), name(1, effect), others, (), remains))


@falls_with(GRADE_B_SNR=0.0)
@falls_with(GRADE_B_SNR=1e9)
def a_very_weak_name_is_no_more_than_a_place() -> None:
    assert place_only(7.0)
    assert not place_only(9.0)


@falls_with(MUCH_STRONGER=0.0)
@falls_with(MUCH_STRONGER=1e9)
@falls_with(GRADE_A_SNR=0.0)
def beside_a_much_stronger_name_it_needs_the_signal_of_grade_a() -> None:
    assert place_only(13.0, backlash=30.0)
    assert not place_only(13.0, backlash=20.0)
    assert not place_only(16.0, backlash=90.0)
    assert not place_only(13.0, gear_harmonic=90.0)  # waves have one form


@falls_with(GRADE_A_SNR=0.0)
@falls_with(GRADE_A_SNR_SLOW=0.0)
def so_it_does_beside_what_remains_and_among_several_over_time() -> None:
    assert place_only(13.0, remains=0.0)
    assert not place_only(16.0, remains=0.0)
    assert place_only(16.0, remains=20.0)  # of what has no name it may be a part
    assert not place_only(24.0, remains=20.0)
    assert place_only(30.0, "base_drift", thermal_offset=30.0)
    assert not place_only(30.0, "base_drift", backlash=30.0)
    noisy = replace(SURE, statistic=30.0**2, noise_follows=True)  # and so is noise that changes slowly
    assert grading.may_be_another(noisy, name(1, "base_drift"), (), (), None)
    assert not grading.may_be_another(noisy, name(1, "backlash"), (), (), None)


@falls_with(GRADE_A_GAIN=-1e9)
@falls_with(GRADE_A_GAIN=1e9)
def held_out_rows_must_bear_it_out() -> None:
    assert grade(gain=(0.05, 0.03)) == "B"
    assert grade(gain=(0.07, 0.03)) == "A"


@falls_with(GRADE_A_STABILITY=0.0)
@falls_with(GRADE_A_STABILITY=1.1)
def it_must_come_first_in_four_of_five_parts() -> None:
    assert grade(stability=0.6) == "B"
    assert grade(stability=0.8) == "A"


@falls_with(GRADE_B_STABILITY=0.0)
@falls_with(GRADE_B_STABILITY=1.1)
def a_name_that_most_parts_do_not_bear_out_may_be_another() -> None:
    def reasons(others: tuple[object, ...] = (), **changed: object) -> list[Reason]:
        found = grading.may_be_another(replace(SURE, **changed), name(1), (), others, None)
        return [because.reason for because in found]

    assert reasons(stability=0.4) == [Reason.UNSTABLE]
    assert reasons(stability=0.6) == []
    assert reasons((name(2),), stability=0.4) == []  # each of two that do as well comes first at times
    assert reasons(is_plausible=False, follows_loads=True) == [Reason.IMPLAUSIBLE]
    assert reasons(is_plausible=False) == []  # worn gears have any backlash
    assert reasons(is_law_shown=False) == [Reason.NO_MASSES]
    wave = Because(Reason.SLOW_WAVE_ALIKE, orders=(1.0,))
    assert reasons(alike=(wave,)) == [Reason.SLOW_WAVE_ALIKE]  # a slope over a short range
    assert reasons(alike=(Because(Reason.OTHER_FORM),)) == []


@falls_with(MAX_EFFECTS=3)
@falls_with(MAX_EFFECTS=9)
def of_many_names_those_of_the_commonest_effect_stay() -> None:
    def reasons(effect: str, *others: str) -> list[Reason]:
        beside = [(SURE, name(2 + k, other)) for k, other in enumerate(others)]
        return [because.reason for because in grading.may_be_another(SURE, name(1, effect), beside, (), None)]

    yields = ["joint_compliance"] * 4
    assert reasons("link_torsion", *yields) == [Reason.UNSURE_COMPANION]
    assert reasons("joint_compliance", *yields[1:], "link_torsion") == []
    assert reasons("link_torsion", *yields[1:]) == []  # four are not many


@falls_with(GRADE_A_SNR_LOADS=0.0)
def a_sag_without_masses_is_a_place_and_no_law() -> None:
    sag = name(1, "gravity_sag")
    found, why = grading.grade(replace(SURE, follows_loads=True, statistic=38.0**2), sag, (), False)
    assert found == "B"
    assert [because.reason for because in why] == [Reason.WEAK_SIGNAL, Reason.NO_MASSES]
    assert grading.grade(SURE, sag, (), False)[0] == "B"
    assert [because.reason for because in grading.may_be_another(SURE, sag, (), (), None)] == [Reason.NO_MASSES]


@falls_with(MAX_PLAUSIBLE_SIZE=0.0)
@falls_with(MAX_PLAUSIBLE_SIZE=np.inf)
def a_size_that_no_arm_has_does_the_work_of_something_else() -> None:
    gap = SimpleNamespace(name="gap", sigma=1e-4)
    assert doubts.is_plausible([gap], np.array([1e-3]))
    assert not doubts.is_plausible([gap], np.array([-5e-3]))
    assert doubts.is_plausible([SimpleNamespace(name="critical", sigma=1.0)], np.array([500.0]))


@falls_with(MIN_SNR_BESIDE_REST=0.0)
@falls_with(MIN_EXPLAINED_SHARE=0.0)
def beside_something_without_a_name_a_weak_name_or_one_of_little_weight_is_a_shadow() -> None:
    def is_shadow(snr: float, left: float) -> bool:
        search = SimpleNamespace(start=SimpleNamespace(fit=SimpleNamespace(remaining=1000.0)))
        search.explains_little = lambda state: Search.explains_little(search, state)
        found = replace(SURE, statistic=snr**2)
        return grading.is_shadow(search, SimpleNamespace(fit=SimpleNamespace(remaining=left)), found)

    assert not is_shadow(20.0, 300.0)
    assert is_shadow(9.0, 300.0)
    assert is_shadow(20.0, 700.0)


@falls_with(CONTRAST=0.0)
@falls_with(CONTRAST=1e3)
def a_compliance_that_changes_with_the_load_must_change() -> None:
    richer = name(2, "joint_compliance_nonlinear")
    parameters = [SimpleNamespace(name=n) for n in ("low", "high", "critical")]
    theta, covariance = np.array([1.0, 2.0, 50.0]), np.diag([0.02, 0.02, 1.0])  # differ by 5 = 1 / 0.2
    assert not grading._richer_needed(richer, parameters, theta, 1.1 * covariance)
    assert grading._richer_needed(richer, parameters, theta, 0.9 * covariance)


def rivals(share: float) -> tuple[Label, ...]:
    """Those of a name beside a block that holds this share of its signature, where only the name is there."""
    C = columns(3)
    cause, other = name(1), name(2)
    block = np.sqrt(share) * C[:, 0] + np.sqrt(1 - share) * C[:, 1]
    world = World({cause: C[:, 0], other: C[:, 2]}, 12.0 * C[:, 0], {"joint3": block})
    with world.search() as search:
        return grading._rivals(search, search.start, cause)


@falls_with(SAME_SHAPE=0.0)
@falls_with(SAME_SHAPE=1.1)
def a_block_without_a_name_that_does_as_well_is_a_rival_unless_it_holds_the_name() -> None:
    assert rivals(0.95) == (BlockLabel("joint3", ("q3",)),)
    assert rivals(0.999) == ()


@falls_with(MAX_CONTENDERS=1)
def a_part_of_the_data_may_have_another_name_first() -> None:
    """Two look-alikes that one row tells apart: without it the other one comes first."""
    C = columns(2)
    cause, other = name(1), name(2)
    one = C[:, 0].copy()
    two = one.copy()
    one[0], two[0], two[1:] = 0.5, -0.5, two[1:] + 0.05 * C[1:, 1]
    world = World({cause: one, other: two}, np.zeros(ROWS))
    world.r = 20.0 * two
    world.r[0] = 20.0 * one[0]
    fold = np.r_[0, 1 + np.arange(ROWS - 1) % 4]
    with world.search() as search, mock.patch.object(grading, "folds", return_value=fold):
        assert grading._stability(search, search.start, cause) == 0.8


@falls_with(MAX_OVER_CLAIM=0.9)
@falls_with(MAX_OVER_CLAIM=2.0)
def nothing_is_sure_where_more_remains_than_is_claimed() -> None:
    """A cause that the library lacks may look like a name, and leave what passes for noise."""
    rows = measured([{"effect": "reduction_ratio", "owner": "joint2", "parameters": {"error": 4e-4}}], rows=110)
    sure, unsure = (diagnose(arm(), rows, sigma=SIGMA / over).effects for over in (1.0, 1.6))
    assert [(f.label, f.grade) for f in sure] == [("reduction_ratio@joint2", "A")]
    assert [(f.label, f.grade) for f in unsure] == [("reduction_ratio@joint2", "B")]
    assert [because.reason for because in unsure[0].limits] == [Reason.NOISE_OVER_CLAIM]


def orders_alike(q: np.ndarray) -> tuple[float, ...]:
    """Orders that can't be told from a wave of three cycles a turn over these positions."""
    wave = name(1, "gear_harmonic", order=3.0)
    columns = np.column_stack([np.sin(3 * q), np.cos(3 * q)])
    with World({wave: columns}, 3.0 * columns[:, 0], q=q[:, np.newaxis]).search() as search:
        return periodic.orders_alike(search.start, wave)


@falls_with(OTHER_ORDER_LOSS=-1e9)
@falls_with(OTHER_ORDER_LOSS=1e9)
def over_a_grid_of_positions_orders_are_alike() -> None:
    """Steps of 10 degrees: 36 k +- 3 cycles a turn are the same wave."""
    steps = np.random.default_rng(4).integers(-12, 13, ROWS)
    assert np.round(orders_alike(np.radians(10.0) * steps), 1).tolist() == [33, 39, 69, 75, 105, 111]
    assert orders_alike(np.random.default_rng(4).uniform(-2.1, 2.1, ROWS)) == ()


def zeros_that_would_do(turn: float, tilt: float) -> list[str]:
    """In place of a step of the base, where it turned by so much [rad] about joint 1's axis and across."""
    moment = 60.0 * ROWS / 2
    bumped = {"step_rz_rad": turn, "step_ry_rad": tilt}
    step = Hypothesis({"effect": "base_step", "owner": "base", "at_s": moment})
    rows = measured([dict(step.entry) | {"parameters": bumped}], rows=ROWS, time=60.0 * np.arange(ROWS))
    state = SearchNode(fit(problem(rows), [step]), Family(1, 1))
    return [label.owner for because in grading.moved_zeros(state, step) for label in because.subjects]


@falls_with(ALPHA_MOVED_ZERO=1.0)
@falls_with(ALPHA_MOVED_ZERO=1e-300)
def a_base_that_only_turned_about_joint_1_may_be_a_zero_that_jumped() -> None:
    assert zeros_that_would_do(5e-4, 0.0) == ["joint1"]
    assert zeros_that_would_do(5e-4, 2e-4) == []
