# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The URDFs of example-robot-data as they are: loaded, calibrated, written back in place, and read by pinocchio."""

import re
import sysconfig
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio
import pytest

from fastcal import calibrate
from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.robot_file import load_robot, write_spec
from fastcal.measurements.dataset import Dataset
from fastcal.robot import se3
from fastcal.robot.robot import Robot

FOLDER = Path(sysconfig.get_path("purelib")) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
FILES = sorted(FOLDER.rglob("*.urdf"))
# A file of nothing but a comment, and two in which nothing moves.
NO_ARM = {
    "ur_description/urdf/ur3.urdf",
    "hector_description/robots/quadrotor_base.urdf",
    "iris_description/robots/iris_simple.urdf",
}
MOST_JOINTS = 12

pytestmark = pytest.mark.skipif(not FILES, reason="the package example-robot-data is not installed")


def ways(xml: str) -> dict[str, list[str]]:
    """The moving joints from the root to each link, in their order, read from the XML alone."""
    up = {}
    for joint in ET.fromstring(xml).iterfind("joint"):  # noqa: S314 - files of a package
        ends = [joint.find(end) for end in ("parent", "child")]
        parent, child = (end.attrib["link"] for end in ends if end is not None)
        up[child] = (parent, joint.attrib["name"], joint.attrib["type"])
    found: dict[str, list[str]] = {}
    for link in up:
        names, at = [], link
        while at in up:
            at, name, kind = up[at]
            if kind in ("floating", "planar"):
                break
            names += [name] if kind != "fixed" else []
        found[link] = names[::-1]
    return found


def tip_of(path: Path) -> str:
    """Empty where fastcal chooses; else the end of the longest way of at most MOST_JOINTS joints."""
    try:
        load_robot(path)
    except ParseError:
        lengths = {link: len(way) for link, way in ways(path.read_text()).items() if len(way) <= MOST_JOINTS}
        return max(sorted(lengths), key=lambda link: lengths[link], default="")
    return ""


def without_origins(xml: str) -> str:
    """The text with what stands in the origins of joints, and origins that came new, taken out."""
    xml = re.sub(r"(<joint\b[^>]*>)\s*<origin [^>]*/>", r"\1", xml)
    return re.sub(r"<origin\b[^>]*>", "<origin>", xml)


def by_pinocchio(xml: str, robot: Robot, q: FloatArray) -> FloatArray:
    """(N, 4, 4) of the tip link in the base link."""
    model = pinocchio.buildModelFromXML(xml)
    data = model.createData()
    names, source = [joint["name"] for joint in robot.spec["joints"]], robot.spec["source"]
    base, tip = (model.getFrameId(source[end]) for end in ("base_link", "tip_link"))
    out = np.zeros((len(q), 4, 4))
    for row, positions in enumerate(q):
        configuration = pinocchio.neutral(model)
        for name, value in zip(names, positions, strict=True):
            joint = model.joints[model.getJointId(name)]
            turns = joint.nq == 2  # a continuous joint is a point of the circle
            configuration[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(value), np.sin(value)] if turns else value
        pinocchio.framesForwardKinematics(model, data, configuration)
        out[row] = (data.oMf[base].inverse() * data.oMf[tip]).homogeneous
    return out


def off(robot: Robot, rng: np.random.Generator) -> Robot:
    """The arm that there is: every joint's origin off by 0.5 mm and 0.5 mrad along and about each axis."""
    spec = Robot(robot.spec).spec
    for joint in spec["joints"]:
        origin = joint["origin"]
        origin["xyz_mm"] = [x + float(rng.normal(0, 0.5)) for x in origin["xyz_mm"]]
        origin["rpy_deg"] = [a + float(rng.normal(0, 0.03)) for a in origin["rpy_deg"]]
    spec["tool"] = {"xyz_mm": [40.0, -30.0, 110.0], "rpy_deg": [0.0, 0.0, 0.0]}
    return Robot(spec)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_public_urdf_is_calibrated_and_comes_back_in_place(path: Path, tmp_path: Path) -> None:
    if path.relative_to(FOLDER).as_posix() in NO_ARM:
        with pytest.raises(ParseError, match=r"no joint moves|No name given for the robot"):
            load_robot(path)
        return
    robot = load_robot(path, tip_link=tip_of(path))
    xml = path.read_text()
    assert [j["name"] for j in robot.spec["joints"]] == ways(xml)[robot.spec["source"]["tip_link"]]

    rng = np.random.default_rng(0)
    q = rng.uniform(np.maximum(robot.limits[:, 0], -3), np.minimum(robot.limits[:, 1], 3), (80, robot.joint_count))
    q = robot.follow(q)  # romeo's fingers mimic its hand, and pinocchio is told every joint
    np.testing.assert_allclose(by_pinocchio(xml, robot, q[:10]), robot.forward(q[:10]), atol=1e-12)

    true = off(robot, rng)
    found = calibrate(robot, Dataset.from_arrays(q, position=true.forward(q)[:, :3, 3]), loss="none")
    assert found.status == "converged"
    left = found.model.forward(q)[:, :3, 3] - true.forward(q)[:, :3, 3]
    assert np.abs(left).max() < 1e-6

    written = tmp_path / "written.urdf"
    write_spec(found.model.spec, written)
    new = written.read_text()
    assert (new == xml) == (robot.joint_count == 1)  # what one joint is off by, base and tool take
    assert without_origins(new) == without_origins(xml)
    assert new.count("<mesh") == xml.count("<mesh")
    base, tool = (_core_pose(found.model.spec[frame]) for frame in ("base", "tool"))
    tip = base @ by_pinocchio(new, robot, q[:20]) @ tool
    np.testing.assert_allclose(tip, found.model.forward(q[:20]), atol=1e-9)


def _core_pose(frame: dict[str, list[float]]) -> FloatArray:
    """T of {xyz_mm, rpy_deg}, by the oracle's own rotations."""
    R = pinocchio.rpy.rpyToMatrix(*np.radians(frame["rpy_deg"]))
    return se3.pose(R, np.array(frame["xyz_mm"]) / 1000)


def test_most_public_urdfs_need_no_wrapper() -> None:
    loaded = 0
    for path in FILES:
        try:
            load_robot(path, tip_link=tip_of(path))
            loaded += 1
        except (ParseError, AssertionError):
            pass
    assert (loaded, len(FILES)) >= (60, 69)
