# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where an arm is measured: what it must not touch, where its tool may be, and what the tracker sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]
Point = Sequence[float]
Corners = tuple[Point, Point]

REASONS = {
    1: "meet a keep-out box",
    2: "leave the region",
    3: "are out of the tracker's range",
    4: "turn the reflector away",
    5: "are hidden from the tracker",
}
UNSEEN = (3, 4, 5)  # the reasons that concern the tracker alone


@dataclass(frozen=True)
class Tracker:
    """An instrument that looks at a reflector on the tool; SI, measuring frame.

    Attributes:
        position: (3,) [m].
        nearest: Least distance that it measures [m].
        farthest: Largest distance [m].
        reflector: (3,) where the reflector looks, in the tool's axes; None: it is turned by hand, or sees all around.
        acceptance: Largest angle between that and the beam [rad].
    """

    position: Point
    nearest: float = 0.0
    farthest: float = float("inf")
    reflector: Point | None = None
    acceptance: float = float(np.pi / 6)


@dataclass(frozen=True)
class Surroundings:
    """Where an arm may be measured; points in the measuring frame [m].

    Attributes:
        keep_out: Boxes, lower and higher corner, that links from the second joint on must not meet, nor the beam.
        region: The box in which the tool's point must lie.
        tracker: What must see the target; None: nothing is asked.
        link_radius: How thick the straight links between the joints are [m]; keep-out boxes grow by it.
    """

    keep_out: Sequence[Corners] = ()
    region: Corners | None = None
    tracker: Tracker | None = None
    link_radius: float = 0.0

    def obstacles(self, robot: Robot, q: FloatArray, *, threads: int = 1) -> NDArray[np.int64]:
        """(N,) 0 where a posture of q (N, n) can be measured, else a key of REASONS: the first that holds."""
        tracker = None
        if self.tracker is not None:
            seen = self.tracker
            reflector = np.zeros(3) if seen.reflector is None else _point(seen.reflector)
            tracker = _core.Tracker(_point(seen.position), seen.nearest, seen.farthest, reflector, seen.acceptance)
        return np.asarray(
            _core.posture_obstacles(
                robot.core,
                q,
                keep_out=[(_point(low), _point(high)) for low, high in self.keep_out],
                region=None if self.region is None else (_point(self.region[0]), _point(self.region[1])),
                tracker=tracker,
                link_radius=self.link_radius,
                threads=threads,
            ),
            dtype=np.int64,
        )


def _point(values: Point) -> FloatArray:
    return np.asarray(values, dtype=np.float64)
