# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The core's score tests beside a statistics library's."""

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import special, stats

from fastcal import InvalidInput, _core
from fastcal.diagnosis.tail_probabilities import p_values

SIZES = [1, 3, 2]


@pytest.mark.parametrize("seed", range(5))
def test_the_statistics_are_those_of_the_score_test_of_an_omitted_variable(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = random.standard_normal((90, 6)) * 10.0 ** random.uniform(-6, 3, 6)
    C = random.standard_normal((90, 6)) @ random.standard_normal((6, 6))
    r = random.standard_normal(90) + 0.3 * C[:, 1]
    tests = _core.ScoreTests(A, C, r, SIZES)
    fit = sm.GLM(r, A / np.linalg.norm(A, axis=0)).fit(scale=1.0)
    assert tests.remaining == pytest.approx(fit.deviance, rel=1e-9)
    for i, first in enumerate((0, 1, 4)):
        peer = fit.score_test(exog_extra=C[:, first : first + SIZES[i]])
        assert tests.scores.rank[i] == peer.k_constraint
        assert tests.scores.statistic[i] == pytest.approx(float(peer.statistic[0]), rel=1e-9)
        p = p_values(np.asarray(tests.scores.statistic), np.asarray(tests.scores.rank), np.inf)[i]
        assert p == pytest.approx(float(peer.pvalue[0]), rel=1e-7)


def test_whole_sets_are_those_of_least_squares() -> None:
    random = np.random.default_rng(9)
    A, C, r = random.standard_normal((50, 4)), random.standard_normal((50, 6)), random.standard_normal(50)
    tests = _core.ScoreTests(A, C, r, SIZES)
    both = sm.OLS(r, np.hstack([A, C[:, :4]])).fit()
    left, rank = tests.remaining_with([0, 1])
    assert left == pytest.approx(both.ssr, rel=1e-11)
    assert rank == 4
    more = sm.OLS(r, np.hstack([A, C])).fit()
    given = tests.given([1, 0])
    assert given.statistic[2] == pytest.approx(both.ssr - more.ssr, rel=1e-9)
    assert list(given.rank) == [0, 0, 2]
    single = sm.OLS(r, np.hstack([A, C[:, 1:4]])).fit()
    np.testing.assert_allclose(tests.estimate[1:4], single.params[4:], rtol=1e-10)
    np.testing.assert_allclose(tests.deviation[1:4], single.bse[4:] / np.sqrt(single.scale), rtol=1e-10)


def test_of_an_estimated_noise_the_test_is_f() -> None:
    p = p_values(np.array([9.0, 12.0, 0.0]), np.array([1, 3, 0], dtype=np.int32), 40.0)
    np.testing.assert_allclose(p, [stats.f.sf(9.0, 1, 40), stats.f.sf(4.0, 3, 40), 1.0], rtol=1e-12)


@pytest.mark.parametrize("rank", [1, 2, 6])
def test_what_is_detectable_of_one_block_follows_the_noncentral_law(rank: int) -> None:
    """P(chi2_k(lambda) > limit) = 0.8; 4000 draws know the root to 0.05."""
    random = np.random.default_rng(rank)
    A, C = random.standard_normal((60, 5)), random.standard_normal((60, rank))
    limit = stats.chi2.isf(1e-3, rank)
    tests = _core.ScoreTests(A, C, np.zeros(60), [rank])
    roots = tests.detectable(list(range(rank)), np.array([limit]), draws=4000)
    wanted = special.chndtrinc(limit, rank, 0.2)
    np.testing.assert_allclose(roots, np.sqrt(wanted), atol=0.08)


def test_a_block_that_looks_alike_makes_more_detectable_and_an_absorbed_column_nothing() -> None:
    random = np.random.default_rng(3)
    A, c = random.standard_normal((60, 5)), random.standard_normal((60, 1))
    alike = c + 0.3 * random.standard_normal((60, 1))
    tests = _core.ScoreTests(A, np.hstack([c, alike, A[:, :1]]), np.zeros(60), [1, 1, 1])
    limit = np.full(3, stats.chi2.isf(1e-3, 1))
    both = tests.detectable([0, 2], limit, draws=2000)
    alone = tests.detectable([0], np.array([limit[0], np.inf, np.inf]), draws=2000)
    assert both[0] < alone[0] - 0.05
    assert np.isinf(both[1])
    with pytest.raises(InvalidInput, match="limits must hold 3 numbers"):
        tests.detectable([0], limit[:2])


def test_of_many_blocks_one_passes_its_limit_four_times_in_five() -> None:
    """By own noise, over blocks that are alike, hardly alike and louder than their limits allow."""
    random = np.random.default_rng(5)
    A, sizes = random.standard_normal((60, 5)), [1, 3, 2, 4, 1, 6, 2, 1]
    C = random.standard_normal((60, sum(sizes)))
    C[:, 6:10] += 3 * C[:, :1]
    C[:, 10] += 0.5 * C[:, 1]
    limits = np.array([stats.chi2.isf(1e-3 if size < 6 else 0.1, size) for size in sizes])
    tests = _core.ScoreTests(A, C, np.zeros(60), sizes)
    Q = np.linalg.qr(A)[0]
    left = C - Q @ (Q.T @ C)
    ends = np.cumsum(sizes)
    bases = [np.linalg.qr(left[:, end - size : end])[0] for end, size in zip(ends, sizes, strict=True)]
    noise = random.standard_normal((5000, 60))
    for column, root in enumerate(tests.detectable(list(range(C.shape[1])), limits, draws=4000)):
        heard = noise + root * left[:, column] / np.linalg.norm(left[:, column])
        passed = [((heard @ basis) ** 2).sum(axis=1) > limit for basis, limit in zip(bases, limits, strict=True)]
        assert np.any(passed, axis=0).mean() == pytest.approx(0.8, abs=0.03), column


def test_sizes_that_do_not_add_up_are_refused() -> None:
    with pytest.raises(InvalidInput, match="add up to the 6 columns"):
        _core.ScoreTests(np.ones((9, 1)), np.ones((9, 6)), np.ones(9), [1, 3])
