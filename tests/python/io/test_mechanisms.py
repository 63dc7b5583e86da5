# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Closed loops from MJCF, SDF and URDF: one five-bar in each, against circles that meet, and against MuJoCo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import load_robot
from fastcal.errors import FastcalError, ParseError
from fastcal.io.robot_file import read_spec
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]
CRANK, ROD, APART = 0.2, 0.32, 0.2

MJCF = """<mujoco model="five_bar">
  <compiler angle="degree" autolimits="true"/>
  <default><joint axis="0 0 1" range="-170 170"/></default>
  <worldbody>
    <body name="left" pos="-0.1 0 0.2" euler="0 0 120">
      <joint name="left" ref="120"/>
      <inertial mass="1" pos="0.1 0 0" diaginertia="0.01 0.01 0.01"/>
      <body name="left_rod" pos="0.2 0 0" euler="0 0 {left}">
        <joint name="left_elbow"/>
        <inertial mass="0.5" pos="0.16 0 0" diaginertia="0.01 0.01 0.01"/>
        <site name="pin" pos="0.32 0 0"/>
      </body>
    </body>
    <body name="right" pos="0.1 0 0.2" axisangle="0 0 1 60">
      <joint name="right" ref="60"/>
      <inertial mass="1" pos="0.1 0 0" diaginertia="0.01 0.01 0.01"/>
      <body name="right_rod" pos="0.2 0 0" euler="0 0 {right}">
        <joint name="right_elbow" pos="0 0 0"/>
        <inertial mass="0.5" pos="0.16 0 0" diaginertia="0.01 0.01 0.01"/>
        <site name="tool" pos="0.32 0 0.05" euler="10 0 0"/>
      </body>
    </body>
  </worldbody>
  <equality>{equality}</equality>
  <actuator><position joint="left"/><position joint="right"/></actuator>
</mujoco>"""
CONNECT = '<connect name="knee" body1="left_rod" body2="right_rod" anchor="0.32 0 0"/>'


def meeting(left: float, right: float) -> Array:
    """Where the rods meet, above the cranks' ends."""
    a = np.array([-APART / 2, 0.0]) + CRANK * np.array([np.cos(left), np.sin(left)])
    b = np.array([APART / 2, 0.0]) + CRANK * np.array([np.cos(right), np.sin(right)])
    half = (b - a) / 2
    rise = np.sqrt(ROD**2 - half @ half) / np.linalg.norm(half)
    return np.asarray(a + half + rise * np.array([-half[1], half[0]]))


def elbows() -> tuple[float, float]:
    """Turns of the rods [deg] against the cranks at 120 and 60 degrees."""
    top = meeting(np.radians(120), np.radians(60))
    turns = []
    for side, crank in ((-1, 120.0), (1, 60.0)):
        end = np.array([side * APART / 2, 0]) + CRANK * np.array([np.cos(np.radians(crank)), np.sin(np.radians(crank))])
        turns.append(float(np.degrees(np.arctan2(*(top - end)[::-1])) - crank))
    return turns[0], turns[1]


def mjcf(folder: Path, equality: str = CONNECT) -> Path:
    left, right = elbows()
    path = folder / "five_bar.xml"
    path.write_text(MJCF.format(left=left, right=right, equality=equality))
    return path


def _link(name: str, more: str = "") -> str:
    return f'<link name="{name}">{more}</link>'


def sdf(folder: Path, kind: str = "revolute") -> Path:
    """Drawn with its loop closed; the knee carries the tool and hangs on both rods."""
    hinge = "<axis><xyz>0 0 1</xyz><limit><lower>-3.2</lower><upper>3.2</upper></limit></axis>"
    left, right = np.radians(elbows())
    places = {
        "left": f">-0.1 0 0.2 0 0 {np.radians(120)}",
        "right": f">0.1 0 0.2 0 0 {np.radians(60)}",
        "left_rod": f' relative_to="left">0.2 0 0 0 0 {left}',
        "right_rod": f' relative_to="right">0.2 0 0 0 0 {right}',
        "knee": ' relative_to="right_rod">0.32 0 0 0 0 0',
    }
    links = "".join(_link(name, f"<pose{place}</pose>") for name, place in places.items()) + _link("base")

    def joint(name: str, parent: str, child: str, kind: str = "revolute") -> str:
        return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{hinge}</joint>'

    joints = joint("q_left", "base", "left") + joint("q_right", "base", "right")
    joints += joint("left_elbow", "left", "left_rod") + joint("right_elbow", "right", "right_rod")
    joints += joint("tip", "right_rod", "knee", "fixed") + joint("knee_pin", "left_rod", "knee", kind)
    path = folder / "five_bar.sdf"
    path.write_text(f'<sdf version="1.9"><model name="five_bar">{links}{joints}</model></sdf>')
    wrapper = folder / "robot.yaml"
    wrapper.write_text("name: a\nkinematics: urdf\nurdf: five_bar.sdf\ntip_link: knee\nmotors: [q_left, q_right]\n")
    return wrapper


