# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Links, joints and what closes loops, as description files have them, made into the content of a robot file.

Fixed joints are folded into what carries them. The tree is walked from the base, children that lead to the tool last;
a joint whose link has a place in the tree already closes a loop.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.fields import LARGEST
from fastcal.place import joint_name
from fastcal.robot import se3
from fastcal.units import from_si

Spec = dict[str, Any]
EVERY = ("x", "y", "z", "rx", "ry", "rz")
# Of a pin whose z is the joint's axis: what a joint holds.
HELD = {"revolute": EVERY[:5], "prismatic": (*EVERY[:2], *EVERY[3:]), "ball": EVERY[:3], "fixed": EVERY}
_AXES = np.eye(3)
_FARTHEST = 10.0  # [m] of a slide without limits
_ROUNDING = 1e-90  # [m], [rad]


@dataclass(eq=False)
class JointOf:
    """A joint between two links: its frame in the parent's at position 0, the child's in the joint's; SI."""

    name: str
    kind: str  # revolute, prismatic, ball, free, fixed
    parent: str
    child: str
    T_parent_joint: FloatArray
    axis: FloatArray  # of length 1
    T_joint_child: FloatArray = field(default_factory=lambda: np.eye(4))
    low: float = -np.inf
    high: float = np.inf
    start: float = 0.0


@dataclass(eq=False)
class Pins:
    """Components of the pose of a pin on one link, seen from a pin on another, that are 0; or a rod between both."""

    name: str
    links: tuple[str, str]
    T_link_pin: tuple[FloatArray, FloatArray]
    fixed: tuple[str, ...] = ()
    length_mm: float | None = None


@dataclass(frozen=True)
class Ratio:
    """A joint that turns with others: position = sum of ratio times theirs + offset, SI."""

    name: str
    driven: str
    ratios: Mapping[str, float]
    offset: float


