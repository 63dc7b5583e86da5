# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints, loops and masses of a mechanism as a robot file counts them."""

from __future__ import annotations

from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.io.mechanism import JointOf, Mechanism, Pins, Ratio, plain_name
from fastcal.place import joint_name
from fastcal.robot import se3
from fastcal.units import from_si

Spec = dict[str, Any]
_AXES = np.eye(3)
_FARTHEST = 10.0  # [m] of a slide without limits
_ROUNDING = 1e-90  # [m], [rad]


class Writing:
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
            place = np.linalg.inv(mount @ se3.pose(_core.rotation_to_axis(axis.tolist()))) @ place
        elif carrier == len(self.entries):
            place = np.linalg.inv(self.flange) @ place
        return _link(carrier), place

    def spec(self, T_tip: FloatArray, pins: list[Pins]) -> Spec:
        """The content of the file; `T_tip` is the flange on the tool's link."""
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
        loop: Spec = {"name": plain_name(pins.name)}
        loop |= {"length_mm": pins.length_mm} if is_rod else {"fixed": list(pins.fixed)}
        for end, link, T in zip(("from", "to"), pins.links, pins.T_link_pin, strict=True):
            loop[end], place = self.pin(link, T)
            loop |= {f"{end}_{key}": value for key, value in _frame(place).items() if key == "xyz_mm" or not is_rod}
        return loop

    def _ratio(self, ratio: Ratio) -> Spec:
        number = self.numbers[ratio.driven]
        unit = "deg" if self.entries[number - 1]["type"] == "revolute" else "mm"
        ratios = {joint_name(self.numbers[name] - 1): value for name, value in ratio.ratios.items()}
        return {"name": plain_name(ratio.name), "joint": number, "ratios": ratios} | {
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
