# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDF in and out: an arm written as XML is the same arm when it is read, to fastcal and to a reader written here."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fastcal import robots
from fastcal.arrays import FloatArray
from fastcal.conversion import convert
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.robot_file import load_robot, read_spec, write_spec
from fastcal.io.urdf_chain import read_chain
from fastcal.io.urdf_file import urdf_text, what_urdf_loses
from fastcal.robot import se3

Spec = dict[str, Any]

XML = """<robot name="two">
  <link name="base"/> <link name="slide"/> <link name="tool0"/>
  <link name="upper"> <inertial> <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/> <mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/> </inertial> </link>
  <joint name="turn" type="continuous"> <origin xyz="0 0 0.5" rpy="0 0 0"/> <parent link="base"/> <child link="upper"/>
    <axis xyz="0 0 1"/> </joint>
  <joint name="rail" type="prismatic"> <origin xyz="0.3 0 0" rpy="0 1.5707963267948966 0"/> <parent link="upper"/>
    <child link="slide"/> <axis xyz="0 0 2"/> <limit lower="-0.1" upper="0.4" effort="1" velocity="1"/> </joint>
  <joint name="end" type="fixed"> <origin xyz="0 0 0.2" rpy="0 0 0"/> <parent link="slide"/>
    <child link="tool0"/> </joint>
</robot>
"""


def numbers(element: ET.Element | None, key: str) -> FloatArray:
    assert element is not None
    return np.array([float(x) for x in element.attrib[key].split()])


def forward(xml: str, q: FloatArray) -> FloatArray:
    """(N, 4, 4) of the last link in the first, as URDF means it, where the joints stand in their order."""
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    column = 0
    for joint in ET.fromstring(xml).iter("joint"):  # noqa: S314 - the text is our own
        origin = joint.find("origin")
        T = T @ se3.pose(se3.rpy_to_rotation(numbers(origin, "rpy")), numbers(origin, "xyz"))
        if joint.attrib["type"] != "fixed":
            axis, zero = numbers(joint.find("axis"), "xyz"), np.zeros(3)
            screw = (axis, zero) if joint.attrib["type"] == "revolute" else (zero, axis)
            T, column = T @ se3.screw_motion(*screw, q[:, column]), column + 1
    return T


@pytest.mark.parametrize("name", robots.serial())
def test_an_arm_written_as_urdf_is_the_same_arm(name: str, tmp_path: Path) -> None:
    spec = read_spec(name)
    spec["base"] = {"xyz_mm": [100.0, 0.0, -30.0], "rpy_deg": [10.0, 20.0, 30.0]}
    spec["gravity_frame"] = "measuring"
    robot = load_robot(name)
    q = np.random.default_rng(0).uniform(robot.limits[:, 0], robot.limits[:, 1], (100, robot.joint_count))
    write_spec(spec, tmp_path / "arm.yaml")
    expected = load_robot(tmp_path / "arm.yaml").forward(q)

    lost = write_spec(convert(spec, "urdf").spec, tmp_path / "arm.urdf")
    again = load_robot(tmp_path / "arm.urdf")
    np.testing.assert_allclose(again.forward(q), expected, atol=1e-12)
    np.testing.assert_allclose(forward((tmp_path / "arm.urdf").read_text(), q), expected, atol=1e-12)
    np.testing.assert_allclose(again.limits, robot.limits, atol=1e-12)
    assert set(lost) <= {"payload", "motor_ratio", "pendant"}
    masses = [[(joint.get("link") or {}).get("mass_kg", 0.0) for joint in r.spec["joints"]] for r in (again, robot)]
    assert masses[0] == masses[1]


def test_bodies_survive_the_xml(tmp_path: Path) -> None:
    spec = convert(read_spec("ur5"), "urdf").spec
    for i, joint in enumerate(spec["joints"]):
        joint["link"]["inertia_kg_m2"] = [1.0 + i, 2.0, 2.5, 0.1, -0.2, 0.3]
    write_spec(spec, tmp_path / "arm.urdf")
    for mine, theirs in zip(read_spec(tmp_path / "arm.urdf")["joints"], spec["joints"], strict=True):
        np.testing.assert_allclose(mine["link"]["com_mm"], theirs["link"]["com_mm"], atol=1e-9)
        np.testing.assert_allclose(mine["link"]["inertia_kg_m2"], theirs["link"]["inertia_kg_m2"], atol=1e-14)


