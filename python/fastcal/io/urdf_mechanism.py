# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDF as links and joints, of which a file beside it closes loops."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.io.mechanism import JointOf, Mechanism, Ratio, direction, numbers
from fastcal.robot import se3

_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed"}


def read_urdf_mechanism(path: str, root: ET.Element) -> Mechanism:
    """Links, joints and mimics of a URDF; a link with two parents is kept as it is: a loop.

    Raises:
        ParseError: It holds what is not understood; one sentence.
    """
    of = Mechanism(path, root.get("name", ""), [each.attrib["name"] for each in root.findall("link")], [])
    for joint in root.findall("joint"):
        name, kind = joint.get("name", ""), _KINDS.get(joint.get("type", ""), "")
        parent, child = (_end(of, joint, key) for key in ("parent", "child"))
        if not kind:
            of.fail(f"joint '{name}' is of type {joint.get('type')}, which is not understood in a mechanism with loops")
        axis, limit, mimic = (joint.find(key) for key in ("axis", "limit", "mimic"))
        along = direction("1 0 0" if axis is None else axis.get("xyz", "1 0 0"), path)
        low, high = -np.inf, np.inf
        if limit is not None and joint.get("type") != "continuous":
            low, high = float(limit.get("lower", 0)), float(limit.get("upper", 0))
        of.joints.append(JointOf(name, kind, parent, child, _origin(joint, path), along, low=low, high=high))
        if mimic is not None:
            factor, offset = (
                float(numbers(mimic.get(key, usual), path, 1)[0])
                for key, usual in (("multiplier", "1"), ("offset", "0"))
            )
            of.ratios.append(Ratio(f"{name}_mimic", name, {mimic.attrib["joint"]: factor}, offset))
    for element in root.findall("link"):
        inertial = element.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        if inertial is not None and mass is not None:
            value = float(numbers(mass.get("value", "0"), path, 1)[0])
            of.bodies[element.attrib["name"]] = value, _origin(inertial, path)[:3, 3]
    return of


def _end(of: Mechanism, joint: ET.Element, key: str) -> str:
    element = joint.find(key)
    link = "" if element is None else element.get("link", "")
    if link not in of.links:
        of.fail(f"{key} of joint '{joint.get('name', '')}' is '{link}', which is no link")
    return link


def _origin(element: ET.Element, path: str) -> FloatArray:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    turn = numbers(origin.get("rpy", "0 0 0"), path, 3)
    return se3.pose(se3.rpy_to_rotation(turn), numbers(origin.get("xyz", "0 0 0"), path, 3))
