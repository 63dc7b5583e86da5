# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What small moves reach in a singular posture is nearer than without them, also where the arm is stretched."""

import numpy as np
import pytest

import fastcal
from fastcal.compensation.one_step import pose_errors
from fastcal.compensation.singular_targets import command_by_small_moves

STRETCHED = [[10, -20, 10, 0, 30, 0], [0, -90, 0, 0, 0, 0], [20, -50, 6, 0, 40, 10]]
HOME = [0, -90, 90, 0, 0, 0]


@pytest.mark.parametrize("posture", [*STRETCHED, HOME], ids=str)
def test_no_command_is_farther_away_than_none(posture: list[float]) -> None:
    """Steps of the nominal Jacobian led up to 500 mm away from a stretched arm's target; it was written, and said."""
    nominal = fastcal.load_robot("kuka_kr6_r900")
    q = np.radians([posture])
    pose = nominal.forward(q)
    for seed in range(20):
        model = fastcal.perturbed(nominal, seed=seed)
        found = command_by_small_moves(model, nominal, pose, q)
        assert found is not None
        command, left = found
        before = pose_errors(pose, model.forward(q))[0]
        assert np.linalg.norm(left[:3]) <= np.linalg.norm(before[:3])
        assert np.degrees(np.abs(command - q)).max() < 21
        np.testing.assert_allclose(left, pose_errors(pose, model.forward(command))[0], atol=1e-12)
        if posture == HOME:  # the wrist's alone: the point is reached
            assert np.linalg.norm(left[:3]) < 1e-6
