# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a fit of touches starts: in closed form, from the last frame's poses.

With the pose (R_i, f_i) of the last frame and the point t on it, p_i = f_i + R_i t. One of the frames is asked for and
all else is held:
    tool    R_i t - s = -f_i of one point s, the same in all touches (a socket, nearly the centre of a sphere), linear
            in t and s;  n . (f_i + R_i t) = d of a plane, linear in t and d for each normal n
    base    x_i = T p_i with points x_i that an instrument measured, by the singular vectors of their moments
    part    x_i = T^-1 p_i with x_i as the part's drawing has them
"""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import in_order, of_observation
from fastcal.measurements.rotations import best_motion
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse, pose

FloatArray = NDArray[np.float64]
What = Literal["tool", "base", "part"]

_NORMALS = 400  # directions on the half sphere that a plane's normal is looked for among
LOST = 1e-6  # of the largest singular value of a start
_POINT_LIKE = ("socket", "anchor")  # labels of rows about one point


def starts(robot: Robot, data: Dataset, what: What, measured: _core.Measurements) -> list[Robot]:
    """The robot with the frame that is asked for about where the readings put it; on a sphere one of several is."""
    flange = robot.poses(data) @ inverse(robot.T_flange_tool)
    if what != "tool":
        base = inverse(robot.T_world_base)
        return [robot.with_(base=frame_spec(_rigid((base @ robot.poses(data))[:, :3, 3], data)))]
    tools = _by_points(flange, data)
    if not len(tools):
        tools = _by_plane(flange, data)
    if not len(tools):
        if not measured.shows_tool:
            kinds = ", ".join(kind.plural for kind in in_order({of_observation(of) for of in measured.observations}))
            raise InvalidInput(f"{data.source}: {kinds} do not show a tool")
        return [robot]
    return [robot.with_(tool=frame_spec(pose(robot.T_flange_tool[:3, :3], tool))) for tool in tools]


def _by_points(flange: FloatArray, data: Dataset) -> FloatArray:
    """(k, 3) tools from rows that are, nearly, at one point of each label, and from measured points.

    Touches of a sphere are at its centre but for its radius r: the tool is within r of what they say.
    """
    groups = [rows for label in _POINT_LIKE for rows in _labelled(data, label)]
    size = 3 + 3 * len(groups)
    rows, right = [], []
    for k, group in enumerate(groups):
        part = np.zeros((len(group), 3, size))
        part[:, :, :3] = flange[group, :3, :3]
        part[:, :, 3 + 3 * k : 6 + 3 * k] = -np.eye(3)
        rows.append(part.reshape(-1, size))
        right.append(-flange[group, :3, 3].ravel())
    if data.position is not None:
        whole = ~np.isnan(data.position).any(axis=1)
        part = np.zeros((int(whole.sum()), 3, size))
        part[:, :, :3] = flange[whole, :3, :3]
        rows.append(part.reshape(-1, size))
        right.append((data.position[whole] - flange[whole, :3, 3]).ravel())
    if not rows:
        return np.zeros((0, 3))
    found, _, _, _ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=LOST)
    radius = 0.0 if data.distance is None else float(np.nanmedian(data.distance))
    around = np.array(list(product((-1, 0, 1), repeat=3))) if radius else np.zeros((1, 3))
    return np.asarray(found[:3] + radius * around)


def _by_plane(flange: FloatArray, data: Dataset) -> FloatArray:
    """(k, 3) the tool from touches of the plane that has most: least squares for each of many normals."""
    groups = _labelled(data, "plane")
    if not groups:
        return np.zeros((0, 3))
    T = flange[max(groups, key=len)]
    k = np.arange(_NORMALS) + 0.5
    z, turn = 1.0 - k / _NORMALS, np.pi * (1.0 + np.sqrt(5.0)) * k  # a spiral of equal areas
    normals = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    best, tool = np.inf, np.zeros(3)
    for n in normals:
        A = np.column_stack([T[:, :3, :3].transpose(0, 2, 1) @ n, -np.ones(len(T))])
        found, _, _, _ = np.linalg.lstsq(A, -T[:, :3, 3] @ n, rcond=LOST)
        left = float(np.linalg.norm(A @ found + T[:, :3, 3] @ n))
        if left < best:
            best, tool = left, found[:3]
    return np.array([tool])


def _labelled(data: Dataset, label: str) -> list[NDArray[np.intp]]:
    codes, names = data.label_codes(label)
    return [np.flatnonzero(codes == k) for k in range(len(names))] if len(codes) else []


def _rigid(p: FloatArray, data: Dataset) -> FloatArray:
    """(4, 4) T with x_i = T p_i of points (N, 3) and the measured ones, of which NaN coordinates are not known.

    Of three whole points the best; else by the origin's point, one on the x axis and one in the plane of x and y.
    """
    x, source = data.points, data.source
    whole = ~np.isnan(x).any(axis=1)
    if whole.sum() >= 3:
        return best_motion(p[whole], x[whole])
    on_axis = np.isnan(x[:, 0]) & ~np.isnan(x[:, 1:]).any(axis=1)
    in_plane = np.isnan(x[:, :2]).all(axis=1) & ~np.isnan(x[:, 2])
    if not (whole.any() and on_axis.any() and in_plane.any()):
        raise Undetermined(
            f"{source}: expected three points with x, y and z, or the origin (0, 0, 0), one on the x axis (x empty) "
            "and one in the plane of x and y (x and y empty)"
        )
    first, second, third = (p[mask][0] for mask in (whole, on_axis, in_plane))
    e_x, across = second - first, third - first
    e_z = np.cross(e_x, across)
    if not np.linalg.norm(e_z) > LOST * np.linalg.norm(e_x) * np.linalg.norm(across):
        raise Undetermined(f"{source}: the three points lie on one line, about which the frame may turn")
    e_x, e_z = e_x / np.linalg.norm(e_x), e_z / np.linalg.norm(e_z)
    R = np.array([e_x, np.cross(e_z, e_x), e_z])
    return pose(R, x[whole][0] - R @ first)
