# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures of a cell in which a camera sees a board: all other arms anywhere, the one that carries it where it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Arm, Cell
from fastcal.design.views import FAR_MARGIN, FARTHEST, MARGIN, filling, seen_corners, sent_to, view_of_board
from fastcal.errors import InvalidInput
from fastcal.place import place_of
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.rig import pictures
from fastcal.robot.robot_spec import Spec

Focus = tuple[float, float] | None

_VIEWS = 1500  # that are tried at a time
_ROUNDS = 4
_ENOUGH = 10  # times as many as are wanted
_FREE = 6  # joints that bring a camera anywhere
_DRAWN = 20  # times as many postures at random, where no arm can be sent to a view


@dataclass(frozen=True, eq=False)
class _Eye:
    """A camera and a board, and the arm that brings the one before the other; `own` is what that arm carries."""

    arm: Arm
    camera: Spec
    board: Spec
    in_hand: bool

    @property
    def own(self) -> Spec:
        return self.camera if self.in_hand else self.board

    @property
    def other(self) -> Spec:
        return self.board if self.in_hand else self.camera


def showing_postures(
    cell: Cell,
    limits: FloatArray,
    pairs: Sequence[tuple[str, str]],
    count: int,
    random: np.random.Generator,
    focus: Focus = None,
    threads: int = 1,
) -> tuple[FloatArray, FloatArray]:
    """Postures q (N, n) that show a board, and the corners (N, K, 2) [px] that are seen then, NaN of others.

    Args:
        cell: With cameras and boards about where they are.
        limits: (n, 2) of the joints.
        pairs: (board, camera) of the pictures that are taken.
        count: How many are wanted; N is several times as many where there are.
        random: Draws them.
        focus: Least and greatest distance of a board's middle from a camera [m]; None: as the picture's size wants it.
        threads: Cores.

    Raises:
        InvalidInput: Fewer than `count` were found.
    """
    margin = MARGIN if cell.record is not None else FAR_MARGIN
    eyes = _eyes(cell, pairs)
    q, uv = np.zeros((0, len(limits))), None
    for turn in range(_ROUNDS):
        fill = FARTHEST[min(turn, len(FARTHEST) - 1)]
        size = _VIEWS if eyes else _DRAWN * _VIEWS
        new = random.uniform(limits[:, 0], limits[:, 1], (size, len(limits)))
        if eyes:
            new = np.vstack(
                [_sent(cell, eye, new[k :: len(eyes)], random, focus, fill, threads) for k, eye in enumerate(eyes)]
            )
        here = _of_pairs(cell, pairs, seen_corners(cell, len(new), partial(cell.frames_at, new), focus, margin))
        shows = np.isfinite(here[..., 0]).any(axis=1)
        q, uv = np.vstack([q, new[shows]]), here[shows] if uv is None else np.vstack([uv, here[shows]])
        if len(q) >= _ENOUGH * count:
            break
    if len(q) < count or uv is None:
        raise InvalidInput(
            f"{count} postures were asked for, and of {_ROUNDS * size} only {len(q)} show a board well; is the board "
            "within reach of the cameras, and do the file's places say about where they are?"
        )
    return np.ascontiguousarray(q), uv


def _of_pairs(cell: Cell, pairs: Sequence[tuple[str, str]], uv: FloatArray) -> FloatArray:
    """Pictures (N, K, 2) without those of other boards and cameras."""
    for (camera, board), own in pictures(cell).items():
        if (board, camera) not in pairs:
            uv[:, own] = np.nan
    return uv


def _eyes(cell: Cell, pairs: Sequence[tuple[str, str]]) -> list[_Eye]:
    """Every camera and board of the pictures of which an arm of enough joints carries one alone, on its flange."""
    out = []
    arms = sorted((arm for arm in cell.arms if not arm.of_poses), key=lambda arm: -arm.robot.joint_count)
    for name, eye in pairs:
        camera, board = cell.cameras[eye], cell.boards[name]
        ends = camera["on"], board["on"]
        for arm in arms:
            if arm.robot.joint_count >= _FREE and arm.flange in ends and not _carries_both(cell, arm, ends):
                out.append(_Eye(arm, camera, board, arm.flange == camera["on"]))
                break
    return out


def _carries_both(cell: Cell, arm: Arm, ends: tuple[Any, Any]) -> bool:
    """Does an arm carry what stands on both frames?"""

    def carried(on: str) -> bool:
        while on != "world":
            name = place_of(on).arm
            if name == arm.name:
                return True
            on = cell.arm(name).on
        return False

    return all(carried(str(on)) for on in ends)


def _sent(
    cell: Cell, eye: _Eye, q: FloatArray, random: np.random.Generator, focus: Focus, fill: float, threads: int
) -> FloatArray:
    """Those postures q (N, n) in which the arm reaches a view of its own, with its joints there."""
    robot = eye.arm.robot.with_(effects=[])
    branch = next(of for of in cell.core.branches if of.name == eye.arm.name)
    joints = slice(branch.first_joint, branch.first_joint + branch.joint_count)
    distances = focus or filling(eye.camera, eye.board, fill)
    T_board_camera = np.array([view_of_board(eye.camera, eye.board, random, distances) for _ in q])
    T_other_own = T_board_camera if eye.in_hand else se3.inverses(T_board_camera)
    T_ground_other = se3.inverses(cell.frames_at(q, eye.arm.on)) @ cell.frames_at(q, eye.other["on"]) @ pose(eye.other)
    T_flange_tool = np.asarray(robot.core.base_and_tool(robot.core.nominal)[1])
    wanted = T_ground_other @ T_other_own @ se3.inverse(pose(eye.own)) @ T_flange_tool
    own = robot.limits
    ranges = np.where(np.isfinite(own), own, np.array([-np.pi, np.pi]))
    found, reached = sent_to(robot, wanted, ranges, random, threads)
    out = q[reached].copy()
    out[:, joints] = found[reached]
    return out
