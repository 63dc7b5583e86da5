# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The controller's flange in the last frame of a table, apart from the tool that calibration identifies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.compensation import compensate_program
from fastcal.errors import ParseError
from fastcal.programs import Cell, read_program
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.core_model import pose

HALF_TURN = {"xyz_mm": [0, 0, 0], "rpy_deg": [180, 0, 0]}
TOOL = {"xyz_mm": [50.0, -20.0, 180.0], "rpy_deg": [10.0, 30.0, -20.0]}
ASKEW = {"xyz_mm": [12.0, -7.0, 30.0], "rpy_deg": [170.0, 25.0, -60.0]}
KRL = (
    "DEF A()\n$TOOL={X 50,Y -20,Z 180,A -20,B 30,C 10}\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n"
    "LIN {X 600,Y -223,Z 595,A -148.4,B -22.1,C -132,S 2,T 2}\n"
    "LIN {X 597,Y -252,Z 592,A -152.4,B -23.8,C -132,S 2,T 2}\nEND\n"
)


def without(spec: dict, key: str) -> dict:
    return {k: v for k, v in spec.items() if k != key}


def frame(T: np.ndarray) -> dict:
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz", degrees=True)
    return {"xyz_mm": (T[:3, 3] * 1e3).tolist(), "rpy_deg": rpy.tolist()}


def old(robot: fastcal.Robot) -> fastcal.Robot:
    """The same arm as files had it: the flange in the tool."""
    tool = pose(robot.spec["flange"]) @ pose(robot.spec["tool"])
    return fastcal.Robot(without(robot.spec, "flange") | {"tool": frame(tool)})


@pytest.mark.parametrize("name", ["kuka_kr6_r900", "kuka_kr210_r2700"])
def test_the_shipped_arms_have_their_half_turn_apart_from_the_tool(name) -> None:
    robot = fastcal.load_robot(name)
    assert robot.spec["flange"] == HALF_TURN
    assert robot.spec["tool"] == {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}


@pytest.mark.parametrize("name", ["kuka_kr6_r900", "staubli_rx160l"])
def test_it_stands_between_the_last_row_and_the_tool(name) -> None:
    spec = without(fastcal.load_robot(name).spec, "flange")
    bare = fastcal.Robot(spec | {"tool": frame(np.eye(4))})
    robot = fastcal.load_robot(spec | {"flange": ASKEW, "tool": TOOL})
    q = fastcal.random_poses(bare, 20, seed=1)
    np.testing.assert_allclose(robot.forward(q), bare.forward(q) @ pose(ASKEW) @ pose(TOOL), atol=1e-12)
    np.testing.assert_allclose(old(robot).forward(q), robot.forward(q), atol=1e-12)
    # What the tool's numbers move is along the flange's axes.
    R = (bare.forward(q) @ pose(ASKEW))[:, :3, :3]
    J = robot.parameter_jacobian(q)
    place = robot.parameter_names.index("tool x")
    np.testing.assert_allclose(J[:, :, place : place + 3], R, atol=1e-12)


def test_loads_hang_on_the_flange() -> None:
    """A compliant arm with a payload, told from the last frame or from the flange."""
    yielding = [{"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": {"value": 2e-6}}}]
    spec = fastcal.load_robot("staubli_rx160l").spec | {"effects": yielding}
    com = np.array([0.06, -0.02, 0.2])
    T = pose(ASKEW)
    turned = T[:3, :3] @ com + T[:3, 3]
    new = fastcal.load_robot(spec | {"flange": ASKEW, "tool": TOOL, "payload": {"com_mm": (com * 1e3).tolist()}})
    plain = fastcal.load_robot(spec | {"tool": frame(T @ pose(TOOL)), "payload": {"com_mm": (turned * 1e3).tolist()}})
    q = fastcal.random_poses(new, 20, seed=2)
    np.testing.assert_allclose(new.forward(q, payload=14.0), plain.forward(q, payload=14.0), atol=1e-12)
    assert np.abs(new.forward(q, payload=14.0) - new.forward(q, payload=0.0)).max() > 1e-5


def test_a_calibration_identifies_the_tool_from_the_flange() -> None:
    robot = fastcal.load_robot("kuka_kr6_r900")
    true = fastcal.Robot(fastcal.perturbed(robot, seed=3).spec | {"tool": TOOL})
    data = fastcal.simulate(true, fastcal.random_poses(robot, 60, seed=4), noise=1e-5, seed=5)
    model = fastcal.calibrate(robot, data).model
    assert model.spec["flange"] == HALF_TURN
    # Joint 6 and the tool's z share a turn and a shift: the point says the rest.
    np.testing.assert_allclose(model.spec["tool"]["xyz_mm"], TOOL["xyz_mm"], atol=2.0)


@pytest.mark.parametrize("to", ["dh", "mdh", "poe", "urdf"])
def test_conversions_keep_flange_and_tool(to, tmp_path) -> None:
    robot = fastcal.load_robot(
        without(fastcal.load_robot("kuka_kr6_r900").spec, "flange") | {"flange": ASKEW, "tool": TOOL}
    )
    found = fastcal.Robot(fastcal.convert(robot, to).spec)
    q = fastcal.random_poses(robot, 20, seed=6)
    np.testing.assert_allclose(found.forward(q), robot.forward(q), atol=1e-11)
    assert found.spec["tool"] == robot.spec["tool"]
    found.save(tmp_path / "arm.yaml")
    assert fastcal.load_robot(tmp_path / "arm.yaml").spec == found.spec
    back = fastcal.Robot(fastcal.convert(found, "dh").spec)
    np.testing.assert_allclose(back.forward(q), robot.forward(q), atol=1e-11)
    assert back.spec["tool"] == robot.spec["tool"]


