# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signatures of what gives way under load, and of loads that are not as the robot file says."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from drawing import Figure, FloatArray
from signatures import POINTS, arm, having, joint_error, over_joint, postures, shift

from fastcal.calibration.prediction import predict
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

PAYLOADS = (0.0, 14.0)  # kg


def soft(joint: int, *causes: dict[str, Any], **more: Any) -> Robot:
    """The arm with one soft joint, and what else there is: weights show through compliances alone."""
    spec = copy.deepcopy(arm().spec) | more
    compliance = {"effect": "joint_compliance", "owner": f"joint{joint}", "parameters": {"compliance_rad_nm": 1e-6}}
    return Robot(spec | {"effects": [compliance, *causes]})


def through(joint: int, cause: dict[str, Any], q: FloatArray, payload: float = 0.0, **more: Any) -> FloatArray:
    """What a cause adds to the turn of a soft joint [mrad]."""
    with_it, without = (
        joint_error(robot, joint, q, payload=payload) for robot in (soft(joint, cause, **more), soft(joint, **more))
    )
    return with_it - without


def joint_load(joint: int, q: FloatArray, payload: float) -> FloatArray:
    """(POINTS,) torque about a joint's axis [N m]."""
    robot = having("joint_compliance", f"joint{joint}", {"compliance_rad_nm": 0.0})
    loads = robot.error_model.loads(robot.conditions(q, payload=payload), robot.error_model.start)
    return np.asarray(loads)[:, 2 * joint - 1, 5]


def joint_compliance() -> Figure:
    """The load of joint 2 over its way."""
    way, q = over_joint(2, -137, 137)
    model = having("joint_compliance", "joint2", {"compliance_rad_nm": 1e-6})
    curves = [(f"{payload:g} kg", joint_error(model, 2, q, payload=payload)) for payload in PAYLOADS]
    return Figure("q2 [deg]", "joint 2 [mrad]", way, curves)


def joint_compliance_nonlinear() -> Figure:
    """Soft at small loads, stiffer beyond."""
    _, q = over_joint(2, -70, 110)
    load = joint_load(2, q, 14.0)
    order = np.argsort(load)
    laws: dict[str, tuple[dict[str, float], dict[str, Any]]] = {
        "linear": ({"low_rad_nm": 6e-7, "high_rad_nm": 6e-7, "critical_nm": 400.0}, {}),
        "piecewise": ({"low_rad_nm": 1e-6, "high_rad_nm": 3e-7, "critical_nm": 400.0}, {}),
        "cubic": ({"compliance_rad_nm": 1e-6, "skew_1_rad": 0.0, "hardening_1_rad2": 6e6}, {"form": "cubic"}),
    }
    curves = []
    for name, (parameters, options) in laws.items():
        model = having("joint_compliance_nonlinear", "joint2", parameters, **options)
        curves.append((name, joint_error(model, 2, q, payload=14.0)[order]))
    return Figure("load of joint 2 [N m]", "joint 2 [mrad]", load[order], curves)


def current_compliance() -> Figure:
    """A line over the motor's current."""
    current = np.linspace(-10, 10, POINTS)
    model = having("current_compliance", "joint2", {"rad_a": 3e-5})
    error = joint_error(model, 2, postures(), current=np.outer(current, np.eye(6)[1]))
    return Figure("current of motor 2 [A]", "joint 2 [mrad]", current, [("3e-5 rad/A", error)])


def link_bending() -> Figure:
    """How far the tool sinks as the upper arm comes down."""
    way, q = over_joint(2, -137, 137)
    model = having("link_bending", "link2", {"inverse_ei_1_nm2": 1e-7})
    curves = [(f"{payload:g} kg", shift(model, q, payload=payload)[:, 2]) for payload in PAYLOADS]
    return Figure("q2 [deg]", "tool, up [mm]", way, curves)


def link_torsion() -> Figure:
    """The forearm's twist, as joint 4 turns the bent wrist from side to side."""
    way, q = over_joint(4, -180, 180)
    model = having("link_torsion", "link4", {"inverse_gj_1_nm2": 1e-6})
    curves = [(f"{payload:g} kg", np.linalg.norm(shift(model, q, payload=payload), axis=1)) for payload in PAYLOADS]
    return Figure("q4 [deg]", "tool [mm]", way, curves)


def bearing_tilt() -> Figure:
    """Joint 1 nods towards where the arm reaches."""
    way, q = over_joint(3, -150, 150)
    model = having("bearing_tilt", "joint1", {"rad_nm": 5e-8})
    curves = [(f"{payload:g} kg", shift(model, q, payload=payload)[:, 2]) for payload in PAYLOADS]
    return Figure("q3 [deg]", "tool, up [mm]", way, curves)


def beam_gravity() -> Figure:
    """The spray robot's tip as its main arm comes up from level, the telescope in and out."""
    robot = load_robot("spray_7dof")
    bent = Robot(
        robot.spec | {"effects": [{"effect": "beam_gravity", "owner": "structure", "parameters": {"scale": 1.0}}]}
    )
    way = np.linspace(20.0, 110.0, POINTS)
    curves = []
    for extension in (0.0, 0.8):
        q = np.zeros((POINTS, 7))
        q[:, 2], q[:, 5] = to_si(way, "deg"), extension
        sag = (bent.forward(q) - robot.forward(q))[:, 2, 3]
        curves.append((f"telescope {from_si(extension, 'mm'):g} mm", from_si(sag, "mm")))
    return Figure("q3 [deg]", "tool, up [mm]", way, curves)


