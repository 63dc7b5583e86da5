# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses that were measured more than once, by the formulas of ISO 9283:1998.

A pose is a commanded posture with its payload, approached from one direction; x_j are its n visits, m their mean, p the
predicted point. AP = |m - p|; l_j = |x_j - m|, RP = mean l + 3 S(l); the turns about each axis: mean, and 3 S. vAP is
the greatest distance between the means of one posture that was approached from several directions. Distances D_j
between the j-th visits of two poses that follow one another: AD = mean D - |p_1 - p_2|, RD = 3 S(D). Drift: how far AP
and RP of later blocks of visits lie from those of the first. S is always the deviation with n - 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import rotations
from fastcal.units import from_si

GroupArray = NDArray[np.intp]

ENOUGH_VISITS = 5  # RP from fewer says little: from two visits it is a third of what thirty give
ISO_VISITS = 30  # the standard's plan: five poses, thirty visits each, always from the same direction
ISO_POSES = 5
_PAUSE = 10.0  # median intervals: after a longer one a new block of visits begins


@dataclass(frozen=True, eq=False)
class Repeatability:
    """What the poses with at least two visits from one direction show; [m] and [rad].

    Attributes:
        poses: Their number, each direction of approach counted.
        visits: Rows that belong to them.
        accuracy: (poses,) AP.
        sigma: Pure noise of one coordinate, pooled over the poses.
        rp_visits: The fewest visits that one of the figures below rests on; 0: no pose has ENOUGH_VISITS.
        repeatability: (k,) RP of the poses with ENOUGH_VISITS.
        turn_accuracy, turn_repeatability: (k, 3) mean of the turn from the predicted to the measured orientation about
            the tool's axes, and 3 S of it; None where no orientation was measured.
        direction_variation: (postures,) vAP; empty where no posture was approached from several directions.
        distance_accuracy, distance_repeatability: (k - 1,) AD and RD of poses that follow one another.
        accuracy_drift, repeatability_drift: (drifting,) dAP, dRP; empty without times and pauses.
    """

    poses: int
    visits: int
    accuracy: FloatArray
    sigma: float
    rp_visits: int
    repeatability: FloatArray
    turn_accuracy: FloatArray | None
    turn_repeatability: FloatArray | None
    direction_variation: FloatArray
    distance_accuracy: FloatArray
    distance_repeatability: FloatArray
    accuracy_drift: FloatArray
    repeatability_drift: FloatArray

    @property
    def is_iso_9283(self) -> bool:
        """Is the standard's plan met: ISO_POSES poses with ISO_VISITS visits each?"""
        return self.rp_visits >= ISO_VISITS and len(self.repeatability) >= ISO_POSES

    @property
    def note(self) -> str | None:
        """What the figures lack; None where the standard's plan is met."""
        if self.is_iso_9283:
            return None
        if self.rp_visits == 0:
            return f"too few visits for RP: it needs at least {ENOUGH_VISITS} of one pose from one direction"
        return (
            f"not ISO 9283, whose plan needs {ISO_POSES} poses with {ISO_VISITS} visits each: there are "
            f"{len(self.repeatability)}, with at least {self.rp_visits} visits each"
        )

    def to_json_dict(self) -> dict[str, Any]:
        """The block `repeated_poses` of result.json; a figure that nothing shows is left out."""
        out: dict[str, Any] = {
            "poses": self.poses,
            "visits": self.visits,
            "rp_visits": self.rp_visits,
            "iso_9283": self.is_iso_9283,
            "sigma_mm": from_si(self.sigma, "mm"),
            "accuracy_mm": _range(self.accuracy, "mm"),
            "repeatability_mm": _range(self.repeatability, "mm"),
            "vap_mm": _range(self.direction_variation, "mm"),
            "ad_mm": _range(np.abs(self.distance_accuracy), "mm"),
            "rd_mm": _range(self.distance_repeatability, "mm"),
            "drift_ap_mm": _range(self.accuracy_drift, "mm"),
            "drift_rp_mm": _range(self.repeatability_drift, "mm"),
            "note": self.note,
        }
        if self.turn_accuracy is not None and self.turn_repeatability is not None:
            out["accuracy_deg"] = _range(np.abs(self.turn_accuracy).max(axis=1), "deg")
            out["repeatability_deg"] = _range(self.turn_repeatability.max(axis=1), "deg")
        return {key: value for key, value in out.items() if value is not None}


