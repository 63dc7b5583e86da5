# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures in which a camera sees a board well: from many sides, near and far, the board anywhere in the picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.moving_rig import frames_of
from fastcal.design.candidates import joint_ranges
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.ik.posture import unwound
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.rig import Seeing, board_corners, lens_numbers, pictures
from fastcal.robot.robot import Robot
from fastcal.units import to_si

STEEPEST = to_si(50.0, "deg")  # that a camera looks at a board: farther, corners blur into each other
_FLANGE, _STILL = "arm", ("world", "arm.base")  # what a camera or board stands on: it moves as the tool does, or not
MARGIN, FAR_MARGIN = 0.02, 0.08  # of the picture's sides that stays free of corners; where places are hardly known
_NEAREST = 0.9  # of the picture's height that a board's size takes
FARTHEST = (0.3, 0.1)  # the same, and where the arm reaches few of these views
_FEW = 0.1  # of the views that are tried
_WHOLE = ("checkerboard", "circles", "points")  # of which all corners must be in the picture
_PART = 0.5  # of the corners of others
_AROUND = 0.2  # of the ranges around their middle where the search for a posture begins: arms like to stand there
_DRAWN = 40  # times as many postures at random, where a camera or board is on a link


def drawn_postures(
    robot: Robot, count: int, random: np.random.Generator, focus: tuple[float, float] | None, threads: int
) -> FloatArray:
    """(N, n) postures from views of each camera on each board that flange and room carry; else at random.

    Args:
        robot: With cameras and boards where they are about.
        count: Of views that are tried.
        random: Draws them.
        focus: Least and greatest distance of a board's middle from a camera [m]; None: as the picture's size wants it.
        threads: Cores.
    """
    spec = robot.description
    T_flange_tool = np.asarray(robot.core.base_and_tool(robot.core.nominal)[1])
    pairs = [
        (camera, board)
        for camera in spec.cameras.values()
        for board in spec.boards.values()
        if (camera["on"] == _FLANGE and board["on"] in _STILL) or (board["on"] == _FLANGE and camera["on"] in _STILL)
    ]
    if not pairs:
        ranges = joint_ranges(robot)
        return random.uniform(ranges[:, 0], ranges[:, 1], (_DRAWN * count, len(ranges)))
    ranges = joint_ranges(robot)
    q = np.zeros((0, len(ranges)))
    for fill in FARTHEST[: 1 if focus else None]:
        wanted = []
        for k in range(count):
            camera, board = pairs[k % len(pairs)]
            T_board_camera = view_of_board(camera, board, random, focus or filling(camera, board, fill))
            in_hand = camera["on"] == _FLANGE
            own, other = (camera, board) if in_hand else (board, camera)
            T_world_other = frames_of(robot, np.zeros((1, robot.joint_count)), other["on"])[0] @ pose(other)
            T_other_own = T_board_camera if in_hand else se3.inverse(T_board_camera)
            wanted.append(T_world_other @ T_other_own @ se3.inverse(pose(own)) @ T_flange_tool)
        new, reached = sent_to(robot, np.array(wanted), ranges, random, threads)
        q = np.vstack([q, new[reached]])
        if len(q) >= _FEW * count:
            break
    return q


