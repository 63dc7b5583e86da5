# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Universal Robots' files: ur_description's kinematics in and out, a controller's calibration.conf in."""

from pathlib import Path

import numpy as np
import pytest
import yaml

import fastcal
from fastcal.arrays import FloatArray
from fastcal.io.ur_files import JOINTS, LINKS
from fastcal.robot import se3

# As ur_description has them for the UR5: x y z roll pitch yaw.
UR5 = {
    "shoulder": (0, 0, 0.089159, 0, 0, 0),
    "upper_arm": (0, 0, 0, 1.570796327, 0, 0),
    "forearm": (-0.425, 0, 0, 0, 0, 0),
    "wrist_1": (-0.39225, 0, 0.10915, 0, 0, 0),
    "wrist_2": (0, -0.09465, -1.941303950897609e-11, 1.570796327, 0, 0),
    "wrist_3": (0, 0.0823, -1.688001216681175e-11, 1.570796326589793, 3.141592653589793, 3.141592653589793),
}
KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
# Of the size that controllers hold: long d that cancel out along nearly parallel axes (rad, m).
CONF = """[mounting]
delta_theta = [ 9.1e-08, 0.178461, 6.682833, -0.578117, 6.1e-06, -5.0e-07]
delta_a = [ -0.000243, 0.003811, 0.034503, 0.000107, -0.000198, 0]
delta_d = [ 9.2e-05, 12.062, 17.6719, -29.733996, -2.8e-05, 0.000217]
delta_alpha = [ 0.001156, 0.003585, 0.003921, 0.000406, -0.002011, 0]
joint_checksum = [ 0xb3241580, 0xb10112f1]
"""


def kinematics(values: dict[str, tuple[float, ...]] = UR5, named: str | None = "calib_123") -> str:
    content: dict[str, object] = {link: dict(zip(KEYS, row, strict=True)) for link, row in values.items()}
    return yaml.safe_dump({"kinematics": content | ({"hash": named} if named else {})}, sort_keys=False)


def forward(content: dict, q: FloatArray) -> FloatArray:
    """(N, 4, 4) of tool0 in the controller's base, by the meaning of the file."""
    out = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for k, link in enumerate(LINKS):
        row = content["kinematics"][link]
        R = se3.rpy_to_rotation([row[key] for key in KEYS[3:]])
        turn = np.array([se3.pose(se3.rotation_z(angle)) for angle in q[:, k]])
        out = out @ se3.pose(R, [row[key] for key in KEYS[:3]]) @ turn
    return out


@pytest.fixture
def q() -> FloatArray:
    return np.random.default_rng(0).uniform(-3, 3, (40, 6))


def bare(robot: fastcal.Robot) -> fastcal.Robot:
    """Without base and tool, which are of a measurement."""
    frame = {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}
    return fastcal.Robot(robot.spec | {"base": frame, "tool": frame})


def test_a_kinematics_file_is_a_robot(tmp_path: Path, q: FloatArray) -> None:
    (tmp_path / "default_kinematics.yaml").write_text(kinematics())
    robot = fastcal.load_robot(tmp_path / "default_kinematics.yaml")
    assert [joint["name"] for joint in robot.spec["joints"]] == list(JOINTS)
    np.testing.assert_allclose(robot.forward(q), forward(yaml.safe_load(kinematics()), q), atol=1e-14)
    np.testing.assert_allclose(robot.forward(q), bare(fastcal.load_robot("ur5")).forward(q), atol=1e-8)
    robot.save(tmp_path / "robot.yaml")
    assert fastcal.load_robot(tmp_path / "robot.yaml").spec == robot.spec


def test_what_else_a_kinematics_file_holds_is_passed_over(tmp_path: Path, q: FloatArray) -> None:
    """As ur_description does; a mark of byte order, Windows' line ends and remarks are no matter either."""
    text = f"%YAML 1.2\n---\n# Zelle 3, Müller\n{kinematics()}meta: {{owner: Größe}}\n...\n"
    (tmp_path / "kept.yaml").write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    (tmp_path / "plain.yaml").write_text(kinematics())
    kept, plain = (fastcal.load_robot(tmp_path / name) for name in ("kept.yaml", "plain.yaml"))
    np.testing.assert_array_equal(kept.forward(q), plain.forward(q))


