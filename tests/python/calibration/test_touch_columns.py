# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches with a diameter for a radius, or slides in another unit, are refused with what was probably meant.

A diameter "converged" at 1.8 mm with nothing said, a gantry in inches at 0.2 mm with a tool of no length.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.arrays import FloatArray
from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.touch_columns import another_radius, check_touches
from fastcal.errors import InvalidInput
from fastcal.io.robot_file import spec_of
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

RADIUS, NOISE = 0.0127, 5e-5  # [m]
SLIDES = 3
COUNT, PLACES = 20, "abc"


def gantry() -> Robot:
    """Three slides at right angles, and a wrist on them."""
    span = {"min_mm": 0, "max_mm": 2000}
    slides = [(0, -90), (-90, -90), (0, 0)]
    joints = [
        {"type": "prismatic", "theta_deg": theta, "d_mm": 0, "a_mm": 0, "alpha_deg": alpha, **span}
        for theta, alpha in slides
    ]
    for d, a, alpha in ((150, 0, 90), (0, 120, -90), (90, 0, 0)):
        joints.append({"type": "revolute", "theta_deg": 0, "d_mm": d, "a_mm": a, "alpha_deg": alpha})
    tool = {"xyz_mm": [30.0, -20.0, 120.0], "rpy_deg": [0.0, 0.0, 0.0]}
    return Robot(spec_of({"name": "gantry", "kinematics": "dh", "joints": joints, "tool": tool}, Path("gantry.yaml")))


ARM = gantry()


def touches(kind: str, seed: int = 1) -> Dataset:
    """Of three balls or sockets, whatever the wrist's posture: the slides go where the tool is wanted."""
    random = np.random.default_rng(seed)
    true = fastcal.perturbed(ARM, seed=seed)
    at = np.repeat(random.uniform(0.3, 0.8, (3, 3)), COUNT, axis=0)
    out = random.standard_normal(at.shape)
    out[:, 2] = np.abs(out[:, 2])
    if kind != "socket":
        at += RADIUS * out / np.linalg.norm(out, axis=1, keepdims=True)
    at += NOISE * random.standard_normal(at.shape)
    q = np.zeros((len(at), 6))
    q[:, SLIDES:] = random.uniform(-0.8, 0.8, (len(at), 3))
    middle = true.forward(np.zeros((1, 6)))[:, :3, 3]
    axes = np.vstack([true.forward(np.eye(6)[k : k + 1])[:, :3, 3] - middle for k in range(SLIDES)]).T
    for _ in range(3):
        q[:, :SLIDES] += np.linalg.solve(axes, (at - true.forward(q)[:, :3, 3]).T).T
    labels = [name for name in PLACES for _ in range(COUNT)]
    if kind == "anchor":
        return Dataset.from_arrays(q, anchor=labels, distance=np.full(len(q), RADIUS), source="ball.csv")
    return Dataset.from_arrays(q, observed_labels={kind: labels}, source="touches.csv")


def in_inches(data: Dataset, columns: list[int]) -> Dataset:
    """As if a column in inches had been called mm."""
    q = data.q.copy()
    q[:, columns] /= 25.4
    return replace(data, q=q)


def scaled(data: Dataset, size: float) -> Dataset:
    assert data.distance is not None
    return replace(data, distance=size * data.distance)


@pytest.mark.parametrize("size", [2.0, 1 / 25.4, 10.0])
def test_a_diameter_or_another_unit_for_a_radius_is_refused(size: float) -> None:
    right = touches("anchor")
    assert fastcal.calibrate(ARM, right).status == "converged"
    with pytest.raises(InvalidInput) as refused:
        fastcal.calibrate(ARM, scaled(right, size))
    text = str(refused.value)
    assert f"ball.csv: distance_mm is {12.7 * size:.4g}, which the touches miss by" in text
    radius = float(text.partition("a sphere of radius ")[2].partition(" mm")[0])
    assert radius == pytest.approx(12.7, rel=0.05)
    assert "is it a diameter" in text


def test_a_diagnosis_refuses_a_diameter_too() -> None:
    with pytest.raises(InvalidInput, match=r"distance_mm is 25.4, .*; is it a diameter"):
        fastcal.diagnose(ARM, scaled(touches("anchor"), 2.0))


def test_as_read_says_it_in_a_note() -> None:
    found = fastcal.calibrate(ARM, scaled(touches("anchor"), 2.0), as_read=True)
    assert any("is it a diameter" in note for note in found.notes)
    assert not any("--as-read" in note for note in found.notes)


@pytest.mark.parametrize("kind", ["socket", "ball"])
@pytest.mark.parametrize("columns", [[0, 1, 2], [0]])
def test_slides_in_inches_are_refused(kind: str, columns: list[int]) -> None:
    """One slide of sockets ended with "the observations have 3 unknowns, got 9 starting values"."""
    right = touches(kind)
    assert not [note for note in fastcal.calibrate(ARM, right).notes if "do not fit" in note]
    names = ", ".join(f"q{k + 1}" for k in columns)
    with pytest.raises(InvalidInput, match=f"with {names} in inches instead of mm; which unit do the titles say"):
        fastcal.calibrate(ARM, in_inches(right, columns))


def test_lengths_that_change_and_points_are_no_touches() -> None:
    def none(other: Dataset) -> Evaluation:
        raise AssertionError(f"{other.source}: looked at")

    wire = touches("anchor")
    fit = fastcal.calibrate(ARM, wire, checks=False).train
    wire = replace(wire, distance=np.linspace(0.1, 0.2, len(wire)))
    assert check_touches(fastcal.load_robot("ur5"), wire, fit, none) == []
    points: FloatArray = np.zeros((len(wire), 3))
    assert check_touches(ARM, replace(wire, position=points), fit, none) == []


def test_a_radius_that_is_a_little_off_is_no_other() -> None:
    given: dict[str, Any] = {"missed": 1e-3, "better": 1e-5}
    assert another_radius(0.025, radius=0.024, **given) is None
    assert another_radius(0.025, radius=0.0125, **given) is not None
    assert another_radius(0.025, missed=1e-4, radius=0.0125, better=5e-5) is None
