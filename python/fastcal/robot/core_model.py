# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The C++ model of a robot file's content: the four ways to write its kinematics, its masses, spring and structure."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.robot.loops import loop_arguments
from fastcal.robot.structure import build_structure, frame_names
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
Spec = dict[str, Any]

ROW_KEYS = {
    "theta": "theta_deg",
    "d": "d_mm",
    "a": "a_mm",
    "alpha": "alpha_deg",
    "beta": "beta_deg",
}  # DH and MDH, in the order of the core
ROW_UNITS = {key: key.rsplit("_", 1)[1] for key in ROW_KEYS.values()}

_IDENTITY = np.eye(4)


def pose(frame: Spec) -> FloatArray:
    """(4, 4) of {xyz_mm, rpy_deg}, rpy about fixed axes X, Y, Z: R = Rz Ry Rx."""
    T = _IDENTITY.copy()
    T[:3, :3] = _core.rpy_to_rotation([to_si(float(angle), "deg") for angle in frame["rpy_deg"]])
    T[:3, 3] = [to_si(float(length), "mm") for length in frame["xyz_mm"]]
    return T


def length_or_angle_unit(joint: Spec) -> str:
    """The unit in which a joint's position and limits are given: deg, or mm for a prismatic one."""
    return "mm" if joint["type"] == "prismatic" else "deg"


def build_core(spec: Spec) -> _core.RobotModel:
    """The C++ model of a canonical spec."""
    joints: list[Spec] = spec["joints"]
    n = len(joints)
    links = [joint.get("link") or {} for joint in joints]
    coupling = np.zeros((n, n))
    for entry in spec.get("coupling") or []:
        coupling[entry["joint"] - 1, entry["source"] - 1] = entry["ratio"]
    description = _core.RobotDescription(
        joint_types=[joint["type"] for joint in joints],
        mass=np.array([link.get("mass_kg", 0.0) for link in links], dtype=float),
        com=to_si(np.array([link.get("com_mm", [0.0] * 3) for link in links], dtype=float), "mm"),
        inertia=np.array([link.get("inertia_kg_m2", [0.0] * 6) for link in links], dtype=float),
        T_world_base=pose(spec["base"]),
        T_flange_tool=pose(spec["tool"]),
        p_flange_payload=to_si(np.asarray(spec["payload"]["com_mm"], dtype=float), "mm"),
        gravity=np.asarray(spec["gravity_m_s2"], dtype=float),
        gravity_in_world=spec["gravity_frame"] == "measuring",
        coupling=coupling,
        wrench_frame=spec["wrench_frame"],
        motor_ratio=np.array([joint.get("motor_ratio", np.nan) for joint in joints], dtype=float),
        compensator=_compensator(spec.get("compensator")),
        **loop_arguments(spec),
        bending=build_structure(spec["structure"], frame_names(n)) if spec.get("structure") else None,
    )
    kinematics = spec["kinematics"]
    if kinematics in ("dh", "mdh"):
        rows = np.array(
            [[to_si(float(joint.get(key, 0.0)), unit) for key, unit in ROW_UNITS.items()] for joint in joints]
        )
        flange = [pose(spec["flange"])] if "flange" in spec else []
        return (_core.build_dh if kinematics == "dh" else _core.build_mdh)(description, rows, *flange)
    if kinematics == "poe":
        return _core.build_poe(description, np.array([screw(joint) for joint in joints]), pose(spec["home"]))
    origins = [pose(joint["origin"]) for joint in joints]
    axes = np.array([joint["axis"] for joint in joints], dtype=float)
    return _core.build_urdf(
        description, origins, axes / np.linalg.norm(axes, axis=1, keepdims=True), pose(spec["flange"])
    )


def _compensator(entry: Spec | None) -> _core.Compensator | None:
    """The spring of a robot file; anchor and arm are in the joint's frame at joint position 0."""
    if not entry:
        return None
    return _core.Compensator(
        joint=entry["joint"] - 1,
        anchor=to_si(np.asarray(entry["anchor_mm"], dtype=float), "mm"),
        arm=to_si(np.asarray(entry["arm_mm"], dtype=float), "mm"),
        stiffness=float(entry["stiffness_n_m"]),
        free_length=to_si(float(entry["free_length_mm"]), "mm"),
    )


def screw(joint: Spec) -> FloatArray:
    """(7,) omega, v, offset of a POE joint in SI; v = -omega x point (or the unit direction of a prismatic joint)."""
    omega = np.asarray(joint["omega"], dtype=float)
    if joint["type"] == "prismatic":
        v = np.asarray(joint["v_mm"] if "v_mm" in joint else joint["v"], dtype=float)
        return np.concatenate([np.zeros(3), v / np.linalg.norm(v), [to_si(float(joint.get("d_mm", 0.0)), "mm")]])
    omega = omega / np.linalg.norm(omega)
    if "point_mm" in joint:
        v = -np.cross(omega, to_si(np.asarray(joint["point_mm"], dtype=float), "mm"))
    else:
        v = to_si(np.asarray(joint["v_mm"], dtype=float), "mm")
    return np.concatenate([omega, v, [to_si(float(joint.get("theta_deg", 0.0)), "deg")]])
