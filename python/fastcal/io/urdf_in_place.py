# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A URDF with other joint origins and nothing else changed: meshes, inertias, branches, comments and blanks stay."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple
from xml.parsers import expat

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.io.robot_schema import Spec
from fastcal.io.urdf_chain import read_chain
from fastcal.robot.core_model import pose
from fastcal.robot.se3 import inverse, rotation_to_rpy

SAME = 1e-13  # [m], and on the entries of a rotation: what conversion between units may leave


class _Tag(NamedTuple):
    """A start tag in the bytes of the text: from its < to behind its >."""

    start: int
    end: int


class _Joint(NamedTuple):
    tag: _Tag
    origin: _Tag | None


def is_from_urdf(spec: Spec) -> bool:
    """Whether a spec keeps the text of the URDF that it was read from."""
    return "xml" in spec.get("source", {})


def first_mount(spec: Spec) -> FloatArray:
    """(4, 4) of the first moving joint's parent link in the base, where the spec keeps its URDF; else the identity."""
    if not is_from_urdf(spec):
        return np.eye(4)
    source = spec["source"]
    return np.asarray(read_chain(source["xml"], source["base_link"], source["tip_link"])["joints"][0]["mount"])


def in_place(spec: Spec) -> str:
    """The text of the URDF that a spec was read from, with the joints' origins of the spec.

    An origin that has not moved keeps its text. Fixed joints stay where they are: what the chain gains goes into the
    moving joint behind them, own = mount^-1 origin.

    Raises:
        InvalidInput: The spec is no longer of that file: other joints, axes or another flange.
    """
    source = spec["source"]
    chain = read_chain(source["xml"], source["base_link"], source["tip_link"])
    if [joint["name"] for joint in chain["joints"]] != [joint["name"] for joint in spec["joints"]]:
        raise InvalidInput("the joints of the robot are no longer those of the URDF that it was read from")
    moved: dict[str, FloatArray] = {}
    for mine, theirs in zip(spec["joints"], chain["joints"], strict=True):
        if np.abs(np.asarray(mine["axis"]) - theirs["axis"]).max() > SAME:
            raise InvalidInput(f"joint '{mine['name']}': its axis is no longer that of the URDF that it was read from")
        origin = pose(mine["origin"])
        if not _same(origin, theirs["origin"]):
            moved[mine["name"]] = inverse(theirs["mount"]) @ origin
    if not _same(pose(spec["flange"]), chain["flange"]):
        raise InvalidInput("the flange of the robot is no longer that of the URDF that it was read from")
    return with_origins(source["xml"], moved)


def with_origins(xml: str, origins: Mapping[str, FloatArray]) -> str:
    """The text with the <origin> of each named joint at a pose (4, 4) [m], in the frame of the joint's parent link."""
    content = xml.encode()
    joints = _joints(content)
    edits: list[tuple[int, int, bytes]] = []
    for name, T in origins.items():
        joint = joints[name]
        values = {"xyz": _numbers(T[:3, 3]), "rpy": _numbers(rotation_to_rpy(T[:3, :3]))}
        if joint.origin is None:
            line = f'<origin xyz="{values["xyz"]}" rpy="{values["rpy"]}"/>'.encode()
            edits.append((joint.tag.end, joint.tag.end, _indent(content, joint.tag.end) + line))
        else:
            text = content[joint.origin.start : joint.origin.end].decode()
            edits.append((*joint.origin, _with_attributes(text, values).encode()))
    for start, end, new in sorted(edits, reverse=True):
        content = content[:start] + new + content[end:]
    return content.decode()


def _joints(content: bytes) -> dict[str, _Joint]:
    """The joints that are children of the root, by name, each with its first <origin>."""
    found: dict[str, _Joint] = {}
    open_tags: list[str] = []
    name = ""
    parser = expat.ParserCreate("utf-8")  # the text is decoded already, whatever its head says

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal name
        place = _Tag(parser.CurrentByteIndex, _end_of_tag(content, parser.CurrentByteIndex))
        if tag == "joint" and len(open_tags) == 1 and attributes.get("name"):
            name = attributes["name"]
            found[name] = _Joint(place, None)
        elif tag == "origin" and open_tags[1:] == ["joint"] and name in found and found[name].origin is None:
            found[name] = found[name]._replace(origin=place)
        open_tags.append(tag)

    def entity(*_: object) -> None:
        raise InvalidInput("the URDF declares entities: it can't be changed in place")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_tags.pop()
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise InvalidInput(f"the URDF is not well-formed XML and can't be changed in place: {error}") from None
    return found


def _end_of_tag(content: bytes, start: int) -> int:
    """The place behind the > of the tag at `start`; one inside quotes is text."""
    match = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""").match(content, start)
    return match.end() if match else len(content)


def _with_attributes(tag: str, values: Mapping[str, str]) -> str:
    """A start tag with other values of xyz and rpy; an attribute that gives the rotation otherwise is taken out."""
    tag = re.sub(r"""\s+quat_xyzw\s*=\s*("[^"]*"|'[^']*')""", "", tag)
    for key, value in values.items():
        pattern = re.compile(rf"""(\s{key}\s*=\s*)("[^"]*"|'[^']*')""")
        found = pattern.search(tag)
        if found:
            quote = found[2][0]
            tag = f"{tag[: found.end(1)]}{quote}{value}{quote}{tag[found.end() :]}"
        else:
            tag = f'<origin {key}="{value}"{tag[len("<origin") :]}'
    return tag


def _indent(content: bytes, after: int) -> bytes:
    """The line end and blanks between a start tag and its first child."""
    found = re.compile(rb"\r?\n[ \t]*(?=<)").match(content, after)
    return found.group() if found else b""


def _same(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.abs(a - b).max() <= SAME)


def _numbers(values: FloatArray) -> str:
    """Digits that read back to the same doubles, without the dust below 1e-16 m or rad."""
    return " ".join(repr(round(float(value), 16) + 0.0) for value in values)
