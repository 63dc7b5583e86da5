# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Closed loops of a robot file: which joints they move, what closes them, and how their constants come back.

The joints stand in depth-first order: each on the link of the one before it, or where its `on` says; the tool is on the
last. A joint that is `passive` has no motor and no column in measurements: the loops say where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.place import place_of
from fastcal.robot.robot_spec import ZERO, Frame, Joint, RobotSpec, Spec
from fastcal.units import from_si, to_si

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
STATUSES = ("closed", "singular", "other_branch", "open")
_NEAR = 0.02  # [m], [rad]: a gap that errors of the nominal geometry may leave
_ASIDE = 0.05  # [rad], [m] from the start posture to others
_WAY = (0.9, 0.8, 0.7, 0.6, 0.5, 0.25)  # shares of the way to a posture at which its joints are looked at
_STILL = 1e-10  # [m], [rad] of the tool by one of a parameter: nothing


@dataclass(frozen=True, eq=False)
class Assembly:
    """Postures with their loops closed.

    Attributes:
        q: (N, n) joint positions [rad or m], passive ones where the loops close, or where the gap is least.
        status: (N,) closed; singular: closed, but a passive joint can move by itself there; other_branch: closed in
            another way than at the start posture; open: nothing closes them.
        gap: (N,) the largest of the loops' equations [m or rad].
        widest: (N,) the loop that has it.
    """

    q: FloatArray
    status: list[str]
    gap: FloatArray
    widest: list[str]

    def sentence(self, row: int) -> str:
        """What is the matter with a row; empty where its loops are closed."""
        what = {
            "open": f"its loops do not close: '{self.widest[row]}' lacks {self.gap[row]:.3g} (m or rad)",
            "singular": "its loops are singular there: a passive joint can move by itself",
            "other_branch": "its loops close only beyond a singular posture, in another way of assembly",
        }
        sentence = what.get(self.status[row], "")
        return f"row {row}: {sentence}" if sentence else ""

    def check(self, near: bool = False) -> None:
        """InvalidInput where a row is not closed; with `near`, by more than errors of the geometry may leave."""
        least = _NEAR if near else 0.0
        for row, status in enumerate(self.status):
            if status == "open" and self.gap[row] > least:
                raise InvalidInput(self.sentence(row))


def has_branches(spec: Spec) -> bool:
    """Does a canonical spec hold branches or closed loops, which a chain of joints cannot say?"""
    return bool(spec.get("loops")) or any("on" in joint for joint in spec["joints"])


def passive_joints(spec: RobotSpec) -> list[int]:
    """Joints, from 0, that no motor moves."""
    return [i for i, joint in enumerate(spec.joints) if joint.passive]


def parents(spec: RobotSpec) -> list[int]:
    """Of each joint, from 0, the one on whose link it stands; -1: the base. Empty where each stands on that before."""
    found = [i - 1 if joint.on is None else _joint_of(joint.on) for i, joint in enumerate(spec.joints)]
    return [] if found == list(range(-1, len(found) - 1)) else found


def joints_beside(spec: RobotSpec) -> list[int]:
    """Joints, from 0, that do not move the tool: of another arm or a head on the same torso. None where loops are."""
    on = parents(spec)
    if not on or spec.loops:
        return []
    way, joint = set(), len(on) - 1
    while joint >= 0:
        way.add(joint)
        joint = on[joint]
    return [i for i in range(len(on)) if i not in way]


def loop_arguments(spec: RobotSpec) -> dict[str, Any]:
    """What the core's description of a robot needs of its branches and loops; nothing where it has none."""
    out: dict[str, Any] = {}
    if branches := parents(spec):
        out["parents"] = branches
    passive = passive_joints(spec)
    if passive or spec.loops:
        home = [to_si(joint.start, joint.unit) for joint in spec.joints]
        loops = [_loop(entry, spec.joints) for entry in spec.loops]
        out |= {"passive": passive, "home": np.array(home), "loops": loops}
    return out


def assemble(core: _core.RobotModel, q: FloatArray, threads: int = 1) -> Assembly:
    """Joint positions (N, n) with the passive ones where the loops close, whatever q says of them."""
    values = np.array(q, dtype=float)
    home = np.asarray(core.home)
    unknown = np.isnan(values)
    values[unknown] = np.broadcast_to(home, values.shape)[unknown]
    closed, status, gap, widest = core.assemble(np.ascontiguousarray(values), threads)
    return Assembly(
        np.asarray(closed), [STATUSES[k] for k in np.asarray(status).tolist()], np.asarray(gap), list(widest)
    )


def closed_within(core: _core.RobotModel, q: FloatArray, limits: FloatArray) -> FloatArray:
    """Of postures q (N, n) those whose loops close, with every joint within its limits (n, 2) [rad or m].

    It must stay within them on the straight way of the motors from the start posture, too: a parallelogram of bars that
    are not quite alike turns round smoothly where it would fold, and comes back to where it seems to be within.
    """
    home = np.asarray(core.home)[:, np.newaxis]
    on_the_way = np.where((home >= limits[:, :1]) & (home <= limits[:, 1:]), limits, [-np.inf, np.inf])
    assembly = assemble(core, q)
    closed = assembly.q[_are_within(assembly, limits)]
    for share in _WAY:
        way = assemble(core, home.T + share * (closed - home.T))
        closed = closed[_are_within(way, on_the_way)]
    return np.asarray(closed)


