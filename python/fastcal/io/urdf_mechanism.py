# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDF as links and joints, and what closes its loops: a file beside it, or elements of its own.

`constraint` is the element proposed for urdfdom (https://github.com/ros/urdfdom/pull/264): two frames, each with an
axis. `loop_joint` is that of exporters of CAD programs: two points, and an axis of the parent alone.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.io.mechanism import HELD, JointOf, Mechanism, Pins, Ratio, direction, numbers
from fastcal.robot import se3

_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed"}
_CLOSURES = _KINDS | {"spherical": "ball", "ball": "ball"}
LOOP_ELEMENTS = ("constraint", "loop_joint")


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
        has_axis = axis is not None and kind != "fixed"  # of fixed ones exporters write 0 0 0
        along = direction(axis.get("xyz", "1 0 0") if axis is not None and has_axis else "1 0 0", path)
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
    of.pins += [_closure(of, element) for tag in LOOP_ELEMENTS for element in root.findall(tag)]
    for element in root.findall("link"):
        inertial = element.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        if inertial is not None and mass is not None:
            value = float(numbers(mass.get("value", "0"), path, 1)[0])
            of.bodies[element.attrib["name"]] = value, _origin(inertial, path)[:3, 3]
    return of


def _closure(of: Mechanism, element: ET.Element) -> Pins:
    """The pins of a `constraint` or `loop_joint`, z along its axis."""
    name, kind = element.get("name", ""), _CLOSURES.get(element.get("type", ""), "")
    links = _end(of, element, "parent"), _end(of, element, "child")
    axes = [_axis(element, f"{end}_axis", of.path) for end in ("parent", "child")]
    lacks_axis = any(axis is None for axis in axes)
    if not kind or (kind == "prismatic" and lacks_axis):
        of.fail(
            f"<{element.tag}> '{name}' is of type {element.get('type')}, which is not understood; give this loop in a "
            "robot file (kinematics: urdf, urdf: FILE) with motors: [...] and loops: [...]"
        )
    if kind == "revolute" and lacks_axis:
        kind = "ball"  # where the hinge's axis is in the child is not said; a flat loop holds it itself
    places = []
    for end, axis in zip(("parent", "child"), axes, strict=True):
        turn = np.eye(4)
        if axis is not None and kind in ("revolute", "prismatic"):
            turn[:3, :3] = _core.rotation_to_axis(axis.tolist())
        places.append(_origin(element, of.path, f"{end}_origin") @ turn)
    return Pins(name, links, (places[0], places[1]), tuple(HELD[kind]))


def _axis(element: ET.Element, key: str, path: str) -> FloatArray | None:
    axis = element.find(key)
    return None if axis is None else direction(axis.get("xyz", "1 0 0"), path)


def _end(of: Mechanism, joint: ET.Element, key: str) -> str:
    element = joint.find(key)
    link = "" if element is None else element.get("link", "")
    if link not in of.links:
        of.fail(f"{key} of joint '{joint.get('name', '')}' is '{link}', which is no link")
    return link


def _origin(element: ET.Element, path: str, key: str = "origin") -> FloatArray:
    origin = element.find(key)
    if origin is None:
        return np.eye(4)
    turn = numbers(origin.get("rpy", "0 0 0"), path, 3)
    return se3.pose(se3.rpy_to_rotation(turn), numbers(origin.get("xyz", "0 0 0"), path, 3))
