# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""check, update and compare of arms that are no DH arms of turning joints: a URDF, screws (POE), a slide."""

import copy
from dataclasses import dataclass

import numpy as np
import pytest

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

TURN, SLIP = 1e-3, 1e-3  # rad, m


def on_a_slide() -> Robot:
    """An RX160L on a slide that stands on a turntable."""
    spec = fastcal.load_robot("staubli_rx160l").spec
    row = {"theta_deg": 0.0, "d_mm": 0.0, "a_mm": 0.0, "beta_deg": 0.0}
    table = {"type": "revolute", **row, "alpha_deg": 90.0, "min_deg": -170, "max_deg": 170}
    slide = {"type": "prismatic", **row, "alpha_deg": -90.0, "min_mm": -800, "max_mm": 800}
    arm = [row | joint for joint in spec["joints"]]
    return Robot(spec | {"name": "on_a_slide", "joints": [table, slide, *arm]})


ARMS = {
    "urdf": lambda: Robot(fastcal.convert(fastcal.load_robot("ur10"), to="urdf").spec),
    "poe": lambda: Robot(fastcal.convert(fastcal.load_robot("staubli_rx160l"), to="poe").spec),
    "slide": on_a_slide,
}


@dataclass(frozen=True)
class Known:
    """An arm as it is, and its calibrated model."""

    true: Robot
    model: Robot

    def measured(self, count: int, joint: int | None, seed: int) -> Dataset:
        """Poses of a check, the zero of a joint (from 1) being off, before a tracker that was set up anew."""
        q = fastcal.check_poses(self.model, count).q
        off = np.zeros_like(q)
        if joint is not None:
            off[:, joint - 1] = TURN if self.true.joint_types[joint - 1] == "revolute" else SLIP
        spec = copy.deepcopy(self.true.spec) | {"base": {"xyz_mm": [900, 400, -200], "rpy_deg": [1, 2, 100]}}
        seen = fastcal.simulate(Robot(spec), q + off, noise=3e-5, seed=seed)
        return Dataset.from_arrays(q, position=seen.position, robot=self.model)


@pytest.fixture(scope="module", params=list(ARMS))
def known(request: pytest.FixtureRequest) -> Known:
    nominal = ARMS[request.param]()
    true = fastcal.perturbed(nominal, seed=2)
    data = fastcal.simulate(true, fastcal.random_poses(nominal, 60, seed=1), noise=3e-5, seed=3)
    return Known(true, fastcal.calibrate(nominal, data, checks=False).model)


def test_a_check_holds_and_lists_what_no_pose_shows(known) -> None:
    found = fastcal.check(known.model, known.measured(8, None, 5))
    assert found.verdict == "holds"
    assert "joint1 zero" in found.blind


@pytest.mark.parametrize("joint", [2, 3, 4])
def test_the_zero_that_moved_is_named(known, joint: int) -> None:
    found = fastcal.check(known.model, known.measured(8, joint, 5 + joint))
    assert found.verdict == "changed"
    (cause,) = found.causes
    assert cause.label == f"joint{joint} zero"
    (change,) = cause.changes
    slides = known.model.joint_types[joint - 1] == "prismatic"
    assert change.unit == ("mm" if slides else "deg")
    moved = 1e3 * SLIP if slides else np.degrees(TURN)
    assert change.change == pytest.approx(moved, abs=5 * change.std)
    assert change.std < 0.2 * moved


def test_update_takes_it_in_and_compare_names_it_alone(known) -> None:
    data = known.measured(12, 3, 31)
    updated = fastcal.update(known.model, data)
    assert updated.train.after is not None
    assert updated.train.after.rms < 3 * 3e-5
    assert fastcal.check(updated.model, known.measured(8, 3, 10)).verdict == "holds"
    (difference,) = fastcal.compare(known.model, updated.model).significant
    assert difference.owner == "joint3"
    assert difference.difference == pytest.approx(np.degrees(TURN), abs=5 * (difference.std or 0))
