# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the cameras of a robot are, as hand-eye tools say it: in the frame of its flange, or of its base."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import RobotSpec
from fastcal.units import to_si

Spec = dict[str, Any]

_TURN = 1e-12  # of a quaternion's part that is no turn


@dataclass(frozen=True, eq=False)
class HandEye:
    """One camera.

    Attributes:
        camera: Its name, and that of its frame: z forward, x right, y down.
        parent: The frame in which it is: the effector's, or the base's.
        T_parent_camera: (4, 4) [m].
        std: (6,) standard deviations along x, y, z [m] and about them [rad], NaN where not identified.
        in_hand: Does the arm carry it?
        base, effector, marker: Frames of the arm, and of the board that it saw.
        lens: Its entry in the spec; None where only poses were read.
        of_model: Was it found with an arm that was identified too? It belongs to that arm.
    """

    camera: str
    parent: str
    T_parent_camera: FloatArray
    std: FloatArray
    in_hand: bool
    base: str = "base_link"
    effector: str = "flange"
    marker: str = "board"
    lens: Mapping[str, Any] | None = None
    of_model: bool = False

    @property
    def wxyz(self) -> FloatArray:
        """(4,) unit quaternion of T_parent_camera, w >= 0."""
        turn = _core.log_so3(self.T_parent_camera[:3, :3])
        angle = float(np.linalg.norm(turn))
        axis = turn / angle if angle > _TURN else np.zeros(3)
        return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


def hand_eyes(spec: RobotSpec) -> list[HandEye]:
    """Every camera of an arm.

    A camera on the flange or a link is given there; one in the room in the frame of the arm's base. Links are named as
    in the URDF where the arm came from one.

    Raises:
        InvalidInput: It has no camera.
    """
    cameras = spec.cameras
    if not cameras:
        raise InvalidInput("there is no camera whose place could be written; expected a cell file with cameras")
    source = spec.source
    base, effector = (str(source.get(key, name)) for key, name in (("base_link", "base_link"), ("tip_link", "flange")))
    out = []
    for name, entry in cameras.items():
        on, part = str(entry["on"]), str(entry["on"]).partition(".")[2]
        T = pose(entry)
        in_hand = on != "world" and part != "base"
        if on == "world":
            T = np.linalg.inv(spec.base.T) @ T
        parent = base if not in_hand else part if part else effector
        board = next(iter(spec.boards), "board")
        std = deviations(entry)
        out.append(HandEye(str(name), parent, T, std, in_hand, base, effector, str(board), entry))
    return out


def deviations(entry: Mapping[str, Any]) -> FloatArray:
    """(6,) of where a camera of a spec was found [m, rad], NaN where the spec has none."""
    found = entry.get("identified") or {}
    parts = [
        to_si(np.array([np.nan if value is None else value for value in found.get(f"std_{unit}") or [None] * 3]), unit)
        for unit in ("mm", "deg")
    ]
    return np.concatenate(parts)
