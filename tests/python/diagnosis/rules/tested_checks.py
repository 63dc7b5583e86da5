# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is tested: the variants of names, and what the blocks without a name can follow."""

from types import SimpleNamespace

import numpy as np

from fastcal import load_robot
from fastcal.diagnosis import doubts, generic, library, variants
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.measurements.dataset import Dataset

from .mutants import falls_with

ROWS = 400


def random(seed: int = 11) -> np.random.Generator:
    return np.random.default_rng(seed)


q = random().uniform(-3.0, 3.0, (ROWS, 2))
moments = np.linspace(0.0, 3600.0, ROWS)
places = random(12).uniform(-1.0, 1.0, (ROWS, 3)) + np.array([0.0, 0.0, 0.3])


def left_of(curve: np.ndarray, values: np.ndarray) -> float:
    """Share of the square of a curve that columns (N, k) and a constant leave."""
    X = np.column_stack([np.ones(len(values)), values])
    left = curve - X @ np.linalg.lstsq(X, curve, rcond=None)[0]
    return float(left @ left / np.sum((curve - curve.mean()) ** 2))


@falls_with(WAVE_ORDERS=(1,))
@falls_with(WAVE_ORDERS=(1, 2, 3, 4, 5, 6, 7, 8))
def waves_of_a_joint_are_tried_by_whole_orders_to_six() -> None:
    arm = load_robot("ur5")
    data = Dataset.from_arrays(random().uniform(-3.0, 3.0, (50, 6)))
    waves = [n for n in library.build_library(arm, data).names if n.key == ("gear_harmonic", "joint2")]
    assert [n.entry["order"] for n in waves] == [1, 2, 3, 4, 5, 6]
    assert [n.searched for n in waves] == [0] * 6
    assert Hypothesis({"effect": "gear_harmonic", "owner": "joint2", "order": 7.0}).searched == 1


@falls_with(CORNER_QUANTILES=(0.5,))
@falls_with(CORNER_QUANTILES=tuple(k / 100 for k in range(1, 100)))
def a_compliance_that_bends_anywhere_resembles_one_that_is_tried() -> None:
    load = np.abs(random().standard_normal(ROWS))
    bare = {"effect": "joint_compliance_nonlinear", "owner": "joint1"}
    tried = [n.entry["corner"] for n in variants._corners(bare, None, None)]
    bends = {at: np.maximum(load - np.quantile(load, at), 0.0) for at in tried}
    for true in np.linspace(0.1, 0.85, 16):
        curve = np.maximum(load - np.quantile(load, true), 0.0)
        assert min(left_of(curve, np.column_stack([load, bend])) for bend in bends.values()) < 0.1
    assert len(tried) <= 8  # each is one more test


@falls_with(MIN_ROWS_BESIDE_STEP=1)
@falls_with(MIN_ROWS_BESIDE_STEP=100)
def a_law_bends_only_where_poses_load_the_joint_less_and_more() -> None:
    """25 rows of 13 poses, of which three with a load near 0: a step there, and other poses 1.8 times as far off."""
    poses = np.repeat(np.arange(40), 3)
    load = poses - 20.0
    kept = Dataset.from_arrays(np.repeat(random().uniform(-1, 1, (40, 2)), 3, axis=0))
    for effect, corner, unseen in (
        ("joint_compliance_nonlinear", 2.5, False),
        ("joint_compliance_nonlinear", 1.5, True),
        ("joint_compliance_nonlinear", 19.5, True),
        ("joint_compliance", 1.5, False),
    ):
        at = SimpleNamespace(
            place=lambda name: slice(0, 2),
            model=SimpleNamespace(parameters=[SimpleNamespace(name="low"), SimpleNamespace(name="critical")]),
            theta=np.array([1e-6, corner]),
            loads=np.column_stack([np.zeros(len(load)), load]),
            problem=SimpleNamespace(kept=kept),
        )
        name = Hypothesis({"effect": effect, "owner": "joint2"})
        assert doubts.bends_unseen(at, name) is unseen


@falls_with(LAG_SHARES=())
@falls_with(LAG_SHARES=(0.9,))
def heat_that_comes_late_resembles_a_lag_that_is_tried() -> None:
    entry = {"effect": "thermal_expansion", "owner": "robot"}
    lags = [n.entry["lag_s"] for n in variants.with_lags(entry, moments)]
    warmth = np.where(moments < 1800, 0.0, 8.0)  # a step of the temperature

    def late(lag: float) -> np.ndarray:
        return np.where(moments < 1800, 0.0, 8.0 * (1 - np.exp(-np.maximum(moments - 1800, 0.0) / lag)))

    for true in (120.0, 240.0, 400.0, 700.0, 1000.0):
        assert min((left_of(late(true), late(lag)[:, np.newaxis]) for lag in lags), default=1.0) < 0.03
    assert left_of(late(400.0), warmth[:, np.newaxis]) > 0.03


