# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is learnt: residuals of a model in the base's axes, in regions of joint space that are held out as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.evaluation import ALIGNED_BETTER, realigned
from fastcal.correction import Inputs
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import nearest_rotation, rotations
from fastcal.measurements.splits import deal
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import turns_from
from fastcal.units import from_si

FEWEST_ROWS = 30
REGION_ROWS = 20
GROSS = 8.0  # times the median length, in deviations of a normal error: such rows are no residual to be learnt
_MEDIAN_LENGTH = 1.5382  # median length of a standard normal vector in three dimensions


@dataclass(frozen=True, eq=False)
class Problem:
    """N rows to learn from.

    Attributes:
        robot: The model without a correction.
        data: The rows, all with a whole point.
        inputs: What a residual model may look at.
        residuals: (N, k) measured less predicted, base's axes: points [m], k = 3; where orientations were measured the
            turns too [rad], k = 6, 0 in rows without one.
        measured: (N, k) is the number measured?
        regions: (N,) number of the cell of joint space.
        folds: (N,) number of the fold; a region is in one fold.
        left_out: Rows of the data that was given which are not here: no whole point, or gross ones.
        gross: How many of them are gross.
        any_load: The load is not among the inputs.
    """

    robot: Robot
    data: Dataset
    inputs: Inputs
    residuals: FloatArray
    measured: NDArray[np.bool_]
    regions: IndexArray
    folds: IndexArray
    left_out: IndexArray
    gross: int
    any_load: bool = False

    def __len__(self) -> int:
        return len(self.residuals)

    @property
    def fold_count(self) -> int:
        """K."""
        return int(self.folds.max()) + 1

    def training_rows(self) -> list[IndexArray]:
        """For each fold, the rows of all others."""
        return [np.flatnonzero(self.folds != fold) for fold in range(self.fold_count)]

    @property
    def size(self) -> float:
        """Root mean square of a residual coordinate [m], never 0."""
        return max(float(np.sqrt(np.mean(self.residuals[:, :3] ** 2))), 1e-12)

    @property
    def has_turns(self) -> bool:
        """Were orientations measured?"""
        return bool(self.residuals.shape[1] == 6)

    @property
    def turn_size(self) -> float:
        """Root mean square of a turn about an axis [rad], never 0 where orientations were measured; else 0."""
        if not self.has_turns:
            return 0.0
        return max(float(np.sqrt(np.mean(self.residuals[:, 3:][self.measured[:, 3:]] ** 2))), 1e-12)

    @property
    def axes(self) -> tuple[int, ...]:
        """The columns of the residuals."""
        return tuple(range(self.residuals.shape[1]))

    @property
    def units(self) -> FloatArray:
        """(k,) the sizes, one a column of the residuals."""
        return np.repeat([self.size, self.turn_size], 3)[: self.residuals.shape[1]]

    @property
    def wanted(self) -> FloatArray:
        """(N, k) the residuals in units: a turn counts as much as a displacement."""
        return self.residuals / self.units

    @property
    def J(self) -> FloatArray:
        """(N, k, n) `wanted` by the joints' errors in `size` a metre; 0 where nothing was measured."""
        J = self.inputs.J_tool_q[:, : self.residuals.shape[1]] * (self.size / self.units)[:, np.newaxis]
        return np.asarray(J * self.measured[:, :, np.newaxis])

    def left(self, twist: FloatArray, rows: IndexArray) -> FloatArray:
        """(M, k) of the residuals of M rows after a twist (M, 6) [m; rad]; 0 where not measured."""
        count = self.residuals.shape[1]
        return np.where(self.measured[rows], self.residuals[rows] - twist[:, :count], 0.0)

    def lengths(self, errors: FloatArray) -> FloatArray:
        """(N,) [m] of errors (N, k): of points, or of points and turns, each in its unit."""
        return np.asarray(self.size * np.linalg.norm(errors / self.units, axis=1))


def problem_of(
    robot: Robot,
    data: Dataset,
    *,
    folds: int = 5,
    region_rows: int = REGION_ROWS,
    any_load: bool = False,
    seed: int = 0,
) -> Problem:
    """The residuals of a model on measured rows; a correction that it already has is left aside.

    Raises:
        InvalidInput: No point was measured, or in fewer than 30 rows, or the rows are too few regions for the folds.
    """
    if folds < 2:
        raise InvalidInput(f"expected at least 2 folds, got {folds}")
    bare = robot.with_(correction=None)
    if data.position is None:
        raise InvalidInput(f"{data.source}: training needs measured points, x_mm y_mm z_mm")
    T = bare.poses(data)
    _refuse_other_places(data, T[:, :3, 3])
    _refuse_other_tools(data, T)
    residuals = residuals_of(bare, data, T)
    whole = ~np.isnan(residuals[:, :3]).any(axis=1)
    gross = whole & (_is_gross(residuals[:, :3]) | _is_gross(residuals[:, 3:]))
    kept = np.flatnonzero(whole & ~gross)
    if len(kept) < FEWEST_ROWS:
        raise InvalidInput(f"{data.source}: training needs at least {FEWEST_ROWS} rows with a point, got {len(kept)}")
    if np.isfinite(residuals[kept, 3:]).all(axis=1).sum() < FEWEST_ROWS:
        residuals = residuals[:, :3]
    rows = data.select(kept)
    inputs = bare.inputs(rows.q, rows.payload)
    regions = cells(rows.q, region_rows)
    count = int(regions.max()) + 1
    if count < folds:
        raise InvalidInput(f"{data.source}: {len(kept)} rows are {count} regions, too few for {folds} folds")
    dealt = deal(count, folds, np.random.default_rng((seed, 0)))
    return Problem(
        bare,
        rows,
        inputs.without_load() if any_load else inputs,
        np.nan_to_num(residuals[kept]),
        ~np.isnan(residuals[kept]),
        regions,
        dealt[regions],
        np.setdiff1d(np.arange(len(data)), kept),
        int(gross.sum()),
        any_load,
    )


