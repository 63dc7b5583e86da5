# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The search over sets of columns, against lstsq of every set and fold."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import InvalidInput, _core

Array = NDArray[np.float64]


def problem(
    seed: int, rows: int, kept: int, optional: int, folds: int
) -> tuple[Array, Array, Array, NDArray[np.int32]]:
    """Columns of very different sizes that lean on each other, r of some of them and noise, folds of unlike sizes."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((rows, kept + optional)) @ rng.standard_normal((kept + optional, kept + optional))
    columns *= 10.0 ** rng.uniform(-4, 4, kept + optional)
    wanted = rng.integers(0, 2, kept + optional) / np.linalg.norm(columns, axis=0)
    r = 10 * columns @ wanted + rng.standard_normal(rows)
    fold = np.concatenate([np.arange(folds), rng.integers(0, folds, rows - folds)]).astype(np.int32)
    return columns[:, :kept], columns[:, kept:], r, fold


def by_lstsq(kept: Array, optional: Array, r: Array, fold: NDArray[np.int32]) -> tuple[Array, Array]:
    """Mean and standard error over the folds of the mean squared error held out; sets in the order of their bits."""
    sets = [bits[::-1] for bits in product([False, True], repeat=optional.shape[1])]
    mse = np.empty((len(sets), fold.max() + 1))
    for s, chosen in enumerate(sets):
        J = np.column_stack([kept, optional[:, np.array(chosen, dtype=bool)]])
        sizes = np.linalg.norm(J, axis=0)
        J = J / np.where(sizes > 0, sizes, 1)
        for k in range(mse.shape[1]):
            b = np.linalg.lstsq(J[fold != k], r[fold != k], rcond=1e-9)[0]
            mse[s, k] = np.mean((r[fold == k] - J[fold == k] @ b) ** 2)
    return mse.mean(axis=1), mse.std(axis=1, ddof=1) / np.sqrt(mse.shape[1])


@pytest.mark.parametrize(
    ("seed", "rows", "kept", "optional", "folds"),
    [(0, 40, 3, 6, 4), (1, 60, 0, 8, 10), (2, 30, 5, 1, 3), (3, 25, 1, 7, 25), (4, 300, 9, 5, 2), (5, 12, 2, 0, 3)],
)
def test_every_set_is_what_lstsq_makes_of_it(seed: int, rows: int, kept: int, optional: int, folds: int) -> None:
    given = problem(seed, rows, kept, optional, folds)
    mean, standard_error = by_lstsq(*given)
    found = _core.SubsetSearch(*given).all()
    np.testing.assert_allclose(found.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(found.standard_error, standard_error, rtol=1e-8)


def test_sets_given_one_by_one_are_those_of_the_walk() -> None:
    kept, optional, r, fold = problem(6, 50, 4, 6, 5)
    search = _core.SubsetSearch(kept, optional, r, fold)
    index = np.arange(2**6)
    sets = (index[:, None] >> np.arange(6)) & 1 == 1
    np.testing.assert_allclose(search.of(sets).mean, search.all().mean, rtol=1e-12)
    np.testing.assert_allclose(search.of(sets).standard_error, search.all().standard_error, rtol=1e-11)
    np.testing.assert_array_equal(search.of(sets[::-1]).mean, search.of(sets).mean[::-1])


def test_a_column_in_the_span_of_others_changes_nothing() -> None:
    """Column 0 is in the span of the kept, 3 in that of 1 and 2, 4 is zero: sets that differ by them tie to the bit."""
    kept, optional, r, fold = problem(7, 60, 3, 6, 5)
    optional = optional.copy()
    optional[:, 0] = kept @ [1.0, -2.0, 0.5]
    sizes = np.linalg.norm(optional, axis=0)
    optional[:, 3] = 3 * optional[:, 1] - sizes[1] / sizes[2] * optional[:, 2]
    optional[:, 4] = 0
    found = _core.SubsetSearch(kept, optional, r, fold).all()
    np.testing.assert_allclose(found.mean, by_lstsq(kept, optional, r, fold)[0], rtol=1e-8)
    index = np.arange(2**6)
    np.testing.assert_array_equal(found.mean[index], found.mean[index & ~0b010001])
    both = index[(index & 0b110) == 0b110]
    np.testing.assert_array_equal(found.mean[both], found.mean[both & ~0b1000])


def test_kept_columns_may_repeat_each_other() -> None:
    kept, optional, r, fold = problem(8, 60, 3, 4, 5)
    twice = np.column_stack([kept, 1e6 * kept[:, 0], kept @ [1.0, 1.0, -1.0], np.zeros(60)])
    found = _core.SubsetSearch(twice, optional, r, fold).all()
    np.testing.assert_allclose(found.mean, _core.SubsetSearch(kept, optional, r, fold).all().mean, rtol=1e-9)


def test_a_column_seen_in_one_fold_alone_stays_at_zero_there() -> None:
    """The other folds can't tell its coefficient: held out, it is 0, as in the solution of least norm."""
    kept, optional, r, fold = problem(9, 60, 2, 4, 5)
    optional = np.where((np.arange(4) == 2)[None] & (fold != 3)[:, None], 0.0, optional)
    found = _core.SubsetSearch(kept, optional, r, fold).all()
    np.testing.assert_allclose(found.mean, by_lstsq(kept, optional, r, fold)[0], rtol=1e-9)