def test_a_calibrated_arm_becomes_a_kinematics_file_with_its_hash(run, tmp_path: Path, q: FloatArray) -> None:
    (tmp_path / "kinematics.yaml").write_text(kinematics())
    nominal = fastcal.load_robot(tmp_path / "kinematics.yaml")
    true = fastcal.perturbed(nominal, seed=4)
    model = fastcal.calibrate(nominal, fastcal.simulate(true, true.follow(q), noise=2e-5, seed=0)).model
    model.save(tmp_path / "model.yaml")
    assert run("convert", "model.yaml", "--to", "ur_kinematics", "-o", "new.yaml") == (0, "")
    content = yaml.safe_load((tmp_path / "new.yaml").read_text())
    assert content["kinematics"]["hash"] == "calib_123"
    np.testing.assert_allclose(forward(content, q), bare(model).forward(q), atol=1e-12)
    again = fastcal.load_robot(tmp_path / "new.yaml")
    np.testing.assert_allclose(again.forward(q), bare(model).forward(q), atol=1e-12)


def test_dh_rows_become_the_frames_of_ur_description(run, tmp_path: Path, q: FloatArray) -> None:
    code, said = run("convert", "ur5", "--to", "ur_kinematics", "-o", "new.yaml")
    assert code == 0
    assert "no controller's hash" in said
    content = yaml.safe_load((tmp_path / "new.yaml").read_text())
    for link, row in UR5.items():
        mine = content["kinematics"][link]
        np.testing.assert_allclose([mine[key] for key in KEYS[:3]], row[:3], atol=1e-10)
        rotations = [se3.rpy_to_rotation(angles) for angles in ([mine[key] for key in KEYS[3:]], row[3:])]
        np.testing.assert_allclose(*rotations, atol=1e-8)

    nominal = fastcal.load_robot("ur5")
    true = fastcal.perturbed(nominal, seed=4)
    model = fastcal.calibrate(nominal, fastcal.simulate(true, q, noise=2e-5, seed=0)).model
    model.save(tmp_path / "model.yaml")
    (tmp_path / "default.yaml").write_text(kinematics())
    said = run("convert", "model.yaml", "--to", "ur_kinematics", "--ur-calibration", "default.yaml", "-o", "new.yaml")
    assert said == (0, "")
    content = yaml.safe_load((tmp_path / "new.yaml").read_text())
    assert content["kinematics"]["hash"] == "calib_123"
    np.testing.assert_allclose(forward(content, q), bare(model).forward(q), atol=1e-12)


def test_a_urdf_of_ur_description_gives_the_frames_behind_its_turned_base(run, tmp_path: Path, q: FloatArray) -> None:
    """base_link_inertia is base_link turned by half a turn; flange and tool0 lie in the frame of joint 6."""
    lines = ['<robot name="ur"><link name="base_link"/><link name="base_link_inertia"/>']
    lines += [f'<link name="{link}_link"/>' for link in LINKS] + ['<link name="flange"/><link name="tool0"/>']
    fixed = '<joint name="{}" type="fixed"><origin rpy="{}"/><parent link="{}"/><child link="{}"/></joint>'
    half = np.pi / 2
    lines += [fixed.format("base", f"0 0 {np.pi}", "base_link", "base_link_inertia")]
    lines += [fixed.format("wrist_3-flange", f"0 {-half} {-half}", "wrist_3_link", "flange")]
    lines += [fixed.format("flange-tool0", f"{half} 0 {half}", "flange", "tool0")]
    parent = "base_link_inertia"
    for link, name in zip(LINKS, JOINTS, strict=True):
        x, r = (" ".join(map(str, part)) for part in (UR5[link][:3], UR5[link][3:]))
        lines.append(
            f'<joint name="{name}" type="revolute"><origin xyz="{x}" rpy="{r}"/><parent link="{parent}"/>'
            f'<child link="{link}_link"/><axis xyz="0 0 1"/>'
            '<limit lower="-6" upper="6" effort="1" velocity="1"/></joint>'
        )
        parent = f"{link}_link"
    (tmp_path / "ur.urdf").write_text("\n".join([*lines, "</robot>"]))
    assert run("convert", "ur.urdf", "--to", "ur_kinematics", "-o", "new.yaml")[0] == 0
    content = yaml.safe_load((tmp_path / "new.yaml").read_text())
    np.testing.assert_allclose(forward(content, q), forward(yaml.safe_load(kinematics()), q), atol=1e-12)


