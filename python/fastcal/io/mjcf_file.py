# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""MuJoCo's models (MJCF): bodies, hinges, slides, balls; `equality` of connect, weld and joint as closed loops.

Joints that an actuator moves are motors. Source: MuJoCo's XML reference, mujoco.readthedocs.io (kinematics, equality).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.io.mechanism import EVERY, JointOf, Mechanism, Pins, Ratio, direction, numbers
from fastcal.robot import se3
from fastcal.units import to_si

_KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "ball", "free": "free"}
_SPINS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}  # and how many numbers each has
_GENERATORS = ("replicate", "attach", "composite", "flexcomp")
_WORLD = "world"


def read_mjcf(path: str, root: ET.Element) -> tuple[Mechanism, list[str]]:
    """The mechanism of a model and the joints that actuators move.

    Raises:
        ParseError: It holds what is not understood; one sentence.
    """
    return _Model(path, root).read()


class _Model:
    def __init__(self, path: str, root: ET.Element) -> None:
        self.path, self.root = path, root
        compiler = {key: value for each in root.findall("compiler") for key, value in each.attrib.items()}
        self.per_unit = 1.0 if compiler.get("angle") == "radian" else to_si(1.0, "deg")
        self.sequence = compiler.get("eulerseq", "xyz")
        self.defaults: dict[str, dict[str, dict[str, str]]] = {}
        for each in root.findall("default"):
            self._default(each, {}, "main")
        self.of = Mechanism(path, root.get("model", ""), [_WORLD], [])
        self.places: dict[str, FloatArray] = {_WORLD: np.eye(4)}  # of bodies in the world, all joints where they begin
        self.refs: dict[str, float] = {}
        self.shaped: list[str] = []  # bodies whose mass follows from their shapes

    def _default(self, element: ET.Element, above: dict[str, dict[str, str]], name: str) -> None:
        mine = {tag: dict(values) for tag, values in above.items()}
        for child in element:
            if child.tag != "default":
                mine.setdefault(child.tag, {}).update(child.attrib)
        self.defaults[element.get("class", name)] = mine
        for child in element.findall("default"):
            self._default(child, mine, "")

    def _with_defaults(self, element: ET.Element, inherited: str) -> dict[str, str]:
        chosen = element.get("class", inherited)
        return self.defaults.get(chosen, {}).get(element.tag, {}) | element.attrib

    def read(self) -> tuple[Mechanism, list[str]]:
        for world in self.root.findall("worldbody"):
            self._content(world, _WORLD, "main")
        for equality in self.root.findall("equality"):
            for k, each in enumerate(equality):
                if each.get("active", "true") == "true":
                    self._equality(each, each.get("name", f"equality{k + 1}"))
        if self.shaped:
            self.of.notes.append(f"masses that follow from shapes are not read: {', '.join(self.shaped[:10])}")
        motors: list[str] = []
        for actuator in self.root.findall("actuator"):
            moved = (each.get("joint") or each.get("jointinparent") for each in actuator)
            motors += [joint for joint in moved if joint is not None]
        return self.of, motors

    def _content(self, element: ET.Element, name: str, inherited: str) -> None:
        """Sites and bodies on a body."""
        inside = list(self._inside(element, inherited, np.eye(4)))
        for child, its_class, T in inside:
            if child.tag == "site" and child.get("name"):
                self.of.frames[child.attrib["name"]] = name, T @ self._pose(self._with_defaults(child, its_class))
        for child, its_class, T in inside:
            if child.tag == "body":
                self._body(child, name, its_class, T @ self._pose(child.attrib))

    def _inside(
        self, element: ET.Element, inherited: str, T: FloatArray
    ) -> Iterator[tuple[ET.Element, str, FloatArray]]:
        """Children with the class that they inherit and the place of the frames around them."""
        for child in element:
            if child.tag == "frame":
                yield from self._inside(child, child.get("childclass", inherited), T @ self._pose(child.attrib))
            elif child.tag in _GENERATORS:
                self.of.fail(
                    f"<{child.tag}> makes bodies, which are not read; save them first (mujoco: mj_saveLastXML)"
                )
            else:
                yield child, inherited, T

    def _body(self, body: ET.Element, parent: str, inherited: str, T: FloatArray) -> None:
        inherited = body.get("childclass", inherited)
        name = body.get("name") or f"body{len(self.of.links)}"
        self.places[name] = self.places[parent] @ T
        on = parent
        joints = [child for child in body if child.tag in ("joint", "freejoint")]
        for k, element in enumerate(joints):
            to = name if k == len(joints) - 1 else f"{name}_after_{k + 1}"
            self.of.joints.append(self._joint(element, inherited, on, to, T))
            self.of.links.append(to)
            on, T = to, np.eye(4)
        if not joints:
            self.of.joints.append(JointOf(f"{name}_fixed", "fixed", parent, name, T, np.array([0.0, 0.0, 1.0])))
            self.of.links.append(name)
        for inertial in body.findall("inertial"):
            mass = float(self._numbers(inertial.get("mass", "0"), 1)[0])
            self.of.bodies[name] = mass, self._numbers(inertial.get("pos", "0 0 0"), 3)
        if body.find("inertial") is None and body.find("geom") is not None:
            self.shaped.append(name)
        self._content(body, name, inherited)

    def _joint(self, element: ET.Element, inherited: str, parent: str, child: str, T: FloatArray) -> JointOf:
        given = self._with_defaults(element, inherited)
        kind = "free" if element.tag == "freejoint" else _KINDS.get(given.get("type", "hinge"), "")
        if not kind:
            self.of.fail(f"joint '{given.get('name')}' is of type {given.get('type')}, which is not understood")
        name = given.get("name") or f"{child}_joint"
        axis = direction(given.get("axis", "0 0 1"), self.path)
        anchor = se3.pose(position=self._numbers(given.get("pos", "0 0 0"), 3))
        unit = self.per_unit if kind == "revolute" else 1.0
        low, high = -np.inf, np.inf
        if "range" in given and given.get("limited") != "false":
            low, high = (unit * self._numbers(given["range"], 2)).tolist()
        ref = unit * float(self._numbers(given.get("ref", "0"), 1)[0])
        self.refs[name] = ref
        back = np.eye(4)  # a position of `ref` is the posture that the file draws
        if kind == "revolute" and ref:
            back[:3, :3] = _core.exp_so3(-ref * axis)
        elif kind == "prismatic":
            back[:3, 3] = -ref * axis
        return JointOf(name, kind, parent, child, T @ anchor @ back, axis, se3.inverse(anchor), low, high, start=ref)

    def _equality(self, element: ET.Element, name: str) -> None:
        given = self._with_defaults(element, "main")
        if element.tag == "joint":
            self._coupled(given, name)
            return
        if element.tag not in ("connect", "weld"):
            self.of.fail(f"equality '{name}' is a {element.tag}, which is not understood; its loop would be lost")
        fixed = EVERY[:3] if element.tag == "connect" else EVERY
        if "site1" in given:
            ends = [self.of.frame(given[key]) for key in ("site1", "site2")]
        else:
            first, second = given["body1"], given.get("body2", _WORLD)
            for body in (first, second):
                self.of.frame(body)
            relation = np.linalg.inv(self.places[first]) @ self.places[second]
            pose = self._numbers(given.get("relpose", "0 1 0 0 0 0 0"), 7)
            if element.tag == "weld" and "relpose" in given and pose[3:].any():
                relation = se3.pose(self._turn(pose[3:]), pose[:3])
            if element.tag == "connect":
                anchor = se3.pose(position=self._numbers(given["anchor"], 3))
                ends = [(first, anchor), (second, np.linalg.inv(relation) @ anchor)]
            else:
                ends = [(first, relation), (second, np.eye(4))]
        (link1, T1), (link2, T2) = ends
        self.of.pins.append(Pins(name, (link1, link2), (T1, T2), fixed))

    def _coupled(self, given: dict[str, str], name: str) -> None:
        """joint1 - ref1 = a0 + a1 (joint2 - ref2)."""
        factors = np.zeros(5)
        found = self._numbers(given.get("polycoef", "0 1 0 0 0"), 1, 2, 3, 4, 5)
        factors[: len(found)] = found
        if factors[2:].any():
            self.of.fail(f"equality '{name}' is a curve (polycoef), which is not understood; its loop would be lost")
        if "joint2" not in given:
            self.of.fail(f"equality '{name}' holds joint '{given['joint1']}' where it is; make it fixed instead")
        driven, driver = given["joint1"], given["joint2"]
        offset = factors[0] + self.refs.get(driven, 0.0) - factors[1] * self.refs.get(driver, 0.0)
        self.of.ratios.append(Ratio(name, driven, {driver: float(factors[1])}, float(offset)))

    def _pose(self, given: dict[str, str]) -> FloatArray:
        return se3.pose(self._spin(given), self._numbers(given.get("pos", "0 0 0"), 3))

    def _spin(self, given: dict[str, str]) -> FloatArray:
        key: Any = next((key for key in _SPINS if key in given), None)
        if key is None:
            return np.eye(3)
        values = self._numbers(given[key], _SPINS[key])
        if key == "quat":
            return self._turn(values)
        if key == "axisangle":
            return np.asarray(_core.exp_so3(self.per_unit * values[3] * self._unit(values[:3], key)))
        if key == "euler":
            R = np.eye(3)
            for axis, angle in zip(self.sequence, self.per_unit * values, strict=True):
                turn = np.asarray(_core.rotation_about(axis.lower(), float(angle)))
                R = R @ turn if axis.islower() else turn @ R
            return R
        if key == "zaxis":
            return _shortest(self._unit(values, key))
        x = self._unit(values[:3], key)
        y = self._unit(values[3:] - x * (x @ values[3:]), key)
        return np.column_stack([x, y, np.cross(x, y)])

    def _turn(self, wxyz: FloatArray) -> FloatArray:
        return np.asarray(_core.quaternion_to_rotation(self._unit(wxyz, "quaternion")))

    def _unit(self, vector: FloatArray, what: str) -> FloatArray:
        size = float(np.linalg.norm(vector))
        if size == 0:
            self.of.fail(f"{what} has no direction")
        return np.asarray(vector / size)

    def _numbers(self, text: str, *counts: int) -> FloatArray:
        return numbers(text, self.path, *counts)


def _shortest(z: FloatArray) -> FloatArray:
    """The smallest turn of e_z into z."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, z[2]))
    if size == 0:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(_core.exp_so3(angle * axis / size))
