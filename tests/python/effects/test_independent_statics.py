# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Deflections under load against an oracle of its own, from textbooks and the file format alone: no product code in it.

Arms with a tilted base and a turned tool, links of 0.3 to 1.4 m, weights, payload and wrenches in every frame. Loads
are those of the undeflected arm (`equilibrium: false`), so that each effect is one closed formula.
"""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.io.robot_schema import check_spec

Array = NDArray[np.float64]
N = 4
GRAVITY = np.array([0.0, 0.0, -9.80665])


def turn(axis: str, angle: float) -> Array:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return T


def shift(*xyz: float) -> Array:
    T = np.eye(4)
    T[:3, 3] = xyz
    return T


def frame(entry: dict[str, Any]) -> Array:
    T = shift(*(1e-3 * np.array(entry["xyz_mm"])))
    T[:3, :3] = Rotation.from_euler("xyz", entry["rpy_deg"], degrees=True).as_matrix()
    return T


def twist(translation: Array, rotation: Array) -> Array:
    """exp of a body twist, by the matrix exponential."""
    xi = np.zeros((4, 4))
    x, y, z = rotation
    xi[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    xi[:3, 3] = translation
    return expm(xi)


@dataclass
class Posture:
    """World frames of the undeflected arm: of each joint (after its turn), of each link's far end, of base and tool."""

    joints: list[Array]
    rows: list[Array]
    links: list[Array]
    base: Array
    flange: Array
    tool: Array


def walk(spec: dict[str, Any], q: Array, at_joint: dict[int, Array], at_link: dict[int, Array]) -> Posture:
    """The chain of dh or mdh rows, with motions put in at joints and at links' ends."""
    base = frame(spec["base"])
    T, joints, rows, links = base, [], [], []
    for i, row in enumerate(spec["joints"]):
        d, a = 1e-3 * row["d_mm"], 1e-3 * row["a_mm"]
        theta, alpha, beta = np.radians([row["theta_deg"], row["alpha_deg"], row["beta_deg"]])
        if spec["kinematics"] == "mdh":
            T = T @ turn("x", alpha) @ shift(a, 0, 0)
            if i:
                T = T @ at_link.get(i - 1, np.eye(4))
                links.append(T)
            T = T @ turn("z", theta + q[i]) @ at_joint.get(i, np.eye(4))
            joints.append(T)
            T = T @ shift(0, 0, d) @ turn("y", beta)
        else:
            T = T @ turn("z", theta + q[i]) @ at_joint.get(i, np.eye(4))
            joints.append(T)
            T = T @ shift(a, 0, d) @ turn("x", alpha) @ turn("y", beta)
        rows.append(T)
        if spec["kinematics"] == "dh" or i == N - 1:
            T = T @ at_link.get(i, np.eye(4))
            links.append(T)
    return Posture(joints, rows, links, base, T, T @ frame(spec["tool"]))


def load(spec: dict[str, Any], posture: Posture, first: int, at: Array, payload: float, wrench: Array) -> Array:
    """Force and moment (6,) about the origin of `at`, in its axes, of what hangs on bodies `first` ... and tool."""
    gravity = GRAVITY if spec["gravity_frame"] == "measuring" else posture.base[:3, :3] @ GRAVITY
    centre = (posture.flange @ [*(1e-3 * np.array(spec["payload"]["com_mm"])), 1.0])[:3]
    pulls = [(payload * gravity, centre)]
    for i in range(first, N):
        body = spec["joints"][i]["link"]
        place = (posture.rows[i] @ [*(1e-3 * np.array(body["com_mm"])), 1.0])[:3]
        pulls.append((body["mass_kg"] * gravity, place))
    axes = {"base": posture.base, "flange": posture.flange, "tool": posture.tool}[spec["wrench_frame"]][:3, :3]
    pulls.append((axes @ wrench[:3], centre))
    force = np.sum([pull for pull, _ in pulls], axis=0)
    moment = np.sum([np.cross(place - at[:3, 3], pull) for pull, place in pulls], axis=0) + axes @ wrench[3:]
    return np.concatenate([at[:3, :3].T @ force, at[:3, :3].T @ moment])