def compensator_spring() -> Figure:
    """The spring's moment, a tenth of it, through the compliance of joint 2."""
    way, q = over_joint(2, -137, 137)
    spring = {"joint": 2, "anchor_mm": [0, -400, 0], "arm_mm": [200, 0, 0], "stiffness_n_m": 1e4, "free_length_mm": 150}
    curves = []
    for scale in (0.1, -0.1):
        cause = {"effect": "compensator_spring", "owner": "joint2", "parameters": {"stiffness_scale": scale}}
        curves.append((f"scale {scale:+g}", through(2, cause, q, compensator=spring)))
    return Figure("q2 [deg]", "joint 2 [mrad]", way, curves)


def payload_mass() -> Figure:
    """Half a kilogram more, through the compliance of joint 2."""
    way, q = over_joint(2, -137, 137)
    cause = {"effect": "payload_mass", "owner": "payload", "parameters": {"extra_kg": 0.5}}
    curves = [(f"{payload:g} kg", through(2, cause, q, payload)) for payload in PAYLOADS]
    return Figure("q2 [deg]", "joint 2 [mrad]", way, curves)


def payload_com() -> Figure:
    """A payload beside where it is thought to be, as the wrist turns it about."""
    way, q = over_joint(5, -105, 120)
    curves = []
    for axis in "xyz":
        cause = {"effect": "payload_com", "owner": "payload", "parameters": {f"shift_{axis}_mm": 20.0}}
        curves.append((f"{axis} 20 mm", through(5, cause, q, PAYLOADS[1])))
    return Figure("q5 [deg]", "joint 5 [mrad]", way, curves)


def link_mass() -> Figure:
    """Three kilograms more in the forearm, through the compliances of joints 2 and 3."""
    way, q = over_joint(2, -137, 137)
    cause = {"effect": "link_mass", "owner": "link4", "parameters": {"extra_kg": 3.0}}
    return Figure("q2 [deg]", "turn [mrad]", way, [(f"joint {j}", through(j, cause, q)) for j in (2, 3)])


def link_com() -> Figure:
    """A forearm whose centre is 20 mm off, through the compliance of joint 3."""
    way, q = over_joint(3, -150, 150)
    mass = float(arm().spec["joints"][2]["link"]["mass_kg"])
    curves = []
    for axis in "xz":
        cause = {"effect": "link_com", "owner": "link3", "parameters": {f"moment_{axis}_kg_m": mass * 0.02}}
        curves.append((f"{axis} 20 mm", through(3, cause, q)))
    return Figure("q3 [deg]", "joint 3 [mrad]", way, curves)


def friction() -> Figure:
    """Two branches that part with the load."""
    way, q = over_joint(2, -137, 137)
    model = having("friction", "joint2", {"rad_nm": 1e-7})
    curves = [
        (f"approach {side:+d}", joint_error(model, 2, q, approach=side * np.ones((POINTS, 6)))) for side in (1, -1)
    ]
    return Figure("q2 [deg]", "joint 2 [mrad]", way, curves)


def gravity_sag() -> Figure:
    """Sag over the joint's way, with the forearm stretched and folded."""
    way, q = over_joint(2, -137, 137)
    model = having("gravity_sag", "joint2", {"even_rad": 1e-3})
    curves = []
    for name, elbow in (("forearm folded", 140.0), ("stretched", 0.0)):
        q[:, 2] = to_si(elbow, "deg")
        curves.append((name, joint_error(model, 2, q)))
    return Figure("q2 [deg]", "joint 2 [mrad]", way, curves)


def _of_palletizer(entry: dict[str, Any]) -> Figure:
    """What an effect of a palletizer's loops moves the tool by over its lower arm's way, on which the load turns."""
    robot = load_robot("palletizer")
    there = Robot(robot.spec | {"effects": [entry]})
    way = np.linspace(-30.0, 60.0, POINTS)
    q = np.zeros((POINTS, robot.joint_count))
    q[:, 1], q[:, 2] = to_si(30.0, "deg"), to_si(way, "deg")
    q = robot.assemble(q).q
    curves = []
    for payload in (0.0, 150.0):
        rows = Dataset.from_arrays(q, payload=np.full(POINTS, payload))
        moved, here = (predict(of, rows).position[:, 0] for of in (there, robot))
        curves.append((f"{payload:g} kg", from_si(moved - here, "mm")))
    return Figure("q3 [deg]", "tool, forward [mm]", way, curves)


def pin_slack() -> Figure:
    """The pin of the upper arm has play."""
    return _of_palletizer({"effect": "pin_slack", "owner": "joint5", "parameters": {"gap_mm": 0.4}})


def pin_compliance() -> Figure:
    """The pin of the upper arm yields."""
    return _of_palletizer({"effect": "pin_compliance", "owner": "joint5", "parameters": {"compliance_m_n": 1e-7}})


def rod_slack() -> Figure:
    """The balls of the bar to the upper arm have play."""
    return _of_palletizer({"effect": "rod_slack", "owner": "bar", "parameters": {"gap_mm": 0.4}})


def rod_compliance() -> Figure:
    """The bar to the upper arm yields."""
    return _of_palletizer({"effect": "rod_compliance", "owner": "bar", "parameters": {"compliance_m_n": 1e-7}})