@dataclass(eq=False)
class Mechanism:
    """What a file holds. `frames`: places on links by name; `bodies`: mass [kg] and its centre in the link's frame."""

    path: str
    name: str
    links: list[str]
    joints: list[JointOf]
    pins: list[Pins] = field(default_factory=list)
    ratios: list[Ratio] = field(default_factory=list)
    frames: dict[str, tuple[str, FloatArray]] = field(default_factory=dict)
    bodies: dict[str, tuple[float, FloatArray]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def fail(self, sentence: str) -> NoReturn:
        """Raises ParseError that names the file."""
        raise ParseError(sentence, self.path)

    def frame(self, name: str) -> tuple[str, FloatArray]:
        """The link and the place on it of a link or frame."""
        if name in self.links:
            return name, np.eye(4)
        if name not in self.frames:
            self.fail(f"there is no link or frame '{name}'; there are {_listed([*self.links, *self.frames])}")
        return self.frames[name]


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
            of.fail(f"there are two {what}s '{twice}'; give each a name of its own")
    driven = set(motors)
    if unknown := driven - {joint.name for joint in of.joints}:
        of.fail(f"there is no joint '{min(unknown)}'; there are {_listed(joint.name for joint in of.joints)}")
    base = base_link or _root(of)
    if not tip_link:
        of.fail(f"where does the tool go? Give tip_link, one of {_listed([*of.frames, *of.links])}")
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
    return _Writing(of, base, [joint for joint in tree if joint in needed], tip, driven).spec(T_tip, pins)


def numbers(text: str | None, path: str, *counts: int) -> FloatArray:
    """The numbers of an attribute or element; how many there may be.

    Raises:
        ParseError: They are none, not finite or of another count.
    """
    words = (text or "").split()
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.array([np.nan])
    if len(values) not in counts or not all(abs(v) <= LARGEST for v in values):
        expected = " or ".join(map(str, counts))
        plural = "" if counts == (1,) else "s"
        raise ParseError(f"expected {expected} finite number{plural}, got '{' '.join(words):.60}'", path)
    return values


def direction(text: str | None, path: str) -> FloatArray:
    """A unit vector along three numbers.

    Raises:
        ParseError: They have no direction.
    """
    values = numbers(text, path, 3)
    size = float(np.linalg.norm(values))
    if size == 0:
        raise ParseError(f"expected an axis, got '{text}'", path)
    return np.asarray(values / size)


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
        of.joints.append(JointOf(pins.name, kind, near, far, T_near, _AXES[2], se3.inverse(T_far)))
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
    turn = np.eye(4)
    turn[:3, :3] = _core.rotation_to_axis(joint.axis.tolist())
    ends = (joint.T_parent_joint @ turn, np.linalg.inv(joint.T_joint_child) @ turn)
    return Pins(_plain(joint.name), (joint.parent, joint.child), ends, tuple(HELD[joint.kind]))


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
        of.notes.append(f"joints beside the arm are left out, with their weight: {_listed(beside)}")
    return list(found.values())


class _Writing:
    """Joints numbered in depth-first order, the way to the tool last."""

    def __init__(self, of: Mechanism, base: str, joints: list[JointOf], tip: str, driven: set[str]) -> None:
        self.of, self.driven, self.tip = of, driven, tip
        self.flange = np.eye(4)
        self.at: dict[str, tuple[int, FloatArray]] = {}  # links: the number of the joint that carries it, its place
        self.entries: list[Spec] = []
        self.mounts: list[tuple[int, FloatArray, FloatArray]] = []  # of each joint: carrier, place, axis
        self.numbers: dict[str, int] = {}
        by_child = {joint.child: joint for joint in joints}
        self.way = {tip}
        while tip in by_child:
            tip = by_child[tip].parent
            self.way.add(tip)
        self._walk(base, 0, np.eye(4), joints)

    def _walk(self, link: str, carrier: int, place: FloatArray, joints: list[JointOf]) -> None:
        self.at[link] = (carrier, place)
        on_it = [joint for joint in joints if joint.parent == link]
        for joint in sorted(on_it, key=lambda joint: (joint.child in self.way, joint.kind != "fixed")):
            T, number = place @ joint.T_parent_joint, carrier
            for kind, axis in _single(joint):
                number = self._add(joint, kind, axis, number, T)
                T = np.eye(4)
            self._walk(joint.child, number, T @ joint.T_joint_child, joints)

    def _add(self, joint: JointOf, kind: str, axis: FloatArray, carrier: int, T: FloatArray) -> int:
        number = len(self.entries) + 1
        alone = joint.kind in ("revolute", "prismatic")
        unit = "deg" if kind == "revolute" else "mm"
        part = "" if alone else f"_{'xyz'[int(np.argmax(np.abs(axis)))]}{'' if kind == 'revolute' else '_slide'}"
        entry: Spec = {"name": joint.name + part, "type": kind, "origin": _frame(T), "axis": axis.tolist()}
        low, high = (joint.low, joint.high) if alone else (-np.inf, np.inf)
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            most = 2 * np.pi if kind == "revolute" else _FARTHEST
            low, high = -most, most
        entry |= {f"min_{unit}": from_si(float(low), unit), f"max_{unit}": from_si(float(high), unit)}
        if joint.start and alone:
            entry[f"start_{unit}"] = from_si(joint.start, unit)
        if carrier != number - 1:
            entry["on"] = _link(carrier)
        if joint.name not in self.driven:
            entry["passive"] = True
        self.entries.append(entry)
        self.mounts.append((carrier, T, axis))
        if alone:
            self.numbers[joint.name] = number
        return number

    def pin(self, link: str, place: FloatArray) -> tuple[str, FloatArray]:
        """The link as a robot file counts them, and a place on it in its frame."""
        carrier, T = self.at[link]
        place = T @ place
        if not carrier:
            return _link(carrier), place
        alone = [k for k, mount in enumerate(self.mounts) if mount[0] == carrier]
        if len(alone) == 1:
            _, mount, axis = self.mounts[alone[0]]
            turn = np.eye(4)
            turn[:3, :3] = _core.rotation_to_axis(axis.tolist())
            place = np.linalg.inv(mount @ turn) @ place
        elif carrier == len(self.entries):
            place = np.linalg.inv(self.flange) @ place
        return _link(carrier), place

    def spec(self, T_tip: FloatArray, pins: list[Pins]) -> Spec:
        of = self.of
        carrier, place = self.at[self.tip]
        self.flange = place @ T_tip
        if carrier != len(self.entries):
            last = self.entries[-1]["name"] if self.entries else "none"
            of.fail(f"joint '{last}' stands on the link of the tool; give a tip_link that no joint goes on from")
        loops = [self._pins(each) for each in pins if all(link in self.at for link in each.links)]
        loops += [self._ratio(ratio) for ratio in of.ratios if ratio.driven in self.numbers]
        self._weigh()
        out: Spec = {"name": of.name or "robot", "kinematics": "urdf", "joints": self.entries, "notes": of.notes}
        out["flange"] = _frame(self.flange)
        return out | ({"loops": loops} if loops else {})

    def _pins(self, pins: Pins) -> Spec:
        is_rod = pins.length_mm is not None
        loop: Spec = {"name": _plain(pins.name)}
        loop |= {"length_mm": pins.length_mm} if is_rod else {"fixed": list(pins.fixed)}
        for end, link, T in zip(("from", "to"), pins.links, pins.T_link_pin, strict=True):
            loop[end], place = self.pin(link, T)
            loop |= {f"{end}_{key}": value for key, value in _frame(place).items() if key == "xyz_mm" or not is_rod}
        return loop

    def _ratio(self, ratio: Ratio) -> Spec:
        number = self.numbers[ratio.driven]
        unit = "deg" if self.entries[number - 1]["type"] == "revolute" else "mm"
        ratios = {joint_name(self.numbers[name] - 1): value for name, value in ratio.ratios.items()}
        return {"name": _plain(ratio.name), "joint": number, "ratios": ratios} | {
            f"offset_{unit}": from_si(ratio.offset, unit)
        }

    def _weigh(self) -> None:
        """Masses of the links that each joint carries, at their common centre, in the frame of that link."""
        sums: dict[int, tuple[float, FloatArray]] = {}
        for link, (mass, centre) in self.of.bodies.items():
            if link in self.at and self.at[link][0] and mass > 0:
                T = np.eye(4)
                T[:3, 3] = centre
                place = self.pin(link, T)[1][:3, 3]
                before, moment = sums.get(self.at[link][0], (0.0, np.zeros(3)))
                sums[self.at[link][0]] = before + mass, moment + mass * place
        for number, (mass, moment) in sums.items():
            com = [_in("mm", v) for v in moment / mass]
            self.entries[number - 1]["link"] = {"mass_kg": mass, "com_mm": com}


def _link(carrier: int) -> str:
    """As a robot file calls what joint `carrier`, from 1, carries; 0: the base."""
    return f"link{carrier}" if carrier else "base"


def _single(joint: JointOf) -> list[tuple[str, FloatArray]]:
    """Hinges and slides in the place of a joint."""
    hinges = [("revolute", axis) for axis in _AXES]
    if joint.kind == "fixed":
        return []
    if joint.kind == "ball":
        return hinges
    if joint.kind == "free":
        return [*(("prismatic", axis) for axis in _AXES), *hinges]
    return [(joint.kind, joint.axis)]


def _frame(T: FloatArray) -> Spec:
    return {
        "xyz_mm": [_in("mm", v) for v in T[:3, 3]],
        "rpy_deg": [_in("deg", v) for v in se3.rotation_to_rpy(T[:3, :3])],
    }


def _in(unit: str, value: float) -> float:
    """A number of SI in a unit; what rounding has left of 0 is 0."""
    return from_si(float(value), unit) if abs(value) > _ROUNDING else 0.0


def _plain(name: str) -> str:
    """A name that a loop may have."""
    kept = "".join(c if c.isalnum() and c.isascii() else "_" for c in name).strip("_")[:55]
    return kept if kept[:1].isalpha() else f"loop_{kept}"


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    return ", ".join(every[:20]) + (" ..." if len(every) > 20 else "")
