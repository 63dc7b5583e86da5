# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A URDF written in place: other numbers in its joints' origins, and every other byte as it was."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal.conversion import convert
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.robot_file import load_robot, read_spec, write_spec
from fastcal.io.urdf_in_place import in_place, with_origins
from fastcal.io.yaml_text import yaml_text
from fastcal.robot import se3

# What a reader by patterns would trip over: a joint in a comment, one of a transmission, single quotes, a > in a value,
# attributes in another order, an origin over two lines, none at all, and a rotation alone.
ARM = """<?xml version="1.0" encoding="latin-1"?>
<robot name="odd" xmlns:xacro="http://ros.org/wiki/xacro">
  <!-- <joint name="two"><origin xyz="9 9 9"/></joint> -->
  <link name="base"><visual><origin xyz="1 1 1"/><geometry><mesh filename="package://a/b.stl"/></geometry></visual></link>
  <link name="a"/><link name="b"/><link name="c"/>   <link name="camera"/><link name="tool0"/>
  <transmission name="t"><joint name="two"><origin xyz="8 8 8"/></joint></transmission>
\t<joint type='revolute' name='one'>
\t\t<parent link="base"/><child link="a"/>
\t\t<origin rpy='0 0 0'
\t\t\txyz='0 0 0.4'/>  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
\t</joint>
  <joint name="two" type="revolute" note="a > b">
    <parent link="a"/><child link="b"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <joint name="three" type="revolute"><origin rpy="0 1.5707963267948966 0"></origin><origin xyz="7 7 7"/>
    <parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="look" type="fixed"><origin xyz="0.1 0 0"/><parent link="b"/><child link="camera"/></joint>
  <joint name="end" type="fixed"><origin xyz="0 0 0.2"/><parent link="c"/><child link="tool0"/></joint>
</robot>
"""


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    (tmp_path / "odd.urdf").write_bytes(ARM.encode())
    return tmp_path / "odd.urdf"


def moved(spec: dict[str, Any], *joints: int) -> dict[str, Any]:
    """The spec with origins of these joints off by a millimetre and a milliradian or so."""
    rng = np.random.default_rng(0)
    for joint in joints:
        origin = spec["joints"][joint]["origin"]
        origin["xyz_mm"] = [x + float(rng.normal()) for x in origin["xyz_mm"]]
        origin["rpy_deg"] = [a + 0.05 * float(rng.normal()) for a in origin["rpy_deg"]]
    return spec


def test_nothing_moved_nothing_changed(odd: Path, tmp_path: Path) -> None:
    for text in (ARM, ARM.replace("\n", "\r\n"), ARM + "\n\n", ARM.rstrip("\n")):
        odd.write_bytes(text.encode())
        load_robot(odd).save(tmp_path / "model.yaml")
        spec = read_spec(tmp_path / "model.yaml")
        assert spec == read_spec(odd)
        write_spec(spec, tmp_path / "same.urdf")
        assert (tmp_path / "same.urdf").read_bytes() == text.encode()


def test_each_origin_is_changed_where_it_stands(odd: Path, tmp_path: Path) -> None:
    spec = moved(read_spec(odd), 0, 1, 2)
    write_spec(spec, tmp_path / "new.urdf")
    new = (tmp_path / "new.urdf").read_text()
    q = np.random.default_rng(1).uniform(-3, 3, (50, 3))
    again = load_robot(tmp_path / "new.urdf")
    np.testing.assert_allclose(again.forward(q), load_robot(spec).forward(q), atol=1e-13)
    kept = re.compile(r"""(xyz|rpy)=('[^']*'|"[^"]*")""")
    before, after = ARM.splitlines(), new.splitlines()
    assert after.pop(after.index('  <joint name="two" type="revolute" note="a > b">') + 1).startswith(
        "    <origin xyz="
    )
    assert kept.sub(r"\1", "\n".join(after)) == kept.sub(r"\1", "\n".join(before)).replace(
        "<origin rpy></origin>", "<origin xyz rpy></origin>"
    )
    for line in (2, 3, 4, 5, 16):  # the comment, the mesh, the transmission, the branches
        assert after[line] == before[line]