def _range(values: FloatArray, unit: str) -> dict[str, float] | None:
    if len(values) == 0:
        return None
    return {"mean": from_si(float(np.mean(values)), unit), "max": from_si(float(np.max(values)), unit)}


def pose_groups(data: Dataset) -> GroupArray:
    """(N,) 0 ... poses - 1: rows with the same commanded joints and payload have the same number."""
    return _as_commanded(np.column_stack([data.q, data.payload]))


def posture_groups(data: Dataset) -> GroupArray:
    """(N,) the same with any payload: what a model lacks of a posture is alike in all rows of it."""
    return _as_commanded(data.q)


def _as_commanded(values: NDArray[np.float64]) -> GroupArray:
    # 1e-6 rad or m: commands are rounded in files, and nobody commands two poses that close
    return numbered(np.round(values / 1e-6).astype(np.int64))


def place_groups(values: NDArray[np.float64], bins: int) -> GroupArray:
    """(N,) group of each row: those whose `values` (N, k) all lie in the same one of `bins` parts of their range."""
    low, span = values.min(axis=0), np.ptp(values, axis=0)
    part = np.floor((values - low) / np.where(span > 0, span, 1.0) * bins)
    return np.unique(np.minimum(part, bins - 1), axis=0, return_inverse=True)[1].ravel()


def visit_groups(data: Dataset) -> GroupArray:
    """(N,) the same for rows that were also approached from the same direction in the same set-up."""
    keys = [pose_groups(data)]
    if data.approach is None and data.station is None and data.mount is None:
        return keys[0]
    if data.approach is not None:
        keys.append(numbered(data.approach.astype(np.int64)))
    keys += [labels.astype(np.intp) for labels in (data.station, data.mount) if labels is not None]
    return numbered(np.column_stack(keys))


def numbered(keys: NDArray[np.int64]) -> GroupArray:
    """(N,) which of the distinct rows of keys (N, k) each is, in ascending order.

    One column after the other splits the groups of those before it; mostly the first two set all rows apart, and
    `np.unique` of whole rows takes ten times as long.
    """
    group = np.zeros(len(keys), dtype=np.int64)
    count = min(len(keys), 1)
    for column in keys.T:
        if count == len(keys):
            break
        parts, place = np.unique(column, return_inverse=True)  # by rank: the product below stays under N^2
        if count > 1:
            parts, place = np.unique(group * len(keys) + place, return_inverse=True)
        group, count = place, len(parts)
    return group


def repeated_rows(group: GroupArray, rows: GroupArray) -> list[GroupArray]:
    """Those of some rows, ascending, that share their group with another, by group; first what is met first."""
    rows = rows[np.bincount(group[rows])[group[rows]] > 1]
    if not len(rows):
        return []
    order = np.argsort(group[rows], kind="stable")
    ends = np.flatnonzero(np.diff(group[rows][order])) + 1
    parts = [part for part in np.split(rows[order], ends) if len(part)]
    return sorted(parts, key=lambda part: int(part[0]))


def accuracy(error: FloatArray) -> float:
    """AP [m] of visits with errors (n, 3), predicted less measured."""
    return float(np.linalg.norm(error.mean(axis=0)))


def spread(error: FloatArray) -> float:
    """RP [m] of visits with errors (n, 3)."""
    lengths = np.linalg.norm(error - error.mean(axis=0), axis=1)
    return float(lengths.mean() + 3 * lengths.std(ddof=1))


