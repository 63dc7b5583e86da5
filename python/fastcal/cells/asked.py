# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which parameters of a cell its readings can show, and what is known of them beforehand."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cells.cell import Arm, Cell
from fastcal.cells.readings import Readings
from fastcal.effects.entries import parse_effects, without_repeats
from fastcal.errors import InvalidInput
from fastcal.place import owner_of, places_of
from fastcal.robot.rig import known_within
from fastcal.units import to_si

FloatArray = NDArray[np.float64]

# Plausible sizes within which places and effects are held where the geometry is: far more than a reading leaves open.
WEAK = 10.0
_GROUND = 0.1  # of what says where the world is
_OF_A_PLACE = 6


def asked_parameters(
    cell: Cell, readings: Readings, *, effects: bool = False, arms: Collection[str] | None = None
) -> list[int]:
    """Indices of the parameters to identify: of what lies between a target and the frame that it is read from.

    With `effects` those of the arms' effects too, but for curves, whose smoothness a fit of all does not know. Of arms
    that are not among `arms`, where that is given, only where they stand.

    What carries both moves them together, and no reading shows it. A tool's own place is that of the targets on it. A
    base that stands on a fork of one URDF is the origin of its first joint. Touches of sockets alone leave the world
    where its first arm stands.
    """
    core, parameters = cell.core, cell.core.parameters
    readings = readings.of_frames(cell)
    between = _frames_between(core, readings.sights(cell))
    kinds = [name.partition("@") for name in readings.tables]
    turned = {view.partition(":")[0] for kind, _, view in kinds if kind == "rotation"}
    sensors = {view.partition(":")[2] for kind, _, view in kinds if kind in ("position", "rotation")}
    poses = {each.name for each in cell.arms if each.of_poses}
    ground = _ground(cell, readings)
    out = []
    for branch in core.branches:
        if branch.name in poses:
            continue
        fixed = cell.known(branch.name).fixed
        for i in range(branch.first_parameter, branch.first_parameter + branch.parameter_count):
            parameter = parameters[i]
            place = parameter.owner.removeprefix(f"{branch.name}.")
            if place == branch.name:  # one frame
                shown = branch.name in turned | sensors or not parameter.name.startswith("r")
                wanted = not fixed and shown and branch.first_frame in between
            elif place == "base":
                wanted = not fixed and branch.first_frame in between and branch.name != ground
            else:
                is_asked = arms is None or branch.name in arms
                wanted = is_asked and place != "tool" and core.frame(parameter.owner) in between
            if wanted:
                out.append(i)
    at = len(parameters)
    for member, effect in [(each, effect) for each in cell.arms for effect in each.robot.effects] if effects else ():
        own = range(at, at + len(effect.parameters))
        out += () if effect.penalty or (arms is not None and member.name not in arms) else own
        at = own.stop
    return out


def _ground(cell: Cell, readings: Readings) -> str | None:
    """The arm whose base says where the world is, where touches of unknown places, and no instrument there, show it."""
    if not readings.labels or readings.is_read_from_world:
        return None
    return next((of.name for of in cell.arms if of.on == "world"), None)


def pictured_ground(cell: Cell, readings: Readings) -> str | None:
    """The same where pictures alone were read, of which no camera and no board stands at a known place of the world."""
    if any("@" in name for name in readings.tables) or readings.labels:
        return None
    in_world = [of for of in (*cell.cameras.values(), *cell.boards.values()) if (of["on"] or "world") == "world"]
    if any(of.get("fixed") or "sigma_mm" in of or "sigma_deg" in of for of in in_world):
        return None
    return next((of.name for of in cell.arms if of.on == "world"), None)


def with_effects(cell: Cell, text: str) -> Cell:
    """The cell whose arms have the effects that are asked for, beside their own.

    Args:
        cell: The cell.
        text: `geometry,joint_compliance,gear_harmonic@left.joint4:order=2`; a name alone is meant of all arms.

    Raises:
        InvalidInput: The geometry is not among them, a name or owner is unknown, or one changes weights or beams.
    """
    items = [item.strip() for item in text.split(",")]
    if "geometry" not in items:
        raise InvalidInput(f"a cell's geometry is always identified; write --effects geometry,{text}")
    for item in items:
        head, colon, options = item.partition(":")
        name, at, owner = head.partition("@")
        places = places_of(owner) if at else []
        of = {place.arm for place in places}
        if len(of) > 1 or not of <= {arm.name for arm in cell.arms}:
            raise InvalidInput(f"--effects {item:.60}: expected an owner such as {cell.arms[-1].name}.joint1")
        own_name = f"{name}{at}{owner_of(replace(place, arm='') for place in places)}"
        asked = [f"{own_name}{colon}{options}"]
        cell = replace(cell, arms=tuple(_with_asked(arm, asked, of) for arm in cell.arms))
    cell.model  # noqa: B018  which says whether they can be in a cell
    return cell


