# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Points of another arm, which a calibration brings nearer but never near: it is asked which arm was measured.

Found with a tracker's file of others, whose arm is not among those included: an arm of the same axes was calibrated
from 139 to 9 mm without a word.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.inspection import check_fit
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.residual_checks import shift_note
from fastcal.calibration.shifted_rows import Shift
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.kinds import POINTS, kind_named

from ..cells import camera_scene as scene

ARM = load_robot("ur5e")


@pytest.mark.parametrize(
    ("before", "after", "is_another"),
    [(5e-2, 2e-3, True), (5e-2, 1e-4, False), (2e-3, 2e-3, False)],
)
def test_an_arm_that_is_far_off_before_and_after_is_asked_about(before: float, after: float, is_another: bool) -> None:
    data = simulate(perturbed(ARM, seed=1), random_poses(ARM, 40, seed=1), noise=5e-5, seed=1)
    train = calibrate(ARM, data).train
    assert check_fit(ARM, train) == []
    off = np.zeros((40, 3))
    off[:, 0] = 1.0
    notes = check_fit(ARM, replace(train, error_before=before * off, error_after=after * off))
    assert [note.endswith("is it this arm that was measured?") for note in notes] == [True] * is_another


@pytest.mark.parametrize(("before", "after", "is_another"), [(40.0, 7.0, True), (40.0, 1.0, False), (7.0, 7.0, False)])
def test_so_is_an_arm_that_pictures_show_to_be_far_off(
    tmp_path: Path, before: float, after: float, is_another: bool
) -> None:
    """Pictures of a Panda, read as an iiwa's, were fitted to 9 px without a word."""
    data = simulate(perturbed(ARM, seed=1), random_poses(ARM, 40, seed=1), noise=5e-5, seed=1)
    scene.write(tmp_path, 5)
    seen = load_robot(tmp_path / "cell.yaml")  # pictures 1280 px wide
    off = np.full((40, 24, 2), 0.5**0.5)
    errors = KindErrors(kind_named(CORNERS), after * off, before * off)
    notes = check_fit(seen, replace(calibrate(ARM, data).train, kinds={CORNERS: errors}))
    assert ["is it this arm that moved" in note for note in notes] == [True] * is_another


@pytest.mark.parametrize(("name", "who"), [(CORNERS, "the camera, the base or the board"), (POINTS, "the tracker")])
def test_what_moved_is_called_by_its_name(name: str, who: str) -> None:
    """Of a camera it was said that the tracker moved."""
    shift = Shift((10,), 1e-3, np.zeros((0, 0)), 0.0, stands_out=True)
    for is_used in (True, False):
        assert who in shift_note(shift, 20, kind_named(name), is_used=is_used)
