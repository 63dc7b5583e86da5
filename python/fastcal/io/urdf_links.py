# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Links of a URDF as frames of the arm that was read from it: `on: ARM/LINK` of a cell file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.io.urdf_chain import as_urdfdom_reads
from fastcal.io.xml_text import declared_as_utf8
from fastcal.robot.core_model import pose
from fastcal.robot.loops import has_branches
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse, rpy_to_rotation

Spec = dict[str, Any]


@dataclass(frozen=True, eq=False)
class UrdfLinks:
    """The links of a URDF, and the chains of joints that were read from it.

    Attributes:
        xml: Its text.
        base_link: Where the chains begin; empty: at its root, or below a joint that floats.
        chains: The names in the cell and the canonical specs of the chains; the first begins at the base.
    """

    xml: str
    base_link: str
    chains: Sequence[tuple[str, Spec]]

    def placed(self, link: str, place: Spec) -> tuple[str, Spec]:
        """The frame of a chain that carries `link`, and there {xyz_mm, rpy_deg} of what is at `place` on the link.

        With joint K the nearest one above the link, T_linkK_x = T_linkK_own T_own_link T_link_x, where own is the
        frame of the URDF that moves with joint K, and linkK the mount of the next joint, or the flange.

        Raises:
            InvalidInput: There is no such link, or a joint that is none of the chains' moves it.
        """
        joint, T = self._carrier(link)
        if joint is None:
            return f"{self.chains[0][0]}.base", frame_spec(T @ pose(place))
        name, k, spec = next((n, k, s) for n, s in self.chains for k, j in enumerate(s["joints"]) if j["name"] == joint)
        if has_branches(spec):
            raise InvalidInput(f"links of an arm with closed loops have no names here; expected {name}.link{k + 1}")
        return f"{name}.link{k + 1}", frame_spec(inverse(_end_of_link(spec, k)) @ T @ pose(place))

    def _carrier(self, link: str) -> tuple[str | None, FloatArray]:
        """The chains' joint that carries a link, None for the base, and the link (4, 4) in what the joint moves."""
        mine = {joint["name"] for _, spec in self.chains for joint in spec["joints"]}
        root = _parsed(self.xml)
        names = [of.get("name", "") for of in root.findall("link")]
        if link not in names:
            raise InvalidInput(f"'{link:.60}' is no link of the URDF; its links are {', '.join(names)}")
        above = {child.get("link"): of for of in root.findall("joint") if (child := of.find("child")) is not None}
        T, at = np.eye(4), link
        while at != self.base_link:
            joint = above.pop(at, None)  # taken out: a ring of links ends too
            kind = "" if joint is None else joint.get("type")
            if joint is None or (kind == "floating" and not self.base_link):
                if self.base_link:
                    raise InvalidInput(f"link '{link:.60}' is not carried by {self.base_link}, where the arm begins")
                return None, T
            name, parent = joint.get("name", ""), joint.find("parent")
            if name in mine:
                return name, T
            if kind != "fixed":
                raise InvalidInput(f"link '{link:.60}' moves with joint '{name:.60}', which is no joint of the arm")
            T = _origin(joint) @ T
            at = "" if parent is None else parent.get("link", "")
        return None, T


def links_of(name: str, spec: Spec) -> UrdfLinks | None:
    """The links of an arm that keeps the text of its URDF, by its name in the cell; None where it keeps none."""
    source = spec.get("source", {})
    return UrdfLinks(source["xml"], source.get("base_link", ""), [(name, spec)]) if "xml" in source else None


def _end_of_link(spec: Spec, k: int) -> FloatArray:
    """(4, 4) of the end of joint k's link, counted from 0, in the frame that the joint moves."""
    if k + 1 == len(spec["joints"]):
        return pose(spec["flange"])
    following = spec["joints"][k + 1]
    T = pose(following["origin"])
    axis = np.asarray(following["axis"], dtype=float)
    T[:3, :3] = T[:3, :3] @ _core.rotation_to_axis(axis / np.linalg.norm(axis))
    return T


def _origin(joint: ET.Element) -> FloatArray:
    """(4, 4) of a joint in its parent link."""
    origin, T = joint.find("origin"), np.eye(4)
    if origin is not None:
        T[:3, 3] = np.array(origin.get("xyz", "0 0 0").split(), dtype=float)
        T[:3, :3] = rpy_to_rotation(np.array(origin.get("rpy", "0 0 0").split(), dtype=float))
    return T


def _parsed(xml: str) -> ET.Element:
    if "<!ENTITY" in xml:
        raise InvalidInput("the URDF declares entities: its links can't be named")
    return ET.fromstring(declared_as_utf8(as_urdfdom_reads(xml)).encode())  # noqa: S314 - no entities
