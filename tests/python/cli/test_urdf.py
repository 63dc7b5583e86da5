# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A URDF as ROS has it, given to the commands without a wrapper file."""

import json
from pathlib import Path

import numpy as np
import pytest

import fastcal as library

JOINTS = (("pan", "base_link", "shoulder", "0 0 0.3", "0 0 1"), ("lift", "shoulder", "upper", "0 0.1 0.1", "0 1 0"),
          ("elbow", "upper", "fore", "0 0 0.4", "0 1 0"), ("roll", "fore", "wrist", "0 0 0.3", "0 0 1"),
          ("bend", "wrist", "hand", "0 0.02 0.1", "0 1 0"))  # fmt: skip
LIMIT = '<limit lower="-2.6" upper="2.6" effort="1" velocity="1"/>'


def joint(name: str, parent: str, child: str, xyz: str, axis: str, kind: str = "revolute") -> str:
    return (
        f'  <joint name="{name}" type="{kind}"> <origin xyz="{xyz}" rpy="0 0 0"/> <parent link="{parent}"/>'
        f' <child link="{child}"/> <axis xyz="{axis}"/> {LIMIT} </joint>\n'
    )


def arm(more: str = "", attributes: str = 'name="five"', first: str = "0 0 0.3") -> str:
    links = ["base_link", *(child for _, _, child, _, _ in JOINTS), "tool0"]
    text = "".join(f'  <link name="{name}"/>\n' for name in links)
    text += '  <link name="cover"><visual><geometry><mesh filename="package://five/cover.dae"/></geometry></visual></link>\n'
    rows = [(JOINTS[0][0], *JOINTS[0][1:3], first, JOINTS[0][4]), *JOINTS[1:]]
    text += "".join(joint(*row) for row in rows) + joint("end", "hand", "tool0", "0 0 0.05", "0 0 1", "fixed")
    text += joint("covered", "base_link", "cover", "0 0 0.1", "0 0 1", "fixed")
    return f"<robot {attributes}>\n{text}{more}</robot>\n"


GRIPPER = '  <link name="finger"/>\n' + joint("grip", "hand", "finger", "0 0 0.1", "1 0 0", "prismatic")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """five.urdf, and measurements of an arm that is not quite it."""
    place = tmp_path_factory.mktemp("urdf")
    (place / "five.urdf").write_text(arm())
    (place / "true.urdf").write_text(arm(first="0.0006 -0.0004 0.3").replace("0 0 0.4", "0.0007 0 0.4012"))
    true = library.load_robot(place / "true.urdf")
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (60, 5))
    x = true.forward(q)[:, :3, 3] + np.random.default_rng(1).normal(0, 2e-5, (60, 3)) + [1.0, -0.5, 0.2]
    names = [f"q{i}_deg" for i in range(1, 6)] + ["x_mm", "y_mm", "z_mm"]
    rows = np.column_stack([np.degrees(q), 1000 * x])
    np.savetxt(place / "data.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.9f")
    return place


def test_a_urdf_is_calibrated_and_written_back_without_a_wrapper(process, fastcal, folder: Path, monkeypatch) -> None:
    said = process("calibrate", "five.urdf", "data.csv", "-o", "out", cwd=folder)
    assert said.code == 0, said.err
    assert "tip_link 'tool0' was chosen; the URDF also ends in cover" in said.out
    assert json.loads((folder / "out" / "result.json").read_text())["status"] == "converged"

    monkeypatch.chdir(folder)
    said = fastcal("convert", "out/model.yaml", "--to", "urdf", "-o", "new.urdf")
    assert said.code == 0, said.err
    assert said.err == (
        "fastcal: warning: base and tool are of the measurement and not of the URDF: they stay in out/model.yaml\n"
    )
    before, after = arm().splitlines(), (folder / "new.urdf").read_text().splitlines()
    changed = [b for a, b in zip(before, after, strict=True) if a != b]
    assert 3 <= len(changed) <= 5
    assert all(line.startswith("  <joint name=") for line in changed)

    # The elbow is 1.2 mm further out than the file said; the lengths of links show in no gauge.
    new = library.load_robot(folder / "new.urdf").spec["joints"][2]["origin"]["xyz_mm"]
    assert new[2] == pytest.approx(401.2, abs=0.1)
    measured = library.load_measurements("data.csv", library.load_robot("new.urdf"))
    again = library.calibrate(library.load_robot("new.urdf"), measured)
    left = json.loads((folder / "out" / "result.json").read_text())["train"]["after_mm"]["rms"]
    assert 1000 * again.train.before.rms == pytest.approx(left, rel=0.05)


