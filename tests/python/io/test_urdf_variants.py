# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDFs that urdfdom alone refuses or misreads: quaternions, joints without limits, encodings of Asia, UTF-16."""

import codecs
import math
from pathlib import Path

import numpy as np
import pytest

from fastcal.cli import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.robot_file import load_robot, read_spec, write_spec
from fastcal.io.urdf_chain import read_chain

S = math.sin(math.pi / 8)
C = math.cos(math.pi / 8)
LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'


def urdf(origin: str, *, head: str = "", limit: str = LIMIT, kind: str = "revolute", version: str = "") -> str:
    """Two joints: one at 0.2 m about z, one at `origin` about y; the tip 0.5 m along x."""
    return f"""{head}<robot name="arm"{version}><link name="base"/><link name="a"/><link name="b"/><link name="tip"/>
<joint name="j1" type="revolute"><origin xyz="0 0 0.2"/><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
{LIMIT}</joint>
<joint name="j2" type="{kind}">{origin}<parent link="a"/><child link="b"/><axis xyz="0 1 0"/>{limit}</joint>
<joint name="end" type="fixed"><origin xyz="0.5 0 0"/><parent link="b"/><child link="tip"/></joint></robot>"""


@pytest.mark.parametrize("version", ["", ' version="1.0"', ' version="1.1"', " version='1.2'"])
def test_a_quaternion_turns_the_origin(version: str) -> None:
    """45 degrees about z: the second axis (-s, s, 0), the tip at 0.1 + 0.5 s, 0.5 s, with s = sin 45 degrees."""
    chain = read_chain(urdf(f"<origin xyz='0.1 0 0.3'\n\tquat_xyzw='0 0 {S} {C}'/>", version=version))
    half = math.sqrt(0.5)
    second = np.asarray(chain["joints"][1]["origin"])
    np.testing.assert_allclose(second[:3, 1], [-half, half, 0], atol=1e-12)
    np.testing.assert_allclose(second[:3, 3], [0.1, 0, 0.3])
    np.testing.assert_allclose((second @ chain["flange"])[:3, 3], [0.1 + 0.5 * half, 0.5 * half, 0.3], atol=1e-12)


@pytest.mark.parametrize(
    "attributes",
    [
        'quat_xyzw="0 0 0 0"',
        'quat_xyzw="0 0 1"',
        'quat_xyzw="0 0 nan 1"',
        'quat_xyzw="a b c d"',
        'rpy="0 0 0.1" quat_xyzw="0 0 0.3826834 0.9238795"',
    ],
)
def test_a_quaternion_that_is_none_or_contradicts_is_refused(attributes: str) -> None:
    with pytest.raises(InvalidInput, match="quat_xyzw"):
        read_chain(urdf(f"<origin {attributes}/>"))


def test_two_equal_rotations_are_one() -> None:
    turned = urdf(f'<origin rpy="0 0 {math.pi / 4}" quat_xyzw="0 0 0.3826834 0.9238795"/>')
    np.testing.assert_array_equal(
        read_chain(turned)["flange"], read_chain(urdf(f'<origin rpy="0 0 {math.pi / 4}"/>'))["flange"]
    )


def test_the_file_with_a_quaternion_is_written_in_place(tmp_path: Path) -> None:
    """What was not moved keeps its text; what was moved gets rpy in the quaternion's place."""
    text = urdf(f'<origin xyz="0.1 0 0.3" quat_xyzw="0 0 {S} {C}"/>', version=' version="1.1"')
    (tmp_path / "arm.urdf").write_text(text)
    spec = read_spec(tmp_path / "arm.urdf")
    write_spec(spec, tmp_path / "same.urdf")
    assert (tmp_path / "same.urdf").read_text() == text
    spec["joints"][1]["origin"]["xyz_mm"][0] = 101.0
    write_spec(spec, tmp_path / "moved.urdf")
    again = read_spec(tmp_path / "moved.urdf")
    np.testing.assert_allclose(again["joints"][1]["origin"]["rpy_deg"], [0, 0, 45], atol=1e-9)
    assert again["joints"][1]["origin"]["xyz_mm"] == [101.0, 0, 300.0]
    assert "quat_xyzw" not in (tmp_path / "moved.urdf").read_text()


