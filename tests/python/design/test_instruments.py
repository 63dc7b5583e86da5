# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Designs with levels and touches: derivatives against an arm in numpy, predictions against a calibration."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.design import Instruments, Surroundings, Tracker, design_poses, observability_indices
from fastcal.design.candidates import Candidates
from fastcal.design.instruments import touches
from fastcal.design.linear import linear_problem
from fastcal.design.readings import Readings
from fastcal.errors import InvalidInput

from ..calibration.bench_arm import ROWS, disturbed, on_plane, postures, robot, tilts, tool_points, turn

Array = NDArray[np.float64]

NORMAL = np.array([0.36, -0.48, 0.8])
SLOPE = {"slope": ((NORMAL * 0.3).tolist(), (2 * NORMAL).tolist())}
THREE = {
    "floor": ([0, 0, 0.25], [0, 0, 1]),
    "wall": ([0.45, 0, 0], [1, 0, 0]),
    "side": ([0, 0.4, 0], [0, 1, 0]),
}
STEP = 1e-6


def difference(function: Callable[[float], Array]) -> Array:
    return (function(STEP) - function(-STEP)) / (2 * STEP)


def changed(joint: int, column: int, by: float) -> Array:
    """The arm's rows with one number changed."""
    rows = ROWS.copy()
    rows[joint, column] += by
    return rows


def column(of: Readings, owner: str, name: str) -> int:
    every = [*robot().error_model.parameters, *of.parameters]
    return next(i for i, p in enumerate(every) if (p.owner, p.name) == (owner, name))


@pytest.mark.parametrize(("joint", "name", "dh"), [(0, "alpha", 3), (1, "theta", 0), (2, "a", 2), (4, "theta", 0)])
def test_rows_are_the_derivatives_of_what_is_read(joint: int, name: str, dh: int) -> None:
    q = on_plane(ROWS, postures(8, 1), NORMAL, 0.3)
    labels = np.array(["slope"] * 5 + [""] * 3, dtype=object)
    of = Readings(robot(), Instruments(levels=("link3",), sigma_tilt=0.5, planes=SLOPE), sigma=0.25, threads=1)
    found = of.rows(Candidates(q, np.zeros(8), plane=labels))[:, :, column(of, f"joint{joint + 1}", name)]
    by_tilt = difference(lambda h: tilts(changed(joint, dh, h), q, 3, np.eye(3)))
    by_touch = difference(lambda h: tool_points(changed(joint, dh, h), q) @ NORMAL)
    np.testing.assert_allclose(found[:, :2], by_tilt / 0.5, atol=1e-6)
    np.testing.assert_allclose(found[:5, 2], by_touch[:5] / 0.25, atol=1e-6)
    np.testing.assert_array_equal(found[5:, 2], 0.0)


def test_rows_by_a_mounting_and_by_a_plane() -> None:
    q = on_plane(ROWS, postures(6, 2), NORMAL, 0.3)
    of = Readings(robot(), Instruments(levels=("link4",), sigma_tilt=1.0, planes=SLOPE), sigma=1.0, threads=1)
    found = of.rows(Candidates(q, np.zeros(6), plane=np.full(6, "slope", dtype=object)))
    for axis, name in enumerate(("rx", "ry", "rz")):
        mounted = difference(lambda h, axis=axis: tilts(ROWS, q, 4, turn(axis, h)))
        np.testing.assert_allclose(found[:, :2, column(of, "level on link4", name)], mounted, atol=1e-6)
    np.testing.assert_allclose(found[:, 2, column(of, "plane slope", "offset")], -1.0)
    assert set(of.rows(Candidates(q, np.zeros(6)))[:, 2].ravel()) == {0.0}  # without a label nothing is touched


def test_predicted_deviations_are_those_of_a_calibration_with_the_instruments() -> None:
    """The poses chosen, read in another arm in numpy, and identified."""
    instruments = Instruments(levels=("link3", "link4"), sigma_tilt=4e-5, planes=THREE)
    found = design_poses(robot(), 70, instruments=instruments, sigma=3e-5, candidates="random", candidate_count=1200)
    assert found.plane is not None
    labels = np.array(found.plane)
    assert (labels == "").any()
    truth, random = disturbed(5), np.random.default_rng(6)
    q, points = found.q.copy(), np.full((70, 3), np.nan)
    for label, (point, normal) in THREE.items():
        for row in np.flatnonzero(labels == label):
            height = float(np.dot(point, normal)) + 3e-5 * random.standard_normal()
            q[row] = on_plane(truth, q[row : row + 1], np.array(normal, dtype=float), height)[0]
    free = labels == ""
    points[free] = tool_points(truth, q[free]) + 3e-5 * random.standard_normal((int(free.sum()), 3))
    observed = {
        f"tilt@link{link}": tilts(truth, q, link, np.eye(3)) + 4e-5 * random.standard_normal((70, 2)) for link in (3, 4)
    }
    data = fastcal.Dataset.from_arrays(
        q, position=points, observed=observed, observed_labels={"plane": found.plane}, robot=robot()
    )
    result = fastcal.calibrate(robot(), data, loss="none")
    names = [f"{p.owner} {p.name.removesuffix(f'_{p.unit}')}" for p in result.parameters]
    identified = dict(zip(names, np.sqrt(np.diag(result.covariance)), strict=True))
    predicted = dict(zip(found.parameters, found.deviations, strict=True))
    for name in ("joint2 theta", "joint2 a", "joint3 alpha", "joint4 theta", "tool x"):
        assert predicted[name] == pytest.approx(identified[name], rel=0.3), name


