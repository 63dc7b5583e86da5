# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibration on rows in files: checks on a sample of rows, statistics over all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.data_notes import covered
from fastcal.calibration.error_statistics import ErrorSums
from fastcal.calibration.evaluation import Evaluation, compared
from fastcal.calibration.kind_errors import judged_on, whole_sizes
from fastcal.calibration.some_rows import SHOWN_ROWS, some_rows
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.robot import Robot


def shown(data: LongDataset) -> tuple[Dataset, NDArray[np.intp] | None]:
    """Some rows that stand for all of them, and which they are; None where they are all."""
    if len(data) <= SHOWN_ROWS:
        return data.read(0, len(data)), None
    rows = some_rows(len(data), SHOWN_ROWS)
    return data.pick(rows), rows


def judged_on_all(
    some: Evaluation,
    rows: NDArray[np.intp],
    data: LongDataset,
    model: Robot,
    *,
    before: Robot | None,
    unknowns: Mapping[str, FloatArray],
    unknowns_before: Mapping[str, FloatArray],
    threads: int = 1,
) -> Evaluation:
    """An evaluation of some rows with the statistics of all of them; arguments as `evaluate`."""
    first, last = dict[str, ErrorSums](), dict[str, ErrorSums]()
    for part in data.parts(moves=bool(model.effects)):
        points = replace(part, rotation=None, rotation_angles=None)  # turns are told of the rows that are shown
        for sums, robot, known in ((first, before, unknowns_before), (last, model, unknowns)):
            if robot is None:
                continue
            for kind, numbers in compared(robot, points, known, threads).numbers.items():
                sums.setdefault(kind.name, ErrorSums()).add(whole_sizes(kind, numbers).ravel())
    was, now = ({name: sums.statistics() for name, sums in each.items()} for each in (first, last))
    kinds = judged_on(some.kinds, was, now)
    return replace(some, before=was.get(POINTS), after=now.get(POINTS), kinds=kinds, rows=rows, all_rows=len(data))


def covered_by_all(robot: Robot, data: LongDataset) -> dict[str, tuple[float, float]]:
    """`covered` of all rows."""
    out: dict[str, tuple[float, float]] = {}
    for part in data.parts(moves=False):
        for name, (least, greatest) in covered(robot, part).items():
            low, high = out.get(name, (least, greatest))
            out[name] = min(low, least), max(high, greatest)
    return out


def long_notes(data: LongDataset, some: Dataset) -> list[str]:
    """What was looked at in some rows alone."""
    return [
        f"{len(data)} rows were read part by part: all of them are fitted and counted, and {len(some)} of them are "
        "looked at for the columns, the alignment, turns and figures"
    ]
