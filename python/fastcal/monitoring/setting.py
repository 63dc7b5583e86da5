# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a check and an update begin with: new rows, set-ups, the linear problem and all that may have happened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.inspection import BAD_SHARE, check_columns
from fastcal.display import late
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, POSE, kinds_in
from fastcal.measurements.observations import without_kinds
from fastcal.monitoring.evidence import Evidence
from fastcal.monitoring.hypotheses import Hypothesis, extended, hypotheses, row_hypotheses
from fastcal.monitoring.linear import LinearRows, as_known, linear_rows, record_of
from fastcal.monitoring.setups import SetUp, bare_arm, kind_errors, set_ups
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot
from fastcal.units import UNITS, from_si


@dataclass(frozen=True, eq=False)
class Setting:
    """The linear problem of a check and all that may have happened."""

    arm: Robot
    extended_arm: Robot
    rows: LinearRows
    possible: list[Hypothesis]
    evidence: Evidence


def given(model: RobotLike, data: Sequence[DataLike]) -> tuple[Robot, Dataset]:
    """The model, and its new rows as one data set; several sets are stations of their own.

    Raises:
        InvalidInput: There are no rows, or the model keeps no covariance.
    """
    if not data:
        raise InvalidInput("expected the model and then at least one set of measured poses")
    robot = as_robot(model)
    record_of(robot)
    return robot, _joined(data, robot)


def _joined(data: Sequence[DataLike], robot: Robot) -> Dataset:
    """One data set; several are stations of their own."""
    if len(data) == 1:
        return as_data(data[0], robot)
    if all(not isinstance(each, Dataset) for each in data):
        read: Dataset = late.call("load_measurements", list(data), robot)
        return read
    sets = [as_data(each, robot) for each in data]
    return Dataset.concatenate(sets, labels=[f"{i + 1}" for i in range(len(sets))])


def prepared(robot: Robot, measured: Dataset, *, as_read: bool, threads: int) -> tuple[Setting, list[SetUp], list[str]]:
    """The linear problem, the set-ups and notes."""
    record = record_of(robot)
    notes = [*measured.notes, *check_columns(robot, measured, as_read=as_read)]
    arm, arm_notes = bare_arm(robot, measured)
    known, left_out = as_known(measured, record)
    more, added = extended(arm, {"approach"} if measured.approach is not None else set())
    places, known, too_few = _placed(more, known, threads)
    _refuse_other_robot(robot, measured, places, as_read)
    rows = linear_rows(places, record, threads=threads)
    turned = known.rotation is not None
    possible = [*hypotheses(arm, more, added, turned), *row_hypotheses(rows.row, rows.numbers)]
    columns = [h.columns(rows.J, rows.row, rows.sigma) for h in possible]
    evidence = Evidence(
        rows.whitened(rows.r),
        rows.whitened(rows.B),
        [rows.whitened(c) for c in columns],
        [h.sizes for h in possible],
        rows.freedom,
    )
    notes += [*arm_notes, *left_out, *too_few, *range_notes(robot, measured)]
    return Setting(arm, more, rows, possible, evidence), places, notes


def _placed(arm: Robot, data: Dataset, threads: int) -> tuple[list[SetUp], Dataset, list[str]]:
    """The set-ups; without what is too little to place its anchors, planes or mountings, where there are points."""
    try:
        return set_ups(arm, data, threads=threads), data, []
    except Undetermined as error:
        beside = [kind for kind in kinds_in(data) if kind.name not in POSE]
        if data.position is None or not beside:
            raise
        pose = without_kinds(data, [kind.name for kind in beside])
        note = f"{' and '.join(kind.plural for kind in beside)} are not used: {error}"
        return set_ups(arm, pose, threads=threads), pose, [note]


def _refuse_other_robot(robot: Robot, data: Dataset, places: list[SetUp], as_read: bool) -> None:
    """Refuses readings that no arm of this kind gives: half of them are farther off than a part of the reach."""
    main = next(iter(kind_errors(places).values()))
    median = float(np.nanmedian(main.after))
    is_length = UNITS[main.kind.unit].kind == "length"
    if median > BAD_SHARE * (robot.reach if is_length else 1.0) and not as_read:
        if not is_length:
            raise InvalidInput(
                f"{data.source}: the {main.kind.plural} do not fit {robot.name}: the model misses half of them by more "
                f"than {main.kind.text(median, 3)}; is it the model of this robot?"
            )
        miss, reach = (f"{from_si(length, 'mm'):.4g} mm" for length in (median, robot.reach))
        what = "points" if main.kind.name == POINTS else main.kind.plural
        raise InvalidInput(
            f"{data.source}: the {what} do not fit {robot.name}: with the best base the model misses half of them by "
            f"more than {miss}, with a reach of {reach}; is it the model of this robot?"
        )
