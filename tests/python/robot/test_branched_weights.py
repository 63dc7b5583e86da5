# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A torso with two arms and a head: gravity torques against pinocchio, the other arm's posture with and without it."""

from __future__ import annotations

import runpy
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest

from fastcal import (
    calibrate,
    diagnose,
    inverse_kinematics,
    load_measurements,
    load_robot,
    perturbed,
    predict,
    random_poses,
    simulate,
)
from fastcal.diagnosis.problem import with_nuisances
from fastcal.effects.entries import effect_owners
from fastcal.errors import ParseError
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

Spec = dict[str, Any]
NOISE = 2e-4
YIELDING = {2: 4e-5, 12: 3e-5, 13: 3e-5, 14: 3e-5, 15: 6e-5}  # [rad / (N m)] by joint
BESIDE = list(range(2, 11))
BENCH: Any = runpy.run_path(str(Path(__file__).parents[3] / "bench" / "python" / "bench_torsos.py"))


@cache
def torso() -> Robot:
    robot: Robot = BENCH["torso"]()
    return robot


def yielding() -> list[Spec]:
    return [
        {"effect": "joint_compliance", "owner": f"joint{k}", "parameters": {"compliance_rad_nm": c}}
        for k, c in YIELDING.items()
    ]


@cache
def measured(seed: int) -> tuple[Dataset, Dataset, Dataset]:
    """150 points, the same without the posture of what is beside the arm, and 200 others."""
    real = perturbed(torso(), seed=seed).with_(effects=yielding())
    q, other = (random_poses(torso(), count, seed=seed + k) for k, count in ((10, 150), (20, 200)))
    data = simulate(real, q, noise=NOISE, seed=seed + 30)
    q = q.copy()
    q[:, BESIDE] = 0
    return data, replace(data, q=q), simulate(real, other, noise=NOISE, seed=seed + 40)


def in_pinocchio(robot: Robot) -> pinocchio.Model:
    model = pinocchio.Model()
    model.gravity.linear = np.array([0.0, 0.0, -9.80665])
    ids: dict[str, int] = {}
    before = 0
    for k, spec in enumerate(robot.spec["joints"], start=1):
        parent = ids[spec["on"]] if "on" in spec else before
        axis = np.array(spec["axis"], dtype=float)
        place = pinocchio.SE3(np.eye(3), np.array(spec["origin"]["xyz_mm"]) / 1e3)
        before = ids[f"link{k}"] = model.addJoint(
            parent, pinocchio.JointModelRevoluteUnaligned(axis), place, spec["name"]
        )
        link = spec["link"]
        inertia = pinocchio.Inertia(link["mass_kg"], np.array(link["com_mm"]) / 1e3, np.eye(3) * 1e-3)
        model.appendBodyToJoint(before, inertia, pinocchio.SE3.Identity())
    return model


def test_gravity_torques_of_all_joints_are_pinocchio_s() -> None:
    robot, model = torso(), in_pinocchio(torso())
    q = random_poses(robot, 20, seed=1)
    samples = robot.conditions(q)
    loads = np.asarray(robot.error_model.loads(samples, robot.error_model.start))
    for i, posture in enumerate(q):
        expected = pinocchio.computeGeneralizedGravity(model, model.createData(), posture)
        assert np.abs(loads[i, 1::2, 5][: len(expected)] + expected).max() < 1e-10


def test_a_heavier_link_of_the_other_arm_is_its_weight_in_the_file_and_is_found() -> None:
    heavy = deepcopy(torso().spec)
    heavy["joints"][4]["link"]["mass_kg"] += 1.5  # the right upper arm
    q = random_poses(torso(), 60, seed=3)
    real = load_robot(heavy).with_(effects=yielding())
    entry = {"effect": "link_mass", "owner": "link5", "parameters": {"extra_kg": 1.5}}
    lighter = torso().with_(effects=yielding())
    points = [
        predict(robot, Dataset.from_arrays(q)).position for robot in (real, lighter.with_(effects=[*yielding(), entry]))
    ]
    assert np.abs(points[0] - points[1]).max() < 1e-9
    data = simulate(real, q, noise=1e-6, seed=4)
    found = calibrate(lighter, data, parameters=["link5 extra"], effects=["link_mass@link5"])
    (extra,) = (p for p in found.parameters if p.owner == "link5")
    assert extra.value == pytest.approx(1.5, abs=4 * extra.std)
    assert extra.std < 0.05


