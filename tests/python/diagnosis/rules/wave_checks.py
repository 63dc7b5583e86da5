# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Waves of joints: the scan of all orders, and when many of them are the cause."""

from unittest import mock

import numpy as np

from fastcal.diagnosis import one_curve, periodic

from .linear_world import ROWS, World, columns, name
from .mutants import falls_with

ORDERS = np.arange(1.0, 40.0, 0.1)


def peaks(tops: dict[float, float], **more: float) -> list[float]:
    """Of a scan with these orders and statistics, each a peak of half a cycle on a floor of 1."""
    statistic = np.ones(len(ORDERS))
    for order, size in tops.items():
        statistic = np.maximum(statistic, size * np.exp(-(((ORDERS - order) / 0.5) ** 2)))
    rank = np.full(len(ORDERS), 2, dtype=np.int32)
    return periodic._peaks(ORDERS, statistic, rank, np.inf, 1000.0)


@falls_with(PEAKS_PER_JOINT=1)
@falls_with(PEAKS_PER_JOINT=9)
def three_peaks_of_a_joint_are_taken() -> None:
    assert peaks({8.0: 300.0, 31.0: 200.0, 20.0: 100.0, 13.0: 60.0}) == [8.0, 31.0, 20.0]


@falls_with(ALPHA_WAVE=1e-60)
@falls_with(ALPHA_WAVE=0.9)
def a_wave_is_seen_by_chance_in_one_of_a_thousand_scans() -> None:
    """P(chi2_2 > x) = exp(-x / 2), times 1000 independent orders."""
    assert peaks({8.0: 26.0}) == []
    assert peaks({8.0: 29.0}) == [8.0]


@falls_with(WHOLE_ORDER_WITHIN=0.0)
@falls_with(WHOLE_ORDER_WITHIN=0.5)
def an_order_close_to_a_whole_one_is_whole() -> None:
    assert peaks({8.1: 4000.0}) == [8.0]
    assert peaks({8.3: 4000.0}) == [8.3]


@falls_with(BROKEN_ORDER_GAIN=0.0)
@falls_with(BROKEN_ORDER_GAIN=1e9)
def a_broken_order_must_explain_more() -> None:
    assert peaks({8.2: 30.0}) == [8.0]  # by 30 (1 - exp(-0.16)) = 4.4
    assert peaks({8.2: 60.0}) == [8.2]


@falls_with(MAX_WAVES=5)
def ten_waves_of_joints_are_found_together() -> None:
    C = columns(12)
    waves = [name(k + 1, "gear_harmonic", order=2.0) for k in range(12)]
    world = World(dict(zip(waves, C.T, strict=True)), C[:, :10] @ np.linspace(40.0, 70.0, 10))
    with world.search() as search, mock.patch.object(periodic, "_held_out_share", return_value=0.1):
        found = [search.start.blocks.names[i] for i in search.many_waves]
        assert search.grow()[-1][0].names == tuple(found)
    assert set(found) == set(waves[:10])


@falls_with(MAX_WAVES_SHARE=0.0)
@falls_with(MAX_WAVES_SHARE=1e9)
def many_waves_must_predict_held_out_rows() -> None:
    C = columns(12)
    waves = [name(k + 1, "gear_harmonic", order=2.0) for k in range(12)]
    world = World(dict(zip(waves, C.T, strict=True)), C[:, :10] @ np.linspace(40.0, 70.0, 10))
    for share, is_found in ((0.4, True), (0.6, False)):
        with world.search() as search, mock.patch.object(periodic, "_held_out_share", return_value=share):
            assert bool(search.many_waves) == is_found


@falls_with(MAX_WAVES_SHARE=1e9)
def waves_that_repeat_what_rows_of_one_position_share_are_not_the_cause() -> None:
    """Joint 1 holds still in each of 30 batches of rows, which err alike: some orders meet 30 positions well."""
    random = np.random.default_rng(3)
    q = np.repeat(random.uniform(-np.pi, np.pi, ROWS // 8), 8)
    shared = np.repeat(10.0 * random.standard_normal(ROWS // 8), 8)
    orders = range(1, 25)
    waves = {name(1, "gear_harmonic", order=float(o)): np.column_stack([np.sin(o * q), np.cos(o * q)]) for o in orders}
    true = 10.0 * (np.sin(2 * q) + np.cos(5 * q + 1) + np.sin(7 * q) + np.cos(11 * q) + np.sin(16 * q))
    for measured, is_found in ((shared, False), (true, True)):
        with World(waves, measured, q=q[:, np.newaxis]).search() as search:
            assert len(periodic.forward(search.start, list(range(len(orders))), 5)) == 5
            assert bool(search.many_waves) == is_found


def is_one_curve(curve: np.ndarray, orders: tuple[float, ...]) -> bool:
    """Of waves of these orders that a set names, where joint 1 errs by a curve over q."""
    waves = {o: name(1, "gear_harmonic", order=float(o)) for o in (1, 1.7, 2, 2.5, 3, 4, 5, 6)}
    named = {waves[o]: np.column_stack([np.sin(o * q), np.cos(o * q)]) for o in waves}
    with World(named, curve, q=q[:, np.newaxis]).search() as search:
        found = search.state([waves[o] for o in orders], search.start)
        return one_curve.is_one_curve(search, found, found.names)


q = np.random.default_rng(6).uniform(-1.5, 1.5, ROWS)


@falls_with(CURVE_SCALES=(1e-5,))
@falls_with(CURVE_SCALES=(20.0,))
def waves_that_stand_in_for_a_bump_are_one_curve() -> None:
    bump = np.exp(-((q / 0.35) ** 2))
    assert is_one_curve(12.0 * bump, (1, 2, 3))
    assert is_one_curve(12.0 * bump, (2, 4))
    assert not is_one_curve(5.0 * np.sin(2 * q + 1.0) + 3.0 * np.sin(5 * q), (2, 5))
    assert not is_one_curve(5.0 * np.sin(q) + 3.0 * np.sin(3 * q) + 3.0 * np.cos(6 * q), (1, 3, 6))
    assert not is_one_curve(5.0 * np.sin(2 * q), (2,))
    assert is_one_curve(12.0 * bump, (1.7,))
    assert not is_one_curve(5.0 * np.sin(2.5 * q + 1.0), (2.5,))