@falls_with(STEP_MOMENTS=2)
@falls_with(MIN_ROWS_BESIDE_STEP=1)
@falls_with(MIN_ROWS_BESIDE_STEP=100)
def a_step_anywhere_resembles_one_that_is_tried() -> None:
    bare = {"effect": "base_step", "owner": "base"}
    tried = np.array([n.entry["at_s"] for n in variants._steps(bare, None, SimpleNamespace(time=moments))])
    assert np.sum(moments < tried.min()) == 5
    assert np.sum(moments > tried.max()) == 5
    steps = (moments[:, np.newaxis] >= tried).astype(float)
    for at in moments[20:-20:7]:
        step = (at <= moments).astype(float)
        assert min(left_of(step, column[:, np.newaxis]) for column in steps.T) < 0.35


def curves(data: Dataset, load: np.ndarray) -> dict[tuple[str, ...], np.ndarray]:
    loads = np.column_stack([load, load])
    return {c.depends_on: c.values for c in generic.joint_curves(data, loads, {0: True, 1: True})[0]}


@falls_with(CURVE_ORDERS=2)
@falls_with(CURVE_ORDERS=40)
def a_joint_errs_by_six_orders_of_its_position_and_degree_six_of_its_load() -> None:
    load = np.sin(q[:, 1])
    found = curves(Dataset.from_arrays(q), load)
    assert left_of(np.sin(6 * q[:, 0] + 0.3), found["q1",]) < 1e-6
    assert left_of(load**6, found["torque",]) < 1e-6
    assert found["q1",].shape[1] == 13  # what is free to follow anything places nothing


@falls_with(TIME_DEGREE=2)
@falls_with(TEMPERATURE_DEGREE=1)
@falls_with(CONDITION_DEGREE=1)
def conditions_are_followed_by_low_degrees() -> None:
    x = moments / 3600
    data = Dataset.from_arrays(
        q, time=moments, temperature=20 + 5 * np.cos(4 * x), extra={"coolant": random().random(ROWS)}
    )
    found = curves(data, np.sin(q[:, 1]))
    assert left_of((x - 0.3) ** 5, found["time_s",]) < 1e-6
    assert left_of(np.asarray(data.temperature) ** 3, found["temperature_c",]) < 1e-6
    assert left_of(data.extra["coolant"] ** 2, found["coolant",]) < 1e-6


@falls_with(LONG_LINKS=1)
@falls_with(LONG_LINKS=4)
def a_base_leans_to_where_the_two_long_links_reach() -> None:
    arm = load_robot("kuka_kr6_r900")
    commands = random().uniform(-2.0, 2.0, (ROWS, 6))
    origins = arm.core.frame_origins(commands)
    level = np.eye(3)[:2]
    found = {c.depends_on: c.values for c in generic.lean_curves(level, commands, lambda: origins)}
    shoulder, elbow, wrist = (origins[:, k, :2] for k in (3, 5, 9))
    moment = 20.0 * (shoulder + elbow) / 2 + 15.0 * (elbow + wrist) / 2
    assert left_of(moment[:, 0], found["reach",]) < 0.01
    assert found["reach",].shape[1] == 4  # what a small link adds is not worth its columns


@falls_with(FIELD_DEGREE=2)
@falls_with(FIELD_DEGREE=6)
def a_field_in_the_workspace_is_cubic() -> None:
    found = generic.field_curves(places).values
    x, y, z = places.T
    linear = np.column_stack([found, places])
    assert left_of(x**2 * z - y**3, linear) < 1e-6
    assert found.shape[1] == 16


@falls_with(CIRCLE_ORDERS=1)
@falls_with(RANGE_DEGREE=1)
@falls_with(MIN_AXIS_DISTANCE=0.0)
def an_instrument_errs_by_two_orders_of_a_circle_and_its_range() -> None:
    far = places + np.array([3.0, 0.0, 0.0])
    azimuth, _, reach = (c.values for c, _ in generic.sight_curves(far))
    assert left_of(np.sin(2 * np.arctan2(far[:, 1], far[:, 0])), azimuth) < 1e-6
    distance = np.linalg.norm(far, axis=1)
    assert left_of(distance**2, reach) < 1e-6
    above = np.vstack([far, [[1e-9, 0.0, 2.0]]])  # straight above an instrument there is no azimuth
    assert list(generic.sight_curves(above)) == []


@falls_with(MIN_CURVE_VALUE=0.0)
@falls_with(MIN_CURVE_VALUE=0.9)
def columns_that_hardly_differ_over_these_rows_are_one() -> None:
    x = random(1).standard_normal(ROWS)
    near = x + 1e-4 * random(2).standard_normal(ROWS)
    assert generic.orthonormal(np.column_stack([x, near])).shape[1] == 1
    assert generic.orthonormal(np.column_stack([x, x**2 + 0.5 * x])).shape[1] == 2
