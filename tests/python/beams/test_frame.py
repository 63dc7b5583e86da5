# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""BeamFrame as a user meets it: shapes, supports, hinges, matrices of his own, errors in a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.beams.frame import BeamFrame, StiffnessTable
from fastcal.errors import InvalidInput

Array = NDArray[np.float64]
YOUNG, AREA, INERTIA, MASS, G = 2.1e11, 3e-3, 4e-6, 12.0, 9.80665


def cantilever(**changes: Any) -> BeamFrame:
    given = {"young_pa": YOUNG, "area_m2": AREA, "inertia_m4": INERTIA, "mass_kg": MASS, "fixed": [0]}
    return BeamFrame([(0, 1)], **(given | changes))


def space_cantilever(**changes: Any) -> BeamFrame:
    given = {"inertia_y_m4": INERTIA, "inertia_z_m4": 3 * INERTIA, "torsion_m4": INERTIA, "shear_pa": 8e10}
    return cantilever(inertia_m4=None, **(given | changes))


def tip(length: float) -> Array:
    return np.array([[[0.0, 0.0], [length, 0.0]]])


def end_matrix(length: float, inertia: float = INERTIA) -> Array:
    """K_ee of a plane Euler-Bernoulli element."""
    k = YOUNG * inertia / length**3
    return np.array(
        [[YOUNG * AREA / length, 0, 0], [0, 12 * k, -6 * k * length], [0, -6 * k * length, 4 * k * length**2]]
    )