def test_only_what_moves_the_tool_can_yield() -> None:
    owners = effect_owners("joint_compliance", torso().core)
    assert owners == ["joint1", "joint2", *(f"joint{k}" for k in range(12, 19))]
    assert "link5" in effect_owners("link_mass", torso().core)  # it weighs
    assert not any("joint5" in owner for owner in effect_owners("coupling_ratio", torso().core))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_points_are_predicted_within_a_tenth_of_their_floor(seed: int) -> None:
    data, _, test = measured(seed)
    effects = ["geometry", *(f"joint_compliance@joint{k}" for k in YIELDING)]
    found = calibrate(torso(), data, effects=effects, test=test)
    assert found.test is not None
    rms = np.sqrt(np.mean(np.sum(found.test.error_after**2, axis=1)))
    assert rms < 1.1 * NOISE * 3**0.5


@pytest.mark.full
def test_the_other_arm_s_posture_is_missed_where_it_is_not_in_the_data() -> None:
    _, without, _ = measured(1)
    found = [f for f in diagnose(torso(), without).effects if f.effect == "branch_posture"]
    assert [f.label for f in found] == ["branch_posture@link2"]
    assert found[0].grade == "B"
    assert found[0].snr > 5


@pytest.mark.full
def test_a_posture_that_is_in_the_data_is_not_missed() -> None:
    data, without, _ = measured(1)
    assert not [f for f in diagnose(torso(), data).effects if f.effect == "branch_posture"]
    still = replace(data, q=without.q)
    assert not [f for f in diagnose(torso(), still, exclude=["branch_posture"]).effects if f.effect == "branch_posture"]


@pytest.mark.full
def test_an_arm_that_stood_still_is_not_said_to_have_moved() -> None:
    q = random_poses(torso(), 150, seed=7)
    q[:, BESIDE] = 0
    data = simulate(perturbed(torso(), seed=7).with_(effects=yielding()), q, noise=NOISE, seed=8)
    assert not [f for f in diagnose(torso(), data).effects if f.effect == "branch_posture"]


def test_a_file_without_columns_of_the_other_arm_is_read_and_says_so(tmp_path: Path) -> None:
    data, without, _ = measured(0)
    write_measurements(tmp_path / "all.csv", data, torso().joint_types)
    lines = [line.split(",") for line in (tmp_path / "all.csv").read_text().splitlines()]
    kept = [k for k, name in enumerate(lines[0]) if name not in [f"q{i + 1}_deg" for i in BESIDE]]
    (tmp_path / "few.csv").write_text("\n".join(",".join(line[k] for k in kept) for line in lines) + "\n")
    read = load_measurements(tmp_path / "few.csv", torso())
    assert np.allclose(read.q, without.q, atol=1e-9)
    assert "joints 3, 4, 5, 6, 7, 8, 9, 10, 11 have no column" in " ".join(read.notes)
    kept = [k for k in kept if lines[0][k] != "q12_deg"]
    (tmp_path / "none.csv").write_text("\n".join(",".join(line[k] for k in kept) for line in lines) + "\n")
    with pytest.raises(ParseError, match="joint 12 has no column"):
        load_measurements(tmp_path / "none.csv", torso())


def test_a_robot_without_masses_whose_joint_yields_is_diagnosed_beside_other_branches() -> None:
    light = deepcopy(torso().spec)
    for joint_of in light["joints"]:
        joint_of.pop("link")
    assert effect_owners("gravity_sag", load_robot(light).core) == []
    entry = {"effect": "joint_compliance", "owner": "joint13"}
    assert with_nuisances([entry], load_robot(light)) == [entry]


def test_commands_for_the_hand_of_a_torso() -> None:
    """18 joints, of which those of the other arm and the head stay where the seed has them."""
    q = random_poses(torso(), 5, seed=2)
    seed = q + 0.05 * np.isin(np.arange(torso().joint_count), BESIDE, invert=True)
    T = torso().forward(q)
    found = inverse_kinematics(torso(), T, seed=np.clip(seed, *torso().limits.T))
    assert found.reached.all()
    assert np.abs(torso().forward(found.q) - T).max() < 1e-8
    assert np.array_equal(found.q[:, BESIDE], q[:, BESIDE])
