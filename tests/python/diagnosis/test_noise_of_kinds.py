# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Positions, orientations, lengths and tilts each have noise of their own, whatever is claimed of them."""

from dataclasses import replace

import numpy as np
import pytest

from fastcal import Dataset, Robot, calibrate, diagnose, perturbed, random_poses, simulate
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.noise import NoiseLevel, with_estimated_noise
from fastcal.diagnosis.noise_scales import without_scales
from fastcal.diagnosis.problem import Noise, Problem, prepared_problem
from fastcal.diagnosis.rounds import claimed

from .plain_cobot import in_full
from .rules.small_arm import SIGMA, arm

ROWS = 150
COMPLIANCE = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 2e-6}}


def poses(turn: float, effects: tuple[dict, ...] = (), rows: int = ROWS, seed: int = 1) -> Dataset:
    """Measured poses of the arm; SIGMA [m] of a coordinate, `turn` [rad] about each axis."""
    true = perturbed(arm(), seed=seed)
    payload = np.random.default_rng(seed).choice([0.0, 5.0, 10.0], rows)
    given = Dataset.from_arrays(random_poses(arm(), rows, seed=seed), robot=arm(), payload=payload)
    return simulate(
        Robot(dict(true.spec) | {"effects": list(effects)}), given, noise=SIGMA, noise_rotation=turn, seed=seed
    )


def level_of(data: Dataset) -> tuple[Problem, NoiseLevel]:
    start = prepared_problem(arm(), data, [], claimed(data, None), 1)
    return with_estimated_noise(start, fit(start, []), None)


@pytest.mark.parametrize("turn", [1e-5, 1e-4, 3e-3])
def test_the_noise_of_orientations_is_found_beside_that_of_points(turn: float) -> None:
    data = replace(poses(turn), sigma_position=None, sigma_rotation=None)
    found, level = level_of(data)
    assert level.sigma == pytest.approx(SIGMA, rel=0.15)
    noise = found.noise
    own = noise.common[1] * noise.factor * noise.scale.get("orientation", 1.0)
    assert own == pytest.approx(turn, rel=0.15)
    assert f"orientation {np.degrees(own):.4f} deg" in level.note


def test_a_claim_that_is_right_stays_beside_one_that_is_not() -> None:
    data = poses(1e-3)
    claims = {"sigma_position": np.full((ROWS, 3), SIGMA), "sigma_rotation": np.full(ROWS, 1e-3)}
    both = replace(data, **claims)
    assert level_of(both)[0].noise.scale == {}
    assert level_of(both)[1].sigma == pytest.approx(SIGMA, rel=1e-12)
    optimistic = replace(data, **claims | {"sigma_rotation": np.full(ROWS, 2e-4)})
    found, level = level_of(optimistic)
    assert level.sigma == pytest.approx(SIGMA, rel=1e-12)
    assert found.noise.scale["orientation"] == pytest.approx(5.0, rel=0.15)
    coarse = replace(data, **claims | {"sigma_position": np.full((ROWS, 3), SIGMA / 4)})
    found, level = level_of(coarse)
    assert level.sigma == pytest.approx(SIGMA, rel=0.15)
    own = np.hypot(1e-3, found.noise.common[1]) * found.noise.factor * found.noise.scale.get("orientation", 1.0)
    assert own == pytest.approx(1e-3, rel=0.15)


def test_points_that_repeat_better_than_the_model_fits_say_nothing_of_orientations() -> None:
    """What no model of the points explains leaves the orientations the noise that is measured of them."""
    data = poses(1e-3, rows=100)
    twice = np.repeat(np.arange(100), 2)
    random = np.random.default_rng(5)
    assert data.position is not None
    bent = data.position + 1e-3 * np.sin(40 * data.q[:, :1] + 31 * data.q[:, 1:2]) * [0.6, 0.5, 0.6]
    visits = data.select(twice)
    visits = replace(visits, position=bent[twice] + SIGMA * random.standard_normal((200, 3)), sigma_position=None)
    visits = replace(visits, sigma_rotation=None)
    found, level = level_of(visits)
    assert level.source == "repeats"
    assert level.sigma == pytest.approx(SIGMA, rel=0.15)
    own = found.noise.common[1] * found.noise.factor * found.noise.scale["orientation"]
    assert own == pytest.approx(1e-3, rel=0.25)