def whole_matrix(length: float) -> Array:
    """The textbook's 6 x 6 (Przemieniecki 5.116), written out."""
    a, k, L = YOUNG * AREA / length, YOUNG * INERTIA / length**3, length
    bending = k * np.array(
        [
            [12, 6 * L, -12, 6 * L],
            [6 * L, 4 * L**2, -6 * L, 2 * L**2],
            [-12, -6 * L, 12, -6 * L],
            [6 * L, 2 * L**2, -6 * L, 4 * L**2],
        ]
    )
    matrix = np.zeros((6, 6))
    matrix[np.ix_([0, 3], [0, 3])] = a * np.array([[1, -1], [-1, 1]])
    matrix[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = bending
    return matrix


def test_a_cantilever_sags_under_its_weight_and_a_tip_load() -> None:
    lengths = np.array([0.5, 1.0, 1.7])
    nodes = np.concatenate([tip(length) for length in lengths])
    load = np.zeros((3, 2, 3))
    load[:, 1, 1] = [-100.0, 0.0, 50.0]
    displacement = cantilever().solve(nodes, load)
    EI = YOUNG * INERTIA
    expected = load[:, 1, 1] * lengths**3 / (3 * EI) - MASS * G * lengths**3 / (8 * EI)
    np.testing.assert_allclose(displacement[:, 1, 1], expected, rtol=1e-12)
    assert displacement.shape == (3, 2, 3)
    assert (displacement[:, 0] == 0).all()


def test_gravity_is_down_by_default_in_space_and_may_turn_with_the_posture() -> None:
    frame = space_cantilever()
    nodes = np.tile([[0.0, 0.0, 0.0], [1.2, 0.0, 0.0]], (2, 1, 1))
    down = frame.solve(nodes)
    sag = MASS * G * 1.2**3 / (8 * YOUNG)
    np.testing.assert_allclose(down[0, 1, :3], [0, 0, -sag / INERTIA], atol=1e-12 * sag / INERTIA)
    turned = frame.solve(nodes, gravity=[[0, 0, -G], [0, -G, 0]])
    np.testing.assert_array_equal(turned[0], down[0])
    np.testing.assert_allclose(turned[1, 1, 1], -sag / (3 * INERTIA), rtol=1e-12)


def test_up_distinguishes_y_from_z() -> None:
    nodes = np.array([[[0.0, 0.0, 0.0], [1.2, 0.0, 0.0]]])
    frame = space_cantilever()
    upright, on_its_side = frame.solve(nodes), frame.solve(nodes, up=(0, 1, 0))
    np.testing.assert_allclose(upright[0, 1, 2], 3 * on_its_side[0, 1, 2], rtol=1e-12)


def test_a_support_may_hold_some_directions() -> None:
    frame = BeamFrame(
        [(0, 1), (1, 2)],
        young_pa=YOUNG,
        area_m2=AREA,
        inertia_m4=INERTIA,
        mass_kg=MASS,
        fixed=[(0, "ux uy"), (2, "uy")],
    )
    sag = frame.solve([[[0, 0], [1, 0], [2, 0]]])[0, 1, 1]
    np.testing.assert_allclose(sag, -5 * (MASS * G) * 2**4 / (384 * YOUNG * INERTIA), rtol=1e-11)


def test_a_node_where_every_element_is_hinged_does_not_turn() -> None:
    nodes = [[[-1, 0], [1, 0], [0, 1]]]
    section = {"young_pa": YOUNG, "area_m2": AREA, "inertia_m4": INERTIA, "mass_kg": MASS, "fixed": [0, 1]}
    hinged = BeamFrame([(0, 2), (1, 2)], hinges=[(0, 1), (1, 1)], **section)
    displacement = hinged.solve(nodes, gravity=(3, -9))
    assert displacement[0, 2, 2] == 0
    load = np.zeros((3, 3))
    load[2, 2] = 1
    with pytest.raises(InvalidInput, match="posture 0: a moment acts on node 2 about z"):
        hinged.solve(nodes, load)


def test_whole_and_clamped_matrices_are_the_section_they_came_from() -> None:
    nodes = [[[0, 0], [0.8, 0.5]]]
    length = float(np.hypot(0.8, 0.5))
    load = np.array([[0, 0, 0], [200.0, -300.0, 40.0]])
    expected = cantilever().solve(nodes, load)
    for matrix in (end_matrix(length), whole_matrix(length)):
        got = cantilever(stiffness={0: matrix}).solve(nodes, load)
        np.testing.assert_allclose(got, expected, rtol=1e-11)
        got = cantilever(stiffness={0: None}).solve(nodes, load, stiffness={0: matrix[None]})
        np.testing.assert_allclose(got, expected, rtol=1e-11)


def test_a_table_over_the_posture_is_read_at_each_posture() -> None:
    """A section that turns with theta and a length that grows with d, in polynomials that the table can hold."""
    rng = np.random.default_rng(0)

    def stiffness(angle: Array, extension: Array) -> Array:
        matrices = np.array([end_matrix(1.0)] * len(angle))
        matrices[:, 0, 0] *= 2 - extension
        matrices[:, 1:, 1:] *= ((1 + 0.3 * angle - 0.2 * angle**2) * (3 - extension + extension**2))[:, None, None]
        return matrices

    angle, extension = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 5), np.linspace(0, 0.8, 5)))
    table = StiffnessTable(
        angle, extension, stiffness(angle, extension), dimension=2, angle_degree=2, extension_degree=2
    )
    assert table.relative_error < 1e-12
    frame = cantilever(stiffness={0: table})
    theta, d = rng.uniform(-1, 1, 20), rng.uniform(0, 0.8, 20)
    nodes = np.concatenate([tip(1 + x) for x in d])
    load = np.array([[0, 0, 0], [200.0, -300.0, 40.0]])
    got = frame.solve(nodes, load, gravity=(0, 0), angle_rad=theta, extension_m=d)
    np.testing.assert_allclose(got[:, 1], np.linalg.solve(stiffness(theta, d), load[1]), rtol=1e-10)
    with pytest.raises(InvalidInput, match=r"angle of posture 0 is 1\.2 rad, but .* sampled from -1 to 1 rad"):
        frame.solve(nodes[:1], angle_rad=[1.2], extension_m=[0.1])
    with pytest.raises(InvalidInput, match="angle_rad and extension_m are needed"):
        frame.solve(nodes)


def test_derivatives_by_stiffness_factors_match_differences() -> None:
    frame = BeamFrame(
        [(0, 1), (1, 2), (2, 3)], young_pa=YOUNG, area_m2=AREA, inertia_m4=INERTIA, mass_kg=[9, 5, 3], fixed=[0]
    )
    nodes = np.array([[[0, 0], [0, 1], [1, 1.2], [1.8, 0.4]], [[0, 0], [0.2, 1], [0.9, 1.8], [1.8, 1.4]]])
    displacement, derivative = frame.solve_with_derivative(nodes, [[0], [1, 2]], scale=[1, 1.5, 0.7])
    np.testing.assert_array_equal(displacement, frame.solve(nodes, scale=[1, 1.5, 0.7]))
    np.testing.assert_allclose(derivative.sum(axis=-1), -displacement, atol=1e-12)  # all softer alike: 1/s
    h = 1e-4
    more = frame.solve(nodes, scale=[1, 1.5 * (1 + h), 0.7 * (1 + h)])
    less = frame.solve(nodes, scale=[1, 1.5 * (1 - h), 0.7 * (1 - h)])
    np.testing.assert_allclose(derivative[..., 1], (more - less) / (2 * h), atol=1e-7 * np.abs(displacement).max())


