# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where members of a cell stand, all others being where the file has them, and the axis of a track or a turntable.

A track or turntable is an arm of one joint. Its line u (a unit vector), c (a point of it) in its own base is that of
the file; what is read of a target on it lies, in the frame that it stands on, on a circle about the line or on a line
along it. So its base goes by the least turn and the least shift that bring the one to the other, and its target to the
mean of where the readings then put it: a start; the fit follows, with the ratio of its gear where it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.kind_noise import noise_by_kind
from fastcal.calibration.touches import few_readings
from fastcal.cells.asked import asked_parameters, priors
from fastcal.cells.calibrate import parameter_table
from fastcal.cells.cell import Arm, Cell, Known
from fastcal.cells.placements import Placement, placements
from fastcal.cells.readings import Readings
from fastcal.effects.values import written_parameters
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.kinds import KindNoise
from fastcal.place import joint_name, place_of
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse, turn_between
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]

RATIO = "reduction_ratio"
_POSITIONS, _RATIO_POSITIONS = 3, 4  # of an axis, that show where it is, and how far it goes for what is asked of it
_APART = 1e-3  # [rad, m] between two positions of an axis
_LEAST_TURN = to_si(20.0, "deg")  # of an axis, on which its circle is not mistaken for a line


@dataclass(frozen=True, eq=False)
class PlacedMembers:
    """Members of a cell that were placed.

    Attributes:
        cell: With them where they were found, known within their deviations.
        members: Where, and how surely.
        ratio: Error of the axis' ratio and its standard deviation, 1; None where it was not asked for.
        free: What no reading shows of them, which stays as the file has it.
    """

    cell: Cell
    members: list[Placement]
    ratio: tuple[float, float] | None
    noise: dict[str, KindNoise]
    count: int
    degrees_of_freedom: int
    outliers: list[int]
    free: list[str]

    def to_json_dict(self) -> dict[str, Any]:
        """What `fastcal place` prints."""
        return {
            "placements": [of.to_json_dict() for of in self.members],
            "ratio": None if self.ratio is None else {"error": self.ratio[0], "std": self.ratio[1]},
            "count": self.count,
            "degrees_of_freedom": self.degrees_of_freedom,
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "outliers": self.outliers,
            "free": self.free,
        }


def place_axis(cell: Cell, readings: Readings, name: str | None = None, *, threads: int = 1) -> PlacedMembers:
    """A track or turntable and the targets on it; `name` may be left out where one arm has one joint.

    Raises:
        InvalidInput: There is no such arm, or nothing was read of a target on it.
        Undetermined: Too few positions of it.
    """
    single = [arm for arm in cell.arms if arm.robot.joint_count == 1]
    if name is None and len(single) != 1:
        listed = ", ".join(arm.name for arm in single) or "none"
        raise InvalidInput(f"expected one arm of one joint, or its name; the cell has {listed}")
    arm = single[0] if name is None else next((arm for arm in single if arm.name == name), None)
    if arm is None:
        raise InvalidInput(f"'{name}' is no arm of one joint of this cell")
    targets = [of.name for of in cell.points if of.on == arm.flange and of.role == "target"]
    views = [view for view in readings.views if view.partition(":")[0] in targets]
    if not views:
        raise InvalidInput(f"{readings.source}: nothing was read of a target on {arm.name}; expected x_mm@TARGET")
    positions = _positions(cell, readings, arm, views)
    if positions < _POSITIONS:
        raise Undetermined(
            f"{readings.source}: targets on {arm.name} were read at {positions} of its positions; expected "
            f"{_POSITIONS} or more, {_RATIO_POSITIONS} to tell its ratio"
        )
    cell = _free(cell, [arm.name, *targets])
    cell = _started(cell, readings, arm.name, views)
    return _placed(cell, readings, [arm.name, *targets], arm.name if positions >= _RATIO_POSITIONS else None, threads)


def place_members(cell: Cell, readings: Readings, names: list[str], *, threads: int = 1) -> PlacedMembers:
    """Arms, targets or sensors by their names, from readings that see them.

    Raises:
        InvalidInput: There is no such member.
        Undetermined: No reading shows one of them, or too few do.
    """
    known = [*(of.name for of in cell.arms), *(of.name for of in cell.points)]
    for name in names:
        if name not in known:
            raise InvalidInput(f"'{name}' is no arm, target or sensor of this cell; there are {', '.join(known)}")
    return _placed(_free(cell, names), readings, names, None, threads)


def _free(cell: Cell, names: list[str]) -> Cell:
    """The cell with these members' places open, whatever the file says of how surely they are known."""
    return replace(
        cell,
        arms=tuple(replace(of, known=Known()) if of.name in names else of for of in cell.arms),
        points=tuple(replace(of, known=Known()) if of.name in names else of for of in cell.points),
    )