def test_a_level_adds_to_what_the_same_poses_determine() -> None:
    q = postures(30, 7)
    one = design_poses(robot(), 30, candidates=q, sigma=3e-5)
    more = design_poses(
        robot(), 30, candidates=q, sigma=3e-5, instruments=Instruments(levels=("link3",), sigma_tilt=2e-5)
    )
    assert more.sigma < one.sigma
    before = dict(zip(one.parameters, one.deviations, strict=True))
    after = dict(zip(more.parameters, more.deviations, strict=True))
    assert set(before) | {f"level on link3 r{axis}" for axis in "xyz"} == set(after)
    assert all(after[name] <= before[name] * (1 + 1e-9) for name in before)
    assert after["joint2 theta"] < 0.9 * before["joint2 theta"]


def test_chosen_touches_determine_more_than_as_many_at_random() -> None:
    instruments = Instruments(points=False, planes=THREE)
    found = design_poses(robot(), 60, instruments=instruments, sigma=3e-5, candidates="random", candidate_count=1600)
    assert found.plane is not None
    points = tool_points(ROWS, found.q)
    for label, (point, normal) in THREE.items():
        rows = np.array(found.plane) == label
        assert rows.sum() >= 4
        np.testing.assert_allclose((points[rows] - point) @ np.array(normal, dtype=float), 0.0, atol=1e-8)
    assert (np.abs(found.q) <= np.radians(170)).all()
    assert "" not in found.plane
    pool = touches(robot(), Candidates(postures(100, 13), np.zeros(100)), instruments)
    problem = linear_problem(
        robot(), pool, 60, geometry=True, sigma=3e-5, sigma_rotation=None, seed=0, threads=1, instruments=instruments
    )
    drawn = observability_indices(problem.rows(pool.select(slice(None, None, len(pool) // 60))), 60)
    chosen = Candidates(found.q, found.payload, plane=np.array(found.plane, dtype=object))
    assert observability_indices(problem.rows(chosen), 60)["O1"] > 1.1 * drawn["O1"]
    assert any("base" in line for line in found.unidentifiable)
    back = found.dataset()
    assert back.has_labels("plane")
    assert f"touches: {found.plane.count('floor')} of plane floor" in found.summary()
    assert found.to_frame()["plane"].tolist() == found.plane


def test_a_touch_needs_no_tracker_and_too_few_are_reported() -> None:
    far = Surroundings(tracker=Tracker((0.0, 0.0, 50.0), farthest=1.0))
    planes = Instruments(planes={"floor": THREE["floor"]})
    found = design_poses(robot(), 3, instruments=planes, surroundings=far, candidates=postures(40, 8))
    assert found.plane == ["floor"] * 3
    assert found.rejected == {"are out of the tracker's range": 40}
    assert "plane floor is touched 3 times; a calibration needs at least 4 touches of a plane" in found.notes


def test_measured_poses_count_for_what_they_hold() -> None:
    instruments = Instruments(levels=("link3",), planes=SLOPE)
    q = postures(30, 9)
    options = {"instruments": instruments, "candidates": postures(60, 10), "targets": postures(20, 11)}

    def sigma(measured: fastcal.Dataset) -> float:
        return design_poses(robot(), 12, measured=measured, **options).sigma  # type: ignore[arg-type]

    points = fastcal.Dataset.from_arrays(q, position=tool_points(ROWS, q))
    both = replace(points, observed={"tilt@link3": tilts(ROWS, q, 3, np.eye(3))})
    half = replace(points, position=np.where(np.arange(30)[:, np.newaxis] < 15, points.position, np.nan))
    tilts_alone = replace(both, position=None)
    plan = fastcal.Dataset.from_arrays(q)
    assert sigma(plan) == pytest.approx(sigma(both), rel=1e-6)  # the level stands along its link's axes
    assert sigma(both) < sigma(points) < sigma(half) < sigma(tilts_alone)
    touched = fastcal.Dataset.from_arrays(on_plane(ROWS, q, NORMAL, 0.3), observed_labels={"plane": ["slope"] * 30})
    others = replace(touched, observed_labels={"plane": ["elsewhere"] * 30})
    assert sigma(touched) != sigma(others)


@pytest.mark.parametrize(
    ("instruments", "message"),
    [
        (Instruments(levels=("link7",)), "levels must be on link1 to link6, got 'link7'"),
        (Instruments(levels=("link2", "link2")), "each link once"),
        (Instruments(levels=("link2",), sigma_tilt=0.0), "sigma_tilt must be above 0"),
        (Instruments(points=False), "needs levels or planes"),
        (Instruments(planes={"floor": ([0, 0, 0], [0, 0, 0])}), "plane floor must be a point and a normal"),
        (Instruments(planes={"floor": ([0, 0], [0, 0, 1])}), "plane floor must be a point and a normal"),
        (Instruments(points=False, planes={"sky": ([0, 0, 99], [0, 0, 1])}), "0 candidates can be measured"),
    ],
)
def test_instruments_that_do_not_fit_are_refused(instruments: Instruments, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        design_poses(robot(), 10, instruments=instruments, candidates=postures(20, 12))