def sent_to(
    robot: Robot, wanted: FloatArray, ranges: FloatArray, random: np.random.Generator, threads: int
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(N, n) postures of tool poses (N, 4, 4), the search beginning around the ranges' middle; and (N,) if reached."""
    middle, width = ranges.mean(axis=1), np.ptp(ranges, axis=1)
    seeds = middle + _AROUND * random.uniform(-1, 1, (len(wanted), len(ranges))) * width
    found = inverse_kinematics(robot, wanted, seeds, restarts=4, tolerance_m=1e-4, tolerance_rad=1e-4, threads=threads)
    return unwound(found.q, middle, ranges), np.asarray(found.status) == "reached"


def filling(camera: dict[str, Any], board: dict[str, Any], fill: float) -> tuple[float, float]:
    """Least and greatest distance [m] at which a board takes _NEAREST and `fill` of the picture's shorter side."""
    size = float(np.ptp(board_corners(board)[:, :2], axis=0).max())
    near, far = (float(np.mean(camera["focal_px"])) * size / (of * min(camera["size_px"])) for of in (_NEAREST, fill))
    return near, far


def view_of_board(
    camera: dict[str, Any], board: dict[str, Any], random: np.random.Generator, distances: tuple[float, float]
) -> FloatArray:
    """(4, 4) T_board_camera: slanted, turned and shifted at random, so that the middle is somewhere in the picture.

    A board's z points away from who looks at it, as x is along a row and y down.
    """
    corners = board_corners(board)
    middle, size = corners.mean(axis=0), float(np.ptp(corners[:, :2], axis=0).max())
    focal, sides = np.array(camera["focal_px"]), np.array(camera["size_px"], dtype=float)
    distance = random.uniform(*distances)
    slant, azimuth, roll = STEEPEST * np.sqrt(random.uniform()), *random.uniform(-np.pi, np.pi, 2)
    R = _core.exp_so3(slant * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])) @ _core.exp_so3([0.0, 0.0, roll])
    # Where the middle comes to lie: so far from the picture's middle as the board leaves room.
    room = np.maximum(sides / 2 - 0.5 * focal * size / distance, 0.0)
    ray = np.append((random.uniform(-1, 1, 2) * room) / focal, 1.0)
    ray /= np.linalg.norm(ray)
    about = np.cross(ray, [0.0, 0.0, 1.0])
    length = float(np.linalg.norm(about))
    to_axis = _core.exp_so3(about / length * np.arcsin(length)) if length > 0 else np.eye(3)
    turned = R @ to_axis
    return se3.pose(turned, middle - distance * turned @ ray)


def seen(robot: Robot, q: FloatArray, focus: tuple[float, float] | None, margin: float = MARGIN) -> FloatArray:
    """`seen_corners` of an arm in postures (N, n). InvalidInput where there are none."""
    if not len(q):
        raise InvalidInput(
            "no view of a board is within the arm's reach; do the file's places say about where cameras and boards are?"
        )
    return seen_corners(robot.description, len(q), lambda on: frames_of(robot, q, on), focus, margin)


def seen_corners(
    spec: Seeing,
    count: int,
    frames: Callable[[str], FloatArray],
    focus: tuple[float, float] | None,
    margin: float = MARGIN,
) -> FloatArray:
    """(N, K, 2) [px] of the corners that each camera sees of each board in N postures, NaN of others.

    A picture counts where the board faces the camera within STEEPEST, is in focus and is in the picture, with a margin
    (share of its sides).

    Args:
        spec: Has the cameras and boards.
        count: N.
        frames: (N, 4, 4) of what one stands on, in the measuring frame.
        focus: As of `drawn_postures`.
        margin: Free of corners.
    """
    places = pictures(spec)
    out = np.full((count, list(places.values())[-1].stop, 2), np.nan)
    for (name, plate), own in places.items():
        camera, board = spec.cameras[name], spec.boards[plate]
        corners, size = board_corners(board), np.array(camera["size_px"], dtype=float)
        T = np.linalg.inv(frames(camera["on"]) @ pose(camera)) @ frames(board["on"]) @ pose(board)
        p = np.einsum("nij,kj->nki", T[:, :3, :3], corners) + T[:, None, :3, 3]
        before = (p[..., 2] > 0).all(axis=1)
        middle = p.mean(axis=1)
        distance = np.linalg.norm(middle, axis=1)
        facing = np.einsum("ni,ni->n", T[:, :3, 2], middle) > np.cos(STEEPEST) * distance
        good = before & facing
        if focus is not None:
            good &= (distance >= focus[0]) & (distance <= focus[1])
        rows = np.flatnonzero(good)
        if not len(rows):
            continue
        drawn = np.asarray(_core.draw(camera["model"], lens_numbers(camera), p[rows].reshape(-1, 3)))
        uv = drawn.reshape(len(rows), len(corners), 2)
        inside = ((uv > margin * size) & (uv < (1 - margin) * size)).all(axis=2)
        share = 1.0 if board["kind"] in _WHOLE else _PART
        kept = inside.mean(axis=1) >= share
        uv[~inside] = np.nan
        out[rows[kept], own] = uv[kept]
    return out