URDF_JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
    '<axis xyz="0 0 1"/><limit lower="-3.2" upper="3.2" effort="1" velocity="1"/></joint>'
)


def urdf(folder: Path, more: str = "") -> Path:
    """A chain to the tool and a crank; the wrapper gives the rod between both."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", "left", "right", "rod"))
    joints = URDF_JOINT.format(name="q_left", parent="base", child="left", xyz="-0.1 0 0.2")
    joints += URDF_JOINT.format(name="q_right", parent="base", child="right", xyz="0.1 0 0.2")
    joints += URDF_JOINT.format(name="elbow", parent="right", child="rod", xyz="0.2 0 0")
    joints += '<link name="tcp"/><joint name="end" type="fixed"><parent link="rod"/><child link="tcp"/>'
    joints += '<origin xyz="0.32 0 0"/></joint>'
    (folder / "five_bar.urdf").write_text(f'<robot name="five_bar">{links}{joints}{more}</robot>')
    (folder / "robot.yaml").write_text(
        "name: five_bar\nkinematics: urdf\nurdf: five_bar.urdf\ntip_link: tcp\nmotors: [q_left, q_right]\n"
        f"start_deg: {{q_left: 120, q_right: 60, elbow: {elbows()[1]}}}\nloops:\n"
        "  - {name: rod, from: left, to: tcp, from_xyz_mm: [200, 0, 0], length_mm: 320}\n"
    )
    return folder / "robot.yaml"


def at(robot: Robot, left: float, right: float) -> Array:
    """The tool's place in the plane, and its height, at two motors [deg]."""
    q = np.array(robot.core.home)
    names = [joint.name for joint in robot.joints]
    for name, value in (("left", left), ("right", right)):
        q[names.index(name if name in names else f"q_{name}")] = np.radians(value)
    assembly = robot.assemble(q)
    assert assembly.status == ["closed"]
    return np.asarray(robot.forward(assembly.q)[0, :3, 3])


@pytest.mark.parametrize(("left", "right"), [(120.0, 60.0), (130.0, 70.0), (100.0, 50.0)])
def test_a_model_of_mujoco_closes_where_the_circles_meet(tmp_path: Path, left: float, right: float) -> None:
    robot = load_robot(mjcf(tmp_path), tip_link="tool")
    wanted = meeting(np.radians(left), np.radians(right))
    assert np.abs(at(robot, left, right)[:2] - wanted).max() < 1e-9
    assert robot.passive == [1, 3]
    assert robot.joints[0].mass_kg == 1.0


def test_a_model_of_mujoco_is_as_mujoco_computes_it(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    path = mjcf(tmp_path)
    robot = load_robot(path, tip_link="tool")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    q = np.tile(np.asarray(robot.core.home), (10, 1))
    q[:, [0, 2]] += np.random.default_rng(1).uniform(-0.2, 0.2, (10, 2))
    q = robot.assemble(q).q
    for posture, T in zip(q, robot.forward(q), strict=True):
        data.qpos[:] = posture
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[: data.ne]).max() < 1e-9
        assert np.abs(data.site("tool").xpos - T[:3, 3]).max() < 1e-9
        assert np.abs(data.site("tool").xmat.reshape(3, 3) - T[:3, :3]).max() < 1e-9


@pytest.mark.parametrize("kind", ["weld", "connect"])
def test_sites_of_an_equality_are_its_pins(tmp_path: Path, kind: str) -> None:
    path = mjcf(tmp_path, f'<{kind} name="knee" site1="pin" site2="tool"/>')
    loop = read_spec(path, tip_link="tool")["loops"][0]
    assert loop["fixed"] == ["x", "y", "z", "rx", "ry", "rz"][: 3 if kind == "connect" else 6]
    assert loop["from_xyz_mm"] == pytest.approx([320, 0, 0])
    assert loop["to_xyz_mm"] == pytest.approx([0, 0, 0], abs=1e-9)


def test_an_equality_of_joints_is_a_ratio_about_where_both_begin(tmp_path: Path) -> None:
    more = '<joint name="belt" joint1="right_elbow" joint2="right" polycoef="0.1 -2 0 0 0"/>'
    spec = load_robot(mjcf(tmp_path, CONNECT.replace("<connect", "<connect ") + more), tip_link="tool").description
    belt = spec.loops[1]
    assert belt["ratios"] == {"joint3": -2.0}
    assert belt["offset_deg"] == pytest.approx(np.degrees(0.1) + 2 * 60)