def test_rows_without_a_fold_are_always_fitted() -> None:
    """Priors: two rows that hold the first optional column and the first kept one."""
    kept, optional, r, fold = problem(14, 40, 2, 4, 5)
    weight = 3 * np.linalg.norm(optional[:, 0])
    kept, optional = np.vstack([kept, np.zeros((2, 2))]), np.vstack([optional, np.zeros((2, 4))])
    optional[-2, 0] = weight
    kept[-1, 0] = weight
    r, fold = np.append(r, [0.5, -0.3]), np.append(fold, np.int32([-1, -1]))
    found = _core.SubsetSearch(kept, optional, r, fold).all()
    np.testing.assert_allclose(found.mean, by_lstsq(kept, optional, r, fold)[0], rtol=1e-9)


def test_more_columns_than_rows_give_numbers() -> None:
    given = problem(10, 9, 4, 8, 3)
    found = _core.SubsetSearch(*given).all()
    assert np.isfinite(found.mean).all()
    assert np.isfinite(found.standard_error).all()


def test_least_norm_holds_what_the_data_hardly_tell() -> None:
    """Column 1 leaves 0.05 when column 0 is in: with 0.1 asked for, it counts alone but not on top of column 0."""
    rng = np.random.default_rng(11)
    Q = np.linalg.qr(rng.standard_normal((40, 2)))[0]
    fold = (np.arange(40) % 4).astype(np.int32)
    columns = np.column_stack([Q[:, 0], Q[:, 0] + 0.05 * Q[:, 1]])
    r = columns @ [1.0, 40.0] + 0.01 * rng.standard_normal(40)
    free = _core.SubsetSearch(np.zeros((40, 0)), columns, r, fold).all().mean
    held = _core.SubsetSearch(np.zeros((40, 0)), columns, r, fold, least_norm=0.1).all().mean
    np.testing.assert_array_equal(held[:3], free[:3])
    assert held[3] == free[1]
    assert free[3] < 0.01 * free[1]


def test_a_perfect_fit_is_never_below_zero() -> None:
    kept, optional, _, fold = problem(12, 50, 2, 4, 5)
    found = _core.SubsetSearch(kept, optional, optional[:, 0] + kept[:, 1], fold).all()
    assert (found.mean >= 0).all()
    assert found.mean[1] <= 1e-14 * found.mean[0]


def test_bad_input_is_refused_in_a_sentence() -> None:
    kept, optional, r, fold = problem(13, 20, 2, 3, 4)
    with pytest.raises(InvalidInput, match="fold 1 has no rows"):
        _core.SubsetSearch(kept, optional, r, np.where(fold == 1, 2, fold))
    with pytest.raises(InvalidInput, match="two folds or more"):
        _core.SubsetSearch(kept, optional, r, np.zeros_like(fold))
    with pytest.raises(InvalidInput, match="as many rows, got 20, 19, 20 and 20"):
        _core.SubsetSearch(kept, optional[:19], r, fold)
    with pytest.raises(InvalidInput, match="must be finite"):
        _core.SubsetSearch(kept, optional, np.where(fold == 1, np.nan, r), fold)
    with pytest.raises(InvalidInput, match="sets must have 3 columns, got 2"):
        _core.SubsetSearch(kept, optional, r, fold).of(np.zeros((1, 2), dtype=bool))
    with pytest.raises(InvalidInput, match="at most 24 columns, got 25"):
        _core.SubsetSearch(kept, np.zeros((20, 25)), r, fold).all()


def test_many_columns_and_no_row_that_is_always_fitted() -> None:
    random = np.random.default_rng(5)
    kept, optional, r = random.normal(size=(900, 45)), random.normal(size=(900, 10)), random.normal(size=900)
    fold = (np.arange(900) % 3).astype(np.int32)
    sets = np.array([np.zeros(10, dtype=bool), np.ones(10, dtype=bool)])
    found = _core.SubsetSearch(kept, optional, r, fold).of(sets).mean
    for error, J in zip(found, (kept, np.hstack([kept, optional])), strict=True):
        squares = []
        for k in range(3):
            out = fold == k
            b = np.linalg.lstsq(J[~out], r[~out], rcond=None)[0]
            squares.append(np.mean((r[out] - J[out] @ b) ** 2))
        assert error == pytest.approx(np.mean(squares), rel=1e-9)