def test_a_urdf_is_read_into_the_canonical_form(tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(XML)
    spec = read_spec(tmp_path / "two.urdf")
    turn, rail = spec["joints"]
    assert (spec["name"], turn["name"], turn["min_deg"], turn["max_deg"]) == ("two", "turn", -360.0, 360.0)
    assert spec["notes"] == ["joints without limits get -360 and 360 degrees, slides -10 and 10 m: turn"]
    assert (rail["type"], rail["axis"], rail["min_mm"], rail["max_mm"]) == ("prismatic", [0.0, 0.0, 1.0], -100.0, 400.0)
    np.testing.assert_allclose(rail["origin"]["rpy_deg"], [0, 90, 0], atol=1e-9)
    assert spec["flange"]["xyz_mm"] == [0.0, 0.0, 200.0]
    np.testing.assert_allclose(turn["link"]["inertia_kg_m2"], [2, 1, 3, 0, 0, 0], atol=1e-15)  # turned by 90 degrees


def test_a_yaml_file_names_a_urdf_beside_it(tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(XML)
    file = tmp_path / "arm.yaml"
    file.write_text("name: mine\nkinematics: urdf\nurdf: two.urdf\ntip_link: slide\ntool: {xyz_mm: [0, 0, 7]}\n")
    spec = read_spec(file)
    assert spec["name"] == "mine"
    assert spec["tool"]["xyz_mm"] == [0.0, 0.0, 7.0]
    assert spec["flange"]["xyz_mm"] == [0.0, 0.0, 0.0]
    write_spec(spec, tmp_path / "whole.yaml")
    assert read_spec(tmp_path / "whole.yaml") == spec  # self-contained: the URDF is no longer needed


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("kinematics: urdf\nurdf: none.urdf\n", "none.urdf: there is no such file"),
        ("kinematics: urdf\nurdf: two.urdf\njoints: []\n", "expected urdf: FILE or joints, got both"),
        ("kinematics: urdf\nurdf: 3\n", "urdf: expected a line of text, got 3"),
        ("kinematics: urdf\nurdf: two.urdf\ntip_link: hand\n", "two.urdf: the URDF has no link 'hand' for tip_link"),
        (
            "kinematics: urdf\nurdf: two.urdf\nbase_link: slide\n",
            "no joint moves between link 'slide' and link 'tool0'",
        ),
        ("kinematics: dh\nurdf: two.urdf\n", "joints is missing"),
    ],
)
def test_a_urdf_that_does_not_fit_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(XML)
    (tmp_path / "arm.yaml").write_text(text)
    with pytest.raises(ParseError) as caught:
        read_spec(tmp_path / "arm.yaml")
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    "text", ["", "<robot", "<robot name='a'/>", XML.replace("0.5", "1e999"), XML.replace("0.5", "nan")]
)
def test_text_that_is_not_a_urdf_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(ParseError) as caught:
        read_spec(tmp_path / "arm.urdf")
    assert "\n" not in str(caught.value)


def test_what_a_urdf_cannot_hold_is_named_and_effects_are_not_lost_in_silence(tmp_path: Path) -> None:
    spec = convert(read_spec("ur5"), "urdf").spec
    assert what_urdf_loses(spec) == ("payload", "motor_ratio")
    spec["effects"] = [{"effect": "backlash", "owner": "joint1", "parameters": {}}]
    with pytest.raises(InvalidInput, match=r"a URDF has no place for backlash@joint1; .* \(--drop-effects\)"):
        write_spec(spec, tmp_path / "arm.urdf")
    assert list(tmp_path.iterdir()) == []
    assert write_spec(spec, tmp_path / "arm.urdf", drop_effects=True) == ("backlash@joint1", "payload", "motor_ratio")
    tilted = spec | {"base": {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0, 90.0, 0.0]}}
    assert "gravity_m_s2" in what_urdf_loses(tilted)
    with pytest.raises(InvalidInput, match="from a robot of kind urdf, got dh: convert it first"):
        urdf_text(read_spec("ur5"))


def test_tabs_and_line_ends_between_numbers_are_blanks() -> None:
    """As any XML parser hands attributes over; urdfdom alone refuses them. Comments and their quotes are no markup."""
    odd = XML.replace('"0 0 0.5"', "'0\n  0\t0.5'").replace(
        '<link name="base"/>', '<link\r\n name="base"/><!-- a "b -->'
    )
    assert odd.count("\t") == 1
    plain, read = (read_chain(text) for text in (XML, odd))
    for one, other in zip(plain["joints"], read["joints"], strict=True):
        np.testing.assert_array_equal(one["origin"], other["origin"])


def test_an_origin_over_several_lines_is_written_in_place(tmp_path: Path) -> None:
    odd = XML.replace('<origin xyz="0 0 0.5" rpy="0 0 0"/>', "<origin\n\txyz='0\t0 0.5'\n\trpy='0 0 0'/>")
    (tmp_path / "odd.urdf").write_text(odd)
    spec = read_spec(tmp_path / "odd.urdf")
    spec["joints"][0]["origin"]["xyz_mm"][2] += 1
    write_spec(spec, tmp_path / "out.urdf")
    moved = odd.replace("'0\t0 0.5'", "'0.0 0.0 0.501'").replace("='0 0 0'", "='0.0 0.0 0.0'")
    assert (tmp_path / "out.urdf").read_text() == moved
    assert load_robot(tmp_path / "out.urdf").joint_count == 2