def arm(rng: np.random.Generator, kinematics: str, wrench_frame: str, gravity_frame: str) -> dict[str, Any]:
    joints = []
    for i in range(N):
        link = {"mass_kg": float(rng.uniform(5, 60)), "com_mm": rng.uniform(-300, 300, 3).tolist()}
        sizes = {"theta_deg": float(rng.uniform(-90, 90)), "d_mm": float(rng.uniform(-200, 200)), "beta_deg": 3.0}
        sizes |= {"a_mm": float(rng.uniform(300, 1400)), "alpha_deg": float([-90, 0, 90, 40][i])}
        joints.append({"type": "revolute", **sizes, "min_deg": -400, "max_deg": 400, "link": link})
    spec = {
        "name": "arm", "kinematics": kinematics, "joints": joints, "equilibrium": False,
        "base": {"xyz_mm": [500, -300, 900], "rpy_deg": [35, -50, 20]},
        "tool": {"xyz_mm": [40, 70, 150], "rpy_deg": [25, 60, -80]},
        "payload": {"com_mm": [30, -60, 120]}, "wrench_frame": wrench_frame, "gravity_frame": gravity_frame,
        "gravity_m_s2": GRAVITY.tolist(),
    }  # fmt: skip
    return check_spec(spec, "arm.yaml")


CASES = [(k, w, g) for k in ("dh", "mdh") for w in ("base", "flange", "tool") for g in ("base", "measuring")]


@pytest.fixture(params=CASES, ids=" ".join)
def case(request: pytest.FixtureRequest) -> tuple[dict[str, Any], Array, float, Array]:
    """An arm, a posture, a payload and a wrench."""
    rng = np.random.default_rng(CASES.index(request.param))
    wrench = np.concatenate([rng.uniform(-300, 300, 3), rng.uniform(-100, 100, 3)])
    return arm(rng, *request.param), rng.uniform(-1.5, 1.5, N), 17.0, wrench


def predicted(spec: dict[str, Any], effects: list[dict[str, Any]], q: Array, payload: float, wrench: Array) -> Array:
    robot = fastcal.Robot(copy.deepcopy(spec) | {"effects": effects})
    return robot.forward(q[None], payload=payload, wrench=wrench[None])[0]


def effect(name: str, owner: str, **parameters: float) -> dict[str, Any]:
    return {"effect": name, "owner": owner, "parameters": {key: {"value": value} for key, value in parameters.items()}}


def assert_moved(got: Array, expected: Posture, rigid: Posture) -> None:
    assert np.abs(expected.tool - rigid.tool).max() > 1e-6
    np.testing.assert_allclose(got, expected.tool, rtol=0, atol=1e-12)


def test_joints_yield_to_weights_payload_and_wrench(case: tuple[dict[str, Any], Array, float, Array]) -> None:
    spec, q, payload, wrench = case
    rigid = walk(spec, q, {}, {})
    compliance = np.array([1e-6, 2e-6, 3e-6, 4e-6])
    torque = [load(spec, rigid, j, rigid.joints[j], payload, wrench)[5] for j in range(N)]
    effects = [effect("joint_compliance", f"joint{j + 1}", compliance_rad_nm=compliance[j]) for j in range(N)]
    expected = walk(spec, q + compliance * torque, {}, {})
    assert_moved(predicted(spec, effects, q, payload, wrench), expected, rigid)


def test_a_bearing_tilts_under_the_moment_across_it(case: tuple[dict[str, Any], Array, float, Array]) -> None:
    spec, q, payload, wrench = case
    rigid = walk(spec, q, {}, {})
    moment = load(spec, rigid, 1, rigid.joints[1], payload, wrench)[3:]
    tilt = twist(np.zeros(3), 2e-6 * moment * [1, 1, 0])
    effects = [effect("bearing_tilt", "joint2", rad_nm=2e-6)]
    assert_moved(predicted(spec, effects, q, payload, wrench), walk(spec, q, {1: tilt}, {}), rigid)


def link_load(
    spec: dict[str, Any], rigid: Posture, payload: float, wrench: Array
) -> tuple[Array, float, Array, Array, Array]:
    """Axis, length, force and moment at the far end of link 2, and its own weight, in the axes of that end."""
    end = rigid.links[1]
    row = spec["joints"][1] if spec["kinematics"] == "dh" else spec["joints"][2]
    along = (rigid.joints[1] if spec["kinematics"] == "dh" else rigid.rows[1])[:3, 0]
    axis, length = end[:3, :3].T @ along, 1e-3 * row["a_mm"]
    at_end = load(spec, rigid, 2, end, payload, wrench)
    gravity = GRAVITY if spec["gravity_frame"] == "measuring" else rigid.base[:3, :3] @ GRAVITY
    weight = spec["joints"][1]["link"]["mass_kg"] * end[:3, :3].T @ gravity
    return axis, length, at_end[:3], at_end[3:], weight


def test_a_link_twists_by_its_length(case: tuple[dict[str, Any], Array, float, Array]) -> None:
    """phi = M L / (G J)."""
    spec, q, payload, wrench = case
    rigid = walk(spec, q, {}, {})
    axis, length, _, moment, _ = link_load(spec, rigid, payload, wrench)
    twisted = twist(np.zeros(3), 5e-6 * length * (axis @ moment) * axis)
    effects = [effect("link_torsion", "link2", inverse_gj_1_nm2=5e-6)]
    assert_moved(predicted(spec, effects, q, payload, wrench), walk(spec, q, {}, {1: twisted}), rigid)


