# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal design`: a table that can be measured, and one line where something can't be meant."""

import numpy as np
import pytest

import fastcal as library

SURROUNDINGS = """
keep_out: [{min_mm: [-3000, -3000, -2000], max_mm: [3000, 3000, -300]}]
region: {min_m: [-2, -2, 0], max_m: [2, 2, 3]}
tracker: {xyz_mm: [4000, 0, 1000], nearest_mm: 1000, farthest_mm: 9000, reflector: [0, 0, 1], acceptance_deg: 60}
link_radius_mm: 50
"""

FEW = ("--candidates", "random", "--candidate-count", 1500)


def test_the_table_is_in_order_and_reads_back(tmp_path, fastcal) -> None:
    (tmp_path / "surroundings.yaml").write_text(SURROUNDINGS)
    out = tmp_path / "poses.csv"
    options = ("--count", 24, "--effects", "geometry,backlash@joint3", "--payload-kg", "0,10", "--surroundings")
    said = fastcal("design", "staubli_rx160l", *options, tmp_path / "surroundings.yaml", *FEW, "-o", out)
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("24 poses of ")
    assert "meet a keep-out box" in said.out
    header, first, *_ = out.read_text().splitlines()
    assert header == "order," + ",".join(f"q{i}_deg" for i in range(1, 7)) + ",payload_kg," + ",".join(
        f"approach{i}" for i in range(1, 7)
    )
    assert first.startswith("1,")
    arm = library.load_robot("staubli_rx160l")
    poses = library.load_measurements(out, arm, require_measured=False)
    assert set(poses.payload) == {0.0, 10.0}
    assert poses.approach is not None
    assert set(poses.approach[:, 2]) == {-1.0, 1.0}
    assert (arm.forward(poses.q)[:, 2, 3] > 0).all()


def test_targets_are_poses_or_joint_positions(tmp_path, fastcal) -> None:
    arm = library.load_robot("spray_7dof")
    rows = ["q1_mm,q2_deg,q3_deg,q4_deg,q5_deg,q6_mm,q7_deg", "3000,10,60,0,20,400,30", "2500,-10,50,10,0,300,0"]
    (tmp_path / "joints.csv").write_text("\n".join(rows))
    T = arm.forward(library.load_measurements(tmp_path / "joints.csv", arm, require_measured=False).q)
    lines = ["x_mm,y_mm,z_mm,qw,qx,qy,qz"]
    for pose in T:
        w = np.sqrt(1 + np.trace(pose[:3, :3])) / 2
        turn = [pose[2, 1] - pose[1, 2], pose[0, 2] - pose[2, 0], pose[1, 0] - pose[0, 1]]
        lines.append(",".join(str(x) for x in (*(pose[:3, 3] * 1e3), w, *(np.array(turn) / (4 * w)))))
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    for name in ("joints.csv", "poses.csv"):
        options = ("--count", 40, "--until-sigma-mm", 0.03, "--targets", tmp_path / name)
        said = fastcal("design", "spray_7dof", *options, *FEW, "-o", tmp_path / "out.csv")
        assert said.code == 0
        assert "variance: at least" in said.out
    assert (tmp_path / "out.csv").read_text().startswith("order,q1_mm,q2_deg")


def test_the_power_to_separate_two_effects_is_printed(tmp_path, fastcal) -> None:
    pair = "joint_compliance@joint2,link_bending@link2"
    options = ("--count", 16, "--separate", pair, "--payload-kg", "0,14", *FEW)
    said = fastcal("design", "staubli_rx160l", *options, "-o", tmp_path / "out.csv")
    assert said.code == 0
    assert "link_bending@link2 in place of joint_compliance@joint2 is refused: " in said.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--payload-kg", "much"], "--payload-kg takes masses"),
        (["--effects", "base_drift"], "which no choice of poses varies"),
        (["--separate", "backlash@joint1"], "two effects or more"),
        (["--surroundings", "surroundings.yaml"], "keep_out[0]: min_mm must be below max_mm"),
        (["--count", "0"], "greater than or equal to 1"),
    ],
)
def test_invalid_options_are_refused_in_one_line(tmp_path, fastcal, options, said, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "surroundings.yaml").write_text("keep_out: [{min_mm: [0, 0, 0], max_mm: [1, 1, 0]}]")
    found = fastcal("design", "ur5", "--count", 10, *options, "-o", "out.csv")
    assert found.code == 2
    assert said in found.err
    assert len(found.err.splitlines()) == 1
    assert not (tmp_path / "out.csv").exists()


INSTRUMENTS = """
points: true
levels: [link3]
sigma_tilt_mrad: 0.05
planes: {table: {point_mm: [900, 0, 300], normal: [0, 0, 1]}}
"""


def test_levels_and_planes_come_from_a_file(tmp_path, fastcal) -> None:
    (tmp_path / "shop.yaml").write_text(INSTRUMENTS)
    options = ("--count", 30, "--instruments", tmp_path / "shop.yaml", *FEW, "-o", tmp_path / "out.csv")
    said = fastcal("design", "staubli_rx160l", *options)
    assert said.code == 0
    assert "of plane table" in said.out
    arm = library.load_robot("staubli_rx160l")
    poses = library.load_measurements(tmp_path / "out.csv", arm, require_measured=False)
    touching = poses.label_codes("plane")[0] >= 0
    assert 0 < touching.sum() < 30
    np.testing.assert_allclose(arm.forward(poses.q[touching])[:, 2, 3], 0.3, atol=1e-6)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("levels: link2", "levels: expected a list of links, such as [link2, link3], got 'link2'"),
        ("levels: [link9]", "levels must be on link1 to link6, got 'link9'"),
        ("points: 2", "points: expected true or false, got 2"),
        ("sigma_tilt_mrad: -1", "sigma_tilt_mrad: expected an angle above 0, got -1"),
        ("planes: {top: {point_mm: [0, 0, 0], normal: [0, 0, 0]}}", "planes.top.normal: expected a direction"),
        ("planes: {top: {point: [0, 0, 0], normal: [0, 0, 1]}}", "planes.top.point: "),
        ("planes: [top]", "planes: expected a mapping of labels to planes"),
        ("level: [link2]", "level"),
    ],
)
def test_an_invalid_instruments_file_is_refused(tmp_path, fastcal, content, said) -> None:
    (tmp_path / "shop.yaml").write_text(content)
    options = ("--count", 10, "--instruments", tmp_path / "shop.yaml", *FEW, "-o", tmp_path / "out.csv")
    found = fastcal("design", "ur5", *options)
    assert found.code == 2
    assert said in found.err
    assert len(found.err.splitlines()) == 1
