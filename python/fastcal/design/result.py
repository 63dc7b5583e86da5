# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The poses that a design chose, in the order of visiting, and what a calibration with them would determine."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.design.candidates import Candidates, joint_ranges
from fastcal.design.separation import Separation
from fastcal.display.shown import Shown
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot


@dataclass(frozen=True, eq=False, repr=False)
class PoseDesign(Shown):
    """What `design_poses` chose, SI; rows are in the order of visiting.

    Attributes:
        q: (N, n) joint positions [rad or m].
        payload: (N,) [kg].
        approach: (N, n) +1 or -1: the direction in which each joint is to arrive; where no effect asks for one, that of
            the direct way from the pose before.
        criterion: What was optimized.
        observability: O1 to O5 of the poses alone; columns whitened and scaled by plausible sizes.
        sigma: Predicted standard deviation of a coordinate at the targets, root of the mean square [m].
        efficiency: The criterion reaches surely this share of what any choice of as many candidates could; None where
            no bound is known.
        parameters: Names of the parameters identifiable from the poses.
        deviations: (P,) their predicted standard deviations, SI.
        unidentifiable: What no pose determines, in words.
        separation: What the poses that separate effects gain; indices are those of the candidates. None: not asked.
        enough: Was `until_sigma` reached? True where it was not asked for.
        candidate_count: Candidates that could be measured.
        rejected: Why how many others could not.
        notes: What a reader should know, a sentence each.
        plane: The plane that the tool touches in each pose, "" where it touches none; None: no planes were given.
        joint_types: `revolute` or `prismatic`, one a joint.
    """

    q: FloatArray
    payload: FloatArray
    approach: FloatArray
    criterion: str
    observability: dict[str, float]
    sigma: float
    efficiency: float | None
    parameters: list[str]
    deviations: FloatArray
    unidentifiable: list[str]
    candidate_count: int
    rejected: dict[str, int]
    enough: bool = True
    separation: Separation | None = None
    notes: list[str] = field(default_factory=list)
    plane: list[str] | None = None
    joint_types: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.q)

    def dataset(self) -> Dataset:
        """The poses as `simulate` and `predict` take them."""
        labels: dict[str, Any] = {} if self.plane is None else {"observed_labels": {"plane": self.plane}}
        return Dataset.from_arrays(self.q, payload=self.payload, approach=self.approach, source="design", **labels)


def in_order(robot: Robot, chosen: Candidates) -> Candidates:
    """The poses in an order with a short way: payload after payload, each from pose to near pose.

    Joints count by their range, as if each took the same time for it. The way begins in the middle of all ranges.
    Directions of approach that no effect asked for become those of the way.
    """
    ranges = joint_ranges(robot)
    width = np.maximum(ranges[:, 1] - ranges[:, 0], 1e-9)
    scaled = np.ascontiguousarray((chosen.q - ranges[:, 0]) / width)
    at = np.full(len(width), 0.5)
    rows: list[int] = []
    for payload in np.unique(chosen.payload):
        group = np.flatnonzero(chosen.payload == payload)
        order = group[_core.visiting_order(np.ascontiguousarray(scaled[group]), at)]
        rows += order.tolist()
        at = scaled[order[-1]]
    ordered = chosen.select(rows)
    direct = _directions(np.vstack([ranges.mean(axis=1), ordered.q]))
    approach = direct if ordered.approach is None else np.where(ordered.approach == 0, direct, ordered.approach)
    return Candidates(ordered.q, ordered.payload, approach, ordered.plane)


def _directions(q: FloatArray) -> FloatArray:
    """(N, n) signs in which the joints last moved on the way q (N + 1, n); +1 where one has not moved yet."""
    signs = np.sign(np.diff(q, axis=0))
    for row in range(len(signs)):
        before = signs[row - 1] if row else np.ones(q.shape[1])
        signs[row] = np.where(signs[row] == 0, before, signs[row])
    return np.asarray(signs)