def test_a_controller_s_deltas_make_the_arm_that_it_knows(run, tmp_path: Path, q: FloatArray) -> None:
    (tmp_path / "calibration.conf").write_text(CONF)
    arguments = "convert", "ur5", "--ur-calibration", "calibration.conf"
    assert run(*arguments, "--to", "dh", "-o", "mine.yaml")[0] == 0
    mine = fastcal.load_robot(tmp_path / "mine.yaml")
    rows = [[j["theta_deg"], j["d_mm"], j["a_mm"], j["alpha_deg"]] for j in fastcal.load_robot("ur5").spec["joints"]]
    table = np.array(rows) * [np.pi / 180, 1e-3, 1e-3, np.pi / 180]
    deltas = [yaml.safe_load(CONF.splitlines()[k].split("=")[1]) for k in (1, 3, 2, 4)]
    table += np.array([[float(x) for x in row] for row in deltas]).T
    for angles, T in zip(q, mine.forward(q), strict=True):
        expected = np.eye(4)
        for (theta, d, a, alpha), angle in zip(table, angles, strict=True):
            expected = expected @ se3.pose(se3.rotation_z(theta + angle), [0, 0, d])
            expected = expected @ se3.pose(se3.rotation_x(alpha)) @ se3.pose(position=[a, 0, 0])
        np.testing.assert_allclose(T, expected, atol=1e-11)
    # No far d is left: the arm is the maker's within millimetres.
    for joint, nominal in zip(mine.spec["joints"], fastcal.load_robot("ur5").spec["joints"], strict=True):
        assert abs(joint["d_mm"] - nominal["d_mm"]) < 20
        assert abs(joint["a_mm"] - nominal["a_mm"]) < 20
    assert run(*arguments, "--to", "ur_kinematics", "-o", "mine_kinematics.yaml")[0] == 0
    content = yaml.safe_load((tmp_path / "mine_kinematics.yaml").read_text())
    np.testing.assert_allclose(forward(content, q), bare(mine).forward(q), atol=1e-11)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("short.yaml", "--to", "dh"), "kinematics: wrist_3 is missing"),
        (("words.yaml", "--to", "dh"), "kinematics.forearm.x: expected a finite number, got 'far'"),
        (("pmc6va030", "--to", "ur_kinematics"), "its first axis is not the base's z axis"),
        (("lbr_iiwa14", "--to", "ur_kinematics"), "kinematics file of ur_description is of six turning joints"),
        (("ros1.urdf", "--to", "ur_kinematics"), "its joints do not turn about their z axes"),
        (("ur5", "--ur-calibration", "cut.conf", "--to", "dh"), "delta_d: expected a list of 6 numbers, got 5"),
        (("ur10", "--ur-calibration", "none.conf", "--to", "dh"), "none.conf: there is no such file"),
        (("good.yaml", "--ur-calibration", "cut.conf", "--to", "dh"), "a calibration.conf adds to six DH rows"),
        (("ur5", "--ur-calibration", "good.yaml", "--to", "dh"), "expected a calibration.conf, or --to ur_kinematics"),
        (("ur5", "--ur-calibration", "bare.yaml", "--to", "ur_kinematics"), "a kinematics file of ur_description with"),
        (("bent.yaml", "--to", "ur_kinematics"), "a kinematics file has no place for backlash@joint1"),
        (("good.yaml", "--tip-link", "tool0", "--to", "dh"), "tip_link choose an arm in a URDF"),
    ],
)
def test_files_that_do_not_fit_are_refused(arguments, sentence, run, tmp_path: Path) -> None:
    (tmp_path / "good.yaml").write_text(kinematics())
    (tmp_path / "bare.yaml").write_text(kinematics(named=None))
    (tmp_path / "short.yaml").write_text(kinematics({link: UR5[link] for link in LINKS[:-1]}))
    (tmp_path / "words.yaml").write_text(kinematics().replace("x: -0.425", "x: far"))
    (tmp_path / "cut.conf").write_text(CONF.replace("12.062, ", ""))
    assert run("convert", "ur5", "--to", "urdf", "-o", "ros1.urdf")[0] == 0
    text = (tmp_path / "ros1.urdf").read_text().replace('<axis xyz="0.0 0.0 1.0" />', '<axis xyz="0 1 0"/>', 1)
    (tmp_path / "ros1.urdf").write_text(text)
    bent = fastcal.load_robot("ur5").spec
    bent["effects"] = [{"effect": "backlash", "owner": "joint1", "parameters": {"gap_rad": {"value": 1e-4}}}]
    fastcal.Robot(bent).save(tmp_path / "bent.yaml")
    code, said = run("convert", *arguments, "-o", "new.yaml")
    assert code == 2
    assert sentence in said
    assert not (tmp_path / "new.yaml").exists()


@pytest.fixture
def run(tmp_path: Path, monkeypatch, capsys):
    """Runs a command in the folder; its exit code and what it said on standard error."""
    from fastcal.cli import main

    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str]:
        capsys.readouterr()
        code = main(list(arguments))
        return code, capsys.readouterr().err

    return call
