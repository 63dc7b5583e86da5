# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Closed loops as lists of frames that coincide, beside or in a URDF.

Read are the `robot.yaml` of https://github.com/Gepetto/example-parallel-robots (pairs of frames, motors, and hinges
that stand for balls and universal joints) and the frames `closing_NAME_1` and `closing_NAME_2` of onshape-to-robot,
whose `config.json` says which joints are passive.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.errors import ParseError
from fastcal.io.fields import Fields
from fastcal.io.mechanism import EVERY, JointOf, Mechanism, Pins
from fastcal.io.mechanism_closing import close
from fastcal.io.yaml_file import read_text
from fastcal.robot import se3

Spec = dict[str, Any]
_AXES = dict(zip("XYZ", np.eye(3), strict=True))
_FIXED = {"3d": EVERY[:3], "6d": EVERY}
_CLOSING = re.compile(r"(closing_.+)_1")


def is_loop_list(value: object) -> bool:
    """Is it a list of frames that coincide, as example-parallel-robots has it?"""
    return isinstance(value, dict) and {"closed_loop", "name_mot"} <= value.keys()


def urdf_of(path: Path) -> Path:
    """The URDF beside a list: robot.urdf, or the only one there.

    Raises:
        ParseError: There is none, or there are several.
    """
    there = sorted(path.parent.glob("*.urdf"))
    usual = path.parent / "robot.urdf"
    if usual in there or len(there) == 1:
        return usual if usual in there else there[0]
    raise ParseError(f"lists loops (closed_loop) of a robot.urdf beside it, and there are {len(there)} URDFs", path)


def add_lists(of: Mechanism, value: Spec, path: Path) -> list[str]:
    """Adds the loops of a list to a URDF's links and joints, and holds what no loop moves; returns the motors.

    Raises:
        ParseError: A key, joint, frame or type is not known; the sentence names it.
    """
    top = Fields(value, "", path)
    motors = top.names("name_mot", [])
    kinds = dict(zip(top.names("joint_name", []), top.names("joint_type", []), strict=False))
    of.joints = [part for joint in of.joints for part in _parts(of, joint, kinds.get(joint.name, ""))]
    of.frames |= {joint.name: (joint.child, np.eye(4)) for joint in of.joints if joint.name not in of.links}
    pairs, types = top.take("closed_loop"), top.names("type", [])
    if not isinstance(pairs, list) or any(not isinstance(pair, list) or len(pair) != 2 for pair in pairs):
        top.fail("closed_loop", "a list of pairs of frames", pairs)
    if len(types) != len(pairs) or not {kind.lower() for kind in types} <= _FIXED.keys():
        top.fail("type", "3d or 6d of each of closed_loop", types)
    for (first, second), kind in zip(pairs, types, strict=True):
        (link, T), (other, T_other) = of.frame(str(first)), of.frame(str(second))
        of.pins.append(Pins(f"{first}_{second}", (link, other), (T, T_other), _FIXED[kind.lower()]))
    close(of, motors)
    return [name for name in motors if name in {joint.name for joint in of.joints}]


def _parts(of: Mechanism, joint: JointOf, kind: str) -> Iterable[JointOf]:
    """The hinges that a joint stands for: three of a ball, two of a universal joint."""
    if kind == "FIXED":
        yield replace(joint, kind="fixed")
        return
    letters = "XYZ" if kind == "SPHERICAL" else kind.removeprefix("UJOINT_") if kind.startswith("UJOINT_") else ""
    if not letters:
        if kind:
            of.fail(f"joint '{joint.name}' is of type {kind}, which is not understood")
        yield joint
        return
    if set(letters) - set(_AXES):
        of.fail(f"joint '{joint.name}' is of type {kind}, which is not understood")
    parent, T = joint.parent, joint.T_parent_joint
    for k, letter in enumerate(letters):
        last = k == len(letters) - 1
        child = joint.child if last else f"{joint.child}_after_{letter}"
        if not last:
            of.links.append(child)
        yield replace(
            joint, name=f"{joint.name}_{letter}", kind="revolute", parent=parent, child=child, T_parent_joint=T,
            axis=_AXES[letter], T_joint_child=joint.T_joint_child if last else np.eye(4), low=-np.inf, high=np.inf,
        )  # fmt: skip
        parent, T = child, np.eye(4)


def add_closing_frames(of: Mechanism) -> None:
    """Balls at the frames closing_NAME_1 and closing_NAME_2; what else a hinge holds, a flat loop holds itself."""
    for link in list(of.links):
        match = _CLOSING.fullmatch(link)
        if match and f"{match[1]}_2" in of.links:
            of.pins.append(Pins(match[1], (link, f"{match[1]}_2"), (se3.pose(), se3.pose()), EVERY[:3]))


def closing_frame(xml: str) -> str:
    """The name of a pair of frames of onshape-to-robot that a URDF holds; empty where it has none."""
    names = set(re.findall(r"""<link\s[^>]*?name=["']([^"']+)["']""", xml))
    pairs = (_CLOSING.fullmatch(name) for name in sorted(names))
    return next((match[1] for match in pairs if match and f"{match[1]}_2" in names), "")


def onshape_motors(path: Path, of: Mechanism) -> list[str] | None:
    """The joints that have a motor by the config.json of onshape-to-robot beside a URDF; None where it does not say.

    `joint_properties` holds properties by joint or pattern; `actuated: false` makes a joint passive.

    Raises:
        ParseError: The file is no JSON.
    """
    config = path.parent / "config.json"
    if not config.is_file():
        return None
    lines = [re.sub(r"^\s*//.*$", "", line) for line in read_text(config).splitlines()]
    try:
        found = json.loads("\n".join(re.sub(r"""(?<=[,\[{}\]"\d])\s*//[^"]*$""", "", line) for line in lines))
    except ValueError as error:
        raise ParseError(f"is no JSON: {error}", config) from None
    properties = found.get("joint_properties") if isinstance(found, dict) else None
    if not isinstance(properties, dict) or "actuated" not in str(properties):
        return None
    ratios = {ratio.driven for ratio in of.ratios}
    motors = []
    for joint in of.joints:
        said = {
            key: part
            for name, parts in properties.items()
            if isinstance(parts, dict) and (name in ("default", "*") or fnmatchcase(joint.name, name))
            for key, part in parts.items()
        }
        if joint.kind != "fixed" and said.get("actuated", joint.name not in ratios):
            motors.append(joint.name)
    return motors