def repeatability(
    data: Dataset, error: FloatArray, predicted_rotation: FloatArray | None = None
) -> Repeatability | None:
    """The figures of poses that repeat; None where none does.

    Args:
        data: What was measured.
        error: (N, 3) predicted less measured point [m], NaN where not measured.
        predicted_rotation: (N, 3, 3) of the tool; None where no orientation was measured.
    """
    whole = np.flatnonzero(~np.isnan(error).any(axis=1))
    groups = repeated_rows(visit_groups(data), whole)
    if not groups:
        return None
    squares = sum(float(((error[rows] - error[rows].mean(axis=0)) ** 2).sum()) for rows in groups)
    freedom = sum(3 * (len(rows) - 1) for rows in groups)
    enough = [rows for rows in groups if len(rows) >= ENOUGH_VISITS]
    turns = None if predicted_rotation is None or not enough else _turns(data, predicted_rotation, enough)
    distances = [_distance(data, error, a, b) for a, b in pairwise(enough)]
    drifts = [found for rows in enough if (found := _drift(data, error, rows)) is not None]
    return Repeatability(
        poses=len(groups),
        visits=sum(len(rows) for rows in groups),
        accuracy=np.array([accuracy(error[rows]) for rows in groups]),
        sigma=float(np.sqrt(squares / freedom)),
        rp_visits=min((len(rows) for rows in enough), default=0),
        repeatability=np.array([spread(error[rows]) for rows in enough]),
        turn_accuracy=None if turns is None else turns[:, 0],
        turn_repeatability=None if turns is None else turns[:, 1],
        direction_variation=_variation(data, error, enough),
        distance_accuracy=np.array([d[0] for d in distances]),
        distance_repeatability=np.array([d[1] for d in distances]),
        accuracy_drift=np.array([d[0] for d in drifts]),
        repeatability_drift=np.array([d[1] for d in drifts]),
    )


def turns_between(predicted: FloatArray, measured: FloatArray) -> FloatArray:
    """(n, 3) turns from predicted rotations (n, 3, 3) to measured ones (n, 3, 3), about the predicted axes [rad]."""
    return np.array([_core.log_so3(np.ascontiguousarray(P.T @ R)) for P, R in zip(predicted, measured, strict=True)])


def _turns(data: Dataset, predicted: FloatArray, groups: list[GroupArray]) -> FloatArray | None:
    """(k, 2, 3) mean and 3 S of the turns about the tool's axes [rad]; None where some visit has no orientation."""
    if data.rotation is None or any(np.isnan(data.rotation[rows]).any() for rows in groups):
        return None
    out = []
    for rows in groups:
        turn = turns_between(predicted[rows], rotations(data.rotation[rows]))
        out.append([turn.mean(axis=0), 3 * turn.std(axis=0, ddof=1)])
    return np.array(out)


def _variation(data: Dataset, error: FloatArray, groups: list[GroupArray]) -> FloatArray:
    """VAP of the postures that several groups belong to."""
    posture = pose_groups(data)
    means: dict[int, list[FloatArray]] = {}
    for rows in groups:
        means.setdefault(int(posture[rows[0]]), []).append(error[rows].mean(axis=0))
    apart = [np.array(m) for m in means.values() if len(m) > 1]
    return np.array([float(np.linalg.norm(m[:, None] - m[None], axis=2).max()) for m in apart])


def _distance(data: Dataset, error: FloatArray, a: GroupArray, b: GroupArray) -> tuple[float, float]:
    """AD and RD [m] of two poses by their first visits, as many as both have."""
    count = min(len(a), len(b))
    a, b = a[:count], b[:count]
    between = np.asarray(data.position)[a] - np.asarray(data.position)[b]
    return distance_figures(between, (between + error[a] - error[b]).mean(axis=0))


def distance_figures(between: FloatArray, commanded: FloatArray) -> tuple[float, float]:
    """AD and RD [m] of the j-th visits of two poses, apart by `between` (n, 3), commanded apart by (3,)."""
    D = np.linalg.norm(between, axis=1)
    return float(D.mean() - np.linalg.norm(commanded)), float(3 * D.std(ddof=1))


def blocks_of_visits(time: FloatArray | None, rows: GroupArray) -> list[GroupArray]:
    """The rows of a pose, split where much time (N,) passed; blocks with ENOUGH_VISITS; none without times."""
    if time is None:
        return []
    rows = rows[np.argsort(time[rows], kind="stable")]
    gaps = np.diff(np.sort(time))
    pause = _PAUSE * float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else np.inf
    blocks = np.split(rows, np.flatnonzero(np.diff(time[rows]) > pause) + 1)
    return [block for block in blocks if len(block) >= ENOUGH_VISITS]


def _drift(data: Dataset, error: FloatArray, rows: GroupArray) -> tuple[float, float] | None:
    """DAP and dRP [m] over blocks of visits between which time passed; None where there is one block."""
    blocks = blocks_of_visits(data.time, rows)
    if len(blocks) < 2:
        return None
    ap = np.array([accuracy(error[block]) for block in blocks])
    rp = np.array([spread(error[block]) for block in blocks])
    return float(np.abs(ap - ap[0]).max()), float(np.abs(rp - rp[0]).max())
