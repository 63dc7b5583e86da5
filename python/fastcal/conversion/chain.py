# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The common content of all robot files: joint axes as screws, the flange and the bodies, in the base frame at q = 0.

T_base_flange(q) = exp(S_1 q_1) ... exp(S_n q_n) home (Brockett's product of exponentials). Written from the formulas of
the file format and not from the C++ core, so that each is the other's oracle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import units
from fastcal.arrays import FloatArray
from fastcal.robot import se3
from fastcal.robot.core_model import pose

Spec = dict[str, Any]


@dataclass(frozen=True)
class Body:
    """A rigid body in some frame: mass [kg], centre (3,) [m], inertia (3, 3) about it [kg m^2] or None: not given."""

    mass: float
    com: FloatArray
    inertia: FloatArray | None

    def moved(self, T: FloatArray) -> Body:
        """The same body seen from the frame in which its present frame is at T."""
        R = T[:3, :3]
        inertia = None if self.inertia is None else R @ self.inertia @ R.T
        return Body(self.mass, R @ self.com + T[:3, 3], inertia)


@dataclass(frozen=True)
class Chain:
    """An arm as screws in the base frame at q = 0, SI.

    Attributes:
        revolute: Whether each joint turns; else it slides.
        omega: (n, 3) unit direction of turning joints, 0 for sliding ones.
        v: (n, 3) moment -omega x point of turning joints, unit direction of sliding ones.
        home: (4, 4) T_base_flange at q = 0.
        bodies: What each joint moves, in the base frame at q = 0.
    """

    revolute: tuple[bool, ...]
    omega: FloatArray
    v: FloatArray
    home: FloatArray
    bodies: tuple[Body | None, ...]

    def forward(self, q: FloatArray) -> FloatArray:
        """T_base_flange (N, 4, 4) of joint positions q (N, n), rad and m; no effects."""
        T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for i in range(len(self.revolute)):
            T = T @ se3.screw_motion(self.omega[i], self.v[i], q[:, i])
        return T @ self.home

    def direction(self, joint: int) -> FloatArray:
        """Unit vector along the axis of a joint (counted from 0)."""
        direction: FloatArray = self.omega[joint] if self.revolute[joint] else self.v[joint]
        return direction

    def point(self, joint: int) -> FloatArray | None:
        """The point of a turning joint's axis that is nearest to the base; None: a slide has no place."""
        return np.cross(self.omega[joint], self.v[joint]) if self.revolute[joint] else None


def chain_of(spec: Spec) -> Chain:
    """The chain of a canonical spec of any kind; nominal coupling cancels out and effects are not in it."""
    steps = {"dh": _dh, "mdh": _mdh, "poe": _poe, "urdf": _urdf}[spec["kinematics"]](spec)
    revolute, omegas, vs, bodies = [], [], [], []
    for joint, (axis, link_frame) in zip(spec["joints"], steps, strict=True):
        turns = joint["type"] == "revolute"
        z = axis[:3, 2]
        revolute.append(turns)
        omegas.append(z if turns else np.zeros(3))
        vs.append(np.cross(axis[:3, 3], z) if turns else z)
        body = body_of(joint)
        bodies.append(None if body is None else body.moved(link_frame))
    home = steps[-1][1]
    if (end := "home" if spec["kinematics"] == "poe" else "flange") in spec:
        home = home @ pose(spec[end])
    return Chain(tuple(revolute), np.array(omegas), np.array(vs), home, tuple(bodies))


def body_of(joint: Spec) -> Body | None:
    """The body of a joint's `link`, in the frame that the file gives it in."""
    link = joint.get("link")
    if link is None:
        return None
    inertia = None
    if "inertia_kg_m2" in link:
        xx, yy, zz, xy, xz, yz = link["inertia_kg_m2"]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Body(link["mass_kg"], si(link["com_mm"], "mm"), inertia)


def si(values: list[float], unit: str) -> FloatArray:
    """A list of a spec as an SI array."""
    return units.to_si(np.array(values, dtype=float), unit)


# Each of the following gives, joint after joint at q = 0, a frame with z on the joint's axis and the frame of its link.
_Steps = list[tuple[FloatArray, FloatArray]]


def _table(spec: Spec) -> Iterator[tuple[float, float, float, float, float]]:
    for joint in spec["joints"]:
        theta, alpha, beta = (units.to_si(joint[f"{name}_deg"], "deg") for name in ("theta", "alpha", "beta"))
        yield theta, units.to_si(joint["d_mm"], "mm"), units.to_si(joint["a_mm"], "mm"), alpha, beta


def _dh(spec: Spec) -> _Steps:
    """T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    steps: _Steps = []
    T = np.eye(4)
    for theta, d, a, alpha, beta in _table(spec):
        axis = T
        T = T @ se3.pose(se3.rotation_z(theta)) @ se3.pose(position=[a, 0.0, d])
        T = T @ se3.pose(se3.rotation_x(alpha) @ se3.rotation_y(beta))
        steps.append((axis, T))
    return steps


def _mdh(spec: Spec) -> _Steps:
    """T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta)."""
    steps: _Steps = []
    T = np.eye(4)
    for theta, d, a, alpha, beta in _table(spec):
        axis = T @ se3.pose(se3.rotation_x(alpha), [a, 0.0, 0.0])
        T = axis @ se3.pose(se3.rotation_z(theta), [0.0, 0.0, d]) @ se3.pose(se3.rotation_y(beta))
        steps.append((axis, T))
    return steps


def _poe(spec: Spec) -> _Steps:
    """exp(S_1 (q_1 + o_1)) ...: screws, home and bodies are given where every q_i + o_i is 0."""
    steps: _Steps = []
    T = np.eye(4)
    for joint in spec["joints"]:
        omega = np.array(joint["omega"])
        if joint["type"] == "prismatic":
            direction, point = np.array(joint["v"]), np.zeros(3)
            v, offset = direction, units.to_si(joint["d_mm"], "mm")
        else:
            direction = omega
            v = si(joint["v_mm"], "mm") if "v_mm" in joint else np.cross(si(joint["point_mm"], "mm"), omega)
            point, offset = np.cross(omega, v), units.to_si(joint["theta_deg"], "deg")
        axis = T @ se3.pose(se3.turn_between(np.array([0.0, 0.0, 1.0]), direction, np.array([1.0, 0.0, 0.0])), point)
        T = T @ se3.screw_motion(omega, v, np.array([offset]))[0]
        steps.append((axis, T))
    return steps


def _urdf(spec: Spec) -> _Steps:
    """T_i = origin * motion about or along the axis; the link's frame is the joint's."""
    steps: _Steps = []
    T = np.eye(4)
    for joint in spec["joints"]:
        T = T @ pose(joint["origin"])
        turn = se3.turn_between(np.array([0.0, 0.0, 1.0]), np.array(joint["axis"]), np.array([1.0, 0.0, 0.0]))
        steps.append((T @ se3.pose(turn), T))
    return steps
