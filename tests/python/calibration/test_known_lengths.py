# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sockets a known length apart: a simulated arm whose lengths are all off by one factor, which the length shows."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.known_lengths import known_lengths
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot_spec import RobotSpec

from .bench_arm import ROWS, TOOL, frames, robot

FloatArray = NDArray[np.float64]

SCALE = 1.004
NOISE = 5e-5  # [m] a coordinate
APART = 0.3  # [m]
SOCKETS = np.array([[0.55, -0.15, 0.35], [0.55, -0.15 + APART, 0.35]])


def ball(rows: FloatArray, tool: FloatArray, q: FloatArray) -> FloatArray:
    """The ball's centre of one posture [m], base in the measuring frame."""
    R, p = frames(rows, q)[-1]
    return np.asarray(p + R @ tool)


def reaching(rows: FloatArray, tool: FloatArray, at: FloatArray, count: int, random: np.random.Generator) -> FloatArray:
    """(count, 6) postures with the ball at a point: from random ones by Newton's steps of least length."""
    out: list[FloatArray] = []
    while len(out) < count:
        q = random.uniform(-1.5, 1.5, 6)
        for _ in range(50):
            here = ball(rows, tool, q)
            if np.linalg.norm(at - here) < 1e-10:
                break
            slope = np.array([(ball(rows, tool, q + step) - here) / 1e-6 for step in np.eye(6) * 1e-6]).T
            q = q + np.clip(np.linalg.pinv(slope, rcond=1e-3) @ (at - here), -0.3, 0.3)
        if np.linalg.norm(at - ball(rows, tool, q)) < 1e-9 and np.abs(q).max() < 2.9:
            out.append(q)
    return np.array(out)


def touched(seed: int, known: float = 1e3 * APART, scale: float = SCALE, to: str = "socket b") -> CalibrationResult:
    """A fit of an arm whose zeros and twists are off, and whose lengths are all `scale` times those of its file."""
    random = np.random.default_rng([seed, 41])
    rows, tool = ROWS.copy(), scale * TOOL
    rows[:, [0, 3]] += 2e-3 * random.standard_normal((6, 2))
    rows[:, [1, 2]] *= scale
    q, labels = [], []
    for label, at in zip("ab", SOCKETS, strict=True):
        for _ in range(25):
            # The ball's seat moves by the noise, as if a little dirt were in the socket.
            q.append(reaching(rows, tool, at + NOISE * random.standard_normal(3), 1, random)[0])
            labels.append(label)
    length = {"from": "socket a", "to": to, "mm": known, "sigma_mm": 0.05}
    data = Dataset(q=np.array(q), payload=np.zeros(len(q)), observed_labels={"socket": labels})
    return calibrate(robot(known_distances=[length]), data, checks=False, priors=False)


def test_a_known_length_shows_the_common_scale_within_what_is_stated() -> None:
    off = []
    for seed in range(1, 4):
        found = touched(seed)
        assert found.status == "converged"
        (length,) = found.known_lengths
        assert length.scale_std < 0.001
        off.append((length.scale - SCALE) / length.scale_std)
        assert any("% larger than in the model" in note for note in found.notes)
    assert np.abs(off).max() < 3.5
    assert 0.2 < np.sqrt(np.mean(np.square(off))) < 2.0


def test_an_arm_true_to_its_file_agrees_with_the_length() -> None:
    (note,) = [note for note in touched(7, scale=1.0).notes if "socket a to socket b" in note]
    assert "they agree, which shows the common scale of all lengths to 0.0" in note


def test_a_length_to_a_socket_that_was_not_touched_is_said_to_be_of_no_use() -> None:
    found = touched(7, to="socket c")
    assert found.known_lengths == []
    assert "of no known distance of the file both ends were touched" in found.notes


def test_the_deviation_of_a_length_is_that_of_a_difference() -> None:
    names = [(f"socket {label}", axis) for label in "ab" for axis in "xyz"]
    places = np.array([0.0, 0.0, 0.0, 0.03, 0.04, 0.0])
    root = np.random.default_rng(5).standard_normal((6, 6)) * 1e-5
    known = [{"from": "socket b", "to": "socket a", "mm": 50.1, "sigma_mm": 0.1}]
    spec = RobotSpec("touched", "dh", (), known_distances=known)
    (length,) = known_lengths(spec.known_distances, names, places, root @ root.T)
    drawn = places + np.random.default_rng(6).standard_normal((20000, 6)) @ root.T
    assert length.found == pytest.approx(0.05)
    assert length.found_std == pytest.approx(np.linalg.norm(drawn[:, 3:] - drawn[:, :3], axis=1).std(), rel=0.03)
    assert length.scale == pytest.approx(1.002)
