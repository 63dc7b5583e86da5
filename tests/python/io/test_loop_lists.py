# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Loops as lists of frames and as elements of a URDF: one five-bar in each, against circles that meet."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import load_robot
from fastcal.errors import ParseError
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]
CRANK, ROD, APART = 0.2, 0.32, 0.2
MOTORS = {"q_left": 120.0, "q_right": 60.0}  # [deg] as drawn


def meeting(left: float, right: float) -> Array:
    """Where the rods meet, above the cranks' ends; motors from the horizontal [deg]."""
    ends = [np.array([side * APART / 2, 0.0]) for side in (-1, 1)]
    a, b = (
        end + CRANK * np.array([np.cos(q), np.sin(q)]) for end, q in zip(ends, np.radians([left, right]), strict=True)
    )
    half = (b - a) / 2
    rise = np.sqrt(ROD**2 - half @ half) / np.linalg.norm(half)
    return np.asarray(a + half + rise * np.array([-half[1], half[0]]))


def _joint(name: str, parent: str, child: str, place: str, kind: str = "revolute") -> str:
    axis = "0 0 0" if kind == "fixed" else "0 0 1"  # as exporters write it
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{place}'
        f'<axis xyz="{axis}"/><limit lower="-3.2" upper="3.2" effort="1" velocity="1"/></joint>'
    )


def _origin(x: float, y: float = 0.0, z: float = 0.0, yaw: float = 0.0, tag: str = "origin") -> str:
    return f'<{tag} xyz="{x} {y} {z}" rpy="0 0 {yaw!r}"/>'


def drawn(folder: Path, ends: tuple[str, str] = ("pin_A", "pin_B"), more: str = "", *, knee: bool = False) -> Path:
    """A five-bar drawn with its loop closed at joints of 0; a frame at the end of each rod, turned alike.

    With `knee` the tool's link carries the left rod, which is pinned to its crank.
    """
    top = meeting(*MOTORS.values())
    joints, links = "", ["base", "left", "right", "left_rod", "right_rod", "tcp", *ends]
    yaw = {}
    for side, (motor, angle) in zip((-1, 1), MOTORS.items(), strict=True):
        name = motor.removeprefix("q_")
        crank = np.radians(angle)
        end = np.array([side * APART / 2, 0]) + CRANK * np.array([np.cos(crank), np.sin(crank)])
        yaw[name] = float(np.arctan2(*(top - end)[::-1]))
        joints += _joint(motor, "base", name, _origin(side * APART / 2, 0, 0.2, float(crank)))
        if name == "right" or not knee:
            joints += _joint(f"{name}_elbow", name, f"{name}_rod", _origin(CRANK, yaw=yaw[name] - float(crank)))
    joints += _joint("end", "right_rod", "tcp", _origin(ROD), "fixed")
    if knee:
        joints += _joint("knee", "tcp", "left_rod", _origin(0, yaw=yaw["left"] + np.pi - yaw["right"]))
        joints += _joint("frame_A", "left_rod", ends[0], _origin(ROD, yaw=-yaw["left"] - np.pi), "fixed")
        joints += _joint("frame_B", "left", ends[1], _origin(CRANK, yaw=-float(np.radians(MOTORS["q_left"]))), "fixed")
    else:
        joints += _joint("frame_A", "left_rod", ends[0], _origin(ROD, yaw=-yaw["left"]), "fixed")
        joints += _joint("frame_B", "right_rod", ends[1], _origin(ROD, yaw=-yaw["right"]), "fixed")
    body = "".join(f'<link name="{name}"/>' for name in links) + joints + more
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="five_bar">{body}</robot>')
    return path


def listed(folder: Path, more: str = "", kind: str = "3d") -> Path:
    path = folder / "robot.yaml"
    path.write_text(
        f"closed_loop: [['pin_A', 'pin_B']]\ntype: ['{kind}']\nname_mot: ['q_left', 'q_right']\n{more}",
        encoding="utf-8",
    )
    return path


def wrapped(folder: Path, more: str = "") -> Path:
    path = folder / "wrapper.yaml"
    path.write_text(
        "name: five_bar\nkinematics: urdf\nurdf: robot.urdf\ntip_link: tcp\nmotors: [q_left, q_right]\n" + more
    )
    return path


def check(robot: Robot) -> None:
    """The tool is where the circles meet, at three pairs of motors."""
    names = [joint.name for joint in robot.joints]
    for left, right in [(0.0, 0.0), (10.0, -5.0), (-12.0, 8.0)]:
        q = np.array(robot.core.home)
        q[[names.index("q_left"), names.index("q_right")]] = np.radians([left, right])
        assembly = robot.assemble(q)
        assert assembly.status == ["closed"]
        assert assembly.gap[0] < 1e-10
        place = robot.forward(assembly.q)[0, :3, 3]
        assert place[:2] == pytest.approx(meeting(120 + left, 60 + right), abs=1e-9)
        assert place[2] == pytest.approx(0.2)


def test_a_list_of_frames_closes_where_the_circles_meet(tmp_path: Path) -> None:
    drawn(tmp_path)
    robot = load_robot(listed(tmp_path), tip_link="tcp")
    assert [loop["fixed"] for loop in robot.description.loops] == [["x", "y", "z"]]
    check(robot)


def test_a_hinge_of_a_list_may_stand_for_a_ball_and_its_spin_is_held(tmp_path: Path) -> None:
    drawn(tmp_path)
    more = "joint_name: ['left_elbow']\njoint_type: ['SPHERICAL']\n"
    robot = load_robot(listed(tmp_path, more), tip_link="tcp")
    assert [joint.name for joint in robot.joints if joint.passive] == ["left_elbow_Y", "left_elbow_Z", "right_elbow"]
    assert any("no loop places joints left_elbow_X" in note for note in robot.spec["notes"])
    check(robot)