def test_several_arms_are_asked_about_in_one_sentence(fastcal, folder: Path, tmp_path: Path) -> None:
    two = tmp_path / "two.urdf"
    two.write_text(arm(GRIPPER).replace("tool0", "plate"))
    said = fastcal("calibrate", two, folder / "data.csv", "-o", tmp_path / "out")
    assert said.code == 2
    assert said.error.endswith(
        "the URDF has 2 arms, name the end of one as tip_link: finger (6 joints), plate (5 joints)"
    )
    assert not (tmp_path / "out").exists()
    said = fastcal("design", two, "--tip-link", "plate", "--count", "8", "-o", tmp_path / "poses.csv")
    assert said.code == 0
    said = fastcal("template", two, "--base-link", "shoulder", "--tip-link", "finger", "-o", tmp_path / "empty.csv")
    assert said.code == 0
    assert (tmp_path / "empty.csv").read_text().startswith("q1_deg,q2_deg,q3_deg,q4_deg,q5_mm")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["ur5", "--tip-link", "tool0"], "tip_link choose an arm in a URDF, and this robot is not one"),
        (["five.urdf", "--tip-link", "tool1"], "the URDF has no link 'tool1' for tip_link"),
        (["five.urdf", "--base-link", "hand", "--tip-link", "fore"], "base_link 'hand' does not carry tip_link 'fore'"),
        (["five.urdf.xacro", "--xacro", "size"], "expected a xacro argument as NAME:=VALUE, got 'size'"),
        (["five.urdf.xacro"], "needs the argument size: give it as --xacro size:=VALUE"),
        (["none.xacro"], "there is no such file"),
        (["lost.xacro"], "needs the ROS package 'nowhere', which is neither in the folders around the file nor"),
        (["broken.xacro"], "xacro can't expand it: "),
        (["loop.xacro"], "xacro can't expand it: "),
    ],
)
def test_links_and_macros_that_do_not_fit_are_refused(arguments, sentence, fastcal, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "five.urdf").write_text(arm())
    (tmp_path / "five.urdf.xacro").write_text(XACRO)
    (tmp_path / "macros.xacro").write_text(MACROS)
    (tmp_path / "lost.xacro").write_text(XACRO.replace("macros.xacro", "$(find nowhere)/macros.xacro"))
    (tmp_path / "broken.xacro").write_text(XACRO.replace("</robot>", ""))
    (tmp_path / "loop.xacro").write_text(f'<robot {NAMESPACE} name="x"><xacro:include filename="loop.xacro"/></robot>')
    said = fastcal("template", *arguments, "-o", "new.csv")
    assert said.code == 2
    assert sentence in said.error
    assert said.error.count(sentence) == 1
    assert not (tmp_path / "new.csv").exists()


NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
BODY = arm(first="0 0 ${height}").split(">", 1)[1].removesuffix("</robot>\n")
MACROS = f'<robot {NAMESPACE}><xacro:macro name="links" params="height">{BODY}</xacro:macro></robot>\n'
XACRO = f"""<robot name="five" {NAMESPACE}>
  <xacro:include filename="macros.xacro"/>
  <xacro:links height="${{0.1 * $(arg size)}}"/>
</robot>
"""


def test_a_xacro_is_expanded_and_its_packages_are_found(fastcal, folder: Path, tmp_path: Path) -> None:
    package = tmp_path / "src" / "five_description"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>five_description</name></package>")
    (package / "urdf" / "macros.xacro").write_text(MACROS)
    other = tmp_path / "src" / "cell" / "cell.urdf.xacro"
    other.parent.mkdir()
    other.write_text(XACRO.replace("macros.xacro", "$(find five_description)/urdf/macros.xacro"))
    expected = library.load_robot(folder / "five.urdf")
    nominal = library.load_robot(other, xacro={"size": "3"})
    q = np.random.default_rng(0).uniform(-2, 2, (20, 5))
    np.testing.assert_allclose(nominal.forward(q), expected.forward(q), atol=1e-15)
    said = fastcal("convert", other, "--xacro", "size:=3", "--to", "urdf", "-o", tmp_path / "new.urdf")
    assert said.code == 0
    assert "package://five/cover.dae" in (tmp_path / "new.urdf").read_text()
