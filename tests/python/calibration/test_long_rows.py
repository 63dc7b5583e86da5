# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibration on rows in files is that of the same rows in memory."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration import long_rows
from fastcal.calibration.some_rows import some_rows
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.report.view import rows_of
from fastcal.robot.plain_copy import plain_copy

ROWS = 31_000  # more than are read at once, and than are shown


def arm() -> fastcal.Robot:
    return fastcal.load_robot("staubli_rx160l")


def measured(robot: fastcal.Robot, true: fastcal.Robot, rows: int = ROWS, **given: Any) -> Dataset:
    """Noise 0.05 mm and 0.1 mrad; every hundredth row is off by centimetres."""
    random = np.random.default_rng(4)
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (rows, robot.joint_count))
    conditions = {name: given[name] for name in ("temperature", "payload") if name in given}
    position = true.forward(q, **conditions)[:, :3, 3] + random.normal(0, 5e-5, (rows, 3))
    position[::100] += random.normal(0, 0.02, (len(position[::100]), 3))
    return Dataset.from_arrays(q, **{"position": position, "robot": robot} | given)


def in_files(data: Dataset) -> LongDataset:
    rows = LongDataset(source=data.source, joint_types=data.joint_types)
    for begin in range(0, len(data), 10_000):
        rows.append(data[begin : begin + 10_000])
    return rows


def expect_same(found: fastcal.CalibrationResult, whole: fastcal.CalibrationResult) -> None:
    assert found.status == whole.status == "converged"
    spec, expected = plain_copy(found.model.spec), plain_copy(whole.model.spec)
    assert spec == expected
    np.testing.assert_array_equal(found.covariance, whole.covariance)
    assert found.parameters == whole.parameters
    assert found.outliers == whole.outliers
    assert (found.sigma, found.degrees_of_freedom) == (whole.sigma, whole.degrees_of_freedom)
    for a, b in ((found.train.before, whole.train.before), (found.train.after, whole.train.after)):
        if b is None:
            assert a is None
            continue
        assert a is not None
        assert (a.count, a.max) == (b.count, b.max)
        assert (a.mean, a.std, a.rms) == pytest.approx((b.mean, b.std, b.rms), rel=1e-12)


def test_points_give_the_same_model() -> None:
    robot = arm()
    data = measured(robot, fastcal.perturbed(robot, seed=1))
    whole, found = fastcal.calibrate(robot, data), fastcal.calibrate(robot, in_files(data))
    expect_same(found, whole)
    assert found.train.row_count == ROWS
    assert found.to_json_dict()["train"]["count"] == ROWS
    told = [note for note in found.notes if "read part by part" in note]
    assert told == [note for note in found.notes if note not in whole.notes]
    assert told[0].startswith(f"{ROWS} rows were read part by part")
    expect_same(fastcal.calibrate(robot, in_files(data), threads=2), whole)


def test_poses_lengths_and_what_they_claim_give_the_same_model() -> None:
    robot = arm()
    true = fastcal.perturbed(robot, seed=1)
    rows = ROWS
    random = np.random.default_rng(5)
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (rows, robot.joint_count))
    T = true.forward(q)
    anchors = np.array([[3.0, 0.0, 0.0], [0.0, 3.0, 0.5], [-1.0, -2.0, 2.5]])
    chosen = random.integers(0, 3, rows)
    lengths = np.linalg.norm(T[:, :3, 3] - anchors[chosen], axis=1) + random.normal(0, 5e-5, rows)
    points = T[:, :3, 3] + random.normal(0, 5e-5, (rows, 3))
    points[::2] = np.nan
    lengths[1::2] = np.nan
    data = Dataset.from_arrays(
        q,
        position=points,
        distance=lengths,
        anchor=[f"anchor {place}" for place in chosen],
        sigma_position=np.full(rows, 5e-5),
        robot=robot,
    )
    whole, found = fastcal.calibrate(robot, data), fastcal.calibrate(robot, in_files(data))
    # Of setups and anchors the nominal arm is aligned to all rows in memory, so that both start elsewhere.
    assert found.status == whole.status == "converged"
    deviation = np.sqrt(np.diag(whole.covariance))
    values = [np.array([p.value for p in result.parameters]) for result in (found, whole)]
    known = np.array([p.std for p in whole.parameters], dtype=float)
    assert np.abs((values[0] - values[1]) / known).max() < 1e-5
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), deviation, rtol=1e-6)
    assert found.outliers == whole.outliers
    assert found.unknowns.keys() == whole.unknowns.keys()


def test_effects_of_the_way_and_of_other_columns_give_the_same_model() -> None:
    robot = arm()
    temperature = np.random.default_rng(6).uniform(290, 300, ROWS)
    data = measured(robot, fastcal.perturbed(robot, seed=1), temperature=temperature)
    effects = "geometry,backlash@joint2,settling@joint3,thermal_expansion@link2"
    whole = fastcal.calibrate(robot, data, effects=effects, checks=False)
    expect_same(fastcal.calibrate(robot, in_files(data), effects=effects, checks=False), whole)


def test_the_report_shows_rows_by_their_own_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_rows, "SHOWN_ROWS", 2000)
    robot = arm()
    data = measured(robot, fastcal.perturbed(robot, seed=1), 12_000)
    found = fastcal.calibrate(robot, in_files(data))
    shown = some_rows(12_000, 2000)
    np.testing.assert_array_equal(found.train.rows, shown)
    outliers = set(found.outliers) & set(shown.tolist())
    assert outliers
    assert set(shown[found.train.places(found.outliers)].tolist()) == outliers
    assert found.weights.shape == shown.shape
    assert (found.weights[found.train.places(found.outliers)] < 0.1).all()
    rows = rows_of("Training", found.train, robot.joint_types)
    assert rows is not None
    np.testing.assert_array_equal(rows.conditions[0].values, shown)
    found.save(tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "12\u202f000 rows" in page
    assert any(f">{row}<" in page for row in outliers if row > 2000)
    assert json.loads((tmp_path / "out" / "result.json").read_text())["outliers"] == found.outliers
    assert "12000 rows" in found.summary()


def test_few_rows_in_files_are_taken_into_memory() -> None:
    robot = arm()
    data = measured(robot, fastcal.perturbed(robot, seed=1), 300)
    whole, found = fastcal.calibrate(robot, data), fastcal.calibrate(robot, in_files(data))
    expect_same(found, whole)
    assert found.notes == whole.notes
    np.testing.assert_array_equal(found.weights, whole.weights)


def test_rows_of_the_test_are_looked_for_in_all_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_rows, "SHOWN_ROWS", 2000)
    robot = arm()
    data = measured(robot, fastcal.perturbed(robot, seed=1), 12_000)
    found = fastcal.calibrate(robot, in_files(data), test=data[11_000:11_010])
    assert any("all its rows are among the rows of the fit" in note for note in found.notes)


def test_a_lag_needs_the_rows_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_rows, "SHOWN_ROWS", 100)
    robot = arm()
    data = measured(robot, robot, 400, temperature=np.linspace(290, 300, 400), time=np.arange(400.0))
    spec = plain_copy(robot.spec)
    spec["effects"] = [{"effect": "thermal_expansion", "owner": "link2", "parameters": {}, "lag_s": 60.0}]
    with pytest.raises(fastcal.InvalidInput, match="a lag of the temperature needs all rows in memory"):
        fastcal.calibrate(fastcal.Robot(spec), in_files(data), checks=False)
