# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Folds of poses, dealt out one by one or by stretches of the path along which they were measured."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.pose_folds import along_a_path, measuring_place, pose_folds
from fastcal.measurements.dataset import Dataset

FOLDS = 5


def path(rows: int = 300) -> Dataset:
    return Dataset.from_arrays(np.linspace(0, 1, rows)[:, np.newaxis] * np.array([1.0, 0.3, 0.0]))


def folds(data: Dataset, seed: int = 0) -> NDArray[np.intp]:
    return pose_folds(data, FOLDS, np.random.default_rng(seed))


def test_poses_along_a_path_are_told_from_poses_in_any_order() -> None:
    assert along_a_path(path())
    assert not along_a_path(Dataset.from_arrays(np.random.default_rng(6).uniform(-1, 1, (200, 6))))
    assert not along_a_path(Dataset.from_arrays(np.zeros((20, 2))))
    assert not along_a_path(Dataset.from_arrays(np.zeros((1, 2))))


def test_along_a_path_stretches_are_held_out_from_all_along_it() -> None:
    fold = folds(path())
    assert np.count_nonzero(np.diff(fold)) >= 10
    assert np.mean(fold[5:] == fold[:-5]) > 0.7
    np.testing.assert_array_equal(np.bincount(fold), 60)


def test_the_time_says_in_which_order_the_poses_were_measured() -> None:
    turn = np.random.default_rng(3).permutation(300)
    data = replace(path(), time=np.argsort(turn).astype(float))
    np.testing.assert_array_equal(measuring_place(data)[turn], np.arange(300))
    fold = folds(data)[turn]  # in any order: dealt out one by one
    assert np.mean(fold[5:] == fold[:-5]) < 0.4


def test_all_visits_of_a_pose_are_in_one_fold_with_the_stretch_of_the_first() -> None:
    once, again = path(100), path(100)
    data = Dataset.from_arrays(np.vstack([once.q, again.q[::-1]]))
    fold = folds(data)
    np.testing.assert_array_equal(fold[:100], fold[100:][::-1])
    np.testing.assert_array_equal(fold[:100], folds(once))


def test_a_short_path_still_fills_every_fold() -> None:
    np.testing.assert_array_equal(np.unique(folds(path(FOLDS))), np.arange(FOLDS))
    assert (folds(path()) != folds(path(), seed=1)).any()


def folds_of_postures(postures: int) -> NDArray[np.intp]:
    """(postures, 4) folds of postures under four payloads, measured in any order."""
    random = np.random.default_rng(8)
    q, turn = random.uniform(-1, 1, (postures, 3)), random.permutation(4 * postures)
    data = Dataset.from_arrays(np.repeat(q, 4, axis=0)[turn], payload=np.tile([0.0, 2.0, 4.0, 6.0], postures)[turn])
    return folds(data)[np.argsort(turn)].reshape(postures, 4)


def test_a_posture_is_held_out_under_all_its_payloads() -> None:
    fold = folds_of_postures(40)
    np.testing.assert_array_equal(fold, fold[:, :1].repeat(4, axis=1))


def test_of_few_postures_poses_are_held_out() -> None:
    fold = folds_of_postures(10)
    assert (fold != fold[:, :1]).any()
    np.testing.assert_array_equal(np.bincount(fold.ravel()), 8)
