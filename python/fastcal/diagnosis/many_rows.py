# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Large data sets: the search uses a sample of the rows, and the result is fitted to all.

A search fits dozens of sets; its cost grows with the rows, its information hardly does. It uses stretches of
consecutive rows, so that noise with a memory and approaches stay what they are, spread evenly over the order of
measuring, and at the rows in which a joint or a condition has its least and largest value, so that curves have the same
ranges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import special

from fastcal.arrays import IndexArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.pose_folds import measuring_place
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.noise import left_out
from fastcal.diagnosis.problem import Problem
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

# Measured numbers that names are searched for in, 6,000 rows of positions or 3,000 of poses; where there are more, what
# was found is fitted to all of them. An effect of which these show nothing (SNR 6) moves the tool by less than a
# twentieth of the noise. A limit of memory: columns of all that an arm of six joints may lack take 180 MB.
SEARCHED_NUMBERS = 18000
_STRETCH = 20  # rows
MOST_OF_PICTURES = 24  # numbers of a row that stand for its corners: six a picture


def searched_rows(data: Dataset, robot: Robot) -> IndexArray | None:
    """Measured rows that names are searched for in, about SEARCHED_NUMBERS of numbers; None: in all of them."""
    rows = np.flatnonzero(data.measured)
    numbers = [min(len(of.components), MOST_OF_PICTURES) for of in measurements(data, robot).observations]
    most = SEARCHED_NUMBERS // sum(numbers)
    if len(rows) <= most:
        return None
    order = rows[np.argsort(measuring_place(data)[rows], kind="stable")]
    first = np.linspace(0, len(order) - _STRETCH, most // _STRETCH).round().astype(np.intp)
    chosen = order[(first[:, np.newaxis] + np.arange(_STRETCH)).ravel()]
    return np.unique(np.concatenate([chosen, rows[_extremes(data.select(rows))]]))


def _extremes(data: Dataset) -> IndexArray:
    """Rows with the least and largest value of each column, and the first row of each label."""
    numbers = [data.q, data.payload, data.time, data.temperature, data.position, data.move, *data.sensors.values()]
    columns = np.column_stack([column for column in numbers if column is not None])
    labels = [data.station, data.mount, data.anchor, *map(np.array, data.observed_labels.values())]
    each = [np.unique(label, return_index=True)[1] for label in labels if label is not None]
    known = np.isfinite(columns)
    least = np.where(known, columns, np.inf).argmin(axis=0)
    largest = np.where(known, columns, -np.inf).argmax(axis=0)
    return np.concatenate([least, largest, *each]).astype(np.intp)


def on_all_rows(at: Fit, data: Dataset) -> Problem:
    """The problem of a fit to some rows of `data`, of all of them but for those that it can't reach.

    A row is out of reach where its square, in units of what the fit leaves of a typical one, is larger than noise makes
    one row of all in a hundred such sets. The few parameters that so many rows determine take nothing of it.
    """
    every = replace(at.problem, data=data, used=data.measured, known={})
    model, samples = every.model(at.entries, every.kept)
    near = every.linearized(model, samples, at.theta)
    row = near.row
    count = np.bincount(row, minlength=len(every.rows))
    square = np.bincount(row, near.r**2, len(every.rows)) / every.noise.factor**2
    held = count > 0
    typical = max(1.0, float(np.median(square[held] / special.chdtri(count[held], 0.5))))
    limit = typical * special.chdtri(np.maximum(count, 1), rules.ALPHA_OUTLIER / len(every.rows))
    wrong = np.flatnonzero(held & (square > limit))
    gross = wrong[square[wrong] > rules.GROSS_SIZE**2 * typical * count[wrong]]
    if len(wrong) > rules.MAX_OUTLIER_SHARE * len(every.rows):
        return every  # no outliers but an effect
    used = every.used.copy()
    used[every.rows[left_out(wrong, gross, every.kept)]] = False
    return replace(every, used=used)


def all_moved(moved: Sequence[int], data: Dataset, rows: IndexArray | None) -> list[int]:
    """Measured rows of `data` from the first to the last of those that moved, which are of the searched `rows`."""
    if not moved:
        return []
    place = measuring_place(data)
    own = place[np.array(moved) if rows is None else rows[np.array(moved)]]
    return [int(i) for i in np.flatnonzero(data.measured & (place >= own.min()) & (place <= own.max()))]