def test_threads_and_out_change_no_bit() -> None:
    rng = np.random.default_rng(1)
    nodes = np.concatenate([tip(length) for length in rng.uniform(0.5, 2, 1001)])
    frame = cantilever()
    out = np.full((1001, 2, 3), np.nan)
    assert frame.solve(nodes, threads=3, out=out) is out
    np.testing.assert_array_equal(out, frame.solve(nodes))
    np.testing.assert_array_equal(out[500], frame.solve(nodes[500:501])[0])
    np.testing.assert_array_equal(out, frame.solve(np.asfortranarray(nodes)))
    assert frame.solve(np.zeros((0, 2, 2))).shape == (0, 2, 3)


def test_a_linkage_without_its_drive_names_node_posture_and_direction() -> None:
    frame = BeamFrame(
        [(0, 1), (1, 2), (3, 2)],
        young_pa=YOUNG,
        area_m2=AREA,
        inertia_m4=INERTIA,
        fixed=[0, 3],
        hinges=[(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)],
    )
    with pytest.raises(InvalidInput, match=r"posture 0: node 1 is free to move along x"):
        frame.solve([[[0, 0], [0, 1], [2, 1], [2, 0]]])


BAD_FRAMES: list[tuple[dict[str, Any], str]] = [
    ({"young_pa": -1}, "Young's modulus of element 0 must be a positive number, got -1"),
    ({"area_m2": [1, 2]}, r"area_m2 must be one number or have shape \(1,\), got \(2,\)"),
    ({"mass_kg": "heavy"}, "mass_kg must be real numbers"),
    ({"mass_kg": np.nan}, "mass_kg must be finite"),
    ({"fixed": []}, "a frame needs at least one support"),
    ({"fixed": [7]}, "a support names node 7, but the nodes are 0 to 1"),
    ({"fixed": [(0, "uz")]}, "the support at node 0 may hold ux uy rz, got 'uz'"),
    ({"hinges": [(0, 0, "w")]}, "a hinge of element 0 turns about some of x, y, z, got 'w'"),
    ({"hinges": [(4, 0)]}, "a hinge names element 4, but there are 1 elements"),
    ({"torsion_m4": 1.0}, r"torsion_m4 has no meaning in a plane frame"),
    ({"inertia_m4": None}, "inertia_y_m4, inertia_z_m4, torsion_m4, shear_pa must be given"),
    ({"shear_area_m2": 1e-3}, "shear_pa must be given for shear_area_m2"),
    ({"stiffness": {3: None}}, "there is no element 3 to have a stiffness"),
    ({"stiffness": {0: np.eye(4)}}, r"stiffness of element 0 must end in shape \(3, 3\)"),
    ({"stiffness": {0: np.eye(6)}}, "the forces at its two ends do not cancel"),
]


@pytest.mark.parametrize(("changes", "words"), BAD_FRAMES)
def test_anything_but_a_frame_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        cantilever(**changes)


BAD_CALLS: list[tuple[dict[str, Any], str]] = [
    ({"nodes": np.zeros((2, 2))}, r"nodes must have shape \(N, 2, 2\), got \(2, 2\)"),
    ({"nodes": tip(np.inf)}, r"nodes must be finite, got inf at index \(0, 1, 0\)"),
    ({"nodes": tip(1) * 1j}, "nodes must be real numbers, got an array of complex128"),
    ({"nodes": tip(0)}, "posture 0: element 0 has no length, nodes 0 and 1 coincide"),
    ({"load": np.zeros((3, 3))}, r"load must have shape \(2, 3\) or \(1, 2, 3\), got \(3, 3\)"),
    ({"gravity": (0, 0, -9)}, r"gravity must have shape \(2,\) or \(1, 2\), got \(3,\)"),
    ({"up": (0, 0, 1)}, "up is for space frames"),
    ({"threads": 0}, "threads must be at least 1, got 0"),
    ({"scale": 0}, "scale of element 0 must be positive, got 0"),
    ({"stiffness": {0: np.eye(3)}}, "element 0 was made with a section"),
    ({"out": np.zeros((1, 2, 2))}, r"out must be a float64 array in C order of shape \(1, 2, 3\)"),
]


@pytest.mark.parametrize(("changes", "words"), BAD_CALLS)
def test_what_cant_be_solved_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        cantilever().solve(**({"nodes": tip(1)} | changes))


def test_a_matrix_that_is_not_a_stiffness_is_reported_where_it_is_used() -> None:
    with pytest.raises(InvalidInput, match="not positive"):
        cantilever(stiffness={0: np.diag([1e8, -1e6, 1e5])}).solve(tip(1))
