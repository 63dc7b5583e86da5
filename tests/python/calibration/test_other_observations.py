# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Levels on links and touched planes, against an arm in numpy that is written from the docs alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import fastcal
from fastcal import _core
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import random_poses, simulate
from fastcal.io.measurements import load_measurements
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset

from .bench_arm import MOUNT, ROWS, disturbed, on_plane, postures, robot, tilts, tool_points

FloatArray = NDArray[np.float64]


def test_a_level_on_a_link_finds_its_mounting_and_the_angles_of_the_joints_before_it() -> None:
    truth, random = disturbed(1), np.random.default_rng(2)
    q = postures(120, 3)
    noise = 2e-5
    readings = tilts(truth, q, 4, MOUNT) + noise * random.standard_normal((120, 2))
    points = tool_points(truth, q) + 3e-5 * random.standard_normal((120, 3))
    data = Dataset.from_arrays(q, position=points, observed={"tilt@link4": readings}, robot=robot())
    alone = calibrate(robot(), replace(data, observed={}), effects="geometry")
    both = calibrate(robot(), data, effects="geometry")
    assert both.status == "converged"
    mount = _core.exp_so3(both.unknowns["level on link4"])
    left = both.train.others_after["tilt of link4"]
    assert np.sqrt(np.mean(left**2)) == pytest.approx(noise, rel=0.15)
    assert np.abs(mount - MOUNT).max() < 2e-3

    # The level says more of the angles before it than points alone do.
    def deviation(result: fastcal.CalibrationResult) -> float:
        return next(p.std for p in result.parameters if (p.owner, p.name) == ("joint3", "theta_deg"))

    assert deviation(both) < 0.8 * deviation(alone)


@pytest.mark.parametrize("seed", range(5))
def test_a_level_behind_parallel_axes_is_not_taken_for_its_mirror_image(seed: int) -> None:
    """On links 2 and 3 of an upright arm a level and its mirror image differ by what the arm's errors do, alone."""
    random = np.random.default_rng(20 + seed)
    rows = ROWS.copy()
    rows[1, 3] = 0.0  # joints 2 and 3 are parallel
    truth = rows + 5e-4 * random.standard_normal(rows.shape)
    q = postures(100, 30 + seed)
    mounts = {link: Rotation.random(rng=random).as_matrix() for link in (2, 3)}
    observed = {
        f"tilt@link{link}": tilts(truth, q, link, mount) + 2e-5 * random.standard_normal((100, 2))
        for link, mount in mounts.items()
    }
    points = tool_points(truth, q) + 3e-5 * random.standard_normal((100, 3))
    data = Dataset.from_arrays(q, position=points, observed=observed, robot=robot(rows))
    found = calibrate(robot(rows), data)
    assert found.status == "converged"
    for link, mount in mounts.items():
        left = found.train.others_after[f"tilt of link{link}"]
        assert np.median(np.abs(left)) == pytest.approx(0.6745 * 2e-5, rel=0.3)
        assert np.abs(_core.exp_so3(found.unknowns[f"level on link{link}"]) - mount).max() < 5e-3


def test_levels_alone_leave_lengths_open_and_say_so() -> None:
    truth, random = disturbed(4), np.random.default_rng(5)
    q = postures(150, 6)
    observed = {
        f"tilt@link{link}": tilts(truth, q, link, MOUNT) + 2e-5 * random.standard_normal((150, 2)) for link in (3, 5)
    }
    data = Dataset.from_arrays(q, observed=observed, robot=robot())
    found = calibrate(robot(), data, effects="geometry")
    assert found.status == "converged"
    held = " ".join(u.direction for u in found.unidentifiable)
    assert "joint2 a is not observable" in held
    assert not any(p.unit == "mm" for p in found.parameters)
    assert "base rz" in held  # about the vertical
    for link in (3, 5):
        left = found.train.others_after[f"tilt of link{link}"]
        assert np.sqrt(np.mean(left**2)) == pytest.approx(2e-5, rel=0.15)
    assert found.train.after is None


def touched(seed: int, planes: dict[str, tuple[FloatArray, float]], each: int, noise: float) -> Dataset:
    truth, random = disturbed(seed), np.random.default_rng(seed + 100)
    q, labels = [], []
    for k, (label, (normal, offset)) in enumerate(planes.items()):
        offsets = offset + noise * random.standard_normal(each)
        q.append(
            np.concatenate(
                [
                    on_plane(truth, row[np.newaxis], normal, at)
                    for row, at in zip(postures(each, seed + k), offsets, strict=True)
                ]
            )
        )
        labels += [label] * each
    return Dataset.from_arrays(np.concatenate(q), observed_labels={"plane": labels}, robot=robot())


def test_three_planes_calibrate_an_arm_but_for_what_they_leave_open() -> None:
    planes = {
        "floor": (np.array([0.0, 0.0, 1.0]), 0.25),
        "wall": (np.array([1.0, 0.0, 0.0]), 0.45),
        "slope": (np.array([0.6, 0.64, 0.48]), 0.3),
    }
    data = touched(7, planes, 70, 2e-5)
    found = calibrate(robot(), data, effects="geometry")
    assert found.status == "converged", found.message
    assert found.train.length_after is not None
    rms = float(np.sqrt(np.mean(found.train.length_after**2)))
    assert 1.2e-5 < rms < 2.2e-5  # of the noise, less what the parameters take
    assert found.sigma is None  # of points, which nobody measured
    assert found.noise["plane"].value == pytest.approx(2e-5, rel=0.2)
    # Where the whole stands is not asked of planes that stand wherever the arm finds them; their scale is as open.
    assert not any(p.owner == "base" for p in found.parameters)
    assert any("do not determine where the arm stands as a whole" in note for note in found.notes)
    assert any("together" in u.direction for u in found.unidentifiable)
    # Elsewhere the arm is as the true one, but for a motion and a scale of the whole.
    q = postures(200, 9)
    mine = found.model.forward(q)[:, :3, 3]
    true = tool_points(disturbed(7), q)
    a, b = mine - mine.mean(axis=0), true - true.mean(axis=0)
    U, S, V = np.linalg.svd(a.T @ b)
    R = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
    scale = S.sum() / (a**2).sum()
    nominal = robot().forward(q)[:, :3, 3]
    before = np.linalg.norm(nominal - true, axis=1).mean()
    assert np.linalg.norm(scale * a @ R - b, axis=1).mean() < 0.25 * before


