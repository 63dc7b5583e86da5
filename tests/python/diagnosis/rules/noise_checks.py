# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How large the noise is, and which rows are wrong."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from fastcal.calibration.pose_folds import along_a_path
from fastcal.diagnosis import diagnose, memory, noise, robust_rows, scattered_rows
from fastcal.diagnosis.blocks import columns_at
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.noise import RichFit
from fastcal.diagnosis.problem import Noise
from fastcal.diagnosis.slow_motion import SlowMotion, slow_motions
from fastcal.diagnosis.words import noise_doubts
from fastcal.measurements.dataset import Dataset

from . import small_arm
from .mutants import falls_with

POINTS = 120
NONE = np.zeros(0, dtype=np.intp)


def points(wrong: dict[int, float], seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, right side and rows of points (three numbers each) of noise 1, some of them off along x."""
    random = np.random.default_rng(seed)
    X, r = random.standard_normal((3 * POINTS, 8)), random.standard_normal(3 * POINTS)
    r += X @ random.standard_normal(8)
    for row, size in wrong.items():
        r[3 * row] += size
    return X / np.linalg.norm(X, axis=0), r, np.repeat(np.arange(POINTS), 3)


@falls_with(ALPHA_OUTLIER=1e-60)
@falls_with(ALPHA_OUTLIER=0.9999)
def rows_that_noise_does_not_make_are_outliers() -> None:
    assert list(robust_rows.without_outliers(*points({7: 9.0, 50: -12.0})).wrong) == [7, 50]
    assert all(list(robust_rows.without_outliers(*points({}, seed)).wrong) == [] for seed in range(2, 7))


@falls_with(TUKEY_SIZE=1e9)
@falls_with(TUKEY_SIZE=0.5)
@falls_with(SUSPECT_WEIGHT=-1.0)
@falls_with(SUSPECT_WEIGHT=1.0)
def suspects_are_the_gross_rows() -> None:
    assert list(robust_rows.suspects(*points({7: 15.0, 50: -12.0}))) == [7, 50]


def group(size: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows 0 to 4 are off together, along a column that they share with six good rows alone."""
    X, r, row = points({}, seed)
    lever = np.zeros(len(r))
    lever[:33:3] = 1 / np.sqrt(11)
    r[:15:3] += size
    return np.column_stack([X, lever]), r, row


@falls_with(HUBER_SIZE=1e9)
def gross_rows_do_not_mask_each_other() -> None:
    found = [len(set(robust_rows.suspects(*group(10.0, seed))) & set(range(5))) for seed in range(8)]
    assert np.mean(found) > 4.5


@falls_with(NOISE_ROUNDS=1)
def good_rows_that_gross_ones_pull_at_are_no_suspects() -> None:
    assert all(set(robust_rows.suspects(*group(20.0, seed))) == set(range(5)) for seed in range(8))


@falls_with(MAX_OUTLIER_SHARE=1.0)
@falls_with(MAX_OUTLIER_SHARE=0.0)
def one_row_of_twenty_may_be_an_outlier() -> None:
    row = np.repeat(np.arange(POINTS), 3)
    size = np.arange(POINTS, dtype=float)
    assert list(robust_rows._largest(np.arange(60, POINTS), size, row)) == [114, 115, 116, 117, 118, 119]


def scattered(seed: int, gross: int = 6) -> Dataset:
    """Forty rows of an arm whose second gear is wrong, some of them off by 1.5 mm."""
    ratio = {"effect": "reduction_ratio", "owner": "joint2", "parameters": {"error": 6e-4}}
    data = small_arm.measured([ratio], rows=40, seed=seed)
    assert data.position is not None
    random = np.random.default_rng(seed)
    off, turn = random.choice(40, gross, replace=False), random.standard_normal((gross, 3))
    position = data.position.copy()
    position[off] += 1.5e-3 * turn
    return replace(data, position=position)


@falls_with(MAX_SCATTERED_SHARE=0.0)
@falls_with(SCATTERED_NOISE=0.0)
def gross_rows_of_a_small_set_hide_no_effect() -> None:
    assert [f.effect for f in diagnose(small_arm.arm(), scattered(3)).effects] == ["reduction_ratio"]


def beside(data: Dataset, *names: tuple[str, str]) -> SimpleNamespace:
    """What is found with these names."""
    problem = small_arm.problem(data)
    added = [name for name in problem.names if name.key in names]
    return SimpleNamespace(model=SimpleNamespace(fit=fit(problem, added)))


@falls_with(MAY_HIDE=0.0)
@falls_with(MAY_HIDE=2.0)
def rows_that_an_effect_puts_off_are_no_noise() -> None:
    """A robust fit of the geometry alone leaves them out; with the effect the others fit no better without them."""
    data = scattered(4, gross=0)
    rows = scattered_rows.scattered_rows(small_arm.arm(), data)
    assert rows
    assert not scattered_rows.may_hide(beside(data, ("reduction_ratio", "joint2")), rows)
    gross = scattered(3)
    assert scattered_rows.may_hide(beside(gross), scattered_rows.scattered_rows(small_arm.arm(), gross))


@falls_with(SCATTERED_NOISE=0.0)
@falls_with(SCATTERED_NOISE=2.0)
@falls_with(CALMER=0.1)
@falls_with(CALMER=2.0)
def noise_that_hid_an_effect_is_far_less_without_its_rows() -> None:
    """And an effect that no name explains passes for noise neither with its rows nor without."""
    model = beside(small_arm.measured([])).model

    def found(sigma: float, left: float = 1.0) -> SimpleNamespace:
        noise = replace(model.fit.problem.noise, factor=1.0 / left)
        at = fit(replace(model.fit.problem, noise=noise), [])
        return SimpleNamespace(level=SimpleNamespace(sigma=sigma), few="", model=SimpleNamespace(fit=at))

    assert scattered_rows.are_noise(found(1.0), found(0.3))
    assert not scattered_rows.are_noise(found(1.0), found(0.8))
    assert not scattered_rows.are_noise(found(1.0, left=4.0), found(0.98))


@falls_with(OUTLIER_RUN=1)
@falls_with(OUTLIER_RUN=100)
def rows_that_are_off_one_after_the_other_have_moved() -> None:
    q = np.random.default_rng(2).uniform(size=(POINTS, 1))
    data = Dataset.from_arrays(q, time=np.arange(POINTS) * 1.0)
    wrong = np.array([3, 4, 5, 40, 41, 42, 43, 44, 80])
    assert list(noise.isolated_rows(wrong, data)) == [3, 4, 5, 80]


@falls_with(ALPHA_POSTURE=1e-30)
@falls_with(ALPHA_POSTURE=1e6)
def rows_that_share_a_posture_are_no_outliers() -> None:
    """Findings R5: five of 120 rows within a tenth of a joint's way are an effect; five anywhere are outliers."""
    q = np.linspace(0.0, 1.0, POINTS)[:, np.newaxis]
    data = Dataset.from_arrays(q)
    assert list(noise.isolated_rows(np.array([40, 42, 44, 46, 49]), data)) == []
    assert list(noise.isolated_rows(np.array([4, 32, 54, 76, 99]), data)) == [4, 32, 54, 76, 99]


@falls_with(ALPHA_NOISE=1e-30)
@falls_with(ALPHA_NOISE=0.99)
def a_claim_is_wrong_where_chance_makes_it_so_in_one_of_a_hundred() -> None:
    """Of 300 degrees of freedom, chi square / 300 lies between 0.80 and 1.22 in 99 of 100."""
    left = [RichFit(NONE, NONE, np.full(300, np.sqrt(ms)), np.ones(300)) for ms in (0.75, 0.85, 1.15, 1.28)]
    assert list(map(noise._agreement, left)) == [-1, 0, 0, 1]


@falls_with(ALPHA_MEMORY=1e-12)
@falls_with(ALPHA_MEMORY=0.5)
def rows_err_alike_where_chance_makes_them_so_in_one_of_a_hundred() -> None:
    every = np.arange(320)
    problem = SimpleNamespace(data=Dataset.from_arrays(np.zeros((320, 1))), rows=every, stays=every)
    for slow, has_memory in ((40, False), (160, True)):  # 1 and 4 standard deviations
        r = np.r_[np.tile([1.0, 1, 1, 1, -1, -1, -1, -1], slow // 8), np.tile([1.0, 1, -1, -1], (320 - slow) // 4)]
        assert (memory.memory(problem, np.ones((320, 1)), r, np.arange(320), NONE) > 0) == has_memory


@falls_with(NEAR_STEPS=0.0)
@falls_with(NEAR_STEPS=10.0)
def poses_along_a_path_are_told_from_poses_in_any_order() -> None:
    q = np.random.default_rng(6).uniform(-1, 1, (200, 6))
    assert not along_a_path(Dataset.from_arrays(q), memory.NEAR_STEPS)
    path = np.linspace(0, 1, 200)[:, np.newaxis] * np.array([1.0, 0.3, 0.0])
    assert along_a_path(Dataset.from_arrays(path), memory.NEAR_STEPS)
    assert not along_a_path(Dataset.from_arrays(np.zeros((20, 2))), memory.NEAR_STEPS)


def small_set(error: np.ndarray) -> Dataset:
    """Rows of a small arm, measured with `error` (N, 3) [sigma]."""
    data = small_arm.measured([], rows=len(error), time=20.0 * np.arange(len(error)))
    assert data.position is not None
    return replace(data, position=data.position + small_arm.SIGMA * error)


def knocked() -> Dataset:
    """Ten rows of 80 lie elsewhere by six times the noise."""
    return small_set(6.0 * np.isin(np.arange(80), np.arange(30, 40))[:, np.newaxis] * np.array([0.6, 0.8, 0.0]))


def motions(data: Dataset) -> list[SlowMotion]:
    at = fit(small_arm.problem(data), [])
    return slow_motions(at, at.whitened[0], NONE, columns_at(at).frames).found


@falls_with(SLOW_MOTION_BIC=1e9)
@falls_with(SLOW_MOTION_BIC=-1e9)
def a_block_of_rows_is_no_noise_and_noise_with_a_memory_is_no_block() -> None:
    found = [set(motion.block) for motion in motions(knocked())]
    assert found == [set(range(30, 40))]
    e = 3.0 * np.random.default_rng(2).standard_normal((80, 3))
    for k in range(1, len(e)):
        e[k] = 0.7 * e[k - 1] + np.sqrt(1 - 0.7**2) * e[k]
    assert motions(small_set(e)) == []


@falls_with(MAX_MOVED_SHARE=0.05)
def rows_that_lie_off_together_are_left_out_where_they_are_few() -> None:
    assert len(set(diagnose(small_arm.arm(), knocked()).outliers) ^ set(range(30, 40))) <= 2


@falls_with(STRONG_MEMORY=0.1)
@falls_with(STRONG_MEMORY=0.95)
def noise_that_is_strongly_correlated_may_hide_something() -> None:
    assert [len(noise_doubts(0.0, rho)) for rho in (0.0, 0.3, 0.8)] == [0, 0, 1]


@falls_with(TOGETHER=0.01)
@falls_with(TOGETHER=1.5)
def a_shift_is_told_from_rows_that_scatter() -> None:
    scattered = 1e-3 * np.random.default_rng(5).standard_normal((12, 3))
    assert noise._how_far(scattered) == "are far off"
    assert "are all off by about the same 2 mm" in noise._how_far(np.tile([0.0, 0.0, 2e-3], (12, 1)) + 0.1 * scattered)
    assert noise._how_far(np.full((3, 3), np.nan)) == "are far off"


def visits(poses: int, count: int, rise: float, sigma: float = 2e-5) -> Dataset:
    """Poses measured `count` times, each time 3 K warmer and `rise` [m] further."""
    random = np.random.default_rng(4)
    q = np.tile(random.uniform(-1, 1, (poses, 2)), (count, 1))
    warm = np.repeat(np.arange(count), poses)
    position = np.tile(random.uniform(-1, 1, (poses, 3)), (count, 1)) + rise * warm[:, np.newaxis]
    position += sigma * random.standard_normal(position.shape)
    return Dataset.from_arrays(q, position=position, temperature=20.0 + 3.0 * (warm // 2))


@falls_with(REPEAT_TEMPERATURE=100.0)
def warmer_visits_are_no_repeats() -> None:
    data = visits(60, 4, 0.0)
    assert data.position is not None
    grown = data.position + 1e-4 * (np.asarray(data.temperature)[:, np.newaxis] - 20.0)
    sigma, freedom = noise.repeats(Dataset.from_arrays(data.q, position=grown, temperature=data.temperature))
    assert freedom == 60 * 2 * 3
    assert abs(sigma / 2e-5 - 1) < 0.15


@falls_with(MIN_REPEAT_FREEDOM=0)
@falls_with(MIN_REPEAT_FREEDOM=1000)
def few_repeats_do_not_determine_the_noise() -> None:
    points = small_arm.problem(small_arm.measured([])).measured
    rich = RichFit(NONE, NONE, np.ones(300), np.ones(300))
    for poses, is_enough in ((4, False), (20, True)):
        data = visits(poses, 2, 0.0)
        problem = SimpleNamespace(noise=Noise((2e-5, 1e-4, 2e-5)), data=data, measured=points)
        assert (noise._from_repeats(problem, rich, data, None) is not None) == is_enough


@falls_with(MIN_REDUNDANCY=0.0)
@falls_with(MIN_REDUNDANCY=1.0)
def what_a_row_is_off_is_seen_as_far_as_the_others_leave_it_to_chance() -> None:
    """Of one number a row: e^2 / (1 - h), the externally studentized square but for its scale; 0 where h = 1."""
    random = np.random.default_rng(5)
    X = np.vstack([random.standard_normal((30, 2)), [[6.0, 0.0]]])
    X = np.column_stack([X, np.eye(31)[:, 3]])  # row 3 has a column of its own
    r = random.standard_normal(31)
    Q = np.linalg.qr(X)[0]
    h = np.sum(Q**2, axis=1)
    left = r - Q @ (Q.T @ r)
    left[3] = 1e-9  # rounding
    with np.errstate(divide="ignore", invalid="ignore"):
        square, _ = robust_rows.Leverage(Q, np.arange(31)).studentized(left, None, NONE)
    wanted = left**2 / (1 - h + (h > 1 - 1e-9))
    np.testing.assert_allclose(np.delete(square, 3), np.delete(wanted, 3), rtol=1e-9)
    assert square[3] < 1e-9


@falls_with(RIDGE=1.0)
def the_ridge_of_the_rich_model_does_not_shrink_it() -> None:
    X, r, _ = points({})
    wanted = r - X @ np.linalg.lstsq(X, r, rcond=None)[0]
    Z = robust_rows.ridged_basis(X)
    np.testing.assert_allclose(r - Z @ (Z.T @ r), wanted, atol=1e-6)
