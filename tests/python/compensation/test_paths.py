# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lines and arcs, and how far a tool is from them between compensated points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import random_poses, simulate
from fastcal.compensation import path_accuracy
from fastcal.compensation.curves import arc, between
from fastcal.errors import InvalidInput
from fastcal.report import path_page

Q = np.radians([10.0, 20.0, 80.0, 15.0, 50.0, -20.0])


def corners(robot: fastcal.Robot) -> np.ndarray:
    T = np.repeat(robot.forward(Q), 3, axis=0)
    T[1:, :3, 3] += [[-0.2, 0.15, 0.05], [-0.35, -0.1, 0.1]]
    return T


def test_a_line_is_straight_and_turns_evenly() -> None:
    a, b = np.eye(4), np.eye(4)
    b[:3, 3], b[:3, :3] = [0.3, 0, -0.4], Rotation.from_rotvec([0, 0, 1.2]).as_matrix()
    T = between(a, b, 5)
    np.testing.assert_allclose(T[:, :3, 3], np.outer([0.2, 0.4, 0.6, 0.8, 1.0], [0.3, 0, -0.4]), atol=1e-15)
    turns = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    np.testing.assert_allclose(turns[:, 2], [0.24, 0.48, 0.72, 0.96, 1.2])


@pytest.mark.parametrize(("via", "to"), [(0.7, 1.9), (2.0, 5.5), (-0.7, -1.9), (-3.0, -6.0)])
def test_an_arc_keeps_its_radius_and_passes_its_middle_point(via: float, to: float) -> None:
    """Angles on a circle of radius 0.3 about (1, 2, 3) in a plane that is turned: both ways round, less and more."""
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])

    def pose(angle: float) -> np.ndarray:
        T = np.eye(4)
        T[:3, 3] = np.array([1, 2, 3]) + turn.apply([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0])
        return T

    T = arc(pose(0.0), pose(via), pose(to), (10, 20))
    angles = [*np.linspace(0, via, 11)[1:], *np.linspace(via, to, 21)[1:]]
    np.testing.assert_allclose(T[:, :3, 3], [pose(angle)[:3, 3] for angle in angles], atol=1e-12)


@pytest.mark.parametrize("kind", ["line", "arc"])
def test_compensation_holds_at_the_points_and_nearly_between_them(arms, kind) -> None:
    nominal, real = arms("staubli_rx160l")
    T = corners(nominal)
    found = path_accuracy(real, T, Q, kind=kind, nominal=nominal, payload=3.0)
    np.testing.assert_allclose(found.poses[found.points], T, atol=1e-12)
    np.testing.assert_allclose(found.after[found.points], 0, atol=1e-8)
    # Without: what the real arm misses where the nominal one would be right.
    sent = fastcal.inverse_kinematics(nominal, T, seed=Q, along_path=True).q
    missed = np.linalg.norm((real.forward(sent, payload=3.0) - T)[:, :3, 3], axis=1)
    np.testing.assert_allclose(found.before[found.points], missed, atol=1e-8)
    assert found.after.max() < 0.1 * found.before.min()
    assert (found.off_before <= found.before + 1e-15).all()
    step = np.diff(found.along)
    assert (step > 0).all()
    assert step.max() <= 0.005 + 1e-12


def test_closer_points_leave_less(arms) -> None:
    """Between points the error is that of a chord: half the distance, a quarter of it."""
    nominal, real = arms("staubli_rx160l")
    T = corners(nominal)
    left = []
    for count in (2, 4, 8):
        points = np.concatenate([T[:1], between(T[0], T[2], count)])
        left.append(path_accuracy(real, points, Q, nominal=nominal).after.max())
    assert left[0] / left[1] == pytest.approx(4, rel=0.35)
    assert left[1] / left[2] == pytest.approx(4, rel=0.35)


def test_rounding_adds_no_pose(arms) -> None:
    """0.05 m are ten steps of 0.005 m, wherever they lie."""
    nominal, real = arms("staubli_rx160l")
    T = np.repeat(nominal.forward(Q), 3, axis=0)
    for shift in (0.0, 0.001, 0.002, 0.003, 0.004):
        moved = T.copy()
        moved[:, 0, 3] += np.array([0.0, 0.05, 0.1]) + shift
        np.testing.assert_array_equal(path_accuracy(real, moved, Q, nominal=nominal).points, [0, 10, 20])


def test_another_arm_may_drive(arms) -> None:
    """Driven by the nominal arm itself, the uncompensated path has no error, and the compensated one has."""
    nominal, real = arms("staubli_rx160l")
    found = path_accuracy(real, corners(nominal), Q, nominal=nominal, real=nominal)
    assert found.before.max() < 1e-8
    assert found.after.min() > 1e-4


def test_the_page_draws_both_and_says_the_figures(arms) -> None:
    nominal, real = arms("staubli_rx160l")
    found = path_accuracy(real, corners(nominal), Q, nominal=nominal)
    text = path_page(found, "arm <1>")
    assert "arm &lt;1&gt;" in text
    assert "with compensation" in text
    assert f'data-sort="{float(found.before.max() * 1000)}"' in text
    assert "was not calibrated" in text


def test_the_page_names_the_program_and_how_sure_the_model_is(arms) -> None:
    """An error of a thousandth of what the model is sure of is no figure to print."""
    nominal, real = arms("staubli_rx160l")
    found = path_accuracy(real, corners(nominal), Q, nominal=nominal)
    sure = replace(found, sigma=np.full(len(found.along), 8e-6), after=np.full(len(found.along), 1e-8))
    text = path_page(sure, "arm", "weld_7.csv")
    assert "weld_7.csv" in text
    assert "a standard deviation of 0.0080 mm per coordinate along this path" in text
    assert "&lt; 0.0008" in text


def test_the_sigma_of_a_path_is_that_of_the_model(arms) -> None:
    nominal, real = arms("staubli_rx160l")
    data = simulate(real, random_poses(nominal, 40, seed=2), noise=5e-5, seed=3)
    model = calibrate(nominal, data, loss="none").model
    found = path_accuracy(model, corners(nominal), Q, nominal=nominal)
    expected = np.sqrt(np.mean(model.position_deviation(Q) ** 2))
    assert found.sigma[0] == pytest.approx(expected, rel=0.02)  # the command is a little off the nominal posture


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"kind": "spline"}, "a path is a line or an arc, with at least 2 targets; got spline with 3"),
        ({"targets": np.repeat(np.eye(4)[None], 2, axis=0), "kind": "arc"}, "an odd number of at least 3 targets"),
        ({"step": 0.0}, "step must be above 0"),
        ({"targets": "far"}, "row 1 of the path is unreachable; expected targets that can all be reached"),
        ({"targets": "line", "kind": "arc"}, "the three points of an arc lie on a line"),
    ],
)
def test_an_invalid_path_is_refused(arms, change, sentence) -> None:
    nominal, real = arms("staubli_rx160l")
    T = corners(nominal)
    if change.get("targets") is not None and isinstance(change["targets"], str):
        moved = T.copy()
        moved[1, :3, 3] = 5 * T[1, :3, 3] if change["targets"] == "far" else (T[0] + T[2])[:3, 3] / 2
        change = change | {"targets": moved}
    with pytest.raises(InvalidInput, match=sentence):
        path_accuracy(real, **{"targets": T, "seed": Q, "nominal": nominal} | change)
