# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Draws of the errors of a calibration spread as calibrations of fresh measurements do."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

from .bench_arm import robot
from .kind_sets import read

NOISE = 5e-5


def arm() -> Robot:
    return fastcal.load_robot("staubli_rx160l")


def points(count: int, seed: int) -> Dataset:
    true = fastcal.perturbed(arm(), seed=seed)
    return fastcal.simulate(true, fastcal.random_poses(arm(), count, seed=10 + seed), noise=NOISE, seed=20 + seed)


def rms(ratio: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(ratio**2)))


def stated(found: fastcal.Bootstrap) -> NDArray[np.float64]:
    return np.array([p.std for p in found.result.parameters])


@pytest.mark.parametrize("seed", [0, 1])
def test_white_noise_spreads_as_stated(seed: int) -> None:
    found = fastcal.bootstrap(arm(), points(60, seed), draws=150, seed=seed)
    assert found.values.shape == (150, len(found.result.parameters))
    assert rms(found.std / stated(found)) == pytest.approx(1, abs=0.1)  # two draws of 27 parameters differ by 0.03
    low, high = found.interval(0.9).T
    inside = np.mean((found.values >= low) & (found.values <= high))
    assert inside == pytest.approx(0.9, abs=0.02)


def test_noise_along_one_axis_spreads_as_in_fresh_measurements() -> None:
    """An instrument that is ten times as bad upright, which nobody says: the formula takes one noise for all axes."""
    true, poses = fastcal.perturbed(arm(), seed=4), fastcal.random_poses(arm(), 90, seed=5)

    def measured(seed: int) -> Dataset:
        data = fastcal.simulate(true, poses, seed=0)
        assert data.position is not None
        noise = np.random.default_rng(seed).standard_normal((90, 3)) * [NOISE, NOISE, 10 * NOISE]
        return replace(data, position=data.position + noise)

    found = fastcal.bootstrap(arm(), measured(0), draws=200, loss="none")
    fresh = [fastcal.calibrate(arm(), measured(seed), loss="none", checks=False) for seed in range(1, 151)]
    spread = np.std([[p.value for p in each.parameters] for each in fresh], axis=0, ddof=1)
    by_draws, by_formula = np.log(found.std / spread), np.log(stated(found) / spread)
    assert rms(by_draws) < 0.25
    assert rms(by_draws) < 0.5 * rms(by_formula)


def test_processes_draw_the_same() -> None:
    alone = fastcal.bootstrap(arm(), points(40, 2), draws=45, seed=3)
    side_by_side = fastcal.bootstrap(arm(), points(40, 2), draws=45, seed=3, jobs=2)
    np.testing.assert_array_equal(alone.values, side_by_side.values)
    other = fastcal.bootstrap(arm(), points(40, 2), draws=45, seed=4)
    assert not np.array_equal(alone.values, other.values)


def test_rows_of_a_block_turn_together() -> None:
    """With one block of all rows a draw is the data or their mirror image about the fit: two results, as far apart."""
    found = fastcal.bootstrap(arm(), points(40, 2), draws=12, block=40, loss="none")
    value = np.array([p.value for p in found.result.parameters])
    away = np.abs(found.values - value)
    assert len(np.unique(np.sign(found.values[:, 0] - value[0]))) <= 2
    assert away.max() < 1e-3 * stated(found).max()  # the errors are orthogonal to what the fit can do


def test_orientations_and_lengths_are_drawn() -> None:
    true = fastcal.perturbed(arm(), seed=6)
    poses = fastcal.random_poses(arm(), 60, seed=7)
    turned = fastcal.simulate(true, poses, noise=NOISE, noise_rotation=2e-4, seed=8)
    found = fastcal.bootstrap(arm(), turned, draws=100)
    assert rms(found.std / stated(found)) == pytest.approx(1, abs=0.12)
    seen = fastcal.simulate(true, poses, seed=9)
    assert seen.position is not None
    length = np.linalg.norm(seen.position - [1.5, 0.5, 0.2], axis=1)
    length += NOISE * np.random.default_rng(1).standard_normal(len(length))
    lengths = replace(seen, position=None, distance=length, anchor=np.zeros(60, dtype=int), anchor_names=("a",))
    found = fastcal.bootstrap(arm(), lengths, draws=100)
    assert rms(found.std / stated(found)) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("kinds", [("plane",), ("tilt",), ("position", "plane"), ("plane", "tilt"), ("length", "tilt")])
def test_draws_of_every_kind_spread_as_the_formula_says(kinds: tuple[str, ...]) -> None:
    found = fastcal.bootstrap(robot(), read(kinds, 100, 3), draws=60)
    assert found.not_converged == 0
    assert rms(found.std / stated(found)) == pytest.approx(1, abs=0.15)


def test_what_can_not_be_drawn_is_refused() -> None:
    data = points(40, 2)
    with pytest.raises(fastcal.InvalidInput, match="at least two draws"):
        fastcal.bootstrap(arm(), data, draws=1)
    with pytest.raises(fastcal.InvalidInput, match="the calibration ended"):
        fastcal.bootstrap(arm(), data.select(slice(5)))


def test_it_shows_itself_in_one_line() -> None:
    found = fastcal.bootstrap(arm(), points(60, 1), draws=2)
    assert repr(found) == f"<Bootstrap: 2 draws of {len(found.result.parameters)} parameters>"
    assert repr(replace(found, not_converged=1)).endswith("1 more did not converge>")
