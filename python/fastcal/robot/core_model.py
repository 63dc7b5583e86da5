# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The C++ model of a robot file's content: the four ways to write its kinematics, its masses, spring and structure."""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot.loops import loop_arguments
from fastcal.robot.robot_spec import Compensator, Frame, Joint, Link, RobotSpec, Spec, structured
from fastcal.robot.structure import build_structure, frame_names
from fastcal.units import to_si

ROW_KEYS = {
    "theta": "theta_deg",
    "d": "d_mm",
    "a": "a_mm",
    "alpha": "alpha_deg",
    "beta": "beta_deg",
}  # DH and MDH, in the order of the core
ROW_UNITS = {key: key.rsplit("_", 1)[1] for key in ROW_KEYS.values()}


def pose(frame: Spec) -> FloatArray:
    """(4, 4) of {xyz_mm, rpy_deg}, rpy about fixed axes X, Y, Z: R = Rz Ry Rx."""
    return structured(Frame, frame).T


def build_core(spec: RobotSpec) -> _core.RobotModel:
    """The C++ model of what a robot file says, without its effects."""
    joints = spec.joints
    n = len(joints)
    links = [joint.link or Link() for joint in joints]
    coupling = np.zeros((n, n))
    for entry in spec.coupling:
        coupling[entry.joint - 1, entry.source - 1] = entry.ratio
    description = _core.RobotDescription(
        joint_types=[joint.type for joint in joints],
        mass=np.array([link.mass_kg for link in links], dtype=float),
        com=to_si(np.array([link.com_mm for link in links], dtype=float), "mm"),
        inertia=np.array([link.inertia_kg_m2 or [0.0] * 6 for link in links], dtype=float),
        T_world_base=spec.base.T,
        T_flange_tool=spec.tool.T,
        p_flange_payload=to_si(np.asarray(spec.payload.com_mm, dtype=float), "mm"),
        gravity=np.asarray(spec.gravity_m_s2, dtype=float),
        gravity_in_world=spec.gravity_frame == "measuring",
        coupling=coupling,
        wrench_frame=spec.wrench_frame,
        motor_ratio=np.array([np.nan if j.motor_ratio is None else j.motor_ratio for j in joints], dtype=float),
        compensator=None if spec.compensator is None else _compensator(spec.compensator),
        bending=build_structure(spec.structure, frame_names(n)) if spec.structure else None,
        **loop_arguments(spec),
    )
    if spec.kinematics in ("dh", "mdh"):
        rows = np.array([[to_si(getattr(j, key) or 0.0, unit) for key, unit in ROW_UNITS.items()] for j in joints])
        build = _core.build_dh if spec.kinematics == "dh" else _core.build_mdh
        return build(description, rows, *([] if spec.flange is None else [spec.flange.T]))
    if spec.kinematics == "poe":
        return _core.build_poe(description, np.array([screw(joint) for joint in joints]), (spec.home or Frame()).T)
    origins = [(joint.origin or Frame()).T for joint in joints]
    axes = np.array([joint.axis for joint in joints], dtype=float)
    return _core.build_urdf(
        description, origins, axes / np.linalg.norm(axes, axis=1, keepdims=True), (spec.flange or Frame()).T
    )


def _compensator(spring: Compensator) -> _core.Compensator:
    """The spring of a robot file; anchor and arm are in the joint's frame at joint position 0."""
    return _core.Compensator(
        joint=spring.joint - 1,
        anchor=to_si(np.asarray(spring.anchor_mm, dtype=float), "mm"),
        arm=to_si(np.asarray(spring.arm_mm, dtype=float), "mm"),
        stiffness=float(spring.stiffness_n_m),
        free_length=to_si(float(spring.free_length_mm), "mm"),
    )


def screw(joint: Joint) -> FloatArray:
    """(7,) omega, v, offset of a POE joint in SI; v = -omega x point (or the unit direction of a prismatic joint)."""
    omega = np.asarray(joint.omega, dtype=float)
    if not joint.turns:
        v = np.asarray(joint.v if joint.v_mm is None else joint.v_mm, dtype=float)
        return np.concatenate([np.zeros(3), v / np.linalg.norm(v), [to_si(joint.d_mm or 0.0, "mm")]])
    omega = omega / np.linalg.norm(omega)
    if joint.point_mm is not None:
        v = -np.cross(omega, to_si(np.asarray(joint.point_mm, dtype=float), "mm"))
    else:
        v = to_si(np.asarray(joint.v_mm, dtype=float), "mm")
    return np.concatenate([omega, v, [to_si(joint.theta_deg or 0.0, "deg")]])