def test_a_link_bends_as_a_cantilever(case: tuple[dict[str, Any], Array, float, Array]) -> None:
    """Tables of beams: F L^3 / 3 EI, M L^2 / 2 EI, W L^3 / 8 EI; slopes F L^2 / 2 EI, M L / EI, W L^2 / 6 EI."""
    spec, q, payload, wrench = case
    rigid = walk(spec, q, {}, {})
    axis, L, force, moment, weight = link_load(spec, rigid, payload, wrench)
    across = np.eye(3) - np.outer(axis, axis)
    bent = across @ (force * L**3 / 3 + weight * L**3 / 8) + np.cross(moment, axis) * L**2 / 2
    slope = np.cross(axis, force * L**2 / 2 + weight * L**2 / 6) + across @ moment * L
    effects = [effect("link_bending", "link2", inverse_ei_1_nm2=1e-7)]
    expected = walk(spec, q, {}, {1: twist(1e-7 * bent, 1e-7 * slope)})
    assert_moved(predicted(spec, effects, q, payload, wrench), expected, rigid)


def test_gears_turn_by_their_ratios_and_couplings() -> None:
    """q_i = theta_i + k_i (q_i^n - sum_j c_ij q_j^n) + sum_j (c_ij + h_ij) k_j q_j^n."""
    spec = arm(np.random.default_rng(5), "dh", "base", "base")
    spec["coupling"] = [{"joint": 4, "source": 3, "ratio": -0.2}, {"joint": 3, "source": 2, "ratio": 0.3}]
    q = np.array([0.5, -0.9, 1.1, 0.7])
    k, h = 1 + np.array([0.0, 2e-3, -3e-3, 4e-3]), 5e-3
    c = np.zeros((N, N))
    c[3, 2], c[2, 1] = -0.2, 0.3
    extra = np.zeros((N, N))
    extra[3, 1] = h
    seen = k * (q - c @ q) + (c + extra) @ (k * q)
    effects = [effect("reduction_ratio", f"joint{j + 1}", error=k[j] - 1) for j in (1, 2, 3)]
    effects.append(effect("coupling_ratio", "joint4<-joint2", ratio=h))
    got = fastcal.Robot(spec | {"effects": effects}).forward(q[None])[0]
    np.testing.assert_allclose(got, walk(spec, seen, {}, {}).tool, rtol=0, atol=1e-12)


def test_derivatives_of_masses_and_centres_away_from_the_file_s() -> None:
    """The analytic columns against differences of `forward`, at weights far from those of the robot file."""
    spec = arm(np.random.default_rng(6), "dh", "base", "measuring")
    q = np.random.default_rng(7).uniform(-1.5, 1.5, (6, N))
    effects = [effect("joint_compliance", f"joint{j + 1}", compliance_rad_nm=1e-6 * (j + 1)) for j in range(N)]
    effects += [
        effect("payload_mass", "payload", extra_kg=3.0),
        effect("payload_com", "payload", shift_x_mm=40.0, shift_y_mm=-30.0, shift_z_mm=20.0),
        effect("link_mass", "link2", extra_kg=7.0),
        effect("link_com", "link3", moment_x_kg_m=1.5, moment_y_kg_m=2.5, moment_z_kg_m=-3.5),
    ]
    robot = fastcal.Robot(spec | {"effects": effects})
    J = robot.parameter_jacobian(q, payload=12.0)
    names = list(robot.parameter_names)
    checked = 0
    for i in range(N, len(effects)):
        for key, entry in effects[i]["parameters"].items():
            unit = next(unit for unit in ("kg_m", "kg", "mm") if key.endswith(f"_{unit}"))
            quantity, step = key.removesuffix(f"_{unit}"), {"kg_m": 1e-2, "kg": 1e-2, "mm": 1.0}[unit]
            ends = []
            for sign in (1, -1):
                moved = copy.deepcopy(effects)
                moved[i]["parameters"][key]["value"] = entry["value"] + sign * step
                ends.append(fastcal.Robot(spec | {"effects": moved}).forward(q, payload=12.0)[:, :3, 3])
            slope = (ends[0] - ends[1]) / (2 * step * (1e-3 if unit == "mm" else 1.0))
            (column,) = [k for k, name in enumerate(names) if name == f"{effects[i]['owner']} {quantity}"]
            np.testing.assert_allclose(J[:, :, column], slope, rtol=2e-4, atol=2e-4 * np.abs(slope).max())
            checked += 1
    assert checked == 8
