# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measured rows as visits of commanded poses, in the base of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.repeatability import pose_groups, turns_between, visit_groups
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import best_motion, nearest_rotation, rotations
from fastcal.robot import se3
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

RowArray = NDArray[np.intp]

TARGET_COLUMNS = ("target_x_mm", "target_y_mm", "target_z_mm", "target_qw", "target_qx", "target_qy", "target_qz")
_SAME_COMMAND = 2e-5  # rad or m; a controller's program has five decimals of a degree


@dataclass(frozen=True, eq=False)
class Station:
    """One commanded pose, approached from one side, and its visits.

    Attributes:
        pose: P1 ...
        direction: The side it was approached from; empty: from the pose before.
        rows: Its rows in the data, in their order.
        commanded: (4, 4) T_base_tool.
    """

    pose: str
    direction: str
    rows: RowArray
    commanded: FloatArray


@dataclass(frozen=True, eq=False)
class Campaign:
    """What was measured of a test.

    Attributes:
        data: The rows.
        stations: Commanded poses with their visits.
        points: (N, 3) measured, in the base [m].
        turns: (N, 3) from the commanded to the measured orientation about the tool's axes [rad]; None: not measured.
        T_base_world: (4, 4) that brought the measuring frame to the base.
        fitted: Was that fitted to these rows, or is it the model's?
    """

    data: Dataset
    stations: tuple[Station, ...]
    points: FloatArray
    turns: FloatArray | None
    T_base_world: FloatArray
    fitted: bool

    @property
    def commanded(self) -> FloatArray:
        """(K, 3) commanded points [m]."""
        return np.array([station.commanded[:3, 3] for station in self.stations])

    def conditions(self, rows: RowArray) -> dict[str, Any]:
        """What the data say of some rows beside their joints, as `Robot.forward` takes it."""
        columns = {name: value for name, value in condition_columns(self.data).items() if value is not None}
        extra = {name: values[rows] for name, values in columns.pop("extra").items()}
        return {name: values[rows] for name, values in columns.items()} | {"extra": extra}

    def errors(self, k: int) -> FloatArray:
        """(n, 3) attained less commanded points of station k [m]."""
        station = self.stations[k]
        return np.asarray(self.points[station.rows] - station.commanded[:3, 3])

    def turn_errors(self, k: int) -> FloatArray:
        """(n, 3) attained less commanded turns of station k [rad]."""
        return np.asarray(self.turns)[self.stations[k].rows]


def campaign(model: Robot, data: Dataset, plan: Dataset | None, *, align: bool) -> Campaign:
    """Matches the rows with their commands and brings them to the base.

    Args:
        model: Whose poses are the commands, where there is no plan; its base is where nothing is aligned.
        data: Measured points, at commanded joint positions.
        plan: The visits of `fastcal accept --plan`; None: they are columns of the data, or the model's own poses.
        align: Fit the measuring frame to the commanded poses; False: take the model's base.

    Raises:
        InvalidInput: No points, a row that is no visit of the plan, or too few poses to align with.
    """
    if np.isnan(data.points).all():
        raise InvalidInput(f"{data.source}: holds no measured points; expected x_mm, y_mm and z_mm")
    stations = _stations(model, data, plan)
    T_world_base = model.core.base_and_tool(model.core.nominal)[0]
    T = _fitted(data, stations) if align else se3.inverse(T_world_base)
    points = data.points @ T[:3, :3].T + T[:3, 3]
    found = Campaign(data, tuple(stations), points, None, T, align)
    return replace(found, turns=_turns(found)) if data.rotation is not None else found


def _stations(model: Robot, data: Dataset, plan: Dataset | None) -> list[Station]:
    """The commanded poses of the data's rows, by name, those of the cycle first."""
    measured = np.asarray(~np.isnan(data.points).any(axis=1))
    if plan is None and set(TARGET_COLUMNS) <= set(data.extra):
        plan = data
    if plan is None:
        T_base_world = se3.inverse(model.core.base_and_tool(model.core.nominal)[0])
        T, names, sides = T_base_world @ model.poses(data), _numbered(pose_groups(data)), _numbered(visit_groups(data))
        several = {name for name in names if len({side for n, side in zip(names, sides, strict=True) if n == name}) > 1}
        sides = [side if name in several else "" for name, side in zip(names, sides, strict=True)]
    else:
        commanded = commanded_of(plan)
        if plan is not data:
            _check_once(plan)
        at = np.arange(len(data)) if plan is data else _visits_of(data, plan)
        T, names, sides = commanded[at], _labels(plan, "pose", at), _labels(plan, "direction", at)
    keys = list(zip(names, sides, strict=True))
    return [
        Station(*key, np.array([i for i in range(len(keys)) if keys[i] == key and measured[i]]), T[keys.index(key)])
        for key in sorted({key for key, whole in zip(keys, measured, strict=True) if whole}, key=_in_order)
    ]


def _in_order(key: tuple[str, str]) -> tuple[str, int, str]:
    """P1 before P2, 9 before 10, the cycle before the sides."""
    pose, side = key
    return side, len(pose), pose


