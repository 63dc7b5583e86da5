# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows of a data set: slices and masks, rows to hold out, to pandas and back."""

from __future__ import annotations

import numpy as np
import pytest

from fastcal import Dataset, InvalidInput, load_robot
from fastcal.measurements.splits import deal, random_rows, region_rows


@pytest.fixture(scope="module")
def data() -> Dataset:
    robot = load_robot("ur5")
    random = np.random.default_rng(0)
    q = random.uniform(-2, 2, (40, 6))
    return Dataset.from_arrays(
        q,
        position=robot.forward(q)[:, :3, 3],
        payload=np.repeat([0.0, 5.0], 20),
        approach=random.choice([-1.0, 1.0], (40, 6)),
        station=["a", "b"] * 20,
        temperature=295.0,
        extra={"order": np.arange(40.0)},
        extra_labels={"who": ["x", "y", "z", "w"] * 10},
        robot=robot,
    )


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (slice(5), range(5)),
        (slice(None, None, -1), range(39, -1, -1)),
        ([3, 1, -1], [3, 1, 39]),
        (7, [7]),
        (np.int64(-1), [39]),
    ],
)
def test_rows_are_chosen_as_numpy_does(data: Dataset, rows, expected) -> None:
    part = data[rows]
    np.testing.assert_array_equal(part.extra["order"], list(expected))
    np.testing.assert_array_equal(part.q, data.q[list(expected)])
    assert part.extra_labels["who"] == [data.extra_labels["who"][i] for i in expected]
    assert part.station_names == ("a", "b")


def test_a_mask_chooses_rows(data: Dataset) -> None:
    np.testing.assert_array_equal(data[data.payload > 0].extra["order"], np.arange(20, 40))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (np.ones(39, bool), r"a mask of rows must have shape \(40,\), got \(39,\)"),
        ([40], "rows must lie between 0 and 39"),
        ([0.5], "rows must be whole numbers, a mask or a slice"),
        (slice(0, 0), "none of the 40 rows is chosen"),
        (np.zeros(40, bool), "none of the 40 rows is chosen"),
    ],
)
def test_invalid_rows_are_refused(data: Dataset, rows, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        data[rows]


def test_a_loop_over_rows_ends(data: Dataset) -> None:
    assert sum(len(row) for row in data) == 40
    with pytest.raises(IndexError):
        data[40]


@pytest.mark.parametrize("by", ["random", "region"])
def test_a_split_shares_out_every_row_once_and_again_the_same(data: Dataset, by: str) -> None:
    fit, held = data.split(0.25, by=by, seed=3)
    assert (len(fit), len(held)) == (30, 10)
    both = np.concatenate([fit.extra["order"], held.extra["order"]])
    np.testing.assert_array_equal(np.sort(both), np.arange(40))
    np.testing.assert_array_equal(data.split(0.25, by=by, seed=3)[1].q, held.q)
    assert not np.array_equal(data.split(0.25, by=by, seed=4)[1].q, held.q)


def test_visits_of_a_posture_go_the_same_way() -> None:
    q = np.repeat(np.random.default_rng(1).uniform(-1, 1, (20, 3)), 3, axis=0)
    for held in (random_rows(q, 0.3, 0), region_rows(q, 0.3, 0)):
        visits = held.reshape(20, 3)
        assert (visits.all(axis=1) | ~visits.any(axis=1)).all()
        assert held.sum() == 18


def test_a_held_out_region_is_a_ball_of_joint_space() -> None:
    q = np.random.default_rng(2).uniform(-1, 1, (500, 4)) * [1, 2, 0.1, 3]
    held = region_rows(q, 0.1, 5)
    scaled = q / np.ptp(q, axis=0)
    # Some row of the region has all the others of the region nearer than any row outside.
    far = [np.linalg.norm(scaled[held] - row, axis=1).max() for row in scaled[held]]
    near = [np.linalg.norm(scaled[~held] - row, axis=1).min() for row in scaled[held]]
    assert (np.array(far) < np.array(near)).any()
    with pytest.raises(InvalidInput, match="one region of joint space"):
        region_rows(np.zeros((9, 3)), 0.3, 0)


def test_folds_differ_by_one_at_most_and_the_seed_decides_who_is_in_which() -> None:
    fold = deal(23, 5, np.random.default_rng(1))
    assert sorted(np.bincount(fold)) == [4, 4, 5, 5, 5]
    np.testing.assert_array_equal(fold, deal(23, 5, np.random.default_rng(1)))
    assert (fold != deal(23, 5, np.random.default_rng(2))).any()


@pytest.mark.parametrize("share", [0.0, 1.0, -1.0, float("nan")])
def test_a_share_that_leaves_nothing_is_refused(data: Dataset, share: float) -> None:
    with pytest.raises(InvalidInput, match="between 0 and 1"):
        data.split(share)
    with pytest.raises(InvalidInput, match="by must be one of random, region"):
        data.split(0.5, by="day")
    with pytest.raises(InvalidInput, match="two different postures"):
        data[[0, 0]].split(0.5)


def test_to_pandas_and_back(data: Dataset) -> None:
    robot = load_robot("ur5")
    frame = data.to_frame()
    assert list(frame.columns[:9]) == [*(f"q{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm"]
    back = Dataset.from_frame(frame.sample(frac=1, random_state=0).sort_values("order"), robot)
    for name in ("q", "position", "payload", "approach", "temperature", "station"):
        np.testing.assert_allclose(getattr(back, name), getattr(data, name), rtol=1e-14, atol=1e-15)
    assert back.extra_labels == data.extra_labels
    assert back.station_names == ("a", "b")


def test_a_table_without_units_is_refused_by_its_column(data: Dataset) -> None:
    with pytest.raises(InvalidInput, match=r"the table: .*q1_deg"):
        Dataset.from_frame(data.to_frame().rename(columns={"q1_deg": "q1"}), load_robot("ur5"))


def test_without_a_robot_the_joints_have_no_unit(data: Dataset) -> None:
    bare = Dataset.from_arrays(data.q, position=data.position)
    assert list(bare.to_frame().columns[:2]) == ["q1", "q2"]
    np.testing.assert_array_equal(bare.to_frame()["q1"], data.q[:, 0])
