# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is learnt: residuals of a model in the base's axes, in regions of joint space that are held out as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.evaluation import realigned
from fastcal.correction import Inputs
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.splits import deal
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

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
        residuals: (N, 3) measured less predicted point, base's axes [m].
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
    regions: IntArray
    folds: IntArray
    left_out: IntArray
    gross: int
    any_load: bool = False

    def __len__(self) -> int:
        return len(self.residuals)

    @property
    def fold_count(self) -> int:
        """K."""
        return int(self.folds.max()) + 1

    def training_rows(self) -> list[IntArray]:
        """For each fold, the rows of all others."""
        return [np.flatnonzero(self.folds != fold) for fold in range(self.fold_count)]

    @property
    def size(self) -> float:
        """Root mean square of a residual coordinate [m], never 0."""
        return max(float(np.sqrt(np.mean(self.residuals**2))), 1e-12)


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
    R = bare.T_world_base[:3, :3]
    predicted = bare.poses(data)[:, :3, 3]
    _refuse_other_places(data, predicted)
    residuals = (data.position - predicted) @ R
    whole = ~np.isnan(residuals).any(axis=1)
    length = np.linalg.norm(residuals, axis=1)
    typical = np.median(length[whole]) / _MEDIAN_LENGTH if whole.any() else 0.0
    gross = whole & (length > GROSS * max(typical, 1e-9))
    kept = np.flatnonzero(whole & ~gross)
    if len(kept) < FEWEST_ROWS:
        raise InvalidInput(f"{data.source}: training needs at least {FEWEST_ROWS} rows with a point, got {len(kept)}")
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
        residuals[kept],
        regions,
        dealt[regions],
        np.setdiff1d(np.arange(len(data)), kept),
        int(gross.sum()),
        any_load,
    )


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


def cells(q: FloatArray, rows: int) -> IntArray:
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


def _halves(q: FloatArray, own: IntArray) -> list[IntArray]:
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
    length = np.linalg.norm(errors, axis=1)
    found = {"mean": length.mean(), "rms": np.sqrt((length**2).mean()), "max": length.max()}
    return {name: from_si(float(value), "mm") for name, value in found.items()}
