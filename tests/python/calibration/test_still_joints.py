# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints that stood still in all rows: nothing is listed of each, and no curve over their noise is tried."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.extrapolation_notes import still_joints
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.rivals import Rivals
from fastcal.diagnosis.search import Search
from fastcal.measurements.dataset import Dataset
from fastcal.report.language import in_language
from fastcal.report.summaries import summary

ARM = load_robot("ur5e")


@cache
def rows() -> Dataset:
    """The first two joints move; the others are read within a thousandth of a radian of one posture."""
    q = random_poses(ARM, 60, seed=1)
    q[:, 2:] = np.random.default_rng(1).uniform(-1e-3, 1e-3, (60, 4))
    q[:, 2:] += [1.0, -0.4, 0.7, 0.2]
    return simulate(perturbed(ARM, seed=1), q, noise=5e-5, seed=1)


def test_they_are_those_that_move_by_less_than_a_degree() -> None:
    assert still_joints(ARM, rows()) == ["joint3", "joint4", "joint5", "joint6"]


STILL = {
    "en": "of joint 3, joint 4, joint 5 and joint 6, which stood still in these rows: result.json has them",
    "de": "von Gelenk 3, Gelenk 4, Gelenk 5 und Gelenk 6, die in diesen Zeilen stillstanden: result.json nennt sie",
}


@pytest.mark.parametrize("language", list(STILL))
def test_what_they_leave_open_is_one_line(language: str) -> None:
    result = calibrate(ARM, rows())
    of_still = [of for of in result.unidentifiable if of.parameters[0].split()[0] in still_joints(ARM, rows())]
    assert len(of_still) > 10
    with in_language(language):
        lines = [line.replace("\N{NO-BREAK SPACE}", " ") for line in summary(result)]
    assert f"  {len(of_still)} {STILL[language]}" in lines
    assert not any(of.direction in line for of in of_still for line in lines)


def test_no_curve_over_their_positions_is_tried() -> None:
    problem = prepared_problem(ARM, rows(), build_library(ARM, rows()).names, Noise((5e-5, 1e-4, 5e-5)), 1)
    assert [entry["owner"] for entry in Rivals(Search(problem)).every] == ["joint1", "joint2"]
