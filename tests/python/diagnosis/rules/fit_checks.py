# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Fits, and the noise that a rich model leaves."""

from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import numpy as np

from fastcal import perturbed
from fastcal.diagnosis import blocks, heavy_tails, noise, periodic, priors, rich_model, rounds
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.problem import Linearization, prepared_problem
from fastcal.diagnosis.search import Search

from .linear_world import ROWS, World, columns, name
from .mutants import falls_with
from .small_arm import SIGMA, arm, measured, problem


def near(J: np.ndarray) -> Linearization:
    rows = np.arange(len(J))
    return Linearization(J, np.zeros(len(J)), rows, rows)


COMPLIANCE = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 2e-5}}


@falls_with(PRIOR_WIDTH=1e-3)
@falls_with(MAX_STEP=1e-9)
@falls_with(CHI_SQUARE_TOLERANCE=1e12)
@falls_with(CHI_SQUARE_SHARE=1e3)
def a_fit_reaches_the_noise() -> None:
    given = problem(measured([COMPLIANCE]))
    (cause,) = (n for n in given.names if n.key == ("joint_compliance", "joint2"))
    found = fit(given, [cause])
    assert abs(found.remaining - found.freedom) < 4 * np.sqrt(2 * found.freedom)
    assert abs(found.value(cause)[0] / 2e-5 - 1) < 0.05


@falls_with(MAX_ITERATIONS=1)
def a_fit_follows_what_is_bent() -> None:
    """Errors of centimetres and degrees."""
    given = problem(measured([COMPLIANCE], length=2e-2, angle=5e-2))
    (cause,) = (n for n in given.names if n.key == ("joint_compliance", "joint2"))
    found = fit(given, [cause])
    assert abs(found.remaining - found.freedom) < 4 * np.sqrt(2 * found.freedom)


@falls_with(MIN_INFLUENCE=1e6)
@falls_with(MIN_INFLUENCE=0.0)
@falls_with(MAX_GEOMETRY_SIZE=np.inf)
@falls_with(MAX_GEOMETRY_SIZE=1e-3)
def a_parameter_is_worth_what_it_moves() -> None:
    """A geometry that hardly moves the tool, one that does, an effect that does, and one that moves it by rounding."""
    J = np.diag([1e-3, 5.0, 0.02, 1e-12])
    given = SimpleNamespace(misfit=10.0, own=2, unknowns=np.zeros(0))
    model = SimpleNamespace(parameters=[SimpleNamespace(sigma=s) for s in (1.0, 1.0, 1.0, 7.0)])
    size = priors.plausible_sizes(given, model, near(J))
    np.testing.assert_allclose(size, [30.0, 2.0, 500.0, 7.0])


@falls_with(GEOMETRY_WIDTH=np.inf)
@falls_with(GEOMETRY_WIDTH=0.0)
def what_hardly_shows_stays_near_nominal() -> None:
    """Angles of the arm, of which the first moves nothing and the last hardly anything, a length, the tool, a curve."""
    joints = [("joint1", "rad"), ("joint2", "rad"), ("joint3", "rad"), ("joint4", "rad"), ("joint2", "m")]
    owners = [*joints, ("tool", "rad"), ("joint1", "rad")]
    model = SimpleNamespace(parameters=[SimpleNamespace(owner=o, sigma=1e-3, unit=u) for o, u in owners])
    all_rows = near(np.diag([1e-12, 2.0, 1.0, 1e-4, 1.0, 1.0, 0.1]))
    curve, start = SimpleNamespace(parameters=[None]), SimpleNamespace(robot=SimpleNamespace(reach=2.0))
    entries = [{"effect": "joint_profile", "owner": "joint1"}]
    for misfit, turn, length in ((1e-4, 5e-3, 0.01), (0.04, 0.04, 0.04)):
        given = SimpleNamespace(misfit=misfit, own=6, unknowns=np.zeros(0), start=start, arm_size=None)
        width = priors.widest(given, model, all_rows, entries, [curve])
        np.testing.assert_allclose(width, [*4 * [turn], length, np.inf, turn])


