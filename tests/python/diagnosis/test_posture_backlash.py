# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A joint that jumps where another one passes a position is found: which two, where and how far."""

import copy

import numpy as np
import pytest

import fastcal
from fastcal.calibration.simulation import perturbed

FEWEST = 5  # positions of the joint that decides on either side


@pytest.mark.parametrize(("owner", "joint", "deg"), [(1, 2, -72.0), (3, 5, 30.0)])
def test_a_diagnosis_names_the_joints_and_the_position(owner: int, joint: int, deg: float) -> None:
    nominal = fastcal.load_robot("ur5")
    q = fastcal.random_poses(nominal, 80, seed=joint)
    pair = f"joint{owner}<-joint{joint}"
    entry = {"effect": "posture_backlash", "owner": pair, "at_deg": deg, "parameters": {"gap_rad": 1e-3}}
    spec = copy.deepcopy(dict(perturbed(nominal, length=5e-4, angle=5e-4, seed=1).spec)) | {"effects": [entry]}
    seen = fastcal.simulate(fastcal.Robot(spec), fastcal.Dataset.from_arrays(q), noise=2e-5, seed=3)
    found = fastcal.diagnose(nominal, fastcal.Dataset.from_arrays(q, position=seen.position))
    assert found.verdict == "named"
    (name,) = found.effects
    assert (name.effect, name.owner) == ("posture_backlash", pair)
    assert name.grade != "C"
    own = np.degrees(q[:, joint - 1])
    assert own[own <= deg].max() < name.parameters["at_deg"].value < own[own > deg].min()
    gap = name.parameters["gap_rad"]
    assert gap.std is not None
    assert gap.value == pytest.approx(1e-3, abs=4 * gap.std)


def joint_3_jumps(seed: int) -> tuple[fastcal.Robot, fastcal.Dataset]:
    """The nominal arm and 100 points of one whose joint 3 is 0.4 mrad ahead in the upper 0.4 of its positions."""
    nominal = fastcal.load_robot("siasun_sr210d")
    q = fastcal.random_poses(nominal, 100, seed=seed)
    jumped = q.copy()
    jumped[:, 2] += 4e-4 * (q[:, 2] > np.quantile(q[:, 2], 0.6))
    seen = fastcal.simulate(perturbed(nominal, seed=seed), fastcal.Dataset.from_arrays(jumped), noise=4e-5, seed=seed)
    return nominal, fastcal.Dataset.from_arrays(q, position=seen.position)


def test_a_joint_that_jumps_itself_is_named_and_no_other_one() -> None:
    """An encoder that loses counts at a position: a joint of parallel axis that jumps there was named, with grade A."""
    nominal, data = joint_3_jumps(2)
    (name,) = fastcal.diagnose(nominal, data).effects
    assert (name.label, name.grade) == ("encoder_jump@joint3", "B")
    assert ("joint_profile", "joint3") in name.equivalents
    own = np.degrees(data.q[:, 2])
    edge = np.quantile(own, 0.6)
    before, after = own[own <= edge].max(), own[own > edge].min()
    assert before < name.parameters["at_deg"].value < after
    jump = name.parameters["jump_rad"]
    assert jump.std is not None
    assert jump.value == pytest.approx(4e-4, abs=4 * jump.std)


def test_a_joint_of_parallel_axis_is_doubtful_where_its_encoder_is_excluded() -> None:
    found = fastcal.diagnose(*joint_3_jumps(0), exclude=["encoder_jump"])
    (name,) = found.effects
    assert (name.label, name.grade) == ("posture_backlash@joint2<-joint3", "C")
    assert name.reasons[0] == "a jump of joint 3 at this position of its own would fit as well: check its encoder"
    assert "the cause may be another one" in found.sentence


def test_a_jump_leaves_enough_rows_on_either_side() -> None:
    """A jump of the last two rows is not taken for one: two rows fit anything."""
    robot = fastcal.load_robot("ur5")
    q = fastcal.random_poses(robot, 60, seed=0)
    moved = q.copy()
    moved[q[:, 1] >= np.sort(q[:, 1])[-2], 0] += 1e-3
    data = fastcal.Dataset.from_arrays(q, position=robot.forward(moved)[:, :3, 3])
    found = fastcal.calibrate(robot, data, effects="geometry,posture_backlash@joint1<-joint2", loss="none")
    (entry,) = found.model.spec["effects"]
    above = np.sum(np.degrees(q[:, 1]) > entry["parameters"]["at_deg"]["value"])
    assert FEWEST <= above <= len(q) - FEWEST


def test_a_slider_decides_in_millimetres() -> None:
    nominal = fastcal.load_robot("spray_7dof")
    q = fastcal.random_poses(nominal, 80, seed=2)
    entry = {"effect": "posture_backlash", "owner": "joint3<-joint1", "at_mm": 600.0, "parameters": {"gap_rad": 1e-3}}
    spec = copy.deepcopy(dict(nominal.spec)) | {"effects": [entry]}
    seen = fastcal.simulate(fastcal.Robot(spec), fastcal.Dataset.from_arrays(q), noise=2e-5, seed=3)
    data = fastcal.Dataset.from_arrays(q, position=seen.position)
    found = fastcal.calibrate(nominal, data, effects="geometry,posture_backlash@joint3<-joint1")
    at = found.model.spec["effects"][-1]["parameters"]["at_mm"]["value"]
    own = 1e3 * q[:, 0]
    assert own[own <= 600.0].max() < at < own[own > 600.0].min()