def test_a_link_of_two_parents_in_sdf_is_a_loop(tmp_path: Path) -> None:
    robot = load_robot(sdf(tmp_path))
    assert robot.description.loops[0]["fixed"] == ["x", "y", "z", "rx", "ry"]
    found = at(robot, -10.0, 5.0)
    assert np.abs(found[:2] - meeting(np.radians(110), np.radians(65))).max() < 1e-9
    assert found[2] == pytest.approx(0.2)


def test_loops_beside_a_urdf_are_told_by_its_links(tmp_path: Path) -> None:
    found = at(load_robot(urdf(tmp_path)), 115.0, 70.0)
    assert np.abs(found[:2] - meeting(np.radians(115), np.radians(70))).max() < 1e-9


@pytest.mark.parametrize(
    ("equality", "sentence"),
    [
        ('<tendon name="cable" tendon1="a"/>', "equality 'cable' is a tendon, which is not understood"),
        (
            '<joint name="cam" joint1="left_elbow" joint2="left" polycoef="0 1 1 0 0"/>',
            "equality 'cam' is a curve",
        ),
        (
            '<connect body1="left_rod" body2="rigth_rod" anchor="0 0 0"/>',
            "there is no link or frame 'rigth_rod'",
        ),
    ],
)
def test_an_equality_that_is_not_understood_says_so(tmp_path: Path, equality: str, sentence: str) -> None:
    with pytest.raises(ParseError, match=sentence):
        load_robot(mjcf(tmp_path, equality), tip_link="tool")


def test_a_ring_in_a_urdf_is_not_opened_without_a_word(tmp_path: Path) -> None:
    urdf(tmp_path, URDF_JOINT.format(name="ring", parent="left", child="tcp", xyz="0.2 0 0"))
    with pytest.raises(ParseError, match="joints 'end' and 'ring' both carry link 'tcp', a closed loop"):
        load_robot(tmp_path / "five_bar.urdf")
    urdf(tmp_path, '<loop_joint name="knee" type="ball"/>')
    with pytest.raises(
        ParseError, match="<loop_joint> 'knee' closes a loop, and nothing says which joints have motors"
    ):
        load_robot(tmp_path / "five_bar.urdf")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("motors: [q_left, q_right]\n", "", "nothing says which joints have motors"),
        ("q_right]", "q_rihgt]", "there is no joint 'q_rihgt'"),
        ("tip_link: knee\n", "", "where does the tool go"),
        ("tip_link: knee", "tip_link: nee", "there is no link or frame 'nee'"),
    ],
)
def test_what_a_wrapper_lacks_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    path = sdf(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ParseError, match=sentence):
        load_robot(path)


def test_a_name_that_sdf_gives_twice_says_so(tmp_path: Path) -> None:
    wrapper = sdf(tmp_path)
    path = tmp_path / "five_bar.sdf"
    path.write_text(path.read_text().replace('joint name="right_elbow"', 'joint name="left_elbow"'))
    with pytest.raises(ParseError, match="two links, joints or frames have one name"):
        load_robot(wrapper)


def test_a_joint_of_sdf_that_is_not_understood_says_so(tmp_path: Path) -> None:
    with pytest.raises(ParseError, match="joint 'knee_pin' is of type gearbox, which is not understood"):
        load_robot(sdf(tmp_path, "gearbox"))


@pytest.mark.parametrize("text", ["<mujoco>", "<html/>", "<mujoco><worldbody><body pos='a'/></worldbody></mujoco>"])
def test_a_broken_file_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    (tmp_path / "robot.xml").write_text(text)
    with pytest.raises(FastcalError):
        load_robot(tmp_path / "robot.xml")


def test_frames_of_mjcf_move_what_is_in_them(tmp_path: Path) -> None:
    plain, framed = mjcf(tmp_path), tmp_path / "framed.xml"
    text = plain.read_text().replace('pos="-0.1 0 0.2"', 'pos="-0.1 0 0"').replace('pos="0.1 0 0.2"', 'pos="0.1 0 0"')
    text = text.replace("<worldbody>", '<worldbody><frame pos="0 0 0.5" euler="0 0 30"><frame pos="0 0 -0.3">')
    framed.write_text(text.replace("</worldbody>", "</frame></frame></worldbody>"))
    one, other = (load_robot(path, tip_link="tool") for path in (plain, framed))
    q = one.assemble(np.array(one.core.home)).q
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(np.radians(30)), -np.sin(np.radians(30))], [np.sin(np.radians(30)), np.cos(np.radians(30))]]
    assert np.abs(turn @ one.forward(q)[0] - other.forward(q)[0]).max() < 1e-12
    text = text.replace("</worldbody>", '<replicate count="2"/></frame></frame></worldbody>')
    framed.write_text(text)
    with pytest.raises(ParseError, match="<replicate> makes bodies, which are not read"):
        load_robot(framed, tip_link="tool")