def _placed(cell: Cell, readings: Readings, names: list[str], axis: str | None, threads: int) -> PlacedMembers:
    """The fit of the places of `names`, and of the ratio of `axis`."""
    before = cell
    if axis is not None:
        cell = _with_ratio(cell, axis, {"error": {"value": 0.0, "std": None}})
    model, measured = cell.model, readings.measured(cell)
    if measured.parameters:
        raise InvalidInput(f"{readings.source}: members are placed by targets; cameras and boards are of calibrate")
    parameters, first = model.parameters, len(cell.core.nominal)
    asked = [i for i in asked_parameters(cell, readings) if _owner(parameters[i].owner) in names]
    unseen = [name for name in names if not any(_owner(parameters[i].owner) == name for i in asked)]
    if unseen:
        raise Undetermined(f"{readings.source}: no reading shows where {', '.join(unseen)} stands")
    ratio = None
    if axis is not None:
        own = f"{axis}.{joint_name(0)}"
        ratio = next(i for i in range(first, len(parameters)) if parameters[i].owner == own)
        asked = [*asked, ratio]
    found = _core.identify(
        model,
        readings.samples(cell),
        measured,
        asked=asked,
        loss="huber",
        threads=threads,
        **priors(cell, asked, [], None).options,
    )
    if found.status == "too_few_equations" or found.degrees_of_freedom < 1:
        raise Undetermined(f"{readings.source}: {len(readings)} postures are too few to place {', '.join(names)}")
    if found.status != "converged":
        raise Undetermined(f"{readings.source}: no place explains the readings: {found.message}")
    scale = few_readings(found, measured)
    theta, std = np.asarray(found.theta), scale * np.sqrt(np.diag(found.covariance))
    out = before.with_values(theta)
    of_ratio = None
    if ratio is not None and axis is not None:
        effect = cell.arm(axis).robot.effects[-1]
        spread = np.array([[std[found.free.index(ratio)] ** 2 if ratio in found.free else np.nan]])
        values = written_parameters({"effect": RATIO}, effect, theta[[ratio]], spread)
        out = _with_ratio(out, axis, values)
        of_ratio = (values["error"]["value"], values["error"]["std"])
    table = [
        of if of.std is None else replace(of, std=scale * of.std)
        for of in parameter_table(found, found.parameters, np.asarray(model.start))
    ]
    members = [of for of in placements(out, table) if of.name in names]
    return PlacedMembers(
        _known_within(out, members),
        members,
        of_ratio,
        noise_by_kind(measured, found),
        len(readings),
        int(found.degrees_of_freedom),
        list(found.outliers),
        list(found.unidentifiable),
    )


def _owner(name: str) -> str:
    """The member that owns a parameter: table of table.base, mark of mark."""
    return place_of(name).arm if place_of(name).kind == "base" else name


def _with_ratio(cell: Cell, name: str, parameters: dict[str, Any]) -> Cell:
    """The cell with one ratio of an arm's gear: that of its file gives way."""

    def changed(arm: Arm) -> Arm:
        others = [entry for entry in arm.robot.entries if entry["effect"] != RATIO]
        entry = {"effect": RATIO, "owner": joint_name(0), "parameters": parameters}
        return replace(arm, robot=arm.robot.with_(effects=[*others, entry]))

    return replace(cell, arms=tuple(changed(arm) if arm.name == name else arm for arm in cell.arms))


def _known_within(cell: Cell, members: list[Placement]) -> Cell:
    """The cell with the deviations of what was placed, as its file writes them: the root of their mean square."""

    def known(placed: Placement) -> Known:
        sigma = []
        for std in (placed.std_mm, placed.std_deg):
            own = [value for value in std if value is not None]
            sigma.append(float(np.sqrt(np.mean(np.square(own)))) if own else None)
        return Known(False, *sigma)

    found = {of.name: known(of) for of in members}
    return replace(
        cell,
        arms=tuple(replace(of, known=found.get(of.name, of.known)) for of in cell.arms),
        points=tuple(replace(of, known=found.get(of.name, of.known)) for of in cell.points),
        record=None,  # what was known of all together was with these members elsewhere
    )


def _column(cell: Cell, arm: Arm) -> int:
    """The column of an arm's first joint in the postures of the cell."""
    return cell.joint_columns.index(arm.joint_columns[0])


def _positions(cell: Cell, readings: Readings, arm: Arm, views: list[str]) -> int:
    """At how many positions of the axis was a point read?"""
    read = np.any([~np.isnan(readings.tables[f"position@{view}"]).any(axis=1) for view in views], axis=0)
    q = np.sort(readings.q[read, _column(cell, arm)])
    return int((np.diff(q) > _APART).sum()) + 1 if len(q) else 0


