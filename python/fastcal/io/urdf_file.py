# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDF in (through the core, which alone knows urdfdom) and out (XML text)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from fastcal import units
from fastcal.arrays import FloatArray
from fastcal.effects.entries import label
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.mechanism_file import closed_by_itself
from fastcal.io.robot_schema import Spec
from fastcal.io.urdf_chain import read_chain, read_chains
from fastcal.io.xacro_file import expanded
from fastcal.io.xml_text import read_xml
from fastcal.robot.se3 import rotation_to_rpy

_NO_LIMIT = "1e6"


ENDINGS = (".urdf", ".xacro")


def read_urdf(
    path: str | os.PathLike[str], base_link: str = "", tip_link: str = "", xacro: Mapping[str, str] | None = None
) -> Spec:
    """The arm in a URDF file as a spec of kind `urdf`: name, joints, flange, source, notes; not yet checked.

    Args:
        path: The file; xacro is expanded.
        base_link: Where the arm begins; empty: the root.
        tip_link: Its last link, the flange; empty: the only one there is.
        xacro: Values of a xacro file's arguments.

    Raises:
        ParseError: The file holds no serial arm; the sentence says why.
    """
    xml = expanded(path, xacro) if str(path).lower().endswith(".xacro") else read_xml(path)
    closed_by_itself(xml, Path(path))
    try:
        chain = read_chain(xml, base_link, tip_link)
    except ParseError:
        raise
    except InvalidInput as error:
        raise ParseError(f"{' '.join(str(error).split()):.400}", path) from None
    return _chain_spec(chain) | {"source": {key: chain[key] for key in ("base_link", "tip_link")} | {"xml": xml}}


def read_urdf_tree(path: str | os.PathLike[str], base_link: str, tip_links: list[str]) -> list[tuple[int, str, Spec]]:
    """The arms to several tips of a URDF as chains that share no joint: parent, tip_link and spec of each.

    The parent is the place in the list of the chain that it begins at the end of; -1: at the base. Not yet checked.

    Raises:
        ParseError: A tip is not there, or no joint moves it by itself; the sentence says why.
    """
    try:
        chains = read_chains(read_xml(path), base_link, tip_links)
    except ParseError:
        raise
    except InvalidInput as error:
        raise ParseError(f"{' '.join(str(error).split()):.400}", path) from None
    return [(parent, str(chain["tip_link"]), _chain_spec(chain)) for parent, chain in chains]


def _chain_spec(chain: Mapping[str, Any]) -> Spec:
    return {
        "name": chain["name"] or "robot",
        "kinematics": "urdf",
        "joints": [_joint_spec(joint) for joint in chain["joints"]],
        "flange": _frame_spec(chain["flange"]),
        "notes": list(chain["notes"]),
    }


def urdf_text(spec: Spec) -> str:
    """A spec of kind `urdf` as XML; base and tool become fixed joints.

    Numbers have the digits that load back to the same double. `what_urdf_loses` names what it can't hold.
    """
    if spec["kinematics"] != "urdf":
        raise InvalidInput(f"a URDF is written from a robot of kind urdf, got {spec['kinematics']}: convert it first")
    robot = ET.Element("robot", name=spec["name"])
    robot.append(
        ET.Comment(" written by fastcal; effort and velocity limits are not known and set so that they limit nothing ")
    )
    parent = "base_link"
    if _is_moved(spec["base"]):
        ET.SubElement(robot, "link", name="world")
        _fixed_joint(robot, "world", parent, spec["base"])
    ET.SubElement(robot, "link", name=parent)
    for i, joint in enumerate(spec["joints"]):
        child = f"link{i + 1}"
        _link_element(robot, child, joint.get("link"))
        _moving_joint(robot, parent, child, joint, spec["joints"])
        parent = child
    ET.SubElement(robot, "link", name="flange")
    _fixed_joint(robot, parent, "flange", spec["flange"])
    if _is_moved(spec["tool"]):
        ET.SubElement(robot, "link", name="tool")
        _fixed_joint(robot, "flange", "tool", spec["tool"])
    ET.indent(robot)
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def what_moves_the_tool(spec: Spec) -> list[str]:
    """What moves the tool and only a robot file can hold: the names of the effects, `compensator`, `correction`."""
    return [*map(label, spec.get("effects", ())), *(key for key in ("compensator", "correction") if spec.get(key))]


