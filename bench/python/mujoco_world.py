# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot of rods as MuJoCo has it: a measuring world that shares no code with fastcal.

Every rod is a body of its own, on a ball joint at one pin and held by `connect` at the other. MuJoCo's kinematics and
its equality constraints c (q), with their Jacobian, are all that is used; the joints without a motor come from

    q <- q - J^+ c    (Newton; J^+ leaves a rod's turn about itself alone)
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as Xml

import mujoco
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_MM = 1e-3
_CLOSED = 1e-12  # [m]
_STEPS = 50
_LONGEST = 0.3  # [rad], [m] of a step


class MujocoWorld:
    """The tool's point of a robot whose loops are rods of one length.

    Args:
        robot: Content of a robot file of urdf kinematics.
    """

    def __init__(self, robot: dict[str, Any]) -> None:
        self.joints = robot["joints"]
        self.passive = [k for k, joint in enumerate(self.joints) if joint.get("passive")]
        self.model = mujoco.MjModel.from_xml_string(mjcf(robot))
        self.data = mujoco.MjData(self.model)
        self.motors = [k for k in range(len(self.joints)) if k not in self.passive]
        at = [int(self.model.joint(f"joint{k + 1}").dofadr[0]) for k in self.motors]
        self._free = np.setdiff1d(np.arange(self.model.nv), at)
        self.rods = [loop["name"] for loop in robot["loops"]]

    def points(self, q: FloatArray) -> FloatArray:
        """(N, 3) [m] of the tool at joint positions q (N, n) [rad, m], whose passive ones are only where to begin."""
        return np.array([self._point(row) for row in q])

    def _point(self, q: FloatArray) -> FloatArray:
        for k, value in enumerate(q):
            self.data.qpos[self._place(k)] = value
        mujoco.mj_kinematics(self.model, self.data)
        for rod in self.rods:
            self._aim(rod)
        gap = self._gap()
        for _ in range(_STEPS):
            if np.abs(gap).max() < _CLOSED:
                break
            step = np.zeros(self.model.nv)
            step[self._free] = -np.linalg.lstsq(self._slope()[:, self._free], gap, rcond=1e-10)[0]
            step *= min(1.0, _LONGEST / np.abs(step).max())
            mujoco.mj_integratePos(self.model, self.data.qpos, step, 1.0)
            gap = self._gap()
        if np.abs(gap).max() > 1e-9:
            raise ValueError(f"MuJoCo closes no loop here: {np.abs(gap).max()} m are left")
        return np.array(self.data.site("tool").xpos)

    def _aim(self, rod: str) -> None:
        """Turns a rod's ball joint until the rod, its x axis, points at the far pin."""
        body = self.model.body(rod)
        parent = self.data.xmat[int(body.parentid[0])].reshape(3, 3)
        way = parent.T @ (self.data.site(f"{rod}_to").xpos - self.data.body(rod).xpos)
        x = way / np.linalg.norm(way)
        turn = np.array([1 + x[0], 0.0, -x[2], x[1]])  # from (1, 0, 0) to x by the shortest way
        at = int(self.model.jnt_qposadr[int(body.jntadr[0])])
        half_turn = np.array([0.0, 0.0, 0.0, 1.0])
        length = np.linalg.norm(turn)
        self.data.qpos[at : at + 4] = turn / length if length > 1e-6 else half_turn

    def _gap(self) -> FloatArray:
        mujoco.mj_fwdPosition(self.model, self.data)
        return np.array(self.data.efc_pos[: self.data.ne])

    def _slope(self) -> FloatArray:
        return np.array(self.data.efc_J).reshape(-1, self.model.nv)[: self.data.ne]

    def _place(self, joint: int) -> int:
        return int(self.model.joint(f"joint{joint + 1}").qposadr[0])


def mjcf(robot: dict[str, Any]) -> str:
    """MuJoCo's XML of a robot file's content."""
    root = Xml.Element("mujoco")
    Xml.SubElement(root, "compiler", angle="radian", eulerseq="XYZ")
    Xml.SubElement(root, "option", gravity="0 0 0", jacobian="dense")
    bodies = {"base": Xml.SubElement(root, "worldbody")}
    for number, joint in enumerate(robot["joints"], start=1):
        origin = joint["origin"]
        body = _body(bodies[joint.get("on") or _before(number)], f"link{number}", origin["xyz_mm"])
        body.set("euler", _words(np.radians(origin["rpy_deg"])))
        kind = "slide" if joint["type"] == "prismatic" else "hinge"
        Xml.SubElement(body, "joint", name=f"joint{number}", type=kind, axis=_words(joint["axis"]))
        bodies[f"link{number}"] = body
    last = f"link{len(robot['joints'])}"
    tool = np.asarray(robot["tool"]["xyz_mm"], dtype=float)
    Xml.SubElement(bodies[last], "site", name="tool", pos=_words(tool * _MM))
    equality = Xml.SubElement(root, "equality")
    for loop in robot["loops"]:
        rod = _body(bodies[loop["from"]], loop["name"], loop["from_xyz_mm"])
        Xml.SubElement(rod, "joint", type="ball")
        far = np.asarray(loop["to_xyz_mm"], dtype=float) + (tool if loop["to"] == "tool" else 0.0)
        held = last if loop["to"] == "tool" else loop["to"]
        Xml.SubElement(bodies[held], "site", name=f"{loop['name']}_to", pos=_words(far * _MM))
        Xml.SubElement(rod, "site", name=f"{loop['name']}_end", pos=_words([loop["length_mm"] * _MM, 0.0, 0.0]))
        Xml.SubElement(equality, "connect", site1=f"{loop['name']}_end", site2=f"{loop['name']}_to")
    return Xml.tostring(root, encoding="unicode")


def _body(on: Xml.Element, name: str, xyz_mm: Any) -> Xml.Element:
    body = Xml.SubElement(on, "body", name=name, pos=_words(np.asarray(xyz_mm, dtype=float) * _MM))
    Xml.SubElement(body, "inertial", mass="1", pos="0 0 0", diaginertia="1 1 1")  # MuJoCo wants one; nothing moves it
    return body


def _before(number: int) -> str:
    return f"link{number - 1}" if number > 1 else "base"


def _words(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)
