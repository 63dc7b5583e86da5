# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A mechanism with closed loops as the content of a robot file.

Fixed joints are folded into what carries them. The tree is walked from the base, children that lead to the tool last;
a joint whose link has a place in the tree already closes a loop.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.io.mechanism import EVERY, HELD, JointOf, Mechanism, Pins, listed, plain_name
from fastcal.io.mechanism_writing import Writing
from fastcal.robot import se3

Spec = dict[str, Any]
_Z = np.eye(3)[2]


def mechanism_spec(of: Mechanism, motors: Iterable[str], base_link: str = "", tip_link: str = "") -> Spec:
    """The content of a robot file of kind `urdf`: joints in depth-first order, passive ones marked, and the loops.

    Args:
        of: The mechanism.
        motors: Names of the joints that have a motor; the others are passive.
        base_link: The link that stands still; empty: the one that no joint moves.
        tip_link: The link or frame that is the flange.

    Raises:
        ParseError: The loops or ends are not understood; one sentence.
    """
    for what, names in (("link", of.links), ("joint", [joint.name for joint in of.joints])):
        if twice := next((name for name in names if names.count(name) > 1), None):
            of.fail(f"there are two {what}s '{twice}'; each needs a different name")
    driven = set(motors)
    if unknown := driven - {joint.name for joint in of.joints}:
        of.fail(f"there is no joint '{min(unknown)}'; there are {listed(joint.name for joint in of.joints)}")
    base = base_link or _root(of)
    if not tip_link:
        of.fail(f"where does the tool go? Give tip_link, one of {listed([*of.frames, *of.links])}")
    tip, T_tip = of.frame(tip_link)
    _turn_round(of, base, tip, driven)
    tree, cuts = _spanning_tree(of, base, driven)
    pins = [*of.pins, *(_cut(of, joint, driven) for joint in cuts)]
    if tip not in {base, *(joint.child for joint in tree)}:
        of.fail(f"no joints lead from '{base}' to '{tip_link}'")
    needed = _needed(of, tree, [tip, *(link for each in pins for link in each.links)], driven)
    floating = next((joint for joint in needed if joint.kind == "free" and not pins), None)
    if floating is not None:
        of.fail(f"'{floating.child}' floats freely; give base_link, the link that stands still, such as that one")
    return Writing(of, base, [joint for joint in tree if joint in needed], tip, driven).spec(T_tip, pins)


def _root(of: Mechanism) -> str:
    """The link that no joint moves; of several the one that the first joint stands on."""
    moved = {joint.child for joint in of.joints}
    roots = [link for link in of.links if link not in moved]
    if not roots:
        of.fail("every link is moved by a joint; give base_link, the one that stands still")
    standing = [joint.parent for joint in of.joints if joint.parent in roots]
    return standing[0] if standing else roots[0]


def _turn_round(of: Mechanism, base: str, tip: str, driven: set[str]) -> None:
    """Rods that hang on the tool's link and are pinned elsewhere are hung up there: the tool comes last.

    The joint at the tool's link closes the loop then, and the pins become a joint.
    """
    rigid = {tip}
    while (
        more := {
            end for j in of.joints if j.kind == "fixed" and {j.parent, j.child} & rigid for end in (j.parent, j.child)
        }
        - rigid
    ):
        rigid |= more
    if base in rigid:
        return
    for first in [j for j in of.joints if j.parent in rigid and j.child not in rigid and j.name not in driven]:
        beyond = _links_beyond(of, first)
        pins = next((p for p in of.pins if p.length_mm is None and len(beyond & set(p.links)) == 1), None)
        kind = None if pins is None else {EVERY[:3]: "ball", EVERY: "fixed"}.get(pins.fixed)
        way = [joint for joint in of.joints if joint.child in beyond and joint.name in driven]
        if pins is None or kind is None or way or first.kind not in HELD:
            continue
        near, far = pins.links if pins.links[1] in beyond else pins.links[::-1]
        T_near, T_far = pins.T_link_pin if pins.links[1] in beyond else pins.T_link_pin[::-1]
        of.pins.remove(pins)
        by_child = {joint.child: joint for joint in of.joints}
        link = far
        while link != first.child:
            joint = by_child[link]
            of.joints[of.joints.index(joint)] = _reversed(joint)
            link = joint.parent
        of.joints.append(JointOf(pins.name, kind, near, far, T_near, _Z, se3.inverse(T_far)))
        of.joints.remove(first)
        of.pins.append(_cut(of, first, driven))


def _links_beyond(of: Mechanism, joint: JointOf) -> set[str]:
    """Links that a joint carries."""
    out = {joint.child}
    while more := {other.child for other in of.joints if other.parent in out} - out:
        out |= more
    return out


def _reversed(joint: JointOf) -> JointOf:
    """The same joint seen from its child: T_child_parent = T_jc^-1 exp(-q axis) T_pj^-1."""
    return JointOf(
        joint.name, joint.kind, joint.child, joint.parent, se3.inverse(joint.T_joint_child), -joint.axis,
        se3.inverse(joint.T_parent_joint), joint.low, joint.high, joint.start,
    )  # fmt: skip


def _spanning_tree(of: Mechanism, base: str, driven: set[str]) -> tuple[list[JointOf], list[JointOf]]:
    """Joints that reach each link once, and those that come to a link which is reached; motors and fixed ones first."""
    reached, tree, cuts = {base}, [], []
    left = sorted(of.joints, key=lambda joint: joint.name not in driven and joint.kind != "fixed")
    while ready := [joint for joint in left if joint.parent in reached]:
        joint = ready[0]
        left.remove(joint)
        if joint.child in reached:
            cuts.append(joint)
        else:
            reached.add(joint.child)
            tree.append(joint)
    return tree, cuts


def _cut(of: Mechanism, joint: JointOf, driven: set[str]) -> Pins:
    """The loop that a joint closes."""
    if joint.name in driven or joint.kind not in HELD:
        what = "has a motor" if joint.name in driven else f"is of type {joint.kind}"
        of.fail(
            f"joint '{joint.name}' closes a loop and {what}, which is not understood; cut the loop at another joint"
        )
    turn = se3.pose(_core.rotation_to_axis(joint.axis.tolist()))
    ends = (joint.T_parent_joint @ turn, np.linalg.inv(joint.T_joint_child) @ turn)
    return Pins(plain_name(joint.name), (joint.parent, joint.child), ends, tuple(HELD[joint.kind]))


def _needed(of: Mechanism, tree: list[JointOf], ends: list[str], driven: set[str]) -> list[JointOf]:
    """The joints between the base and the ends, and those that turn with them; what else moves is said and left out."""
    by_child = {joint.child: joint for joint in tree}
    by_name = {joint.name: joint for joint in tree}
    found: dict[str, JointOf] = {}

    def add(link: str) -> None:
        while link in by_child:
            joint = by_child[link]
            found[joint.name] = joint
            link = joint.parent

    for end in ends:
        add(end)
    for ratio in of.ratios:
        if ratio.driven in found:
            for name in ratio.ratios:
                if name not in by_name:
                    of.fail(f"joint '{ratio.driven}' turns with '{name}', which is not there")
                add(by_name[name].child)
    beside = [joint.name for joint in tree if joint.name not in found and joint.kind != "fixed"]
    if beside:
        of.notes.append(f"joints beside the arm are left out, with their weight: {listed(beside)}")
    return list(found.values())
