# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Budgets against examples of the GUM, and inputs against what they do by geometry."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import fastcal
from fastcal.budget import Budget, Input, Scene, combined, components_of, drawn
from fastcal.errors import ParseError
from fastcal.io.budget_file import load_budget

ENTRY = "{name: a, kind: range, half_width_um: 6}"


def test_the_end_gauge_of_the_gum() -> None:
    """JCGM 100, H.1.7: u_c = 32 nm with 25, 9.7, 2.9 and 16.6 nm, effective degrees of freedom 16, U99 = 93 nm."""
    parts = [("d1", 3.9, 5.0), ("d2", 6.7, 8.0), ("theta", 2.9, 50.0), ("alpha", 16.6, 2.0)]
    found = combined(5.8, 24.0, [("standard", 25.0, 18.0), *parts], level=0.99)
    assert found.standard == pytest.approx(32, abs=0.5)
    assert math.floor(found.freedom) == 16
    assert found.expanded == pytest.approx(2.92 * 32, abs=2)


def test_few_degrees_of_freedom_widen_the_interval() -> None:
    found = combined(1.0, 4.0, [])
    assert found.expanded == pytest.approx(stats.t.ppf(0.975, 4))
    assert found.coverage_factor == pytest.approx(stats.t.ppf(0.975, 4))
    assert combined(0.0, 4.0, [("a", 2.0, math.inf)]).expanded == pytest.approx(2 * stats.norm.ppf(0.975))
    assert combined(3.0, 9.0, [("a", 4.0, math.inf)]).freedom == pytest.approx(5**4 / (3**4 / 9))


def scene(**more: object) -> Scene:
    points = np.array([[3.0, 4, 0], [0, 0, 2]])
    return Scene(points, np.tile(np.eye(3), (2, 1, 1)), np.zeros(3), np.array([3.0, 0, 0]), **more)  # type: ignore[arg-type]


def fields(kind: str, quantity: str, **more: object) -> np.ndarray:
    found = components_of(Budget((Input("a", kind, quantity, 2.0, **more),)), scene())  # type: ignore[arg-type]
    return np.array([c.shift if kind != "orientation" else c.turn for c in found])


def test_what_each_input_does_to_the_points() -> None:
    """The first beam is (0.6, 0.8, 0) and 5 long, the second (0, 0, 1) and 2 long."""
    np.testing.assert_allclose(fields("range", "length"), [[[1.2, 1.6, 0], [0, 0, 2]]], atol=1e-12)
    np.testing.assert_allclose(fields("range", "per_length"), [[[6, 8, 0], [0, 0, 4]]], atol=1e-12)
    across = fields("angle", "angle")  # level and upright, 2 rad times 5 m
    np.testing.assert_allclose(across[0, 0], [-8, 6, 0], atol=1e-12)
    np.testing.assert_allclose(across[1, 0], [0, 0, 10], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(across[:, 1], axis=1), [4, 4])
    np.testing.assert_allclose(across[:, 1, 2], 0, atol=1e-12)
    assert fields("angle", "length", common=False).shape == (4, 2, 3)
    np.testing.assert_allclose(fields("temperature", "temperature", expansion=0.5)[0], [[0, 4, 0], [-3, 0, 2]])
    np.testing.assert_allclose(fields("target", "length").sum(axis=0), 2.0)
    np.testing.assert_allclose(fields("orientation", "angle")[2], [[0, 0, 2], [0, 0, 2]])


def test_loads_move_the_points_as_the_model_says() -> None:
    """A joint that yields by c: one kg more at the end of a level arm of 1 m sags it by c g (1 m)^2."""
    spec = {
        "name": "arm",
        "kinematics": "dh",
        "joints": [{"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 1000, "alpha_deg": 0,
                    "link": {"mass_kg": 10, "com_mm": [0, 0, 0]}}],
        "gravity_m_s2": [0, -10.0, 0],
        "effects": [{"effect": "joint_compliance", "owner": "joint1",
                     "parameters": {"compliance_rad_nm": {"value": 1e-7}}}],
    }  # fmt: skip
    model = fastcal.load_robot(spec)
    at = Scene(np.array([[1.0, 0, 0]]), np.eye(3)[np.newaxis], np.zeros(3), np.zeros(3), model, np.zeros((1, 1)), 5.0)
    load = components_of(Budget((Input("load", "payload", "mass", 0.2),)), at)
    np.testing.assert_allclose(load[0].shift, [[0, -0.2e-6, 0]], rtol=1e-3, atol=1e-11)
    masses = components_of(Budget((Input("masses", "masses", "share", 0.05),)), at)
    np.testing.assert_allclose(masses[0].shift, [[0, -0.05 * 1e-5, 0]], rtol=1e-3, atol=1e-11)