def _with_asked(arm: Arm, asked: list[str], of: Collection[str]) -> Arm:
    """The arm with the effects, where they are meant of it: of an arm named, or of all where none is."""
    if arm.of_poses or (of and arm.name not in of):
        return arm
    own = arm.robot.entries
    entries = without_repeats([*own, *parse_effects(asked, arm.robot.core, own)[1]])
    return arm if len(entries) == len(own) else replace(arm, robot=arm.robot.with_(effects=entries))


@dataclass(frozen=True, eq=False)
class Priors:
    """What is known beforehand of the tree's parameters and the unknowns behind them, SI.

    Attributes:
        mean, sigma: (T,) what each is, and within which standard deviation; infinite where it is free.
        geometry: (T,) which are held as the arms' geometry.
    """

    mean: FloatArray
    sigma: FloatArray
    geometry: NDArray[np.bool_]

    @property
    def options(self) -> dict[str, Any]:
        """As keyword arguments of the core's `identify`."""
        return {"prior_mean": self.mean, "prior_sigma": self.sigma} if np.isfinite(self.sigma).any() else {}


def priors(
    cell: Cell, asked: list[int], unknowns: list[_core.Parameter], sizes: float | None, ground: str | None = None
) -> Priors:
    """What is known of a cell before its readings.

    Args:
        cell: Says within what the places of its members are known.
        asked: The parameters that are identified.
        unknowns: Of what was read, behind the parameters.
        sizes: Hold the geometry of the arms within so many plausible sizes of where it is; None: not at all.
        ground: The arm whose base says where the world is, where nothing else does. Held weakly beside readings as
            sharp as pictures, it and all that stands in the world would be told from nothing by rounding alone.
    """
    core = cell.core
    mean = np.asarray(cell.model.start)
    plausible = np.array([parameter.sigma for parameter in cell.model.parameters])
    sigma, geometry = np.full(len(mean), np.inf), np.zeros(len(mean), dtype=bool)
    for branch in core.branches:
        known = cell.known(branch.name)
        first, behind = branch.first_parameter, branch.first_parameter + _OF_A_PLACE
        if sizes is not None:  # what no reading shows of a place must not wander to where the held geometry fits better
            sigma[first:behind] = (_GROUND if branch.name == ground else WEAK) * plausible[first:behind]
            if branch.joint_count:
                geometry[behind : first + branch.parameter_count - _OF_A_PLACE] = True
        if known.sigma_mm is not None:
            sigma[first : first + 3] = to_si(known.sigma_mm, "mm")
        if known.sigma_deg is not None:
            sigma[first + 3 : behind] = to_si(known.sigma_deg, "deg")
    if sizes is not None:  # few readings must not send what arms yield where no arm does
        sigma[len(core.parameters) :] = WEAK * plausible[len(core.parameters) :]
    chosen = np.zeros(len(mean), dtype=bool)
    chosen[asked] = True
    geometry &= chosen
    sigma[geometry] = (sizes or np.inf) * plausible[geometry]
    sigma[~chosen] = np.inf
    none = np.zeros(len(unknowns))
    return Priors(
        np.append(mean, none), np.append(sigma, known_within(cell, unknowns)), np.pad(geometry, (0, len(unknowns)))
    )


def arms_between(cell: Cell, sight: str) -> frozenset[str]:
    """Names of the arms whose joints move the one end of a sight and not the other.

    Args:
        cell: The tree.
        sight: TARGET, TARGET:SENSOR or BOARD:CAMERA.
    """
    rig = {name: of["on"] for members in (cell.cameras, cell.boards) for name, of in members.items()}
    ends = [rig.get(end, end) or "world" for end in (sight.partition(":")[0], sight.partition(":")[2])]
    between = _frames_between(cell.core, [":".join(ends)])
    arms = {arm.name for arm in cell.arms}
    frames = {of.name: range(of.first_frame, of.first_frame + of.frame_count) for of in cell.core.branches}
    return frozenset(name for name, own in frames.items() if name in arms and not between.isdisjoint(own))


def _frames_between(core: _core.RobotModel, views: list[str]) -> set[int]:
    """Frames that carry the one end of a view and not the other."""
    parents = core.parents

    def carriers(frame: int) -> set[int]:
        out = set()
        while frame >= 0:
            out.add(frame)
            frame = parents[frame]
        return out

    out: set[int] = set()
    for view in views:
        target, _, sensor = view.partition(":")
        out |= carriers(core.frame(target)) ^ carriers(core.frame(sensor or "world"))
    return out
