# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows weighted by the covariance of a tracker that is surer along its beam: S by hand, files, and what it gains."""

import json
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.errors import InvalidInput, ParseError
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

RANGE, ANGLE = 5e-6, 2e-5  # 0.005 mm along the beam, 0.06 mm across it at 3 m
AWAY = {"xyz_mm": [2600.0, -1500.0, -300.0], "rpy_deg": [0.5, 1.0, 35.0]}


def covariance(x: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) along the beam and across it, without choosing directions across."""
    beam = x - c
    d = np.linalg.norm(beam)
    along = np.outer(beam, beam) / d**2
    return np.asarray(RANGE**2 * along + (ANGLE * d) ** 2 * (np.eye(3) - along))


def arm() -> Robot:
    return Robot(fastcal.load_robot("ur5").spec | {"base": AWAY})


def seen(robot: Robot, q: NDArray[np.float64], random: np.random.Generator) -> Dataset:
    """Points with such a tracker's errors, drawn from their covariance."""
    points = robot.forward(q)[:, :3, 3]
    draws = [np.linalg.cholesky(covariance(x, np.zeros(3))) @ random.standard_normal(3) for x in points]
    return Dataset.from_arrays(q, position=points + np.array(draws), robot=robot)


def test_whitened_rows_are_those_of_the_covariance() -> None:
    """r^T r = sum e^T S^-1 e, and J^T J the information matrix of S, for stations that stand anywhere."""
    robot = arm()
    random = np.random.default_rng(1)
    q = fastcal.random_poses(robot, 12, seed=1)
    x = robot.forward(q)[:, :3, 3]
    c = random.uniform(-3, 3, (12, 3))
    c[0] = x[0] - [0.0, 0.0, 1.5]  # right below its point
    e = 1e-4 * random.standard_normal((12, 3))
    data = Dataset.from_arrays(q, position=x - e, robot=robot).with_tracker(RANGE, ANGLE, c)
    model = robot.error_model
    near = _core.linearize(model, robot.samples(data), measurements(data, robot), model.start, [0.0], 1)
    S = [np.linalg.inv(covariance(point, place)) for point, place in zip(x - e, c, strict=True)]
    found = np.bincount(np.asarray(near.row), np.asarray(near.r) ** 2)
    np.testing.assert_allclose(found, [v @ W @ v for v, W in zip(e, S, strict=True)], rtol=1e-9)
    J = robot.parameter_jacobian(q)
    expected = np.einsum("nip,nij,njr->pr", J, np.array(S), J)
    own = np.asarray(near.J)
    np.testing.assert_allclose(own.T @ own, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_files_give_range_and_angle(tmp_path: Path) -> None:
    robot = arm()
    random = np.random.default_rng(2)
    data = seen(robot, fastcal.random_poses(robot, 6, seed=2), random).with_tracker(RANGE, ANGLE, [0.2, 0.1, -0.3])
    file = tmp_path / "a.csv"
    fastcal.write_measurements(file, data)
    header = file.read_text().splitlines()[0]
    assert "sigma_range_mm,sigma_angle_mrad,instrument_x_mm,instrument_y_mm,instrument_z_mm" in header
    back = fastcal.load_measurements(file, robot)
    assert back.instrument is not None
    assert back.sigma_position is not None
    np.testing.assert_allclose(back.instrument, data.instrument, atol=1e-12)
    np.testing.assert_allclose(back.sigma_position, data.sigma_position, rtol=1e-9)
    plain = Dataset.from_arrays(data.q, position=data.position, sigma_position=np.full(6, 1e-5), robot=robot)
    both = Dataset.concatenate([data, plain])
    fastcal.write_measurements(tmp_path / "both.csv", both, robot.joint_types)
    again = fastcal.load_measurements(tmp_path / "both.csv", robot)
    assert again.sigma_position is not None
    np.testing.assert_allclose(again.sigma_position[6:], 1e-5, rtol=1e-9)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"sigma_range_mm": "0.005"}, "expected also sigma_angle_"),
        ({"instrument_x_mm": "0", "instrument_y_mm": "0", "instrument_z_mm": "0"}, "expected also sigma_range_mm"),
        ({"sigma_range_mm": "0.005", "sigma_angle_mrad": "0.02", "sigma_mm": "0.1"}, "expected no other sigma"),
        ({"sigma_range_mm": "0.005", "sigma_angle_mrad": "0"}, "a standard deviation greater than 0"),
        ({"sigma_range_mm": "0.005", "sigma_angle_mm": "0.02"}, "'mm' is no unit of angle"),
        (
            {"sigma_range_mm": "0.005", "sigma_angle_mrad": "0.02", "instrument_x_mm": "1"},
            "expected also instrument_y_",
        ),
        (
            {"sigma_range_mm": "0.005", "sigma_angle_mrad": "0.02", "x_mm": "10", "y_mm": "0", "z_mm": "3"},
            "100 mm",
        ),
        (
            {"sigma_range_mm": "0.005", "sigma_angle_mrad": "0.02", "z_mm": ""},
            "a point that was seen",
        ),
    ],
)
def test_mistakes_in_a_file_are_named(tmp_path: Path, columns: dict[str, str], said: str) -> None:
    robot = fastcal.load_robot("ur5")
    row = {f"q{j}_deg": "10" for j in range(1, 7)} | {"x_mm": "1500", "y_mm": "900", "z_mm": "300"} | columns
    file = tmp_path / "bad.csv"
    file.write_text(f"{','.join(row)}\n{','.join(row.values())}\n")
    with pytest.raises(ParseError, match=said):
        fastcal.load_measurements(file, robot)