@pytest.mark.parametrize("distribution", ["normal", "rectangular", "triangular", "arcsine"])
def test_draws_have_mean_zero_and_variance_one(distribution: str) -> None:
    found = drawn(Input("a", "range", "length", 1.0, distribution), np.random.default_rng(1), (200_000,))
    assert found.mean() == pytest.approx(0, abs=0.01)
    assert found.var() == pytest.approx(1, abs=0.01)
    widest = {"normal": np.inf, "rectangular": 3**0.5, "triangular": 6**0.5, "arcsine": 2**0.5}[distribution]
    assert np.abs(found).max() <= widest
    assert np.abs(found).max() > 0.98 * min(widest, 3)


def written(folder: Path, text: str) -> Path:
    path = folder / "budget.yaml"
    path.write_text(text)
    return path


def test_sizes_become_standard_uncertainties(tmp_path: Path) -> None:
    text = """
level: 0.99
instrument: {xyz_m: [1, 2, 3]}
inputs:
  - {name: offset, kind: range, half_width_um: 6}
  - {name: scale, kind: range, expanded_um_m: 8, coverage_factor: 4}
  - {name: angles, kind: angle, standard_um_m: 3, degrees_of_freedom: 12}
  - {name: wave, kind: position, half_width_mm: 0.02, distribution: arcsine}
  - {name: room, kind: temperature, half_width_k: 3, distribution: triangular, expansion_1_k: 1.2e-5}
  - {name: masses, kind: masses, standard_percent: 5}
"""
    found = load_budget(written(tmp_path, text))
    assert found.level == 0.99
    np.testing.assert_allclose(found.instrument, [1, 2, 3])
    sizes = [each.standard for each in found.inputs]
    np.testing.assert_allclose(sizes, [6e-6 / 3**0.5, 2e-6, 3e-6, 2e-5 / 2**0.5, 3 / 6**0.5, 0.05])
    assert [each.common for each in found.inputs] == [True, True, False, False, True, True]
    assert found.inputs[2].freedom == 12


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("level: 0.95", "inputs is missing"),
        ("inputs: []", "a list of 1 to 100 inputs"),
        ("inputs: [{name: a, kind: wind, standard_mm: 1}]", "kind: expected range"),
        ("inputs: [{name: a, kind: range}]", "expected one such key, got none"),
        ("inputs: [{name: a, kind: range, standard_mm: 1, half_width_mm: 1}]", "got standard_mm, half_width_mm"),
        ("inputs: [{name: a, kind: range, standard_kg: 1}]", "standard_, half_width_ or expanded_ with m, mm, um"),
        ("inputs: [{name: a, kind: temperature, half_width_c: 1, expansion_1_k: 1e-5}]", "with k"),
        ("inputs: [{name: a, kind: range, standard_mm: -1}]", "a number above 0"),
        ("inputs: [{name: a, kind: range, expanded_mm: 1, coverage_factor: 0.5}]", "at least 1"),
        ("inputs: [{name: a, kind: range, standard_mm: 1, degrees_of_freedom: 0}]", "at least 1"),
        ("inputs: [{name: a, kind: range, standard_mm: 1, common: maybe}]", "true or false"),
        ("inputs: [{name: a, kind: temperature, half_width_k: 1}]", "expansion_1_k is missing"),
        (f"inputs: [{ENTRY}, {ENTRY}]", "'a' is the name of two inputs"),
        (f"inputs: [{ENTRY}]\nlevel: 95", "a probability"),
        (f"inputs: [{ENTRY}]\ntracker: leica", "'tracker' is not known"),
        ("inputs: 5", "a list"),
        ("inputs: [5]", "a mapping"),
    ],
)
def test_a_mistake_in_a_budget_is_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ParseError) as error:
        load_budget(written(tmp_path, text))
    assert said in str(error.value)


def test_one_pose_from_several_sides_has_one_error_of_the_instrument() -> None:
    points = np.array([[3.0, 4, 0], [0, 0, 2], [3, 4, 0]])
    twice = Scene(points, np.tile(np.eye(3), (3, 1, 1)), np.zeros(3), np.zeros(3))
    found = components_of(Budget((Input("a", "angle", "angle", 1.0, common=False),)), twice)
    assert len(found) == 4  # two poses, level and upright
    for component in found:
        np.testing.assert_array_equal(component.shift[0], component.shift[2])
