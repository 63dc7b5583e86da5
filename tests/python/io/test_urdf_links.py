# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Links of a URDF in cell files, `on: ARM/LINK`: as far from the base as an arm that ends at that link says."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal import load_robot
from fastcal.cells.cell import Cell
from fastcal.errors import FastcalError, ParseError
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.robot.core_model import pose

JOINTS = [  # name, type, parent, child, xyz, rpy, axis
    ("plate", "fixed", "base", "plate", "0.1 0 0.05", "0 0 0.5", ""),
    ("turn", "revolute", "plate", "column", "0 0 0.3", "0.1 0.2 0.3", "0 0.6 0.8"),
    ("shelf", "fixed", "column", "bracket", "0 0.2 0.1", "0.4 0 0", ""),
    ("lift", "revolute", "column", "upper", "0.4 0 0.1", "0 1.0 0", "1 0 0"),
    ("left_j", "revolute", "upper", "left_hand", "0.3 0.1 0", "0 0 0.2", "0 0 -1"),
    ("left_f", "fixed", "left_hand", "left_tip", "0 0 0.1", "0.3 0 0", ""),
    ("right_j", "revolute", "upper", "right_hand", "0.3 -0.1 0", "0.2 0 0", "0 1 0"),
    ("finger_j", "prismatic", "right_hand", "finger", "0 0 0.1", "0 0 0", "0 0 1"),
]
LINKS = ("base", "plate", "column", "bracket", "upper", "left_hand", "left_tip", "right_hand", "finger")
PLACE = {"xyz_mm": [10.0, -20.0, 30.0], "rpy_deg": [10.0, 20.0, 30.0]}
WORLD = {"on": "world", "xyz_mm": [100.0, 200.0, 300.0], "rpy_deg": [0.0, 0.0, 90.0]}


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
    joints = "".join(
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/>{f"<axis xyz={chr(34)}{axis}{chr(34)}/>{limit}" if axis else ""}</joint>'
        for name, kind, parent, child, xyz, rpy, axis in JOINTS
    )
    links = "".join(f'<link name="{name}"/>' for name in LINKS)
    (tmp_path / "torso.urdf").write_text(f'<robot name="t">{links}{joints}</robot>')
    return tmp_path / "torso.urdf"


def cell_with(urdf: Path, tips: dict[str, str], on: str) -> Cell:
    arms = {name: {"robot": urdf.name, "tip_link": tip, **WORLD} for name, tip in tips.items()}
    path = urdf.parent / "cell.yaml"
    path.write_text(yaml.safe_dump({"arms": arms, "targets": {"smr": {"on": on, **PLACE}}}))
    return load_cell(path)


TWO = {"left": "left_tip", "right": "right_hand"}


@pytest.mark.parametrize("tips", [TWO, {"left": "left_tip"}])
@pytest.mark.parametrize("link", ["column", "bracket", "upper", "left_hand", "left_tip", "right_hand"])
def test_a_link_is_where_an_arm_that_ends_there_has_its_flange(urdf: Path, tips: dict[str, str], link: str) -> None:
    if link == "right_hand" and len(tips) == 1:
        with pytest.raises(ParseError, match="moves with joint 'right_j', which is no joint of the arm"):
            cell_with(urdf, tips, f"left/{link}")
        return
    cell = cell_with(urdf, tips, f"left/{link}")
    q = np.random.default_rng(4).uniform(-1, 1, (5, len(cell.joint_types)))
    names = [titles[-1] for titles in cell.joint_columns]
    alone = load_robot(urdf, tip_link=link)
    own = np.stack([q[:, names.index(str(joint.name))] for joint in alone.joints], axis=1)
    expected = pose(WORLD) @ alone.forward(own) @ pose(PLACE)
    (smr,) = cell.points
    np.testing.assert_allclose(cell.frames_at(q, smr.on) @ pose(smr.place), expected, atol=1e-12)
    (urdf.parent / "again.yaml").write_text(cell_text(cell))
    assert load_cell(urdf.parent / "again.yaml").points == cell.points