def commanded_of(plan: Dataset) -> FloatArray:
    """(N, 4, 4) T_base_tool of a plan's rows."""
    if missing := [name for name in TARGET_COLUMNS if name not in plan.extra]:
        raise InvalidInput(
            f"{plan.source}: has no column {missing[0]}; expected a plan that fastcal accept has written"
        )
    columns = np.column_stack([plan.extra[name] for name in TARGET_COLUMNS])
    T = np.tile(np.eye(4), (len(plan), 1, 1))
    T[:, :3, 3] = to_si(columns[:, :3], "mm")
    T[:, :3, :3] = rotations(columns[:, 3:] / np.linalg.norm(columns[:, 3:], axis=1, keepdims=True))
    if not np.isfinite(T).all():
        row = int(np.argmax(~np.isfinite(T).all(axis=(1, 2))))
        raise InvalidInput(f"{plan.source}: data row {row} holds no commanded pose")
    return T


def _labels(plan: Dataset, column: str, at: RowArray) -> list[str]:
    if column in plan.extra_labels:
        return [plan.extra_labels[column][i] for i in at]
    if column == "direction":
        return [""] * len(at)
    numbers = _numbered(pose_groups(plan))
    return [numbers[i] for i in at]


def _check_once(plan: Dataset) -> None:
    """Refuses a plan with a visit twice: whose rows would then be of one, and whose of the other?"""
    every = np.arange(len(plan))
    cycle = plan.extra.get("cycle", np.zeros(len(plan)))
    approach = np.zeros_like(plan.q) if plan.approach is None else np.asarray(plan.approach)
    seen: dict[tuple[object, ...], int] = {}
    sides, poses = _labels(plan, "direction", every), _labels(plan, "pose", every)
    for row, key in enumerate(zip(poses, sides, cycle.tolist(), plan.q.tolist(), approach.tolist(), strict=True)):
        visit = tuple(tuple(part) if isinstance(part, list) else part for part in key)
        if visit in seen:
            other = f"data row {row} is the same visit as row {seen[visit]}"
            raise InvalidInput(f"{plan.source}: {other}; expected each visit of a cycle once")
        seen[visit] = row


def _numbered(groups: RowArray) -> list[str]:
    """1, 2, ... in the order of first appearance."""
    order = {g: str(i) for i, g in enumerate(dict.fromkeys(groups.tolist()), start=1)}
    return [order[g] for g in groups.tolist()]


def _visits_of(data: Dataset, plan: Dataset) -> RowArray:
    """(N,) the visit of the plan that each row is: the next one of the same joints (and approach), else any of them."""
    both = data.approach is not None and plan.approach is not None
    out = np.zeros(len(data), dtype=np.intp)
    after = 0
    for i, q in enumerate(data.q):
        away = np.abs(plan.q - q).max(axis=1)
        if away.min() > _SAME_COMMAND:
            raise InvalidInput(
                f"{data.source}: data row {i} is not a visit of {plan.source}: its joints are "
                f"{from_si(float(away.min()), 'deg'):.4f} deg from the nearest; expected the commanded positions"
            )
        same = away <= _SAME_COMMAND
        if both and (fits := same & (np.asarray(plan.approach) == np.asarray(data.approach)[i]).all(axis=1)).any():
            same = fits
        places = np.flatnonzero(same)
        later = places[places >= after]
        out[i] = later[0] if len(later) else places[0]
        after = int(out[i]) + 1
    return out


def _fitted(data: Dataset, stations: list[Station]) -> FloatArray:
    """T_base_world (4, 4) that best brings the mean attained points to the commanded ones ."""
    chosen = cycle_of(stations)
    p = np.array([stations[k].commanded[:3, 3] for k in chosen])
    x = np.array([data.points[stations[k].rows].mean(axis=0) for k in chosen])
    if len(p) < 3 or np.linalg.svd(p - p.mean(axis=0), compute_uv=False)[1] < 1e-3:
        raise InvalidInput(
            f"{data.source}: the alignment needs at least three poses that are not on one line, got {len(p)}; "
            "--align model takes the base of MODEL"
        )
    return best_motion(x, p)


def cycle_of(stations: Sequence[Station]) -> list[int]:
    """Places of the stations that AP and RP are of: one a pose, approached from the pose before where there is such."""
    best: dict[str, int] = {}
    for k, station in enumerate(stations):
        known = best.get(station.pose)
        if known is None or (stations[known].direction and not station.direction):
            best[station.pose] = k
    return sorted(best.values())


def _turns(found: Campaign) -> FloatArray | None:
    """(N, 3) turns; where the frame was fitted, how the target sits on the tool is fitted too. None: not all known."""
    wxyz = np.asarray(found.data.rotation)
    rows = np.concatenate([station.rows for station in found.stations])
    if np.isnan(wxyz[rows]).any():
        return None
    R = found.T_base_world[:3, :3] @ rotations(wxyz[rows])
    commanded = np.concatenate([[station.commanded[:3, :3]] * len(station.rows) for station in found.stations])
    if found.fitted:
        means = [np.swapaxes(commanded[at], 1, 2) @ R[at] for at in _parts(found)]
        R = R @ nearest_rotation(np.mean([part.mean(axis=0) for part in means], axis=0)).T
    out = np.full((len(wxyz), 3), np.nan)
    out[rows] = turns_between(commanded, R)
    return out


def _parts(found: Campaign) -> list[RowArray]:
    """Places of each aligned station's rows among all rows one after the other."""
    ends = np.cumsum([len(station.rows) for station in found.stations])
    return [np.arange(ends[k] - len(found.stations[k].rows), ends[k]) for k in cycle_of(found.stations)]
