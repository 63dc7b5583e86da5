# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Trees of frames against pinocchio: poses, Jacobians and torques of gravity, payloads too, of several tips."""

import sysconfig
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio
import pytest

from fastcal import _core
from fastcal.cells.cell import Cell
from fastcal.io.tree_file import load_cell
from fastcal.io.yaml_text import yaml_text

FOLDER = Path(sysconfig.get_path("purelib")) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
ROBOTS = [
    "talos_data/robots/talos_reduced.urdf",
    "talos_data/robots/talos_full_v2.urdf",
    "tiago_description/robots/tiago_dual.urdf",
    "baxter_description/urdf/baxter.urdf",
    "solo_description/robots/solo12.urdf",
    "anymal_b_simple_description/robots/anymal-kinova.urdf",
    "romeo_description/urdf/romeo_small.urdf",
    "allegro_hand_description/urdf/allegro_right_hand.urdf",
]
ROWS = 4


def ends(xml: str) -> tuple[str, list[str]]:
    """The root, or what hangs below its free joint, and the links behind the last moving joint of each way."""
    joints = []
    for joint in ET.fromstring(xml).iterfind("joint"):  # noqa: S314 - files of a package
        parent, child = (joint.find(end).attrib["link"] for end in ("parent", "child"))  # type: ignore[union-attr]
        joints.append((joint.attrib["type"], parent, child))
    children = {child for _, _, child in joints}
    root = next(parent for _, parent, _ in joints if parent not in children)
    carried: dict[str, list[tuple[str, str]]] = {}
    for kind, parent, child in joints:
        carried.setdefault(parent, []).append((kind, child))

    def moves_more(link: str) -> bool:
        return any(kind != "fixed" or moves_more(child) for kind, child in carried.get(link, []))

    moving = [child for kind, _, child in joints if kind != "fixed"]
    return root, [link for link in moving if not moves_more(link)]


def random_tree(rng: np.random.Generator, links: int) -> str:
    """A URDF of so many links, each on one before it, most by a moving joint."""

    def numbers(size: float, count: int = 3) -> str:
        return " ".join(f"{x:.6f}" for x in rng.uniform(-size, size, count))

    out = ['<robot name="tree"><link name="l0"/>']
    for k in range(1, links):
        mass = (
            f'<inertial><origin xyz="{numbers(0.2)}" rpy="{numbers(3)}"/><mass value="{rng.uniform(0.1, 5):.4f}"/>'
            '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>'
        )
        kind = rng.choice(["revolute", "prismatic", "fixed"], p=[0.6, 0.2, 0.2]) if k > 1 else "revolute"
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        text = " ".join(repr(float(x)) for x in axis)
        out.append(
            f'<link name="l{k}">{mass}</link><joint name="j{k}" type="{kind}"><parent link="l{rng.integers(0, k)}"/>'
            f'<child link="l{k}"/><origin xyz="{numbers(0.5)}" rpy="{numbers(3)}"/><axis xyz="{text}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
    return "".join(out) + "</robot>"


def cell_of(urdf: Path, folder: Path) -> Cell:
    """Its ways to all ends as a cell of arms that share joints."""
    root, tips = ends(urdf.read_text(encoding="utf-8"))
    arms = {f"arm{i}": {"robot": str(urdf), "base_link": root, "tip_link": tip} for i, tip in enumerate(tips)}
    (folder / "cell.yaml").write_text(yaml_text({"arms": arms}), encoding="utf-8")
    return load_cell(folder / "cell.yaml")


def check(urdf: Path, folder: Path) -> None:
    cell = cell_of(urdf, folder)
    model = pinocchio.buildModelFromUrdf(str(urdf))
    model.gravity = pinocchio.Motion(np.array([0.0, 0.0, -9.80665]), np.zeros(3))
    tips = {f"arm{i}": tip for i, tip in enumerate(ends(urdf.read_text(encoding="utf-8"))[1])}
    tips |= {arm.name: arm.name for arm in cell.arms if arm.name not in tips}
    rng = np.random.default_rng(len(cell.core.branches))
    payload = rng.uniform(0, 9, len(cell.arms)) * rng.integers(0, 2, len(cell.arms))  # kg, in the order of the tree
    for of, mass in zip(cell.core.branches, payload, strict=True):
        end = model.frames[model.getFrameId(tips[of.name])]
        model.appendBodyToJoint(end.parentJoint, pinocchio.Inertia(mass, np.zeros(3), np.zeros((3, 3))), end.placement)
    data = model.createData()
    joints = [joint for of in cell.core.branches for joint in cell.arm(of.name).robot.spec["joints"]]
    turns = [joint["type"] == "revolute" for joint in joints]
    q = np.random.default_rng(len(joints)).uniform(-1, 1, (ROWS, len(joints)))
    theta = cell.model.start
    loads = np.asarray(cell.model.loads(_core.Samples(q, payload=np.tile(payload, (ROWS, 1))), theta))
    frames = [f for f in range(cell.core.frame_count) if ".joint" in cell.core.frame_name(f)]
    parameters = {(p.owner, p.name): i for i, p in enumerate(cell.core.parameters)}
    for row in range(ROWS):
        at, place = pinocchio.neutral(model), []
        for joint, value in zip(joints, q[row], strict=True):
            own = model.joints[model.getJointId(joint["name"])]
            place.append(own.idx_v)
            # One without limits is given by cosine and sine.
            at[own.idx_q : own.idx_q + own.nq] = (np.cos(value), np.sin(value)) if own.nq == 2 else value
        pinocchio.framesForwardKinematics(model, data, at)
        pinocchio.computeJointJacobians(model, data, at)
        held = pinocchio.computeGeneralizedGravity(model, data, at)
        one = _core.Samples(q[row : row + 1])
        for arm in cell.arms:
            frame = model.getFrameId(tips[arm.name])
            found = np.asarray(cell.model.predict(one, theta, of=arm.flange))[0]
            assert np.abs(found - data.oMf[frame].homogeneous).max() < 1e-12
            J = np.asarray(cell.model.parameter_jacobian(one, theta, rows=6, of=arm.flange))[0]
            wanted = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
            for k, joint in enumerate(joints):
                axis = np.array(joint["axis"]) / np.linalg.norm(joint["axis"])
                owner = cell.core.frame_name(frames[k])
                columns = [parameters[owner, f"r{a}" if turns[k] else a] for a in "xyz"]
                assert np.abs(J[:, columns] @ axis - wanted[:, place[k]]).max() < 1e-12
        torques = np.array([loads[row, f, 5 if turn else 2] for f, turn in zip(frames, turns, strict=True)])
        assert np.abs(torques + held[place]).max() < 1e-12 * max(1.0, float(np.abs(held).max()))


@pytest.mark.skipif(not FOLDER.is_dir(), reason="the package example-robot-data is not installed")
@pytest.mark.parametrize("name", ROBOTS)
def test_robots_with_several_tips_agree_with_pinocchio(name: str, tmp_path: Path) -> None:
    check(FOLDER / name, tmp_path)


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_agree_with_pinocchio(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    (tmp_path / "tree.urdf").write_text(random_tree(rng, int(rng.integers(6, 16))), encoding="utf-8")
    check(tmp_path / "tree.urdf", tmp_path)