def test_a_urdf_that_is_written_ends_at_the_flange(tmp_path) -> None:
    robot = fastcal.load_robot("kuka_kr6_r900")
    fastcal.Robot(fastcal.convert(robot, "urdf").spec).save(tmp_path / "arm.urdf")
    read = fastcal.load_robot(tmp_path / "arm.urdf")
    assert read.spec["source"]["tip_link"] == "flange"
    q = fastcal.random_poses(robot, 5, seed=7)
    np.testing.assert_allclose(read.forward(q), robot.forward(q), atol=1e-12)


def test_a_file_of_screws_has_its_flange_at_home() -> None:
    spec = fastcal.convert(fastcal.load_robot("kuka_kr6_r900"), "poe").spec
    with pytest.raises(ParseError, match="flange: goes with kinematics dh, mdh and urdf; home is the flange"):
        fastcal.load_robot(spec | {"flange": HALF_TURN})


def compensated(model: fastcal.Robot, **options: object) -> np.ndarray:
    program = read_program({"A.src": KRL.encode()})
    done = compensate_program(model, program, **options)
    return np.array(
        [
            [number.value for number in target.numbers]
            for target in read_program({"A.src": done.documents[0].text.encode()}).targets
        ]
    )


def test_programs_are_told_from_it_and_a_cell_file_overrides_it() -> None:
    robot = fastcal.load_robot("kuka_kr6_r900")
    real = fastcal.perturbed(robot, seed=8)
    T = pose(HALF_TURN)
    mine = compensated(real, nominal=robot)
    # The old file with the flange in the cell, the new one with the cell that the old one needed, or without one.
    np.testing.assert_allclose(compensated(old(real), nominal=old(robot), cell=Cell(T_last_flange=T)), mine, atol=1e-3)
    np.testing.assert_allclose(compensated(real, nominal=robot, cell=Cell(T_last_flange=T)), mine, atol=1e-3)
    # A model of before, given the arm that is shipped now.
    np.testing.assert_allclose(compensated(old(real), nominal=robot, cell=Cell(T_last_flange=T)), mine, atol=1e-3)
    q = fastcal.random_poses(robot, 5, seed=9)
    np.testing.assert_allclose(
        nominal_robot(old(real), robot).forward(q), nominal_robot(real, robot).forward(q), atol=1e-12
    )
    assert np.abs(mine - compensated(real, nominal=real)).max() > 0.05


def test_a_gripper_on_tool0_moves_no_program(tmp_path: Path) -> None:
    """The flange of a program is tool0, and the command says where the arm ends."""
    links = "".join(f"<link name='{n}'/>" for n in ("base", *(f"l{i}" for i in range(1, 7)), "tool0", "hand", "lens"))
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    at = ("0 0 .3", ".1 0 .2", "0 0 .5", ".2 0 .1", ".4 0 0", ".1 0 0")
    joints = "".join(
        f"<joint name='j{i}' type='revolute'><origin xyz='{xyz}'/><parent link='{'base' if i == 1 else f'l{i - 1}'}'/>"
        f"<child link='l{i}'/><axis xyz='{axis}'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>"
        for i, (xyz, axis) in enumerate(zip(at, axes, strict=True), start=1)
    )
    fixed = "".join(
        f"<joint name='{child}' type='fixed'><origin xyz='.05 0 0' rpy='0 1.5707963267948966 .3'/>"
        f"<parent link='{parent}'/><child link='{child}'/></joint>"
        for parent, child in (("l6", "tool0"), ("tool0", "hand"), ("l6", "lens"))
    )
    (tmp_path / "arm.urdf").write_text(f"<robot name='a'>{links}{joints}{fixed}</robot>")
    (tmp_path / "bare.urdf").write_text(
        f"<robot name='a'>{links}{joints}{fixed}</robot>".replace("<link name='hand'/>", "").replace(
            fixed[fixed.index("<joint name='hand'") : fixed.index("<joint name='lens'")], ""
        )
    )
    arm, bare = (fastcal.load_robot(tmp_path / f"{name}.urdf") for name in ("arm", "bare"))
    assert arm.spec["source"]["tip_link"] == bare.spec["source"]["tip_link"] == "tool0"
    q = fastcal.random_poses(arm, 5, seed=1)
    np.testing.assert_allclose(arm.forward(q), bare.forward(q), atol=1e-15)
    named = fastcal.load_robot(tmp_path / "arm.urdf", tip_link="hand")
    assert np.abs(named.forward(q) - arm.forward(q)).max() > 0.01
    module = (
        "MODULE a\nCONST jointtarget j1:=[[10,20,30,40,50,60],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
        "PROC main()\nMoveAbsJ j1,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    )
    done = compensate_program(arm, read_program({"a.mod": module.encode()}))
    assert any("a ends at the link tool0 of its URDF" in note for note in done.notes)