@falls_with(RICH_MODEL_SHARE=0.0)
@falls_with(RICH_MODEL_SHARE=0.99)
@falls_with(RICH_MODEL_COLUMNS=0)
def a_missing_effect_is_no_noise_and_enough_is_left_to_estimate_it() -> None:
    C = columns(200)
    names = [name(k + 1) for k in range(200)]
    world = World(dict(zip(names, C.T, strict=True)), 40.0 * C[:, 150])
    start = world.fit(world.problem, [])
    with world.looked_at():
        rich = rich_model.RichModel.of(start).left
    assert abs(rich.mean_square - 1) < 0.25
    assert rich.freedom > ROWS / 2


@falls_with(MAX_CLEAR_BLOCKS=0)
@falls_with(CLEAR_BLOCK_BIC=1e9)
@falls_with(CLEAR_BLOCK_BIC=-100.0)
def what_is_clearly_missing_comes_first_in_the_rich_model() -> None:
    C = columns(20)
    names = [name(k + 1) for k in range(20)]
    world = World(dict(zip(names, C.T, strict=True)), 40.0 * C[:, 15] + 30.0 * C[:, 7])
    with world.looked_at():
        assert rich_model._clear(blocks.blocks(world.fit(world.problem, []))) == [15, 7]


@falls_with(HEAVY_TAILS_GAIN=-1e9)
@falls_with(HEAVY_TAILS_GAIN=1e9)
def rows_are_weighed_where_the_tails_are_heavy() -> None:
    for far, is_weighed in ((0.0, False), (2e-4, True)):
        data = measured([])
        assert data.position is not None
        offset = np.zeros((len(data), 3))
        offset[:6, 2] = far
        given = problem(replace(data, position=data.position + offset))
        assert (heavy_tails.weighed(given, fit(given, [])).weight is not None) == is_weighed


@falls_with(NOISE_GUESS=1e3)
def the_noise_is_found_from_a_guess() -> None:
    data = measured([COMPLIANCE])
    given = problem(data)
    guessed = given.with_noise(rounds.claimed(data, None))
    _, level = noise.with_estimated_noise(guessed, fit(guessed, []), None)
    assert abs(level.sigma / SIGMA - 1) < 0.25


@falls_with(SCALE_ROUNDS=1)
@falls_with(SCALE_CHANGE=1.0)
def the_noise_of_much_finer_lengths_is_found_beside_that_of_points() -> None:
    points = measured([], rows=120)
    random = np.random.default_rng(3)
    true = perturbed(arm(), seed=1, length=5e-4, angle=5e-4)
    lengths = np.linalg.norm(true.forward(points.q)[:, :3, 3] - [1.5, 0.3, 0.2], axis=1)
    lengths += SIGMA / 5 * random.standard_normal(120)
    data = replace(points, distance=lengths, anchor=np.zeros(120, dtype=np.int64), anchor_names=("a",))
    given = prepared_problem(arm(), data, [], rounds.claimed(data, None), 1)
    found = noise.with_estimated_noise(given, fit(given, []), None)[0].noise
    own = found.common[2] * found.factor * found.scale["length"]
    assert abs(own / (SIGMA / 5) - 1) < 0.25


@falls_with(ORDERS_OF_A_STEP=1)
def an_order_between_two_of_the_scan_is_found() -> None:
    wave = {"order": 7.4, "amplitude_rad": 3e-4, "phase_rad": 0.4}
    given = problem(measured([{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], rows=90))
    orders = [n.entry["order"] for n in periodic.scan(Search(given).start) if n.owner == "joint2"]
    assert min(abs(order - 7.4) for order in orders) < 0.05


@falls_with(MAX_ORDER=20.0)
def an_order_of_33_is_scanned_for() -> None:
    wave = {"order": 33.0, "amplitude_rad": 3e-4, "phase_rad": 0.4}
    given = problem(measured([{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], rows=90))
    with mock.patch.object(periodic, "FINEST_WAVE", 1.0):
        found = periodic.scan(Search(given).start)
    assert "gear_harmonic@joint2:order=33" in [repr(n) for n in found]