def _started(cell: Cell, readings: Readings, name: str, views: list[str]) -> Cell:
    """The cell with the axis where the circle or line of its most read target puts it, and its targets there."""
    arm = cell.arm(name)
    q = readings.q[:, _column(cell, arm)]
    there = {view: _points(cell, readings, arm, view) for view in views}
    main = max(views, key=lambda view: int(np.isfinite(there[view][:, 0]).sum()))
    known = np.isfinite(there[main][:, 0])
    p, at = there[main][known], q[known]
    own = arm.robot.with_(base={}, tool={})
    u, c = _own_line(own.forward(np.array([[0.0], [0.1]])), arm)
    T = arm.robot.T_world_base.copy()
    turns = arm.robot.joint_types[0] == "revolute"
    d, e = _circle(p, at, readings.source) if turns else _line(p, at)
    T[:3, :3] = turn_between(T[:3, :3] @ u, d, _across(d)) @ T[:3, :3]
    if turns:
        off = e - (T[:3, :3] @ c + T[:3, 3])
        T[:3, 3] += off - d * (d @ off)
    flange = T @ own.forward(q[:, np.newaxis])
    places = {}
    for view in views:
        points = np.einsum("nji,nj->ni", flange[:, :3, :3], there[view] - flange[:, :3, 3])
        places[view.partition(":")[0]] = np.nanmedian(points, axis=0)
    points = tuple(
        replace(of, place=frame_spec(np.block([[pose(of.place)[:3, :3], places[of.name][:, None]], [0, 0, 0, 1]])))
        if of.name in places
        else of
        for of in cell.points
    )
    arms = tuple(replace(of, robot=of.robot.with_(base=frame_spec(T))) if of.name == name else of for of in cell.arms)
    return replace(cell, arms=arms, points=points)


def _points(cell: Cell, readings: Readings, arm: Arm, view: str) -> FloatArray:
    """(N, 3) what was read, in the frame that the arm stands on [m]."""
    samples = readings.samples(cell)

    def world(frame: str) -> FloatArray:
        if frame in ("", "world"):
            return np.broadcast_to(np.eye(4), (len(readings), 4, 4))
        return np.asarray(cell.model.predict(samples, cell.model.start, of=frame))

    sensor, ground = world(view.partition(":")[2]), world(arm.on)
    p = np.einsum("nij,nj->ni", sensor[:, :3, :3], readings.tables[f"position@{view}"]) + sensor[:, :3, 3]
    return np.asarray(np.einsum("nji,nj->ni", ground[:, :3, :3], p - ground[:, :3, 3]))


def _own_line(T: FloatArray, arm: Arm) -> tuple[FloatArray, FloatArray]:
    """A joint's line in its arm's base: direction, and a point, from two flange poses (2, 4, 4)."""
    if arm.robot.joint_types[0] != "revolute":
        along = T[1, :3, 3] - T[0, :3, 3]
        return along / np.linalg.norm(along), np.zeros(3)
    D = T[1] @ inverse(T[0])
    turn = _core.log_so3(np.ascontiguousarray(D[:3, :3]))
    # A point c of the axis stays: (1 - R) c = t, by least squares, as it may lie anywhere along the axis.
    c, _, _, _ = np.linalg.lstsq(np.eye(3) - D[:3, :3], D[:3, 3], rcond=1e-9)
    return np.asarray(turn / np.linalg.norm(turn)), np.asarray(c)


def _circle(p: FloatArray, q: FloatArray, source: str) -> tuple[FloatArray, FloatArray]:
    """Axis and centre of the circle of points (N, 3) at angles q: Kasa's, in the plane where they spread most."""
    if not np.ptp(q) > _LEAST_TURN:
        turned = from_si(float(np.ptp(q)), "deg")
        raise Undetermined(
            f"{source}: the axis was turned by {turned:.1f} deg; expected 20 deg or more, best a whole turn"
        )
    middle = p.mean(axis=0)
    axes = np.linalg.svd(p - middle)[2]
    flat = (p - middle) @ axes[:2].T
    A = np.column_stack([2 * flat, np.ones(len(flat))])
    found, _, _, _ = np.linalg.lstsq(A, (flat**2).sum(axis=1), rcond=None)
    about = flat - found[:2]
    normal = np.cross(axes[0], axes[1])
    cross = about[:, None, 0] * about[None, :, 1] - about[:, None, 1] * about[None, :, 0]
    sense = float((cross * np.sin(q[None, :] - q[:, None])).sum())
    return np.asarray(normal * np.copysign(1.0, sense)), np.asarray(middle + found[:2] @ axes[:2])


def _line(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction in which points (N, 3) move as q grows, and their middle."""
    slope = (q - q.mean()) @ (p - p.mean(axis=0))
    return np.asarray(slope / np.linalg.norm(slope)), np.asarray(p.mean(axis=0))


def _across(d: FloatArray) -> FloatArray:
    """A unit vector across a unit vector."""
    out = np.cross(d, np.eye(3)[int(np.argmin(np.abs(d)))])
    return np.asarray(out / np.linalg.norm(out))