def test_one_moved_joint_leaves_the_text_of_the_others(odd: Path) -> None:
    spec = moved(read_spec(odd), 2)
    new = in_place(spec)
    assert [a for a, b in zip(ARM.splitlines(), new.splitlines(), strict=True) if a != b] == [ARM.splitlines()[15]]
    assert '<origin xyz="7 7 7"/>' in new  # only the first origin of a joint is read


def test_a_fixed_joint_before_a_moving_one_stays(odd: Path) -> None:
    mounted = ARM.replace('<parent link="a"/><child link="b"/>', '<parent link="plate"/><child link="b"/>').replace(
        "</robot>",
        '<link name="plate"/><joint name="p" type="fixed"><origin xyz="0 0.3 0" rpy="0.1 0.2 0.3"/>'
        '<parent link="a"/><child link="plate"/></joint></robot>',
    )
    odd.write_text(mounted)
    spec = moved(read_spec(odd), 1)
    new = in_place(spec)
    assert '<origin xyz="0 0.3 0" rpy="0.1 0.2 0.3"/>' in new
    odd.write_text(new)
    q = np.random.default_rng(1).uniform(-3, 3, (50, 3))
    np.testing.assert_allclose(load_robot(odd).forward(q), load_robot(spec).forward(q), atol=1e-13)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, np.pi / 2 - 1e-6])
def test_a_rotation_at_the_lock_of_its_angles_comes_back(odd: Path, pitch: float) -> None:
    T = se3.pose(se3.rpy_to_rotation([0.3, pitch, -0.7]), [0.1, 0.2, 0.3])
    odd.write_text(with_origins(ARM, {"one": T}))
    origin = read_spec(odd)["joints"][0]["origin"]
    R = se3.rpy_to_rotation(np.radians(origin["rpy_deg"]))
    np.testing.assert_allclose(R, T[:3, :3], atol=1e-15)


def test_a_quaternion_makes_way_for_angles() -> None:
    text = ARM.replace("rpy='0 0 0'", "quat_xyzw='0 0 0 1'")
    new = with_origins(text, {"one": np.eye(4)})
    assert "quat_xyzw" not in new
    assert new.count("rpy=") == text.count("rpy=") + 1


def test_what_is_no_longer_that_urdf_is_refused(odd: Path, tmp_path: Path) -> None:
    spec = read_spec(odd)
    for change, sentence in (
        ({"joints": spec["joints"][:2]}, "the joints of the robot are no longer those"),
        ({"flange": {"xyz_mm": [0.0, 0.0, 1.0], "rpy_deg": [0.0] * 3}}, "the flange of the robot is no longer"),
        ({"joints": [{**joint, "axis": [1.0, 0.0, 0.0]} for joint in spec["joints"]]}, "its axis is no longer"),
    ):
        with pytest.raises(InvalidInput, match=sentence):
            write_spec(spec | change, tmp_path / "new.urdf")
    entities = ARM.replace("<robot", '<!DOCTYPE robot [<!ENTITY e "1">]><robot', 1)
    with pytest.raises(InvalidInput, match="declares entities"):
        with_origins(entities, {"one": np.eye(4)})
    with pytest.raises(InvalidInput, match="not well-formed XML"):
        with_origins(ARM.replace("</robot>", ""), {"one": np.eye(4)})
    assert list(tmp_path.glob("new*")) == []


def test_another_kind_has_no_urdf_to_be_written_into(odd: Path) -> None:
    spec = read_spec(odd)
    assert "source" not in convert(spec, "poe").spec
    with pytest.raises(ParseError, match="source: the URDF of a robot goes with kinematics: urdf"):
        read_spec(read_spec("ur5") | {"source": spec["source"]})
    with pytest.raises(ParseError, match="xml: expected the text of a URDF, got 3"):
        read_spec(spec | {"source": spec["source"] | {"xml": 3}})


@pytest.mark.parametrize(
    "text", ["a\nb", "a\n\n b\n", "a\n\n\n", " a\nb", "a\n\x01", "a\n\u2028b", "a\r\nb\n", "#\n---\n"]
)
def test_text_of_several_lines_comes_back_from_yaml(text: str, tmp_path: Path) -> None:
    from fastcal.io.yaml_file import read_yaml

    (tmp_path / "a.yaml").write_text(yaml_text({"x": {"text": text, "more": 1}, "text": text}), newline="\n")
    assert read_yaml(tmp_path / "a.yaml") == {"x": {"text": text, "more": 1}, "text": text}