def test_what_with_tracker_refuses() -> None:
    robot = arm()
    data = Dataset.from_arrays(np.zeros((2, 6)), position=np.ones((2, 3)), robot=robot)
    with pytest.raises(InvalidInput, match="sigma_angle must be a standard deviation above 0"):
        data.with_tracker(RANGE, 0.0)
    with pytest.raises(InvalidInput, match="at least 100 mm from the instrument"):
        data.with_tracker(RANGE, ANGLE, [1.0, 1.0, 1.05])
    with pytest.raises(InvalidInput, match="expected measured points"):
        replace(data, position=None).with_tracker(RANGE, ANGLE)
    with pytest.raises(InvalidInput, match="shape"):
        data.with_tracker(RANGE, ANGLE, [1.0, 2.0])


def test_a_frame_that_is_not_the_trackers_is_noted() -> None:
    robot = fastcal.load_robot("ur5")
    q = fastcal.random_poses(robot, 40, region=[[0.2, -1, 0.2], [1, 1, 1]], seed=3)
    data = fastcal.simulate(robot, q, noise=2e-5, seed=4)
    notes = fastcal.calibrate(robot, data.with_tracker(RANGE, ANGLE), checks=False).notes
    assert any("the tracker would have stood 0 mm from the robot's base" in note for note in notes)
    notes = fastcal.calibrate(robot, data.with_tracker(RANGE, ANGLE, [3.0, 0.0, 0.0]), checks=False).notes
    assert not any("would have stood" in note for note in notes)


def test_the_page_shows_what_it_gains() -> None:
    """The kept figures, and the page that shows them."""
    root = Path(__file__).parents[3]
    kept = json.loads((root / "bench" / "python" / "bench_tracker.json").read_text(encoding="utf-8"))
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(root / "bench" / "python")
        bench = runpy.run_path(str(root / "bench" / "python" / "bench_tracker.py"))
    assert bench["table"](kept["each"]) == {key: value for key, value in kept.items() if key != "each"}
    assert bench["markdown"](kept) in (root / "docs" / "measurement-files.md").read_text(encoding="utf-8")
    weighted, plain = kept["weighted"], kept["plain"]
    assert weighted["away_mm"] < 0.5 * plain["away_mm"]
    assert 0.93 < weighted["covered"] < 0.97
    assert weighted["false_alarm"] <= 0.01
    assert weighted["alarm"] > plain["alarm"]


def test_weighting_brings_the_model_nearer_to_the_arm() -> None:
    robot = arm()
    true = fastcal.perturbed(robot, seed=5)
    random = np.random.default_rng(6)
    data = seen(true, fastcal.random_poses(true, 50, seed=6), random)
    q = fastcal.random_poses(true, 200, seed=7)
    errors = []
    for each in (data.with_tracker(RANGE, ANGLE), data):
        model = fastcal.calibrate(robot, each, checks=False).model
        errors.append(np.sqrt(np.mean((model.forward(q)[:, :3, 3] - true.forward(q)[:, :3, 3]) ** 2)))
    assert errors[0] < 0.6 * errors[1]