@pytest.mark.parametrize("size", [1e-5, 4e-4])
def test_lengths_have_their_own_noise_as_well(size: float) -> None:
    data = replace(poses(1e-3), rotation=None, sigma_rotation=None, sigma_position=None)
    true = perturbed(arm(), seed=1)
    random = np.random.default_rng(3)
    place = np.array([1.5, 0.3, 0.2])
    points = true.forward(data.q)[:, :3, 3]
    lengths = np.linalg.norm(points - place, axis=1) + size * random.standard_normal(ROWS)
    both = replace(data, distance=lengths, anchor=np.zeros(ROWS, dtype=np.int64), anchor_names=("a",))
    found, _level = level_of(both)
    noise = found.noise
    assert noise.common[0] * noise.factor == pytest.approx(SIGMA, rel=0.15)
    assert noise.common[2] * noise.factor * noise.scale["length"] == pytest.approx(size, rel=0.25)


@pytest.mark.parametrize("seed", [0, *in_full(1, 2)])
@pytest.mark.parametrize("turn", [2e-5, 2e-3])
def test_poses_with_nothing_missing_give_the_geometry_of_calibrate(seed: int, turn: float) -> None:
    data = replace(poses(turn, seed=seed + 20), sigma_position=None, sigma_rotation=None)
    found = diagnose(arm(), data)
    assert found.verdict == "none"
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.15)
    true = perturbed(arm(), seed=seed + 20)
    q = random_poses(arm(), 500, seed=99)
    there = true.forward(q)[:, :3, 3]
    error, plain = (
        float(np.sqrt(np.mean(np.sum((model.forward(q)[:, :3, 3] - there) ** 2, axis=1))))
        for model in (found.model, calibrate(arm(), data).model)
    )
    assert error < 1.1 * plain + 1e-6


def test_a_compliance_is_seen_in_points_beside_coarse_orientations() -> None:
    data = replace(poses(5e-3, (COMPLIANCE,)), sigma_position=None, sigma_rotation=None)
    found = diagnose(arm(), data)
    names = {found.effects[0].label, *("@".join(other) for other in found.effects[0].equivalents)}
    assert names == {"joint_compliance@joint2", "link_bending@link1"}  # the same on this arm
    assert found.effects[0].snr > 15


def test_tilts_without_a_claim_beside_orientations_with_one_get_a_noise() -> None:
    data = poses(1e-3)
    mixed = replace(data, sigma_rotation=np.full(ROWS, 1e-3), observed={"tilt@link2": np.zeros((ROWS, 2))})
    assert claimed(mixed, None).common[1] > 0
    claims = {"sigma_tilt": np.full((ROWS, 1), 1e-4), "tilt@link2": np.zeros((ROWS, 2))}
    assert claimed(replace(mixed, observed=claims), None).common[1] == 0
    assert claimed(replace(mixed, observed=claims, rotation=None, sigma_rotation=None), None).common[1] == 0


def test_claims_and_scales_together_are_the_noise() -> None:
    """What a surrogate is whitened with is what the fits are whitened with."""
    data = replace(poses(1e-3), sigma_position=np.full((ROWS, 3), SIGMA), sigma_rotation=np.full(ROWS, 1e-3))
    noise = Noise((2e-5, 1e-4, 2e-5), factor=1.5, scale={"orientation": 4.0})
    given = prepared_problem(arm(), data, [], noise, 1)
    scaled, common = without_scales(given)
    plain = prepared_problem(arm(), scaled, [], Noise(common), 1)
    at = fit(given, [])
    near = plain.linearized(at.model, at.samples, at.theta)
    np.testing.assert_allclose(at.near.r / 1.5, near.r, rtol=1e-9)
    np.testing.assert_allclose(at.near.J / 1.5, near.J, rtol=1e-9, atol=1e-9)