def test_a_link_on_the_base_is_where_the_file_says(urdf: Path) -> None:
    """The plate: 0.1, 0, 0.05 m from the base, turned by 0.5 rad about z."""
    cell = cell_with(urdf, TWO, "right/plate")
    (smr,) = cell.points
    assert smr.on.endswith(".base")
    c, s = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(smr.place["xyz_mm"], [100 + 10 * c + 20 * s, 10 * s - 20 * c, 80], atol=1e-12)
    (smr,) = cell_with(urdf, TWO, "right/base").points
    np.testing.assert_allclose(smr.place["xyz_mm"], PLACE["xyz_mm"], atol=1e-12)


def test_an_arm_and_a_camera_stand_on_links_too(urdf: Path) -> None:
    path = urdf.parent / "cell.yaml"
    arm = {"robot": urdf.name, "tip_link": "left_tip"}
    camera = {"on": "left/bracket", **PLACE, "size_px": [640, 480], "focal_px": [500, 500], "centre_px": [320, 240]}
    board = {"on": "world", "kind": "checkerboard", "columns": 8, "rows": 5, "square_mm": 20}
    rig = {"cameras": {"eye": camera}, "boards": {"plate": board}}
    q = np.array([[0.3, -0.4, 0.5]])
    expected = load_robot(urdf, tip_link="bracket").forward(q[:, :1])[0] @ pose(PLACE)

    path.write_text(yaml.safe_dump({"arms": {"left": arm}, **rig}))
    robot = load_robot(path)
    entry = robot.description.cameras["eye"]
    assert entry["on"] == "arm.link1"
    alone = load_cell_of(path, {"left": arm}, {"smr": {"on": "left.link1"}})
    np.testing.assert_allclose(alone.frames_at(q, "left.link1")[0] @ pose(entry), expected, atol=1e-12)

    other = {"robot": "ur5", "on": "left/bracket", **PLACE}
    path.write_text(yaml.safe_dump({"arms": {"left": arm, "ur": other}, **rig}))
    cell = load_cell(path)
    both = np.hstack([q, np.zeros((1, 6))]) if cell.joint_columns[0][0] == "left.q1" else None
    assert both is not None
    np.testing.assert_allclose(cell.frames_at(both, "ur.base")[0], expected, atol=1e-12)
    np.testing.assert_allclose(cell.frames_at(both, "left.link1")[0] @ pose(cell.cameras["eye"]), expected, atol=1e-12)


def load_cell_of(path: Path, arms: dict[str, object], targets: dict[str, object]) -> Cell:
    other = path.with_name("other.yaml")
    other.write_text(yaml.safe_dump({"arms": arms, "targets": targets}))
    return load_cell(other)


@pytest.mark.parametrize(
    ("arms", "on", "sentence"),
    [
        ({"left": "torso.urdf"}, "left/nose", "'nose' is no link of the URDF; its links are base, plate, column"),
        ({"left": "torso.urdf"}, "left/finger", "moves with joint 'finger_j', which is no joint of the arm"),
        ({"left": "ur5"}, "left/forearm", "'left/forearm', and there is no such frame"),
    ],
)
def test_a_link_that_there_is_not_gets_one_sentence(urdf: Path, arms: dict[str, str], on: str, sentence: str) -> None:
    of_urdf = {"tip_link": "left_tip"} if "torso.urdf" in arms.values() else {}
    entries: dict[str, object] = {name: {"robot": robot, **of_urdf} for name, robot in arms.items()}
    with pytest.raises(ParseError, match=sentence) as error:
        load_cell_of(urdf, entries, {"smr": {"on": on}})
    assert "\n" not in str(error.value)


def test_a_camera_on_a_link_of_no_urdf_is_refused(tmp_path: Path) -> None:
    camera = {"on": "arm/forearm", "size_px": [640, 480]}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump({"arms": {"arm": "ur5"}, "cameras": {"eye": camera}}))
    with pytest.raises(FastcalError, match=r"cameras.eye.on: the arm is of no URDF and has no link 'forearm'"):
        load_robot(tmp_path / "cell.yaml")