def test_files_that_mjcf_includes_stand_in_its_place(tmp_path: Path) -> None:
    path = mjcf(tmp_path)
    expected = read_spec(path, tip_link="tool")
    text = path.read_text()
    start, end = text.index("  <equality>"), text.index("</mujoco>")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/motors.xml").write_text(f"<mujocoinclude>{text[start:end]}</mujocoinclude>")
    scene = text[:start] + '<include file="parts/motors.xml"/></mujoco>'
    path.write_text(scene)
    assert read_spec(path, tip_link="tool") == expected
    path.write_text(scene.replace("<include", '<include file="five_bar.xml"/><include'))
    with pytest.raises(ParseError, match=r"includes 'five_bar\.xml' twice"):
        load_robot(path, tip_link="tool")
    path.write_text(scene.replace("motors.xml", "motor.xml"))
    with pytest.raises(ParseError, match=r"motor\.xml: there is no such file"):
        load_robot(path, tip_link="tool")


def test_a_base_that_floats_asks_for_the_link_that_stands(tmp_path: Path) -> None:
    path = tmp_path / "legged.xml"
    path.write_text(
        '<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint/><body name="arm"><joint name="q"/></body>'
        '</body></worldbody><actuator><motor joint="q"/></actuator></mujoco>'
    )
    with pytest.raises(ParseError, match="'trunk' floats freely; give base_link"):
        load_robot(path, tip_link="arm")
    assert len(load_robot(path, base_link="trunk", tip_link="arm").joints) == 1


def test_a_range_that_does_not_limit_is_no_limit(tmp_path: Path) -> None:
    path = mjcf(tmp_path)
    path.write_text(path.read_text().replace('name="left" ref', 'name="left" limited="false" ref'))
    joints = read_spec(path, tip_link="tool")["joints"]
    assert [joint["max_deg"] for joint in joints if joint["name"] in ("left", "right")] == [360.0, 170.0]


def test_axes_of_sdf_before_1_7_may_be_those_of_the_model(tmp_path: Path) -> None:
    wrapper = sdf(tmp_path)
    path = tmp_path / "five_bar.sdf"
    turned = path.read_text().replace(">-0.1 0 0.2 0 0 ", ">-0.1 0 0.2 0.3 0 ", 1)
    expected = []
    for more in ("", "<use_parent_model_frame>true</use_parent_model_frame>"):
        path.write_text(turned.replace("<xyz>0 0 1</xyz>", f"<xyz>0 0 1</xyz>{more}", 1))
        expected.append(read_spec(wrapper)["joints"])
    q_left = [next(joint for joint in joints if joint["name"] == "q_left")["axis"] for joints in expected]
    assert q_left[0] == pytest.approx([0, 0, 1])
    assert q_left[1] == pytest.approx([0, np.sin(0.3), np.cos(0.3)])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("elbow: ", "elbow: x", "start_deg.elbow: expected a finite number"),
        ("length_mm: 320}", "fixed: [[x]]}", r"loops\[1\].fixed: expected a list of x, y, z, rx, ry, rz"),
        (
            "from: left, to: tcp, from_xyz_mm: [200, 0, 0], length_mm: 320}",
            "joint: elbow, ratios: {q_left: two}}",
            r"loops\[1\].ratios.q_left: expected a finite number, got 'two'",
        ),
    ],
)
def test_a_wrong_value_in_a_wrapper_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    path = urdf(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ParseError, match=sentence):
        load_robot(path)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('axis="0 0 1"', 'axis="0 0 0"', "expected an axis, got '0 0 0'"),
        ('pos="0.2 0 0"', 'pos="0.2 0"', "expected 3 finite numbers, got '0.2 0'"),
        ('axisangle="0 0 1 60"', 'axisangle="0 0 0 60"', "axisangle has no direction"),
        ('joint name="right" ref', 'joint name="left" ref', "there are two joints 'left'"),
        ('body name="right"', 'body name="left"', "there are two links 'left'"),
    ],
)
def test_a_wrong_number_in_mjcf_is_said_with_its_file(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    path = mjcf(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ParseError, match=rf"five_bar.xml: {sentence}"):
        load_robot(path, tip_link="tool")
