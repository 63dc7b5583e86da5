# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Balls of unknown radius, blocks with right angles and dial gauges, touched by the arm in numpy of the docs alone."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.measurements.dataset import Dataset

from .bench_arm import disturbed, postures, robot, tool_points, turn

FloatArray = NDArray[np.float64]

NOISE = 2e-5  # [m]
BALLS = {"near": (np.array([0.55, 0.2, 0.35]), 0.03), "far": (np.array([-0.1, 0.7, 0.5]), 0.05)}
BALLS |= {"low": (np.array([0.5, -0.5, 0.2]), 0.04)}
BLOCKS = {
    "front": (turn(2, 0.4) @ turn(0, 0.2), np.array([0.5, 0.3, 0.3])),
    "side": (turn(1, -0.3), np.array([0.2, 0.6, 0.2])),
}
GAUGES = {"a": (np.array([0.0, 0.6, 0.8]), 0.6), "b": (np.array([1.0, 0.0, 0.0]), 0.5)}


def brought(rows: FloatArray, q: FloatArray, height: Callable[[FloatArray], float]) -> FloatArray:
    """A posture (6,) moved by least squares to where `height` of the tool's point is 0."""
    q = q.copy()
    for _ in range(60):
        here = height(tool_points(rows, q[np.newaxis])[0])
        slope = np.array([height(tool_points(rows, (q + 1e-7 * e)[np.newaxis])[0]) - here for e in np.eye(6)]) / 1e-7
        step = -here * slope / (slope @ slope)
        q += step * min(1.0, 0.3 / np.abs(step).max())
        if abs(here) < 1e-12:
            break
    return q


def read(kind: str, count: int, seed: int, truth: int = 1) -> Dataset:
    """`count` touches of balls or faces, or readings of gauges."""
    rows, random = disturbed(truth), np.random.default_rng([seed, 5])
    q, labels = postures(count, seed), list[str]()
    fields: dict[str, Any] = {}
    if kind == "dial":
        points, values = tool_points(rows, q), []
        for k, p in enumerate(points):
            label = list(GAUGES)[k % len(GAUGES)]
            n, zero = GAUGES[label]
            values.append(n @ p - zero + NOISE * random.standard_normal())
            labels.append(label)
        fields = {"observed": {"dial": np.array(values)[:, np.newaxis]}, "observed_labels": {"gauge": labels}}
        return Dataset.from_arrays(q, robot=robot(), source=kind, **fields)
    for k in range(count):
        error = NOISE * random.standard_normal()
        if kind == "ball":
            name = list(BALLS)[k % len(BALLS)]
            center, radius = BALLS[name]
            q[k] = brought(rows, q[k], lambda p, c=center, R=radius, e=error: float(np.linalg.norm(p - c) - R - e))
        else:
            block, face = list(BLOCKS)[k % 2], (k // 2) % 3
            R, d = BLOCKS[block]
            name = f"{block}/{'xyz'[face]}"
            q[k] = brought(rows, q[k], lambda p, n=R[:, face], o=d[face], e=error: float(n @ p - o - e))
        labels.append(name)
    return Dataset.from_arrays(q, robot=robot(), source=kind, observed_labels={kind: labels})


@pytest.mark.parametrize("kind", ["ball", "cube", "dial"])
def test_an_arm_is_calibrated_by_touches_alone(kind: str) -> None:
    found = fastcal.calibrate(robot(), read(kind, 150, 3), test=read(kind, 60, 4))
    assert found.status == "converged"
    assert found.test is not None
    before, after = found.train.kinds[kind].statistics
    there = found.test.kinds[kind].statistics[1]
    assert after is not None
    assert there is not None
    assert after.rms < 1.1 * NOISE
    assert there.rms < 1.5 * NOISE
    assert found.noise[kind].value == pytest.approx(NOISE, rel=0.2)
    assert before is not None
    assert before.rms > 5 * NOISE


def test_radii_of_balls_are_found_as_surely_as_is_said() -> None:
    """Beside points, which show the scale."""
    off = []
    for seed in range(8):
        touches, q = read("ball", 36, 40 + seed, 9), postures(60, 80 + seed)
        random = np.random.default_rng(seed)
        points = tool_points(disturbed(9), q) + NOISE * random.standard_normal((60, 3))
        labels = [*touches.observed_labels["ball"], *[""] * 60]
        position = np.vstack([np.full((36, 3), np.nan), points])
        data = Dataset.from_arrays(
            np.vstack([touches.q, q]), position=position, robot=robot(), observed_labels={"ball": labels}
        )
        found = {(p.owner, p.name): p for p in fastcal.calibrate(robot(), data).parameters}
        for name, (center, radius) in BALLS.items():
            at = found[f"ball {name}", "radius_mm"]
            off.append((at.value - 1e3 * radius) / at.std)
            off += [
                (found[f"ball {name}", f"{axis}_mm"].value - 1e3 * c) / found[f"ball {name}", f"{axis}_mm"].std
                for axis, c in zip("xyz", center, strict=True)
            ]
    assert 0.75 < np.sqrt(np.mean(np.square(off))) < 1.3


def test_diagnose_and_check_take_touches_of_a_block() -> None:
    assert "No missing effect" in fastcal.diagnose(robot(), read("cube", 120, 6)).sentence
    model = fastcal.calibrate(robot(), read("cube", 150, 3)).model
    assert fastcal.check(model, read("cube", 60, 7)).verdict == "holds"


def test_wrong_labels_get_one_sentence() -> None:
    data = Dataset.from_arrays(postures(3, 1), observed_labels={"cube": ["block"] * 3})
    with pytest.raises(fastcal.InvalidInput, match=r"^arrays: column 'cube': expected labels such as .*, got 'block'"):
        fastcal.calibrate(robot(), data)