@pytest.mark.parametrize(("kind", "range_"), [("revolute", 2 * math.pi), ("prismatic", 10.0)])
@pytest.mark.parametrize("limit", ["", '<limit effort="1" velocity="1"/>', "<limit/>", "<!-- <limit lower='-1'/> -->"])
def test_a_joint_without_limits_gets_the_widest(kind: str, range_: float, limit: str) -> None:
    chain = read_chain(urdf("<origin/>", limit=limit, kind=kind))
    assert (chain["joints"][1]["lower"], chain["joints"][1]["upper"]) == (-range_, range_)
    assert [note for note in chain["notes"] if "without limits" in note and note.endswith(": j2")]


@pytest.mark.parametrize("limit", ['<limit lower="-1" upper="1"/>', "<limit upper='1' lower='-1'\tvelocity='2'/>"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_limits_without_effort_or_velocity_are_limits(kind: str, limit: str) -> None:
    chain = read_chain(urdf("<origin/>", limit=limit, kind=kind))
    assert (chain["joints"][1]["lower"], chain["joints"][1]["upper"]) == (-1.0, 1.0)
    assert not chain["notes"]


def test_a_continuous_joint_with_half_a_limit_is_read() -> None:
    chain = read_chain(urdf("<origin/>", limit='<limit velocity="2"/>', kind="continuous"))
    assert chain["joints"][1]["upper"] == 2 * math.pi


def test_every_command_says_which_joints_have_no_limits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.urdf").write_text(urdf("<origin/>", limit=""))
    assert main(["convert", str(tmp_path / "arm.urdf"), "--to", "poe", "-o", str(tmp_path / "arm.yaml")]) == 0
    assert "joints without limits get -360 and 360 degrees, slides -10 and 10 m: j2" in capsys.readouterr().out


TEXT = urdf('<origin xyz="0.1 0 0"/>', head="<?xml version='1.0' encoding='{}'?>\n<!-- {} -->\n")


@pytest.mark.parametrize(
    ("encoding", "word"),
    [
        ("cp932", "①軸目"),
        ("Shift_JIS", "軸目"),
        ("windows-31j", "①"),
        ("GBK", "关节"),
        ("big5", "關節"),
        ("cp949", "관절"),
    ],
)
def test_encodings_of_asia_are_read_and_kept(tmp_path: Path, encoding: str, word: str) -> None:
    python = {"windows-31j": "cp932"}.get(encoding, encoding)
    path = tmp_path / "arm.urdf"
    path.write_bytes(TEXT.format(encoding, word).encode(python))
    spec = read_spec(path)
    assert word in spec["source"]["xml"]
    write_spec(spec, tmp_path / "same.urdf")
    assert (tmp_path / "same.urdf").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF16_LE])
@pytest.mark.parametrize("declared", ["utf-16", "UTF-8"])
def test_utf_16_is_read_with_or_without_its_mark(tmp_path: Path, mark: bytes, declared: str) -> None:
    """XML 1.0, appendix F: the first four bytes tell. It is written as UTF-8, and says so."""
    path = tmp_path / "arm.urdf"
    for order in ("utf-16-le", "utf-16-be"):
        before = b"".join(reversed([mark[:1], mark[1:]])) if order.endswith("be") else mark
        path.write_bytes(before + TEXT.format(declared, "軸").encode(order))
        write_spec(read_spec(path), tmp_path / "same.urdf")
        assert (tmp_path / "same.urdf").read_bytes() == TEXT.format("UTF-8", "軸").encode()
        np.testing.assert_allclose(load_robot(path).forward(np.zeros((1, 2)))[0, :3, 3], [0.6, 0, 0.2])


def test_an_encoding_that_nobody_knows_is_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(TEXT.format("x-shop-7", "軸").encode("cp932"))
    with pytest.raises(ParseError, match=r"expected UTF-8 text, .*; the encoding 'x-shop-7' that it declares is not"):
        load_robot(path)
