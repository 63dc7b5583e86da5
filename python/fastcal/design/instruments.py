# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is measured in a pose: the tool's point, levels on links, touches of planes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.design.candidates import Candidates, joined
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.robot.robot import Robot
from fastcal.units import to_si

SIGMA_TILT = to_si(0.1, "mrad")


@dataclass(frozen=True)
class Instruments:
    """What is measured in a pose.

    Attributes:
        points: Whether the tool's point is measured (and its orientation, where its standard deviation is given).
        levels: Links that carry a level or an accelerometer, such as "link3"; both its tilts are read in every pose.
        sigma_tilt: Standard deviation of a tilt [rad].
        planes: Surfaces that the tool may touch: label to a point on the surface and its normal in the measuring frame
            [m]. A touch replaces the measured point. Where the surface lies needs to be known only roughly: its three
            parameters are identified.
    """

    points: bool = True
    levels: Sequence[str] = ()
    sigma_tilt: float = SIGMA_TILT
    planes: Mapping[str, tuple[Sequence[float], Sequence[float]]] = field(default_factory=dict)

    @property
    def only_points(self) -> bool:
        """Whether nothing but points (and orientations) is measured."""
        return self.points and not self.levels and not self.planes

    def check(self, robot: Robot) -> None:
        """Raises InvalidInput where nothing would be measured, or where something does not fit the robot."""
        links = [f"link{i + 1}" for i in range(robot.joint_count)]
        for link in self.levels:
            if link not in links:
                raise InvalidInput(f"levels must be on {links[0]} to {links[-1]}, got '{link}'")
        if len(set(self.levels)) < len(self.levels):
            raise InvalidInput(f"levels must name each link once, got {', '.join(self.levels)}")
        if not (np.isfinite(self.sigma_tilt) and self.sigma_tilt > 0):
            raise InvalidInput(f"sigma_tilt must be above 0, got {self.sigma_tilt}")
        if not (self.points or self.levels or self.planes):
            raise InvalidInput("a design without points needs levels or planes")
        for label, (point, normal) in self.planes.items():
            vectors = np.asarray(point, dtype=float), np.asarray(normal, dtype=float)
            if any(v.shape != (3,) or not np.isfinite(v).all() for v in vectors) or not vectors[1].any():
                raise InvalidInput(f"plane {label} must be a point and a normal of three finite numbers each")

    @property
    def plane_values(self) -> dict[str, FloatArray]:
        """The parameters of each plane as its observation has them: "plane LABEL" to (rx, ry, offset)."""
        out = {}
        for label, (point, normal) in self.planes.items():
            n = _unit(normal)
            n = -n if n[2] < 0 else n
            across = float(np.hypot(n[0], n[1]))
            by = float(np.arctan2(across, n[2])) / across if across > 0 else 0.0
            out[f"plane {label}"] = np.array([-by * n[1], by * n[0], float(n @ np.asarray(point, dtype=float))])
        return out


def touches(robot: Robot, poses: Candidates, instruments: Instruments, threads: int = 1) -> Candidates:
    """The poses and, for each plane, those that reach it when the tool is moved along its normal.

    The poses themselves are left out where they would measure nothing.
    """
    bare = robot.with_(effects=[])
    T = bare.forward(poses.q, threads=threads)
    parts = [replace(poses, plane=np.full(len(poses), "", dtype=object))]
    for label, (point, normal) in instruments.planes.items():
        n = _unit(normal)
        there = T.copy()
        there[:, :3, 3] -= ((T[:, :3, 3] - np.asarray(point, dtype=float)) @ n)[:, np.newaxis] * n
        found = inverse_kinematics(bare, there, poses.q, restarts=0, threads=threads)
        rows = np.flatnonzero(found.status == "reached")
        parts.append(replace(poses.select(rows), q=found.q[rows], plane=np.full(len(rows), label, dtype=object)))
    return joined(parts if instruments.points or instruments.levels else parts[1:])


def _unit(vector: Sequence[float]) -> FloatArray:
    v = np.asarray(vector, dtype=float)
    return np.asarray(v / np.linalg.norm(v))