def _are_within(assembly: Assembly, limits: FloatArray) -> NDArray[np.bool_]:
    inside = ((assembly.q >= limits[:, 0]) & (assembly.q <= limits[:, 1])).all(axis=1)
    return np.asarray(inside & (np.array(assembly.status) == "closed"))


def hidden_parameters(core: _core.RobotModel) -> set[int]:
    """Indices of geometry that moves the tool in no posture: loops put passive joints wherever their mounts are."""
    home = np.asarray(core.home)
    if not len(home):
        return set()
    q = home + np.array([[0.0], [_ASIDE], [-_ASIDE]]) * np.cos(np.arange(len(home)))
    model = _core.ErrorModel(core, [], np.zeros(0))
    J = np.asarray(model.parameter_jacobian(_core.Samples(assemble(core, q).q), model.start, 6))
    still = np.abs(J).max(axis=(0, 1)) < _STILL
    return {i for i, parameter in enumerate(core.parameters) if still[i] and parameter.owner.startswith("joint")}


def loop_pins(core: _core.RobotModel, spec: RobotSpec, q: FloatArray) -> list[tuple[int, int, FloatArray]]:
    """Of each loop but gears its two frames, and where its two pins or balls are (N, 2, 3) [m] at q (N, n)."""
    model, samples, out = _core.ErrorModel(core), _core.Samples(np.ascontiguousarray(q)), []
    for loop in spec.loops:
        if "ratios" not in loop:
            T = [np.asarray(model.predict(samples, model.start, of=loop[end])) for end in ("from", "to")]
            pins = [of[:, :3, :3] @ _point(loop, end) + of[:, :3, 3] for of, end in zip(T, ("from", "to"), strict=True)]
            out.append((core.frame(loop["from"]), core.frame(loop["to"]), np.stack(pins, axis=1)))
    return out


def write_loops(spec: Spec, values: dict[str, dict[str, float]]) -> None:
    """Writes identified constants, SI by owner and name, into the loops of a spec."""
    for entry in spec.get("loops") or []:
        found = values.get(entry["name"], {})
        for end in ("from", "to"):
            if f"{end}_x" in found:
                entry[f"{end}_xyz_mm"] = [from_si(found[f"{end}_{axis}"], "mm") for axis in "xyz"]
        if "length" in found:
            entry["length_mm"] = from_si(found["length"], "mm")
        if "offset" in found:
            unit = "mm" if spec["joints"][entry["joint"] - 1]["type"] == "prismatic" else "deg"
            entry[f"offset_{unit}"] = from_si(found["offset"], unit)
            entry["ratios"] = {joint: found[f"ratio_{joint}"] for joint in entry["ratios"]}
        if "rx" in found:
            R = _pin(entry, "from")[:3, :3]
            for axis in "xyz":
                R = R @ _core.rotation_about(axis, found[f"r{axis}"])
            entry["from_rpy_deg"] = [from_si(v, "deg") for v in _core.rotation_to_rpy(R).tolist()]


def _loop(entry: Spec, joints: Sequence[Joint]) -> _core.Loop:
    name = entry["name"]
    if "ratios" in entry:
        unit = joints[entry["joint"] - 1].unit
        ratios = [(place_of(joint).index, float(ratio)) for joint, ratio in entry["ratios"].items()]
        offset = to_si(float(entry[f"offset_{unit}"]), unit)
        return _core.Loop.gear(name=name, driven=entry["joint"] - 1, joints=ratios, offset=offset)
    ends: dict[str, Any] = {
        "from_frame": _frame(entry["from"], len(joints)),
        "to_frame": _frame(entry["to"], len(joints)),
    }
    if "length_mm" in entry:
        added = [(place_of(joint).index, float(share)) for joint, share in (entry.get("joints") or {}).items()]
        return _core.Loop.rod(
            name=name,
            **ends,
            p_from=_point(entry, "from"),
            p_to=_point(entry, "to"),
            length=to_si(float(entry["length_mm"]), "mm"),
            joints=added,
        )
    return _core.Loop.pose(
        name=name,
        **ends,
        T_from_pin=_pin(entry, "from"),
        T_to_pin=_pin(entry, "to"),
        fixed=[COMPONENTS.index(component) for component in entry["fixed"]],
        knows_from="from_xyz_mm" in entry,
        knows_to="to_xyz_mm" in entry,
    )


def _pin(entry: Spec, end: str) -> FloatArray:
    """T of an end on its link."""
    return Frame(*(entry.get(f"{end}_{key}", ZERO) for key in ("xyz_mm", "rpy_deg"))).T


def _point(entry: Spec, end: str) -> FloatArray:
    return _pin(entry, end)[:3, 3]


def _frame(name: str, joint_count: int) -> int:
    """Of base, linkN or tool in the order of the core's frames."""
    if name == "base":
        return 0
    return 2 * joint_count + 1 if name == "tool" else 2 * _joint_of(name) + 2


def _joint_of(link: str) -> int:
    """Of linkN, from 0; -1: base."""
    return place_of(link).number - 1