def test_a_hinge_of_a_list_may_be_fixed_or_universal(tmp_path: Path) -> None:
    drawn(tmp_path, more='<link name="more"/>' + _joint("spare", "left_rod", "more", _origin(0.1)))
    universal = "joint_name: ['left_elbow', 'spare']\njoint_type: ['UJOINT_YZ', 'FIXED']\n"
    check(load_robot(listed(tmp_path, universal), tip_link="tcp"))


@pytest.mark.parametrize("kind", ["3D", "6d"])
def test_a_rod_on_the_tool_is_hung_up_at_its_other_end(tmp_path: Path, kind: str) -> None:
    drawn(tmp_path, knee=True)
    more = "joint_name: ['knee']\njoint_type: ['SPHERICAL']\n" if kind == "3D" else ""
    if kind == "6d":  # a weld, and the hinge at the crank in a joint of its own
        text = (tmp_path / "robot.urdf").read_text()
        weld = '<joint name="frame_A" type="fixed">'
        (tmp_path / "robot.urdf").write_text(text.replace(weld, weld.replace("fixed", "continuous")).replace(
            '<axis xyz="0 0 0"/>', '<axis xyz="0 0 1"/>', 2))  # fmt: skip
    robot = load_robot(listed(tmp_path, more, kind), tip_link="tcp")
    assert robot.joints[-1].name == "right_elbow"
    check(robot)


def test_frames_of_onshape_close_by_the_config_beside(tmp_path: Path) -> None:
    path = drawn(tmp_path, ("closing_knee_1", "closing_knee_2"))
    with pytest.raises(ParseError, match="frames 'closing_knee_1' and 'closing_knee_2' close a loop, and nothing says"):
        load_robot(path, tip_link="tcp")
    check(load_robot(wrapped(tmp_path)))
    config = {"output_format": "urdf", "joint_properties": {"*_elbow": {"actuated": False}}}
    (tmp_path / "config.json").write_text("// exported\n" + json.dumps(config))
    robot = load_robot(path, tip_link="tcp")
    assert [joint.name for joint in robot.joints if not joint.passive] == ["q_left", "q_right"]
    check(robot)
    (tmp_path / "config.json").write_text("{")
    with pytest.raises(ParseError, match="is no JSON"):
        load_robot(path, tip_link="tcp")
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(ParseError, match="nothing says which joints have motors"):
        load_robot(path, tip_link="tcp")


def test_a_loop_of_the_robot_file_is_the_last_word_on_closing_frames(tmp_path: Path) -> None:
    drawn(tmp_path, ("closing_knee_1", "closing_knee_2"))
    more = "loops:\n  - {name: knee, from: closing_knee_1, to: closing_knee_2, fixed: [x, y, z, rx, ry]}\n"
    robot = load_robot(wrapped(tmp_path, more))
    assert [(loop["name"], loop["fixed"]) for loop in robot.description.loops] == [
        ("knee", ["x", "y", "z", "rx", "ry"])
    ]
    check(robot)


ENDS = '<parent link="left_rod"/><child link="right_rod"/><parent_origin xyz="0.32 0 0"/><child_origin xyz="0.32 0 0"/>'
AXES = '<parent_axis xyz="0 0 1"/><child_axis xyz="0 0 1"/>'


@pytest.mark.parametrize(
    ("element", "held"),
    [
        (f'<constraint name="knee" type="revolute">{ENDS}{AXES}</constraint>', 5),
        (f'<constraint name="knee" type="spherical">{ENDS}</constraint>', 3),
        (f'<loop_joint name="knee" type="revolute">{ENDS}<axis xyz="0 0 1" frame="parent"/></loop_joint>', 3),
    ],
)
def test_an_element_of_a_urdf_closes_its_loop(tmp_path: Path, element: str, held: int) -> None:
    path = drawn(tmp_path, more=element)
    with pytest.raises(ParseError, match="'knee' closes a loop, and nothing says which joints have motors"):
        load_robot(path)
    robot = load_robot(wrapped(tmp_path))
    assert [len(loop["fixed"]) for loop in robot.description.loops] == [held]
    check(robot)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("'3d'", "'4d'", "type: expected 3d or 6d of each of closed_loop"),
        ("'pin_B'", "'pin_C'", "there is no link or frame 'pin_C'"),
        ("['pin_A', ", "[", "closed_loop: expected a list of pairs of frames"),
        ("'q_left'", "1", "name_mot: expected a list of names"),
        ("'SPHERICAL'", "'UJOINT_XW'", "joint 'left_elbow' is of type UJOINT_XW, which is not understood"),
        ("'SPHERICAL'", "'CARDAN'", "joint 'left_elbow' is of type CARDAN, which is not understood"),
    ],
)
def test_a_list_that_is_not_understood_says_so(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    drawn(tmp_path)
    path = listed(tmp_path, "joint_name: ['left_elbow']\njoint_type: ['SPHERICAL']\n")
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ParseError, match=sentence):
        load_robot(path, tip_link="tcp")


def test_a_list_without_a_urdf_and_an_unknown_closure_say_so(tmp_path: Path) -> None:
    with pytest.raises(ParseError, match="there are 0 URDFs"):
        load_robot(listed(tmp_path), tip_link="tcp")
    drawn(tmp_path, more=f'<constraint name="knee" type="universal">{ENDS}{AXES}</constraint>')
    with pytest.raises(ParseError, match="<constraint> 'knee' is of type universal, which is not understood"):
        load_robot(wrapped(tmp_path))
