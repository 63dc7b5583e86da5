# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Two calibrated models of one arm: which parameters differ, and by how much at the tool.

The second model is written in the first one's parameters: those that make the first predict what the second does, over
postures of the joint ranges that both were fitted on, base and tool free. So what the two gauges hold differently,
where the instrument stood and which target was on is no difference. With d = M theta_b - theta_a, M the least squares:
cov d = C_a + M C_b M^T + H H^T, H the plausible changes that these postures do not show.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.error_statistics import ErrorStatistics
from fastcal.calibration.parallel import one_blas_thread
from fastcal.display import late
from fastcal.display.shown import PlottedArm, Shown
from fastcal.errors import InvalidInput
from fastcal.monitoring.common_gauge import (
    bare,
    base_of,
    ends,
    fitted_to,
    identified,
    noise_of,
    postures,
    readable,
    union_of,
)
from fastcal.monitoring.differences import Difference, differences
from fastcal.robot.given import RobotLike, as_robot
from fastcal.robot.robot import Robot
from fastcal.units import factor

OTHER_ARM = 0.05  # of the reach: RMS distance between models of different arms


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(PlottedArm, Shown):
    """What `compare` found.

    Attributes:
        first, second: The models.
        at_tool: Distances [m] between them over the postures, bases and tools aligned.
        q: (N, n) the postures; payload (N,) [kg]; distance (N,) [m]; points (N, 3) of the first model in its base [m],
            apart (N, 3) from them to the second model's [m].
        parameters: Those of the first model and of the second one's further effects, base and tool left out.
        unexplained: RMS distance [m] that no change of the parameters explains.
    """

    first: Robot
    second: Robot
    at_tool: ErrorStatistics
    q: FloatArray
    payload: FloatArray
    distance: FloatArray
    points: FloatArray
    apart: FloatArray
    parameters: list[Difference]
    unexplained: float
    notes: list[str] = field(default_factory=list)

    @property
    def significant(self) -> list[Difference]:
        """The parameters that differ beyond noise."""
        return [d for d in self.parameters if d.significant]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of compare.json."""
        sizes = self.at_tool.to_mm()
        return {
            "at_tool_mm": {name: sizes[name] for name in ("mean", "rms", "max")},
            "parameters": [vars(d) for d in self.parameters],
            "unexplained_mm": self.unexplained / factor("mm"),
            "postures": len(self.q),
            "models": [{"robot": model.name, "made_by": model.made_by} for model in (self.first, self.second)],
            "notes": self.notes,
        }

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes compare.json and report.html into a folder, both or none."""
        late.call("write_comparison", self, folder)


@one_blas_thread()
def compare(first: RobotLike, second: RobotLike, *, threads: int = 1) -> Comparison:
    """Compares two models of one arm; paths are read.

    Raises:
        InvalidInput: They have other joints, another kind of kinematics, or ranges that do not meet.
    """
    a, b = as_robot(first), as_robot(second)
    if a.kinematics != b.kinematics or a.joint_types != b.joint_types:
        raise InvalidInput(
            f"expected two models of one arm, got {a.name} ({a.kinematics}, {a.joint_count} joints) and {b.name} "
            f"({b.kinematics}, {b.joint_count} joints); `fastcal convert` brings kinematics of two kinds together"
        )
    a, b = bare(a), bare(b)
    at = postures(a, b, threads)
    x = at.points(b)
    union = union_of(a, b)
    alone, _ = fitted_to(union, at, x, ends(union), noise_of(a, b))
    apart = (x - at.points(alone)) @ base_of(alone)[:3, :3]
    distance = np.linalg.norm(apart, axis=1)
    statistics = ErrorStatistics.of(distance)
    if statistics is None or statistics.rms > OTHER_ARM * a.reach:
        raise InvalidInput(f"{a.name} and {b.name} differ by more than a twentieth of their reach; expected one arm")
    free = readable(union, at, sorted({*ends(union), *identified(union, a, b)}))
    fitted, change = fitted_to(union, at, x, free, noise_of(a, b))
    left = at.points(fitted) - x
    inside = np.asarray(np.linalg.inv(base_of(a)) @ np.vstack([at.points(a).T, np.ones(len(x))]), dtype=np.float64)
    notes = [] if a.record and b.record else ["a model without covariance has no standard deviations to judge by"]
    return Comparison(
        first=as_robot(first),
        second=as_robot(second),
        at_tool=statistics,
        q=at.q,
        payload=at.payload,
        distance=distance,
        points=inside.T[:, :3],
        apart=apart,
        parameters=differences(union, a, b, change, free, at),
        unexplained=float(np.sqrt(np.mean(np.sum(left**2, axis=1)))),
        notes=notes,
    )
