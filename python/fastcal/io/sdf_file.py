# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""SDFormat: links and joints of a model; a link with two parents closes a loop.

Source: the specification, sdformat.org (poses and their frames: "Pose Frame Semantics", version 1.7 and later).
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.mechanism import JointOf, Mechanism, Ratio, direction, numbers
from fastcal.robot import se3
from fastcal.units import to_si

_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "ball": "ball"}
_MODEL = "__model__"


def read_sdf(path: str, root: ET.Element) -> Mechanism:
    """The mechanism of the one model of a file.

    Raises:
        ParseError: It holds what is not understood; one sentence.
    """
    models = root.findall(".//model")
    if len(models) != 1 or models[0].find("include") is not None:
        raise ParseError(f"expected one model without others in it, got {len(models)}", path)
    return _Model(path, models[0]).read()


class _Model:
    def __init__(self, path: str, model: ET.Element) -> None:
        self.model = model
        self.links, self.joints, self.own = (
            {each.attrib["name"]: each for each in model.findall(tag)} for tag in ("link", "joint", "frame")
        )
        if len(self.links | self.joints | self.own) != sum(
            len(model.findall(tag)) for tag in ("link", "joint", "frame")
        ):
            raise ParseError("two links, joints or frames have one name; each needs a different name", path)
        self.of = Mechanism(path, model.get("name", ""), [*self.links], [])
        self.places: dict[str, FloatArray] = {_MODEL: np.eye(4)}
        self.asked: set[str] = set()

    def read(self) -> Mechanism:
        for name, joint in self.joints.items():
            self._joint(name, joint)
        for name in self.own:
            link = name
            while link in self.own:
                link = self.own[link].get("attached_to", _MODEL)
            if link in self.links:
                self.of.frames[name] = link, np.linalg.inv(self._place(link)) @ self._place(name)
        for name, element in self.links.items():
            inertial = element.find("inertial")
            if inertial is not None:
                mass = float(numbers(inertial.findtext("mass", "1"), self.of.path, 1)[0])
                self.of.bodies[name] = mass, self._pose(inertial.find("pose"))[:3, 3]
        return self.of

    def _joint(self, name: str, joint: ET.Element) -> None:
        kind = _KINDS.get(joint.get("type", ""), "")
        parent, child = (self._link(name, joint, key) for key in ("parent", "child"))
        if not kind:
            self.of.fail(f"joint '{name}' is of type {joint.get('type')}, which is not understood")
        T = self._place(name)
        axis = np.array([0.0, 0.0, 1.0])
        low, high = -np.inf, np.inf
        element = joint.find("axis")
        if element is not None and kind in ("revolute", "prismatic"):
            xyz = element.find("xyz")
            if xyz is not None:
                # <use_parent_model_frame>: of version 1.6 and before
                old = element.findtext("use_parent_model_frame", "").strip() in ("true", "1")
                seen_from = _MODEL if old else xyz.get("expressed_in") or name
                axis = T[:3, :3].T @ self._place(seen_from)[:3, :3] @ direction(xyz.text, self.of.path)
            if joint.get("type") != "continuous":
                low = float(element.findtext("limit/lower", "-inf"))
                high = float(element.findtext("limit/upper", "inf"))
            for mimic in element.findall("mimic"):
                self._mimic(name, mimic)
        T_parent = np.linalg.inv(self._place(parent)) @ T
        T_child = np.linalg.inv(T) @ self._place(child)
        self.of.joints.append(JointOf(name, kind, parent, child, T_parent, axis, T_child, low, high))

    def _link(self, name: str, joint: ET.Element, key: str) -> str:
        link = joint.findtext(key, "").strip()
        if link == "world":
            if link not in self.of.links:
                self.of.links.append(link)
                self.places[link] = np.eye(4)
        elif link in self.own:
            self.of.fail(f"{key} of joint '{name}' is the frame '{link}', which is not understood; name its link")
        elif link not in self.links:
            self.of.fail(f"{key} of joint '{name}' is '{link}', which is no link of the model")
        return link

    def _mimic(self, name: str, mimic: ET.Element) -> None:
        """Its position is multiplier times (that of the other less reference) plus offset."""
        factor, offset, reference = (
            float(numbers(mimic.findtext(key, default), self.of.path, 1)[0])
            for key, default in (("multiplier", "1"), ("offset", "0"), ("reference", "0"))
        )
        ratio = Ratio(f"{name}_mimic", name, {mimic.attrib["joint"]: factor}, offset - factor * reference)
        self.of.ratios.append(ratio)

    def _place(self, name: str) -> FloatArray:
        """Of a link, joint or frame in the model, with all joints at 0."""
        if name in self.places:
            return self.places[name]
        if name in self.asked:
            self.of.fail(f"the pose of '{name}' is told from itself")
        self.asked.add(name)
        if name in self.links:
            element, usual = self.links[name], _MODEL
        elif name in self.joints:
            element = self.joints[name]
            usual = element.findtext("child", "").strip()
        elif name in self.own:
            element = self.own[name]
            usual = element.get("attached_to", _MODEL)
        else:
            self.of.fail(f"a pose is told from '{name}', which is not there")
        pose = element.find("pose")
        start = usual if pose is None else pose.get("relative_to") or usual
        self.places[name] = self._place(start) @ self._pose(pose)
        return self.places[name]

    def _pose(self, element: ET.Element | None) -> FloatArray:
        if element is None or not (element.text or "").strip():
            return np.eye(4)
        if element.get("rotation_format") == "quat_xyzw":
            values = numbers(element.text, self.of.path, 7)
            wxyz = values[[6, 3, 4, 5]]
            if not wxyz.any():
                self.of.fail("a quaternion is 0 0 0 0")
            return se3.pose(_core.quaternion_to_rotation(wxyz / np.linalg.norm(wxyz)), values[:3])
        values = numbers(element.text, self.of.path, 6)
        unit = to_si(1.0, "deg") if element.get("degrees") == "true" else 1.0
        return se3.pose(se3.rpy_to_rotation(unit * values[3:]), values[:3])