def what_urdf_loses(spec: Spec) -> tuple[str, ...]:
    """The keys of a spec, and the names of its effects, that say something and have no place in a URDF."""
    # A URDF that is written in place gets no links: base and tool belong to the measurement.
    in_place = "xml" in spec.get("source", {})
    lost = [key for key in ("base", "tool") if in_place and _is_moved(spec[key])]
    lost += [key for key in ("coupling", "pendant", "structure") if spec.get(key)] + what_moves_the_tool(spec)
    lost += ["calibration"] if spec.get("calibration") and not in_place else []
    if any(spec["payload"]["com_mm"]):
        lost.append("payload")
    if spec["gravity_m_s2"] != [0.0, 0.0, -9.80665] or (
        spec["gravity_frame"] == "base" and any(spec["base"]["rpy_deg"]) and not in_place
    ):
        lost.append("gravity_m_s2")
    if any("motor_ratio" in joint for joint in spec["joints"]):
        lost.append("motor_ratio")
    return tuple(lost)


def _joint_spec(joint: Mapping[str, Any]) -> Spec:
    revolute = joint["type"] == "revolute"
    unit = "deg" if revolute else "mm"
    spec: Spec = {"name": joint["name"], "type": joint["type"], "origin": _frame_spec(joint["origin"])}
    spec["axis"] = [float(x) for x in joint["axis"]]
    spec[f"min_{unit}"] = units.from_si(float(joint["lower"]), unit)
    spec[f"max_{unit}"] = units.from_si(float(joint["upper"]), unit)
    if (mimic := joint["mimic"]) is not None:
        offset = units.from_si(float(mimic["offset"]), unit)
        spec["mimic"] = {"joint": mimic["driver"] + 1, "multiplier": mimic["multiplier"], f"offset_{unit}": offset}
    inertia = [float(x) for x in joint["inertia"]]
    if joint["mass"] or any(inertia):
        spec["link"] = {
            "mass_kg": float(joint["mass"]),
            "com_mm": _from_si(joint["com"], "mm"),
            "inertia_kg_m2": inertia,
        }
    return spec


def _frame_spec(T: FloatArray) -> Spec:
    return {"xyz_mm": _from_si(T[:3, 3], "mm"), "rpy_deg": _from_si(rotation_to_rpy(T[:3, :3]), "deg")}


def _from_si(values: Iterable[float], unit: str) -> list[float]:
    return [units.from_si(float(x), unit) for x in values]


def _is_moved(frame: Spec) -> bool:
    return any(frame["xyz_mm"]) or any(frame["rpy_deg"])


def _si(values: Iterable[float], unit: str) -> str:
    return " ".join(repr(units.to_si(x, unit)) for x in values)


def _origin(parent: ET.Element, frame: Spec) -> None:
    ET.SubElement(parent, "origin", xyz=_si(frame["xyz_mm"], "mm"), rpy=_si(frame["rpy_deg"], "deg"))


def _joint_element(robot: ET.Element, name: str, kind: str, parent: str, child: str, frame: Spec) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    _origin(joint, frame)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _fixed_joint(robot: ET.Element, parent: str, child: str, frame: Spec) -> None:
    _joint_element(robot, f"{parent}-{child}", "fixed", parent, child, frame)


def _moving_joint(robot: ET.Element, parent: str, child: str, joint: Spec, joints: list[Spec]) -> None:
    element = _joint_element(robot, joint["name"], joint["type"], parent, child, joint["origin"])
    ET.SubElement(element, "axis", xyz=" ".join(repr(x) for x in joint["axis"]))
    unit = "deg" if joint["type"] == "revolute" else "mm"
    lower, upper = (repr(units.to_si(joint[f"{end}_{unit}"], unit)) for end in ("min", "max"))
    ET.SubElement(element, "limit", lower=lower, upper=upper, effort=_NO_LIMIT, velocity=_NO_LIMIT)
    if (mimic := joint.get("mimic")) is not None:
        offset = units.to_si(mimic[f"offset_{unit}"], unit)
        named = {"joint": joints[mimic["joint"] - 1]["name"], "multiplier": repr(mimic["multiplier"])}
        ET.SubElement(element, "mimic", named, offset=repr(offset))


def _link_element(robot: ET.Element, name: str, link: Spec | None) -> None:
    element = ET.SubElement(robot, "link", name=name)
    if link is None:
        return
    inertial = ET.SubElement(element, "inertial")
    _origin(inertial, {"xyz_mm": link["com_mm"], "rpy_deg": [0.0, 0.0, 0.0]})
    ET.SubElement(inertial, "mass", value=repr(link["mass_kg"]))
    moments = [repr(x) for x in link.get("inertia_kg_m2", [0.0] * 6)]
    ET.SubElement(inertial, "inertia", dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), moments, strict=True)))
