# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Stations of the instrument and mounts of the target start in closed form, whatever lies between them."""

import copy
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.setups import with_setups
from fastcal.calibration.simulation import perturbed, random_poses, simulate
from fastcal.diagnosis import diagnose
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot
from fastcal.units import to_si

NOISE = to_si(0.03, "mm")


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("ur5")


def poses(stations: list[str], mounts: list[str], rows: int = 150) -> Dataset:
    random = np.random.default_rng(0)
    return Dataset.from_arrays(
        random.uniform(-2.5, 2.5, (rows, 6)),
        station=[stations[k % len(stations)] for k in range(rows)],
        mount=[mounts[k] for k in [*range(len(mounts)), *random.integers(0, len(mounts), rows - len(mounts))]],
    )


def measured(arm: Robot, rows: Dataset, shifts: dict[str, float], targets: dict[str, float]) -> Dataset:
    spec = copy.deepcopy(perturbed(arm, seed=1).spec)
    spec["base"] = {"xyz_mm": [2500, 300, 400], "rpy_deg": [3, 5, 100]}
    spec["tool"] = {"xyz_mm": [20, 30, 80], "rpy_deg": [0, 0, 0]}
    effects: list[dict[str, Any]] = []
    if shifts:
        stations = list(rows.station_names)
        effects.append({"effect": "station_offset", "owner": "base", "stations": stations, "parameters": shifts})
    if targets:
        mounts = list(rows.mount_names)
        effects.append({"effect": "tool_shift", "owner": "tool", "mounts": mounts, "parameters": targets})
    return simulate(Robot(spec | {"effects": effects}), rows, noise=NOISE, seed=3)


FAR_STATION = {"station2_x_mm": 600.0, "station2_ry_rad": 0.2, "station2_rz_rad": 1.0}
FAR_TARGETS = {"mount2_x_mm": -60.0, "mount2_z_mm": 30.0, "mount3_y_mm": 45.0}


@pytest.mark.parametrize(
    ("shifts", "targets"), [(FAR_STATION, {}), ({}, FAR_TARGETS), (FAR_STATION, FAR_TARGETS)], ids=str
)
def test_far_set_ups_are_calibrated_without_being_asked_for(
    arm: Robot, shifts: dict[str, float], targets: dict[str, float]
) -> None:
    rows = poses(["A", "B"] if shifts else ["A"], ["1", "2", "3"] if targets else ["1"])
    found = calibrate(arm, measured(arm, rows, shifts, targets))
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.15)
    entries = {entry["effect"]: entry["parameters"] for entry in found.model.spec["effects"]}
    assert set(entries) == {name for name, v in (("station_offset", shifts), ("tool_shift", targets)) if v}
    for effect, truth in (("station_offset", shifts), ("tool_shift", targets)):
        for name, value in entries.get(effect, {}).items():
            # A far set-up is written in frames of the geometry, which is off by 0.3 mrad.
            assert abs(value["value"] - truth.get(name, 0.0)) < (0.4 if name.endswith("_mm") else 1e-3)
        assert effect not in entries or any(effect in note for note in found.notes)


def test_gross_points_do_not_spoil_the_start(arm: Robot) -> None:
    data = measured(arm, poses(["A", "B"], ["1"]), FAR_STATION, {})
    assert data.position is not None
    data.position[::25] += 0.05
    found = calibrate(arm, data)
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.2)


def test_four_cameras_with_a_tenth_of_gross_rows_start_where_they_stand() -> None:
    """A tenth of the points is off by decimetres: in least squares these would turn each base."""
    arm, seed = load_robot("ur5"), 2
    rng = np.random.default_rng(seed)
    q = np.tile(random_poses(arm, 40, seed=seed), (4, 1))
    truth = perturbed(arm, seed=seed)
    points = np.array(simulate(truth, q, noise=5e-4, seed=seed).position)
    station = np.repeat(np.arange(4), 40)
    for k in range(4):
        turn = Rotation.random(random_state=10 * seed + k)
        points[station == k] = turn.apply(points[station == k]) + rng.uniform(-2, 2, 3)
    bad = rng.choice(len(q), 16, replace=False)
    points[bad] += rng.normal(0, 0.3, (16, 3))
    data = Dataset.from_arrays(q, position=points, station=[f"camera {k}" for k in station], robot=arm)
    result = calibrate(arm, data)
    assert result.status == "converged"
    assert set(result.outliers) == set(bad.tolist())
    left = np.linalg.norm(result.train.error_after, axis=1)
    assert np.median(left) < 1e-3  # three coordinates of 0.5 mm


def test_set_ups_that_hardly_differ_are_left_to_who_asks(arm: Robot) -> None:
    """A tenth of a millimetre is an effect to find; geometry is off by more."""
    data = measured(arm, poses(["A", "B"], ["1"]), {"station2_x_mm": 0.1}, {})
    assert calibrate(arm, data).model.spec["effects"] == []
    asked = calibrate(arm, data, effects="geometry,station_offset")
    offset = asked.model.spec["effects"][0]["parameters"]["station2_x_mm"]
    assert abs(offset["value"] - 0.1) < 4 * offset["std"] < 0.1


