# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The chain that the core reads from the text of a URDF."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.io.xml_text import declared_as_utf8
from fastcal.robot.se3 import rotation_to_rpy, rpy_to_rotation

# Comments and character data as they are; or a tag, in which a > inside quotes is text.
_MARKUP = re.compile(r"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|</?[A-Za-z_:](?:[^>"']|"[^"]*"|'[^']*')*>""", re.DOTALL)
_NAME = re.compile(r"</?([\w:.-]+)")
_BLANKS = str.maketrans("\t\r\n", "   ")
_SAME_TURN = 1e-6  # on the entries of a rotation: numbers of seven digits
_NO_LIMIT = '<limit lower="0" upper="0" effort="0" velocity="0"/>'  # as one that is left out is read


def read_chain(xml: str, base_link: str = "", tip_link: str = "") -> dict[str, Any]:
    """Joints, links and notes of the arm between two links, as `_core.read_urdf` gives them.

    urdfdom is given what it takes: tabs and line ends within an attribute as the blanks that they count as (XML 1.0,
    section 3.3.3); rotations by quat_xyzw (URDF 1.1) as rpy; and moving joints that state no limits, or no effort
    and velocity with them, with zeros in their place, which the core knows as none.

    Raises:
        InvalidInput: The text holds no serial arm; the sentence says why.
    """
    chain: dict[str, Any] = _core.read_urdf(declared_as_utf8(as_urdfdom_reads(xml)), base_link, tip_link)
    return chain


def read_chains(xml: str, base_link: str, tip_links: list[str]) -> list[tuple[int, dict[str, Any]]]:
    """The chains to several tips, as `_core.read_urdf_tree` gives them; errors as `read_chain`."""
    found: list[tuple[int, dict[str, Any]]] = _core.read_urdf_tree(
        declared_as_utf8(as_urdfdom_reads(xml)), base_link, tip_links
    )
    return found


def as_urdfdom_reads(xml: str) -> str:
    """The text as urdfdom takes it: see `read_chain`."""
    moves, limited = False, False  # the joint that is open, and whether its limit has come

    def one(match: re.Match[str]) -> str:
        nonlocal moves, limited
        tag = match[0]
        if tag.startswith("<!"):
            return tag
        name, ends, tag = _NAME.match(tag)[1], tag.startswith("</"), tag.translate(_BLANKS)  # type: ignore[index]
        if name == "joint":
            before = _NO_LIMIT if ends and moves and not limited else ""
            moves = not ends and _attribute(tag, "type") in ("revolute", "prismatic", "continuous")
            limited = not moves or _attribute(tag, "type") == "continuous"  # which needs none
            return before + tag
        if name == "limit" and moves and not ends:
            limited = True
            return _with_zeros(tag, ("effort", "velocity"))
        if name == "robot" and not ends and _attribute(tag, "version") in ("1.1", "1.2"):
            return _with(tag, "version", "1.0")
        return _with_rpy(tag) if name == "origin" else tag

    return _MARKUP.sub(one, xml)


def _with_rpy(tag: str) -> str:
    """An <origin> whose rotation is in rpy; one that gives it as a quaternion has that taken out."""
    text = _attribute(tag, "quat_xyzw")
    if text is None:
        return tag
    turn = _numbers(text, 4)
    if turn is None or not 0.9 < (length := math.hypot(*turn)) < 1.1:
        raise InvalidInput(f"expected quat_xyzw of an origin to be a unit quaternion x y z w, got '{text:.60}'")
    R = _core.quaternion_to_rotation(turn[[3, 0, 1, 2]] / length)
    if (given := _attribute(tag, "rpy")) is not None:
        angles = _numbers(given, 3)
        if angles is None or np.abs(rpy_to_rotation(angles) - R).max() > _SAME_TURN:
            raise InvalidInput(f"an origin gives two rotations, rpy='{given:.60}' and quat_xyzw='{text:.60}'")
        return tag
    return _with(tag, "rpy", " ".join(map(repr, map(float, rotation_to_rpy(R)))))


def _numbers(text: str, count: int) -> FloatArray | None:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return None
    return np.array(values) if len(values) == count and all(map(math.isfinite, values)) else None


def _attribute(tag: str, name: str) -> str | None:
    """The text of an attribute of a start tag."""
    found = re.search(rf"""\s{name}\s*=\s*(?:"([^"]*)"|'([^']*)')""", tag)
    return None if found is None else found[1] if found[1] is not None else found[2]


def _with(tag: str, name: str, value: str) -> str:
    """A start tag with an attribute of this value, which holds no quotes."""
    bare = re.sub(rf"""\s{name}\s*=\s*("[^"]*"|'[^']*')""", "", tag)
    return re.sub(r"(\s*/?>)\Z", rf' {name}="{value}"\1', bare)


def _with_zeros(tag: str, names: tuple[str, ...]) -> str:
    for name in names:
        tag = tag if _attribute(tag, name) is not None else _with(tag, name, "0")
    return tag