def test_one_plane_leaves_what_lies_in_it_open() -> None:
    data = touched(11, {"floor": (np.array([0.0, 0.0, 1.0]), 0.25)}, 150, 2e-5)
    found = calibrate(robot(), data, effects="geometry")
    held = " | ".join(u.direction for u in found.unidentifiable)
    assert "joint1 theta is not observable" in held
    assert "joint1 d and plane floor offset move together" in held
    assert not any(p.owner == "base" for p in found.parameters)
    assert found.status == "converged"


def test_all_observations_in_one_file_go_there_and_back(tmp_path: Path) -> None:
    truth = disturbed(13)
    q = postures(90, 14)
    part = np.arange(90) % 3
    points = np.where((part == 0)[:, np.newaxis], tool_points(truth, q), np.nan)
    q[part == 1] = on_plane(truth, q[part == 1], np.array([0.0, 0.0, 1.0]), 0.2)
    readings = np.where((part == 2)[:, np.newaxis], tilts(truth, q, 3, MOUNT), np.nan)
    data = Dataset.from_arrays(
        q,
        position=points,
        sigma_position=np.full(90, 3e-5),
        observed={"tilt@link3": readings, "sigma_tilt": np.full(90, 2e-5)},
        observed_labels={"plane": ["bench" if k == 1 else "" for k in part]},
        robot=robot(),
    )
    assert data.measured.all()
    path = tmp_path / "measured.csv"
    write_measurements(path, data)
    header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert {"plane", "tilt_x_mrad@link3", "tilt_y_mrad@link3", "sigma_tilt_mrad", "sigma_mm"} <= set(header)
    again = load_measurements(path, robot())
    assert again.observed_labels["plane"] == data.observed_labels["plane"]
    np.testing.assert_allclose(again.observed["tilt@link3"], readings, atol=1e-12)
    np.testing.assert_allclose(again.observed["sigma_tilt"], 2e-5, atol=1e-12)
    half = Dataset.concatenate([again[:40], again[40:]])
    assert half.observed_labels == again.observed_labels
    np.testing.assert_array_equal(half.observed["tilt@link3"], again.observed["tilt@link3"])
    found = calibrate(robot(), again, effects="geometry")
    assert found.status == "converged"
    assert set(found.unknowns) == {"level on link3", "plane bench"}
    assert found.train.after is not None
    assert found.train.after.max < 1e-5
    one, three = calibrate(robot(), again), calibrate(robot(), again, threads=3)
    assert [p.value for p in one.parameters] == [p.value for p in three.parameters]


@pytest.mark.parametrize(
    ("title", "message"),
    [
        ("tilt_x@link3", "has no unit"),
        ("tilt_x_mm@link3", "no unit of angle"),
        ("tilt_x_mrad@link9", "names no link of this robot"),
        ("tilt_x_mrad@link3", "expected also"),
    ],
)
def test_an_invalid_column_of_a_level_is_refused(tmp_path: Path, title: str, message: str) -> None:
    header = ",".join([*(f"q{j}_deg" for j in range(1, 7)), title])
    path = tmp_path / "bad.csv"
    path.write_text(f"{header}\n" + "1,2,3,4,5,6,7\n" * 3, encoding="utf-8")
    with pytest.raises(fastcal.ParseError, match=message):
        load_measurements(path, robot())


def test_a_simulated_arm_is_read_as_the_docs_say() -> None:
    truth = disturbed(17)
    q = postures(20, 18)
    poses = Dataset.from_arrays(
        q,
        observed={"tilt@link2": np.zeros((20, 2))},
        observed_labels={"plane": ["" if k < 10 else "floor" for k in range(20)]},
        robot=robot(),
    )
    read = simulate(robot(truth), poses, unknowns={"plane floor": [0.0, 0.0, 0.2]}, points=False)
    assert read.position is None
    np.testing.assert_allclose(read.observed["tilt@link2"], tilts(truth, read.q, 2, np.eye(3)), atol=1e-12)
    np.testing.assert_allclose(read.q[:10], q[:10])
    np.testing.assert_allclose(tool_points(truth, read.q[10:])[:, 2], 0.2, atol=1e-9)


def test_a_diagnosis_takes_planes_and_levels_beside_points() -> None:
    truth = disturbed(19)
    arm = robot()
    q = random_poses(arm, 100, seed=3)
    random = np.random.default_rng(20)
    data = Dataset.from_arrays(
        q,
        position=tool_points(truth, q) + 3e-5 * random.standard_normal((100, 3)),
        observed={"tilt@link3": tilts(truth, q, 3, MOUNT) + 2e-5 * random.standard_normal((100, 2))},
        robot=arm,
    )
    found = fastcal.diagnose(arm, data)
    assert found.verdict == "none"