def test_the_start_is_exact_where_the_arm_is(arm: Robot) -> None:
    """Against bases and tools that are known, by SciPy's rotations."""
    rows = poses(["A", "B"], ["1", "2"])
    spec = copy.deepcopy(arm.spec) | {"tool": {"xyz_mm": [20, 30, 80], "rpy_deg": [10, 20, 30]}}
    B = [np.eye(4), np.eye(4)]
    B[0][:3, :3], B[0][:3, 3] = Rotation.from_rotvec([0.1, -0.2, 0.5]).as_matrix(), [1.0, 2.0, 0.3]
    B[1][:3, :3], B[1][:3, 3] = Rotation.from_rotvec([-1.0, 0.3, 2.0]).as_matrix(), [-1.5, 0.4, 0.9]
    flange = np.linalg.inv(pose(arm.spec["base"])) @ arm.forward(rows.q) @ np.linalg.inv(pose(arm.spec["tool"]))
    tools = np.array([[0.02, 0.03, 0.08], [0.1, -0.05, 0.2]])
    assert rows.station is not None
    assert rows.mount is not None
    at = flange[:, :3, 3] + np.einsum("nij,nj->ni", flange[:, :3, :3], tools[rows.mount])
    bases = np.array(B)[rows.station]
    p = np.einsum("nij,nj->ni", bases[:, :3, :3], at) + bases[:, :3, 3]
    data = Dataset.from_arrays(
        rows.q,
        position=p,
        station=[rows.station_names[k] for k in rows.station],
        mount=[rows.mount_names[k] for k in rows.mount],
    )
    start = Robot(with_setups(spec, data))
    np.testing.assert_allclose(start.poses(data)[:, :3, 3], p, atol=2e-6)


def test_a_diagnosis_begins_with_the_set_ups(arm: Robot) -> None:
    found = diagnose(arm, measured(arm, poses(["A", "B"], ["1"], 120), FAR_STATION, {}))
    assert found.verdict == "none"
    assert found.gap[0].train_rms_mm < 0.06


def turned(k: int) -> Rotation:
    return Rotation.from_euler("z", 70 * k, degrees=True) * Rotation.from_euler("x", 25 * k, degrees=True)


def campaigns(arm: Robot, rows: tuple[int, ...], *, is_line: bool = False) -> Dataset:
    """A six-dimensional target, remounted and turned anew in each file, the tracker elsewhere; file after file."""
    random = np.random.default_rng(5)
    true = perturbed(arm, seed=1)
    parts = []
    for k, count in enumerate(rows):
        q = random.uniform(-2.5, 2.5, (count, 6))
        if is_line and k == 1:
            q[:] = q[0] + np.outer(np.linspace(0, 0.4, count), np.eye(6)[0])
        spec = copy.deepcopy(true.spec)
        turn = turned(k)
        spec["base"] = {"xyz_mm": [2500 - 700 * k, 300 + 400 * k, 400], "rpy_deg": [3, 5, 100 - 40 * k]}
        spec["tool"] = {"xyz_mm": [20 + 15 * k, 30, 80], "rpy_deg": turn.as_euler("xyz", degrees=True).tolist()}
        poses = Dataset.from_arrays(q, station=[f"s{k}"] * count, mount=[f"m{k}"] * count)
        parts.append(simulate(Robot(spec), poses, noise=NOISE, noise_rotation=1e-4, seed=10 + k))
    return Dataset.concatenate(parts)


@pytest.mark.parametrize(("rows", "is_line"), [((60, 60, 60), False), ((20, 150, 130), True)], ids=str)
def test_a_target_that_was_turned_between_files_is_calibrated(arm: Robot, rows: tuple[int, ...], is_line: bool) -> None:
    """The lesser part of the rows is of the first station; about a line of points a base turns as it likes."""
    found = calibrate(arm, campaigns(arm, rows, is_line=is_line))
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.15)
    assert len(found.outliers) < 5
    shift = next(entry for entry in found.model.spec["effects"] if entry["effect"] == "tool_shift")
    assert shift["target"] == "pose"
    rotation_vector = [shift["parameters"][f"mount3_r{axis}_rad"]["value"] for axis in "xyz"]
    assert np.linalg.norm(rotation_vector) == pytest.approx(turned(2).magnitude(), abs=1e-3)
    assert any("turned as well" in note for note in found.notes)


def test_a_diagnosis_of_files_writes_nothing_worse_than_the_geometry(arm: Robot) -> None:
    """Held out whole, the rows of the first station say themselves where base and tool are."""
    found = diagnose(arm, campaigns(arm, (40, 60, 60)))
    assert found.verdict == "none"
    assert found.plain is None
    assert found.gap[0].held_out_rms_mm < 0.1


def test_a_mount_is_not_thrown_out_for_gross_rows(arm: Robot) -> None:
    """Two millimetres hide behind the geometry's errors at the start, and are gross beside the noise in the end."""
    rows = poses(["A"], ["1"], 90)
    rows = Dataset.from_arrays(rows.q, station=["A"] * 90, mount=["1"] * 60 + ["2"] * 30)
    found = calibrate(arm, measured(arm, rows, {}, {"mount2_x_mm": 1.2, "mount2_y_mm": -1.0, "mount2_z_mm": 0.8}))
    assert found.outliers == []
    (shift,) = found.model.spec["effects"]
    assert shift["parameters"]["mount2_x_mm"]["value"] == pytest.approx(1.2, abs=0.1)
    assert any(note.startswith("mounts 1, 2: each has a tool point of its own") for note in found.notes)


def test_a_mount_of_one_row_keeps_no_other_from_its_place(arm: Robot) -> None:
    rows = Dataset.from_arrays(poses(["A"], ["1"]).q, station=["A"] * 150, mount=["1"] * 70 + ["2"] + ["3"] * 79)
    found = calibrate(arm, measured(arm, rows, {}, FAR_TARGETS))
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.15)
    (shift,) = found.model.spec["effects"]
    assert shift["parameters"]["mount3_y_mm"]["value"] == pytest.approx(45.0, abs=0.4)
