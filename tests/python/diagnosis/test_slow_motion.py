# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A base that drifts, or was knocked and put back, is no noise with a memory."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, calibrate, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.many_rows import all_moved
from fastcal.diagnosis.noise import moved_together, with_estimated_noise
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.slow_motion import SlowMotion, _Blocks
from fastcal.measurements.dataset import Dataset
from fastcal.report.diagnosis_steps import next_steps

from .plain_cobot import in_full

FloatArray = NDArray[np.float64]

SIGMA = 5e-5  # [m]
ROWS = 150
BLOCK = range(50, 73)
TIME = 20.0 * np.arange(ROWS)


@cache
def arm() -> Robot:
    return load_robot("ur10e")


def exact(seed: int, time: FloatArray | None = TIME) -> Dataset:
    """Points without noise."""
    poses = Dataset.from_arrays(random_poses(arm(), ROWS, seed=seed), robot=arm(), time=time)
    return simulate(perturbed(arm(), seed=seed), poses, noise=1e-12, seed=seed)


def moved(way: FloatArray, seed: int, time: FloatArray | None = TIME) -> Dataset:
    """White noise, and the base moved along one direction by `way` (ROWS,) [m]."""
    random = np.random.default_rng(seed)
    data = exact(seed, time)
    assert data.position is not None
    along = random.standard_normal(3)
    shift = way[:, np.newaxis] * along / np.linalg.norm(along)
    return replace(data, position=data.position + shift + SIGMA * random.standard_normal((ROWS, 3)))


def knocked(size: float) -> FloatArray:
    return size * SIGMA * np.isin(np.arange(ROWS), BLOCK)


def off(model: Robot, seed: int) -> float:
    """RMS distance of a model's points from those without noise [m]."""
    data = exact(seed)
    assert data.position is not None
    return float(np.sqrt(np.mean(np.sum((model.poses(data)[:, :3, 3] - data.position) ** 2, axis=1))))


@pytest.mark.parametrize(("size", "seed"), [(3.0, 1), *in_full((6.0, 2)), (15.0, 3)])
def test_a_base_that_was_knocked_and_put_back_is_told_and_bends_no_model(size: float, seed: int) -> None:
    data = moved(knocked(size), seed)
    found = diagnose(arm(), data)
    assert (found.verdict, found.effects) == ("none", [])
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.15)
    assert found.search.problem.noise.memory == 0
    assert len(set(found.outliers) ^ set(BLOCK)) <= 4
    assert any("one after the other and are all off by about the same" in note for note in found.notes)
    first = ", ".join(map(str, found.outliers[:5]))
    left_out = f"but {len(found.outliers)} rows that nothing explains were left out ({first} and "
    assert left_out in found.sentence
    assert off(found.model, seed) < 1.1 * off(calibrate(arm(), data).model, seed)


@pytest.mark.parametrize(("size", "seed"), [(6.0, 4), pytest.param(15.0, 5, marks=pytest.mark.full)])
def test_a_base_that_drifts_and_comes_back_remains_to_be_found(size: float, seed: int) -> None:
    found = diagnose(arm(), moved(size * SIGMA * np.sin(np.pi * np.arange(ROWS) / ROWS), seed))
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert (found.unexplained.owner, found.unexplained.depends_on) == ("base", ("time_s",))
    assert found.search.problem.noise.memory == 0
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.1)


def test_without_times_a_block_is_told_and_a_drift_stays_in_the_noise() -> None:
    assert set(estimated(moved(knocked(6.0), 1, time=None)).moved) <= set(BLOCK)
    level = estimated(moved(15 * SIGMA * np.sin(np.pi * np.arange(ROWS) / ROWS), 1, time=None))
    assert level.moved == ()
    assert level.noise.memory > 0.5


def test_without_times_what_jumped_is_named_by_its_row() -> None:
    """A bolt that came loose."""
    data = moved(20 * SIGMA * (np.arange(ROWS) > 80), 3, time=None)
    found = diagnose(arm(), data)
    assert [(f.label, f.grade) for f in found.effects] == [("base_step@base", "A")]
    assert found.effects[0].parameters["at_row"].value == 81
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.1)
    (entry,) = found.model.spec["effects"]
    assert entry["rows"] == ROWS
    again = calibrate(found.model, data)  # the rows of the file that it was fitted to
    assert again.train.after is not None
    assert 1e3 * again.train.after.rms == pytest.approx(found.gap[-1].train_rms_mm, rel=0.02)


def test_without_times_what_drifts_is_unexplained_and_no_noise() -> None:
    """No effect can have it, and it must not be none for that."""
    found = diagnose(arm(), moved(60 * SIGMA * np.arange(ROWS) / ROWS, 3, time=None))
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert (found.unexplained.owner, found.unexplained.depends_on) == ("base", ("order",))
    assert "depends on the order of measuring" in found.sentence
    assert found.unexplained.share > 0.3
    assert any("with a column time_s a step or a drift can be named" in step for step in next_steps(found))


def remembering(rho: float, seed: int) -> FloatArray:
    """(ROWS, 3) noise of deviation 1 with a memory."""
    e = np.random.default_rng(seed).standard_normal((ROWS, 3))
    for k in range(1, ROWS):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return e


