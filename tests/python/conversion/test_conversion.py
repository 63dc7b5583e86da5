# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Conversion keeps the tool's pose to 1e-12 m and rad for every arm and kind, and bodies, ends and effects with it."""

import copy
from typing import Any

import numpy as np
import pytest

from fastcal import robots
from fastcal.arrays import FloatArray
from fastcal.conversion import KINDS, convert
from fastcal.conversion.chain import chain_of, si
from fastcal.errors import InvalidInput
from fastcal.io.robot_file import read_spec
from fastcal.io.robot_schema import check_spec
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

Spec = dict[str, Any]


def tool_poses(spec: Spec, q: FloatArray) -> FloatArray:
    """T_measuring_tool (N, 4, 4) by the screws."""
    return pose(spec["base"]) @ chain_of(spec).forward(q) @ pose(spec["tool"])


def postures(spec: Spec, count: int = 100, seed: int = 0) -> FloatArray:
    """Joint positions within the limits, (count, n) SI."""
    limits = Robot(spec).limits
    return np.random.default_rng(seed).uniform(limits[:, 0], limits[:, 1], (count, len(limits)))


def worst(a: FloatArray, b: FloatArray) -> float:
    """The largest distance [m] or, for small ones, angle [rad] between two stacks of poses."""
    angles = np.linalg.norm(a[:, :3, :3] - b[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
    return float(max(np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1).max(), angles.max()))


def revolute(**geometry: Any) -> Spec:
    return {"type": "revolute", "min_deg": -170, "max_deg": 170} | geometry


def poe_arm(axes: list[tuple[Any, Any]], home: FloatArray | None = None, **more: Any) -> Spec:
    """A canonical arm of hinges along directions (normalised here) through points in mm."""
    joints = [revolute(omega=list(np.asarray(w) / np.linalg.norm(w)), point_mm=list(map(float, p))) for w, p in axes]
    T = np.eye(4) if home is None else home
    frame = {"xyz_mm": list(1000.0 * T[:3, 3]), "rpy_deg": list(np.degrees(se3.rotation_to_rpy(T[:3, :3])))}
    return check_spec({"name": "arm", "kinematics": "poe", "joints": joints, "home": frame} | more)


@pytest.mark.parametrize("name", robots.serial())
@pytest.mark.parametrize("kind", KINDS)
def test_every_shipped_arm_becomes_every_kind_and_comes_back(name: str, kind: str) -> None:
    spec = read_spec(name)
    q = postures(spec)
    there = convert(spec, kind)
    back = convert(there.spec, spec["kinematics"])
    expected = Robot(spec).forward(q)
    assert worst(tool_poses(spec, q), expected) < 1e-12  # screws in numpy against the core
    for converted in (there, back):
        assert converted.dropped == ()
        assert check_spec(converted.spec) == converted.spec
        assert worst(Robot(converted.spec).forward(q), expected) < 1e-12
        assert worst(tool_poses(converted.spec, q), expected) < 1e-12


@pytest.mark.parametrize("name", [name for name in robots.serial() if "link" in read_spec(name)["joints"][0]])
@pytest.mark.parametrize("kind", KINDS)
def test_bodies_payload_and_gravity_stay_where_they_are(name: str, kind: str) -> None:
    spec = read_spec(name)
    rng = np.random.default_rng(1)
    for joint in spec["joints"]:
        root = rng.normal(size=(3, 3))
        joint["link"]["inertia_kg_m2"] = list((root @ root.T)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    spec["base"] = {"xyz_mm": [100.0, -2000.0, 300.0], "rpy_deg": [10.0, 20.0, -130.0]}
    new = convert(spec, kind).spec
    assert sum(joint["link"]["mass_kg"] for joint in new["joints"]) > 0
    for mine, theirs in zip(chain_of(new).bodies, chain_of(spec).bodies, strict=True):
        assert mine is not None
        assert theirs is not None
        mine, theirs = mine.moved(pose(new["base"])), theirs.moved(pose(spec["base"]))
        assert mine.mass == theirs.mass
        np.testing.assert_allclose(mine.com, theirs.com, atol=1e-12)
        np.testing.assert_allclose(mine.inertia, theirs.inertia, atol=1e-12)
    # The payload's centre and gravity, seen from the measuring frame in the zero posture.
    centres, weights = [], []
    for s in (new, spec):
        flange = pose(s["base"]) @ chain_of(s).home
        centres.append(flange[:3, :3] @ si(s["payload"]["com_mm"], "mm") + flange[:3, 3])
        weights.append(pose(s["base"])[:3, :3] @ np.array(s["gravity_m_s2"]))
    np.testing.assert_allclose(*centres, atol=1e-12)
    np.testing.assert_allclose(*weights, atol=1e-12)


def test_inertia_not_given_is_not_invented() -> None:
    assert "inertia_kg_m2" not in convert(read_spec("ur5"), "poe").spec["joints"][0]["link"]
    bare = read_spec("ur5")
    del bare["joints"][0]["link"]
    assert "link" not in convert(bare, "mdh").spec["joints"][0]


def test_a_table_keeps_its_numbers() -> None:
    """The UR5's DH table from its screws is the maker's again, and its MDH table the well-known one."""
    ur5 = read_spec("ur5")
    again = convert(convert(ur5, "poe").spec, "dh").spec
    assert [{**joint} for joint in again["joints"]] == ur5["joints"]
    mdh = convert(ur5, "mdh").spec["joints"]
    assert [joint["a_mm"] for joint in mdh] == [0, 0, -425, -392.25, 0, 0]
    assert [joint["d_mm"] for joint in mdh] == [89.159, 0, 0, 109.15, 94.65, 82.3]
    assert [joint["alpha_deg"] for joint in mdh] == [0, 90, 0, 0, 90, -90]


def parallel_rows(kind: str, joints: list[Spec]) -> list[tuple[int, int]]:
    """The rows that hold alpha and beta of each pair of parallel neighbouring axes."""
    later = [i for i in range(1, len(joints)) if joints[i if kind == "mdh" else i - 1]["alpha_deg"] == 0]
    return [(i, i - 1) if kind == "mdh" else (i - 1, i - 1) for i in later]


@pytest.mark.parametrize("name", ["ur5", "ur10", "kuka_kr500_3", "staubli_rx160l", "pmc6va030", "siasun_sr210d"])
@pytest.mark.parametrize("kind", ["dh", "mdh"])
@pytest.mark.parametrize("tilt", [10.0**-k for k in range(1, 10)])
@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_nearly_parallel_axes_never_give_a_far_d(
    name: str, kind: str, tilt: float, direction: tuple[float, float]
) -> None:
    """Axes tilted by 1e-1 to 1e-9 rad, told by their screws alone, come back with every d within 20 mm of nominal."""
    nominal = convert(read_spec(name), kind).spec
    spec = copy.deepcopy(nominal)
    pairs = parallel_rows(kind, spec["joints"])
    assert pairs
    for alpha_row, beta_row in pairs:
        spec["joints"][alpha_row]["alpha_deg"] += np.degrees(tilt * direction[0])
        spec["joints"][beta_row]["beta_deg"] += np.degrees(tilt * direction[1])
    again = convert(convert(spec, "poe").spec, kind).spec
    q = postures(spec)
    assert worst(tool_poses(again, q), tool_poses(spec, q)) < 1e-12
    for mine, theirs in zip(again["joints"], nominal["joints"], strict=True):
        assert abs(mine["d_mm"] - theirs["d_mm"]) < 20.0
    for _, beta_row in pairs if direction[1] else []:
        joint, truth = again["joints"][beta_row], spec["joints"][beta_row]
        assert joint["beta_deg"] == pytest.approx(truth["beta_deg"], abs=1e-9)
        assert joint["d_mm"] == pytest.approx(truth["d_mm"], abs=1e-6)


@pytest.mark.parametrize("name", robots.serial())
@pytest.mark.parametrize("kind", ["dh", "mdh"])
@pytest.mark.parametrize("seed", range(5))
def test_a_measured_arm_keeps_near_its_nominal_table(name: str, kind: str, seed: int) -> None:
    """All axes off by 0.5 mm and 0.5 mrad: no length moves by more than 20 mm, wherever axes meet or are parallel."""
    rng = np.random.default_rng(seed)
    spec = convert(read_spec(name), "poe").spec
    nominal = convert(spec, kind).spec
    for joint in spec["joints"]:
        key = "omega" if joint["type"] == "revolute" else "v"
        direction = np.array(joint[key]) + rng.normal(size=3) * 5e-4
        joint[key] = list(direction / np.linalg.norm(direction))
        if "point_mm" in joint:
            joint["point_mm"] = list(np.array(joint["point_mm"]) + rng.normal(size=3) * 0.5)
    spec = check_spec(spec)
    table = convert(spec, kind).spec
    q = postures(spec)
    assert worst(tool_poses(table, q), tool_poses(spec, q)) < 1e-12
    for mine, theirs in zip(table["joints"], nominal["joints"], strict=True):
        for key in ("d_mm", "a_mm"):
            assert abs(mine[key] - theirs[key]) < 20.0


X, Y, Z, HERE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)
SPECIAL = {
    "coaxial": [(Z, HERE), (Z, HERE), (Z, HERE)],
    "coaxial, the last one turned over": [(Z, HERE), (Z, HERE), ((0, 0, -1), HERE)],
    "antiparallel": [(Z, HERE), ((0, 0, -1), (300, 0, 0)), (Z, (700, 50, 0))],
    "meeting at a small angle": [(Z, HERE), ((1e-6, 0, 1), HERE), ((0, 1e-9, 1), HERE)],
    "meeting far away at a small angle": [(Z, HERE), ((1e-5, 0, 1), (500, 0, 0)), (X, (500, 0, 300))],
    "a hair apart": [(Z, HERE), (Z, (1e-9, 0, 0)), ((1e-9, 0, 1), (0, 1e-7, 0))],
    "first axis level and off": [(X, (0, 200, 300)), (Y, (100, 0, 0)), (Z, (5, 6, 7))],
    "first axis downwards": [((0, 0, -1), (10, 20, 30)), (X, HERE), (Y, HERE)],
    "first axis askew": [((1, 2, 3), (10, 20, 30)), ((3, -2, 1), (100, 0, 0)), ((0, 1, 1), (0, 0, 500))],
    "one joint": [((1, 1, 0), (1, 2, 3))],
}


@pytest.mark.parametrize("case", SPECIAL)
@pytest.mark.parametrize("kind", ["dh", "mdh", "urdf"])
def test_special_positions_of_axes(case: str, kind: str) -> None:
    home = se3.pose(se3.rpy_to_rotation([0.3, -1.1, 2.0]), [0.4, -0.2, 0.9])
    tool = {"xyz_mm": [10, 20, 30], "rpy_deg": [10, 20, 30]}
    spec = poe_arm(SPECIAL[case], home, tool=tool, payload={"com_mm": [1, 2, 3]})
    q = np.random.default_rng(0).uniform(-3, 3, (50, len(spec["joints"])))
    new = convert(spec, kind).spec
    assert worst(tool_poses(new, q), tool_poses(spec, q)) < 1e-12
    assert max(abs(joint.get("d_mm", 0.0)) for joint in new["joints"]) < 2000.0


@pytest.mark.parametrize("seed", range(60))
def test_random_arms_of_hinges_and_slides(seed: int) -> None:
    """Axes at any angle, with zero offsets, converted along a random path through the kinds."""
    rng = np.random.default_rng(seed)
    joints: list[Spec] = []
    for _ in range(rng.integers(1, 9)):
        w = rng.normal(size=3)
        w /= np.linalg.norm(w)
        if rng.random() < 0.3:
            joints.append(
                {"type": "prismatic", "v": list(w), "min_mm": -500, "max_mm": 500, "d_mm": float(rng.normal())}
            )
        else:
            point = [float(x) for x in rng.uniform(-800, 800, 3)]
            joints.append(revolute(omega=list(w), point_mm=point, theta_deg=float(rng.uniform(-180, 180))))
    home = {
        "xyz_mm": [float(x) for x in rng.uniform(-800, 800, 3)],
        "rpy_deg": [float(x) for x in rng.uniform(-180, 180, 3)],
    }
    spec = check_spec({"name": "arm", "kinematics": "poe", "joints": joints, "home": home})
    q = postures(spec, 50, seed)
    expected = tool_poses(spec, q)
    assert worst(Robot(spec).forward(q), expected) < 1e-12
    for kind in rng.permutation(KINDS):
        spec = convert(spec, str(kind)).spec
        assert worst(tool_poses(spec, q), expected) < 1e-12
        assert worst(Robot(spec).forward(q), expected) < 1e-12


def with_effects(spec: Spec, *names: str) -> Spec:
    spec = copy.deepcopy(spec)
    spec["effects"] = [{"effect": name, "owner": f"owner{i}", "parameters": {}} for i, name in enumerate(names)]
    return spec


def test_effects_of_joint_axes_survive_and_those_of_row_frames_are_refused_or_named() -> None:
    spec = with_effects(read_spec("ur5"), "joint_compliance", "link_bending", "backlash", "thermal_expansion")
    with pytest.raises(
        InvalidInput, match=r"link_bending@owner1, thermal_expansion@owner3 can't be carried from dh to"
    ):
        convert(spec, "urdf")
    new, dropped, _ = convert(spec, "urdf", drop_effects=True)
    assert dropped == ("link_bending@owner1", "thermal_expansion@owner3")
    assert [effect["effect"] for effect in new["effects"]] == ["joint_compliance", "backlash"]
    assert convert(spec, "dh").spec == spec  # the same kind carries everything


def test_effects_of_a_frame_that_moves_are_not_carried() -> None:
    spec = with_effects(read_spec("pmc6va030"), "base_drift", "tool_shift")
    assert convert(spec, "poe").dropped == ()
    assert convert(spec, "dh", drop_effects=True).dropped == ("base_drift@owner0",)  # its base is turned over


def test_a_compensator_and_what_needs_a_structure_stand_in_row_frames() -> None:
    spec = with_effects(read_spec("spray_7dof"), "beam_gravity")
    spec["compensator"] = {"joint": 2}
    new = convert(spec, "urdf", drop_effects=True)
    assert new.dropped == ("beam_gravity@owner0", "compensator")
    assert "compensator" not in new.spec
    assert new.spec["structure"] == {}
    assert any("structure" in note for note in new.notes)


def test_coupling_limits_and_gears_are_kept() -> None:
    spec = read_spec("ur10")
    spec["coupling"] = [{"joint": 6, "source": 5, "ratio": -0.01}]
    for kind in KINDS:
        new = convert(spec, kind).spec
        assert new["coupling"] == spec["coupling"]
        for key in ("min_deg", "max_deg", "motor_ratio"):
            assert [joint[key] for joint in new["joints"]] == [joint[key] for joint in spec["joints"]]


def test_a_turned_frame_of_wrenches_is_reported() -> None:
    assert convert(read_spec("pmc6va030"), "dh").notes == (
        "the base frame was turned: fx_n ... mz_nm are read along its new axes",
    )
    assert convert(read_spec("pmc6va030"), "poe").notes == ()


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InvalidInput, match="expected dh, mdh, poe or urdf as the kind to convert to, got 'xacro'"):
        convert(read_spec("ur5"), "xacro")
