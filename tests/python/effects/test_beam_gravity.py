# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray robot's beams: where its tip goes, against a frame solved beside it, and found again in what they made."""

import copy
import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import perturbed, random_poses, simulate
from fastcal.io.robot_file import load_robot, read_spec
from fastcal.robot.robot import Robot
from fastcal.robot.structure import full_matrix
from fastcal.units import to_si

ROOT = Path(__file__).parents[3]
GROUPS = ["base", "arm", "forearm", "telescope"]


def bent(robot: Robot, scale: float = 1.0, **more: Any) -> Robot:
    spec = copy.deepcopy(robot.spec) | more
    spec["effects"] = [{"effect": "beam_gravity", "owner": "structure", "parameters": {"scale": {"value": scale}}}]
    return Robot(spec)


@pytest.fixture(scope="module")
def spray() -> Robot:
    return load_robot("spray_7dof")


def test_own_weight_moves_the_tip_by_2_to_4_mm_at_full_reach(spray: Robot) -> None:
    reach = np.array([0, 0, to_si(20.0, "deg"), to_si(60.0, "deg"), 0, 0.8, 0])
    shift = (bent(spray).forward(reach) - spray.forward(reach))[0, :3, 3]
    assert 0.002 < np.linalg.norm(shift) < 0.004
    assert shift[2] < 0
    assert abs(shift[1]) < 1e-9  # the arm lies in its plane, and so does all of its weight


def test_the_table_of_unit_9_samples_its_formula() -> None:
    unit9 = runpy.run_path(str(ROOT / "bench" / "papers" / "spray_unit9.py"))
    table = read_spec("spray_7dof")["structure"]["tables"]["telescope"]
    grid = [(a, d) for a in table["angle_deg"] for d in table["extension_mm"]]
    for (angle, extension), upper in zip(grid, table["matrices_si"], strict=True):
        K = unit9["unit9_stiffness"](math.radians(angle), extension / 1000)
        size = np.sqrt(np.outer(np.diag(K), np.diag(K)))
        assert np.abs(full_matrix(upper) - K).max(initial=0, where=size > 0) <= 1e-6 * np.abs(K).max()


def test_the_tip_goes_where_a_frame_solved_beside_it_goes(spray: Robot) -> None:
    """Ten nodes worked out from the arm's sizes alone, in its plane; small displacements, so a tiny scale."""
    theta3, theta4, extension, tiny = math.radians(50), math.radians(-10), 0.5, 1e-5
    out, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    arm = math.cos(theta3) * out + math.sin(theta3) * up
    neck = math.cos(theta3 + theta4) * out + math.sin(theta3 + theta4) * up
    fore = math.sin(theta3 + theta4) * out - math.cos(theta3 + theta4) * up
    turntable = 0.8 * up
    shoulder = turntable + 0.3 * out
    elbow = shoulder + 1.5 * arm
    crank, lever = shoulder - 0.35 * fore, elbow - 0.35 * fore
    sleeve = elbow + 0.2 * neck + 0.9 * fore
    wrist = sleeve + (0.6 + extension) * fore
    nodes = np.array([0 * up, turntable, shoulder, crank, lever, elbow, elbow + 0.2 * neck, sleeve, wrist,
                      wrist + 0.3 * fore])  # fmt: skip
    structure = spray.spec["structure"]
    names = [node["name"] for node in structure["nodes"]]
    sections = [
        structure["sections"].get(e.get("section"), structure["sections"]["gun"]) for e in structure["elements"]
    ]
    pairs = [(names.index(e["start"]), names.index(e["end"])) for e in structure["elements"]]
    hinges = [(k, end, e[key]) for k, e in enumerate(structure["elements"])
              for end, key in enumerate(("start_hinge", "end_hinge")) if key in e]  # fmt: skip
    unit9 = runpy.run_path(str(ROOT / "bench" / "papers" / "spray_unit9.py"))["unit9_stiffness"]
    frame = fastcal.BeamFrame(
        pairs,
        **{key: [s.get(key, 0.0) for s in sections] for key in sections[0]},
        mass_kg=[e["mass_kg"] for e in structure["elements"]],
        fixed=[0],
        hinges=hinges,
        stiffness={8: unit9(0.0, extension)},
    )
    load = np.zeros((10, 6))
    load[9] = np.concatenate([[0, 0, -6 * 9.80665], np.cross(-0.15 * fore, [0, 0, -6 * 9.80665])])  # 6 kg half way
    u = frame.solve(nodes[np.newaxis], load, up=np.cross(arm, neck) if theta4 > 0 else np.cross(neck, arm))[0]
    q = np.array([0, 0, theta3, theta4, 0, extension, to_si(0.0, "deg")])
    # The gun points along x7; theta7 = 0 turns it along the forearm.
    assert spray.forward(q)[0, :3, 3] == pytest.approx(nodes[9], abs=1e-9)
    moved = bent(spray, tiny, equilibrium=False).forward(q, payload=6.0) - spray.forward(q)
    assert moved[0, :3, 3] / tiny == pytest.approx(u[9, :3], rel=2e-3, abs=1e-7)  # the table is fitted to 0.4 %


def test_groups_are_found_with_geometry_in_what_they_made(spray: Robot, tmp_path: Path) -> None:
    truth_spec = copy.deepcopy(perturbed(spray, seed=3).spec)
    scales = {"scale_base": 1.3, "scale_arm": 0.8, "scale_forearm": 1.15, "scale_telescope": 1.6}
    truth_spec["effects"] = [{"effect": "beam_gravity", "owner": "structure", "by": "group", "parameters": scales}]
    q = random_poses(spray, 150, seed=1)
    data = simulate(
        Robot(truth_spec), q, noise=to_si(0.03, "mm"), seed=2, payload=np.where(np.arange(150) % 2, 15.0, 0.0)
    )
    found = calibrate(spray, data, effects="geometry,beam_gravity:by=group")
    assert found.status == "converged"
    got = found.model.spec["effects"][0]["parameters"]
    for name, value in scales.items():
        assert abs(got[name]["value"] - value) < 3.5 * got[name]["std"] < 1.0, name
    found.model.save(tmp_path / "model.yaml")
    loaded = load_robot(tmp_path / "model.yaml")
    assert np.array_equal(loaded.forward(q, payload=5.0), found.model.forward(q, payload=5.0))


def test_a_prior_holds_a_scale_near_the_robot_file(spray: Robot) -> None:
    """Three postures with the arm upright tell nothing of the beams."""
    q = random_poses(spray, 40, seed=1)
    q[:, 2:4], q[:, 5] = [math.radians(90), math.radians(-60)], 0.0
    data = simulate(bent(spray), q, noise=to_si(0.03, "mm"), seed=2)
    found = calibrate(spray, data, effects="beam_gravity:by=group:prior=yes")
    for got in found.model.spec["effects"][0]["parameters"].values():
        assert got["value"] == pytest.approx(1.0, abs=3 * got["std"])
        assert got["std"] <= 0.51