def test_a_drift_beside_noise_with_a_memory_is_added() -> None:
    data = exact(8)
    assert data.position is not None
    way = 40 * SIGMA * np.sin(np.pi * np.arange(ROWS) / ROWS)[:, np.newaxis] * [0.6, 0.0, 0.8]
    found = diagnose(arm(), replace(data, position=data.position + way + SIGMA * remembering(0.7, 8)))
    assert found.unexplained is not None
    assert found.unexplained.added == "surrogate@base"
    assert found.gap[-1].train_rms_mm < 0.4 * found.gap[0].train_rms_mm
    assert found.search.problem.noise.memory > 0.3


def estimated(data: Dataset):  # type: ignore[no-untyped-def]
    """The noise of the arm as it came."""
    names = build_library(arm(), data).names
    problem = prepared_problem(arm(), data, names, Noise((1e-4, 1e-4, 1e-4)), 1)
    return with_estimated_noise(problem, fit(problem, []), None)[1]


@pytest.mark.parametrize("rho", [0.4, 0.8])
def test_noise_with_a_memory_is_no_motion(rho: float) -> None:
    for seed in range(1, 5):
        data = exact(seed)
        assert data.position is not None
        level = estimated(replace(data, position=data.position + SIGMA * remembering(rho, seed)))
        assert level.moved == ()
        assert level.noise.memory == pytest.approx(rho, abs=0.2)


def test_a_block_that_its_payload_sets_apart_may_be_an_effect() -> None:
    """Nothing but the moment may set the rows apart that are left out."""
    data = exact(1)
    block = np.array(BLOCK)
    motion = SlowMotion("base", knocked(1.0)[:, np.newaxis], block)
    drift = SlowMotion("base", TIME[:, np.newaxis], block[:0])
    assert moved_together([drift, motion], data).tolist() == block.tolist()
    loaded = replace(data, payload=10.0 * np.isin(np.arange(ROWS), block))
    assert moved_together([drift, motion], loaded).tolist() == []
    near = data.q.copy()
    near[block, 2] = 0.3 + 1e-3 * np.arange(len(block))
    assert moved_together([motion], replace(data, q=near)).tolist() == []


def test_the_best_block_is_the_best_of_all() -> None:
    """Beside fits of every block, and of every step."""
    random = np.random.default_rng(3)
    count, width = 30, 2
    place = np.repeat(np.arange(count), width)
    Q = np.linalg.qr(random.standard_normal((len(place), 4)))[0]
    F = random.standard_normal((len(place), 3))
    r = random.standard_normal(len(place)) + 3 * F[:, 0] * ((place >= 9) & (place < 17))
    r -= Q @ (Q.T @ r)

    def left(first: int, end: int) -> float:
        X = np.hstack([Q, F * ((place >= first) & (place < end))[:, np.newaxis]])
        return float(np.sum((r - X @ np.linalg.lstsq(X, r, rcond=None)[0]) ** 2))

    every = {
        (first, end): left(first, end) for first in range(5, 26) for end in range(first + 5, 26) if end - first <= 15
    }
    steps = {(first, count): left(first, count) for first in range(5, 26)}
    block, step = _Blocks(Q, F, r, place, count).best()
    assert block == min(every, key=lambda key: every[key])
    assert step == min(steps, key=lambda key: steps[key])
    assert list(_Blocks(Q[:20], F[:20], r[:20], place[:20], 10).best()) == []


def test_all_rows_between_those_that_moved_have_moved() -> None:
    data = exact(1)
    assert all_moved((), data, None) == []
    assert all_moved((50, 54), data, None) == list(range(50, 55))
    assert all_moved((5, 6), data, np.arange(0, ROWS, 10)) == list(range(50, 61))


def test_noise_that_may_hide_something_is_told_with_the_verdict() -> None:
    """Strong noise with a memory, and much more of it than is claimed."""
    data = exact(1)
    assert data.position is not None
    noisy = replace(data, position=data.position + 4 * SIGMA * remembering(0.8, 1))
    found: Diagnosis = diagnose(arm(), noisy, sigma=SIGMA)
    assert found.verdict == "none"
    for doubt in ("times the stated value", "errors of successive rows are strongly correlated"):
        assert doubt in found.sentence
        assert any(doubt in note for note in found.notes)


def test_a_tool_that_slipped_is_named_though_successive_rows_do_not_err_alike() -> None:
    """Its shift turns with the hand: white in the frame of the base, and hidden by a condition on correlation."""
    random = np.random.default_rng(6)
    data = exact(6, time=None)
    assert data.position is not None
    turned = perturbed(arm(), seed=6).poses(data)[:, :3, :3] @ np.array([1.2e-4, -0.9e-4, 0.8e-4])
    slipped = turned * (np.arange(ROWS) >= 90)[:, np.newaxis]
    found = diagnose(arm(), replace(data, position=data.position + slipped + SIGMA * random.standard_normal((ROWS, 3))))
    (effect,) = found.effects
    assert (effect.label, effect.in_model) == ("tool_step@tool", True)
    assert abs(effect.parameters["at_row"].value - 90) <= 3
    assert effect.parameters["step_x_mm"].value == pytest.approx(0.12, abs=0.03)
