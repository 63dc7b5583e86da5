# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Branches and closed loops in a robot file: `on`, `passive` and `start` of joints, and `loops`."""

from __future__ import annotations

import re
from typing import Any

from fastcal.io.fields import Fields
from fastcal.robot.core_model import pose
from fastcal.robot.loops import COMPONENTS
from fastcal.robot.robot_spec import frame_spec

Spec = dict[str, Any]
_ZERO = [0.0, 0.0, 0.0]
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")
_TAKEN = re.compile(r"(base|tool|payload|robot|structure|instrument|world|(joint|link)\d+)")


def check_branch(fields: Fields, unit: str) -> Spec:
    """What a joint says of where it stands and of what moves it."""
    out: Spec = {}
    if (on := fields.optional("on")) is not None:
        if not isinstance(on, str) or not re.fullmatch(r"base|link[1-9]\d*", on):
            fields.fail("on", "base or the link of a joint, such as link2", on)
        out["on"] = on
    if (passive := fields.optional("passive")) is not None:
        if not isinstance(passive, bool):
            fields.fail("passive", "true or false", passive)
        if passive:
            out["passive"] = True
    if fields.has_quantity("start", unit):
        out[f"start_{unit}"] = fields.quantity("start", unit)
    return out


def check_order(joints: list[Spec], fields: list[Fields], kind: str) -> None:
    """Joints in depth-first order, so that all that stands on a link follows it without a gap."""
    open_joints: list[int] = []  # on whose links a next joint may stand
    for i, joint in enumerate(joints):
        if "on" not in joint:
            open_joints.append(i)
            continue
        if kind == "poe":
            fields[i].refuse("on", "a robot of kind poe has no branches; write it with kinematics dh, mdh or urdf")
        on = -1 if joint["on"] == "base" else int(joint["on"].removeprefix("link")) - 1
        if on >= i:
            fields[i].refuse("on", f"joint {i + 1} must stand on the base or on the link of a joint before it")
        if on >= 0 and on not in open_joints:
            fields[i].refuse(
                "on",
                f"{joint['on']} is closed by a joint on another link; list all joints that stand on a link directly "
                "or in the end before going on elsewhere",
            )
        open_joints = [j for j in open_joints if j <= on] + [i]


def check_loops(given: list[Fields], joints: list[Spec], tool: Spec) -> list[Spec]:
    """The loops in canonical form, each with a name; a pin of `tool` becomes one of the link that carries it.

    What is in the hand is placed anew with each measurement; the loop stays as it was built.
    """
    loops: list[Spec] = []
    for k, fields in enumerate(given):
        name = fields.text("name", f"loop{k + 1}")
        if not _NAME.fullmatch(name) or _TAKEN.fullmatch(name) or any(loop["name"] == name for loop in loops):
            fields.fail("name", "a name of its own of letters, digits and _, such as rod1", name)
        if fields.has("ratios"):
            loop = _gear(fields, joints)
        else:
            ends = {key: _frame(fields, key, len(joints)) for key in ("from", "to")}
            loop = ends | (_rod(fields, joints) if fields.has_quantity("length", "mm") else _pose(fields))
            for end in ("from", "to"):
                if loop[end] == "tool":
                    _leave_tool(loop, end, f"link{len(joints)}", tool)
        fields.done()
        loops.append({"name": name} | loop)
    if bool(loops) != any(joint.get("passive") for joint in joints):
        where = "loops" if loops else "joints"
        what = "loops need joints with passive: true" if loops else "passive joints need loops that say where they are"
        Fields({}, where, given[0].path if given else "robot").refuse("", what)
    return loops


def _gear(fields: Fields, joints: list[Spec]) -> Spec:
    """A joint that turns with others, by gears, belts or a parallelogram: q = sum of ratio times q_j, and an offset."""
    joint = fields.count("joint", 1, len(joints))
    unit = "mm" if joints[joint - 1]["type"] == "prismatic" else "deg"
    ratios = _by_joint(fields, "ratios", len(joints))
    if not ratios or f"joint{joint}" in ratios:
        fields.fail("ratios", f"a ratio by the name of each joint that turns joint {joint}", str(ratios))
    return {"joint": joint, "ratios": ratios, f"offset_{unit}": fields.quantity("offset", unit, 0.0)}


def _rod(fields: Fields, joints: list[Spec]) -> Spec:
    """A rod between two balls; joints, as the screw of a leg, add to its length."""
    loop: Spec = {f"{end}_xyz_mm": fields.quantities(f"{end}_xyz", "mm", 3, _ZERO) for end in ("from", "to")}
    loop["length_mm"] = fields.quantity("length", "mm")
    if loop["length_mm"] < 0:
        fields.fail("length_mm", "a length that is not negative", loop["length_mm"])
    if added := _by_joint(fields, "joints", len(joints)):
        loop["joints"] = added
    return loop


def _pose(fields: Fields) -> Spec:
    """Pins of which components of the pose, seen from the first, are 0."""
    fixed = fields.take("fixed")
    if (
        not isinstance(fixed, list)
        or not fixed
        or any(c not in COMPONENTS for c in fixed)
        or len(set(fixed)) < len(fixed)
    ):
        fields.fail("fixed", f"a list of {', '.join(COMPONENTS)}", fixed)
    loop: Spec = {"fixed": sorted(fixed, key=COMPONENTS.index)}
    for end in ("from", "to"):
        for name, unit in (("xyz", "mm"), ("rpy", "deg")):
            if fields.has_quantity(f"{end}_{name}", unit):
                loop[f"{end}_{name}_{unit}"] = fields.quantities(f"{end}_{name}", unit, 3)
    return loop


def _leave_tool(loop: Spec, end: str, link: str, tool: Spec) -> None:
    """The pin in the axes of the link that carries the tool."""
    T = pose(tool) @ pose({key: loop.get(f"{end}_{key}", _ZERO) for key in ("xyz_mm", "rpy_deg")})
    loop[end] = link
    loop |= {f"{end}_{key}": numbers for key, numbers in frame_spec(T).items() if key == "xyz_mm" or "fixed" in loop}


def _frame(fields: Fields, key: str, joint_count: int) -> str:
    name = fields.text(key)
    match = re.fullmatch(r"base|tool|link([1-9]\d*)", name)
    if match is None or (match[1] and int(match[1]) > joint_count):
        fields.fail(key, f"base, tool or link1 to link{joint_count}", name)
    return name


def _by_joint(fields: Fields, key: str, joint_count: int) -> dict[str, float]:
    """Numbers by joints, joint1 and on."""
    given = fields.take(key, {})
    if not isinstance(given, dict):
        fields.fail(key, "a number by the name of a joint, such as {joint2: -1}", given)
    out = {}
    for joint, value in given.items():
        match = re.fullmatch(r"joint([1-9]\d*)", str(joint))
        if match is None or int(match[1]) > joint_count:
            fields.fail(key, f"joint1 to joint{joint_count}", joint)
        out[str(joint)] = fields.checked_number(f"{key}.{joint}", value)
    return out
