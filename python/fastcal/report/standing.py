# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What stands about an arm or in a cell, as points and lines of its figure: cameras with their cones, boards, targets.

A camera is drawn as the pyramid of what it sees, z forward: from its centre to (u - cx) d / fx, (v - cy) d / fy, d for
the corners (u, v) of its picture, d a share of the size of the whole; a board as the outline of its corners.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.report.arm import GAP, LINK, Arm, Run
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners
from fastcal.robot.robot_spec import Spec
from fastcal.units import from_si, to_si

Poses = Callable[[str], FloatArray]  # of the frame that `on` names in R postures: (R, 4, 4) [m]

SEES, BOARD, TARGET, SIGHT = "#009e73", "#a14a82", "#0072b2", "#aab4bd"
_DEEP = 0.11  # of a camera's pyramid, of the diagonal of all that stands there
_HOLDER = 4  # how wide what holds a camera is
_OUTLINE = [0, 1, 2, 3, 0]
_CONE = [0, 1, 2, 3, 4, 1, GAP, 0, 2, GAP, 0, 3, GAP, 0, 4]


def with_points(arm: Arm, points: FloatArray, *runs: Run) -> Arm:
    """The figure with more points (R, k, 3) [mm] and runs through them, whose places count from the first of these."""
    first = arm.points.shape[1]
    moved = [replace(run, through=[place + first if place >= 0 else GAP for place in run.through]) for run in runs]
    return replace(arm, points=np.concatenate([arm.points, points], axis=1), runs=[*arm.runs, *moved])


def with_rig(arm: Arm, poses: Poses, cameras: Mapping[str, Spec], boards: Mapping[str, Spec]) -> Arm:
    """The figure with cameras and boards, by their names as a spec has them."""
    deep = _DEEP * _extent(arm.points)
    for shapes, colour in ((cameras, SEES), (boards, BOARD)):
        for name, member in shapes.items():
            T = poses(member["on"])
            shape, line = (_pyramid(member, deep), _CONE) if colour == SEES else (_outline(member), _OUTLINE)
            held = np.concatenate([_moved(T, member, shape), from_si(T[:, np.newaxis, :3, 3], "mm")], axis=1)
            runs = [Run(line, colour, 3), Run([0], colour, 0, (name,), "circle")]
            holder = [] if member["on"] == "world" else [Run([0, len(shape)], LINK, _HOLDER)]
            arm = with_points(arm, held if holder else held[:, :-1], *runs, *holder)
    return arm


def with_mark(arm: Arm, at: FloatArray, name: str, colour: str, on: FloatArray | None = None) -> Arm:
    """The figure with a named mark at (R, 3) [mm], and what holds it at the frame that it stands on (R, 3)."""
    mark = Run([0], colour, 0, (name,))
    return with_points(arm, at[:, np.newaxis], mark) if on is None else with_points(
        arm, np.stack([at, on], axis=1), mark, Run([0, 1], LINK, _HOLDER)
    )  # fmt: skip


def is_far(arm: Arm, at: FloatArray) -> bool:
    """Would a point (3,) [mm] make all that is drawn small?"""
    flat = arm.points.reshape(-1, 3)
    middle = (np.nanmin(flat, axis=0) + np.nanmax(flat, axis=0)) / 2
    return bool(np.linalg.norm(at - middle) > _extent(arm.points))


def with_sight(arm: Arm, start: FloatArray, end: FloatArray) -> Arm:
    """The figure with a thin line of sight between points (R, 3) [mm]; NaN: nothing was read in a posture."""
    return with_points(arm, np.stack([start, end], axis=1), Run([0, 1], SIGHT, 2))


def middle_of(poses: Poses, member: Spec) -> FloatArray:
    """(R, 3) [mm] where a camera is, or the middle of a board's corners."""
    at = board_corners(member).mean(axis=0)[np.newaxis] if "kind" in member else np.zeros((1, 3))
    return _moved(poses(member["on"]), member, at)[:, 0]


def _extent(points: FloatArray) -> float:
    """The diagonal of the box around points (R, P, 3); 1 m where there is next to none."""
    flat = points.reshape(-1, 3)
    known = flat[np.isfinite(flat).all(axis=1)]
    return (float(np.linalg.norm(np.ptp(known, axis=0))) if len(known) else 0.0) or 1000.0


def _moved(T: FloatArray, member: Spec, points: FloatArray) -> FloatArray:
    """Points (k, 3) [m] of a member that stands on frames T (R, 4, 4), in the measuring frame (R, k, 3) [mm]."""
    T = T @ pose(member)
    return np.asarray(from_si(np.einsum("rij,kj->rki", T[:, :3, :3], points) + T[:, np.newaxis, :3, 3], "mm"))


def _pyramid(camera: Spec, deep_mm: float) -> FloatArray:
    """(5, 3) [m] the centre and the corners of the picture, in the camera's frame."""
    (wide, high), (fx, fy), (cx, cy) = camera["size_px"], camera["focal_px"], camera["centre_px"]
    corners = [((u - cx) / fx, (v - cy) / fy, 1.0) for u, v in ((0, 0), (wide, 0), (wide, high), (0, high))]
    return np.array([(0.0, 0.0, 0.0), *corners]) * to_si(deep_mm, "mm")


def _outline(board: Spec) -> FloatArray:
    """(4, 3) [m] the corners of the box around those of a board, in its frame."""
    at = board_corners(board)
    (x0, y0, _z0), (x1, y1, _z1) = at.min(axis=0), at.max(axis=0)
    z = float(at[:, 2].mean())
    return np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