def residuals_of(robot: Robot, data: Dataset, T: FloatArray) -> FloatArray:
    """(N, k) measured less predicted T (N, 4, 4), base's axes, NaN where not measured.

    k = 3: points [m]; k = 6, where orientations were measured: the turns too [rad].
    """
    R = robot.T_world_base[:3, :3]
    points = (np.asarray(data.position) - T[:, :3, 3]) @ R
    if data.rotation is None or np.isnan(data.rotation).any(axis=1).all():
        return np.asarray(points)
    return np.hstack([points, turns_from(T[:, :3, :3], rotations(data.rotation)) @ R])


def _refuse_other_tools(data: Dataset, T: FloatArray) -> None:
    """Refuses orientations of a tool that is mounted as a model that predicts T (N, 4, 4) does not know.

    Raises:
        InvalidInput: One turn of the tool makes them fit several times better.
    """
    if data.rotation is None or not (seen := np.isfinite(data.rotation).all(axis=1)).any():
        return
    predicted, measured = T[seen, :3, :3], rotations(data.rotation[seen])
    turned = nearest_rotation(np.einsum("nji,njk->ik", predicted, measured))
    before, after = turns_from(predicted, measured), turns_from(predicted @ turned, measured)
    if np.sum(before**2) > ALIGNED_BETTER**2 * np.sum(after**2):
        by = from_si(float(np.linalg.norm(turns_from(np.eye(3)[np.newaxis], turned[np.newaxis]))), "deg")
        raise InvalidInput(
            f"{data.source}: its orientations fit the model with the tool turned by {by:.2f} deg: calibrate on these "
            "files first, which finds how it is mounted, and train that model"
        )


def _is_gross(residuals: FloatArray) -> NDArray[np.bool_]:
    """(N,) is the vector of residuals (N, 3) too long to be one? False where not measured."""
    length = np.linalg.norm(residuals, axis=1)
    if not residuals.shape[1] or np.isnan(length).all():
        return np.zeros(len(residuals), dtype=bool)
    return np.asarray(length > GROSS * max(float(np.nanmedian(length)) / _MEDIAN_LENGTH, 1e-9))


def _refuse_other_places(data: Dataset, predicted: FloatArray) -> None:
    """Refuses points (N, 3) [m] of a tracker that stood where the model knows nothing of: a network would learn that.

    Raises:
        InvalidInput: A rigid motion makes those of one station fit the predicted ones several times better.
    """
    station = np.zeros(len(data), dtype=int) if data.station is None else data.station
    for k in np.unique(station):
        own = station == k
        found = realigned(predicted[own], predicted[own] - np.asarray(data.position)[own])
        if found is not None:
            name = f"the rows of station {data.station_names[k]}" if data.station_names else "its rows"
            away = from_si(float(np.linalg.norm(found.motion[:3, 3])), "mm")
            raise InvalidInput(
                f"{data.source}: {name} fit the model with the tracker moved by {away:.1f} mm: calibrate on these "
                "files first, which finds where it stood, and train that model"
            )


def cells(q: FloatArray, rows: int) -> IndexArray:
    """(N,) cells of joint space of about `rows` rows: halved at the median of the widest joint until small enough.

    Rows with the same q are in one cell.
    """
    out = np.zeros(len(q), dtype=np.intp)
    waiting, found = [np.arange(len(q))], 0
    while waiting:
        own = waiting.pop()
        parts = _halves(q, own) if len(own) > rows * 4 / 3 else []
        if parts:
            waiting += parts
        else:
            out[own] = found
            found += 1
    return out


def _halves(q: FloatArray, own: IndexArray) -> list[IndexArray]:
    """The rows below and above the median of the joint with the greatest deviation that can be halved; else none."""
    for joint in np.argsort(-q[own].std(axis=0), kind="stable"):
        values = q[own, joint]
        below = values < np.median(values)
        if not below.any():
            below = values <= np.median(values)
        if below.any() and not below.all():
            return [own[below], own[~below]]
    return []


def lengths_mm(errors: FloatArray) -> dict[str, float]:
    """mean, rms and max of the lengths of errors (N, 3) [m], in mm."""
    return _statistics(errors, "mm")


def turns_deg(turns: FloatArray) -> dict[str, float]:
    """mean, rms and max of the angles of rotation vectors (N, 3) [rad], in degrees."""
    return _statistics(turns, "deg")


def _statistics(vectors: FloatArray, unit: str) -> dict[str, float]:
    length = np.linalg.norm(vectors, axis=1)
    found = {"mean": length.mean(), "rms": np.sqrt((length**2).mean()), "max": length.max()}
    return {name: from_si(float(value), unit) for name, value in found.items()}
