# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is given for a robot or for data: the object, or what it can be read from."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from fastcal.display import late
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

RobotLike: TypeAlias = Robot | str | os.PathLike[str] | Mapping[str, Any]
DataLike: TypeAlias = Union[Dataset, str, os.PathLike[str], "pd.DataFrame"]
RowsLike: TypeAlias = DataLike | LongDataset


def as_robot(given: RobotLike) -> Robot:
    """A Robot as it is; a path, the name of a shipped arm or a mapping as `load_robot` reads it.

    Raises:
        InvalidInput: It is something else, and the sentence says what was meant.
    """
    if isinstance(given, Robot):
        return given
    if isinstance(given, str | os.PathLike | Mapping):
        robot: Robot = late.call("load_robot", given)
        return robot
    if isinstance(given, Dataset):
        raise InvalidInput("the robot comes first and the data second, got a Dataset for the robot")
    model = getattr(given, "model", None)
    if isinstance(model, Robot):
        raise InvalidInput(f"expected a Robot, got a {type(given).__name__}; its robot is its attribute .model")
    raise InvalidInput(
        f"expected a Robot, the path of a robot file or the name of a shipped arm, got {type(given).__name__}"
    )


def as_rows(given: RowsLike, robot: Robot) -> Dataset | LongDataset:
    """`as_data`, but for a LongDataset, which stays as it is, and the path of a file of very many rows, which is one.

    Raises:
        InvalidInput, ParseError: As there.
    """
    if isinstance(given, LongDataset):
        return given
    if isinstance(given, str | os.PathLike) and late.call("is_long", given):
        rows: LongDataset = late.call("open_measurements", given, robot)
        return rows
    return as_data(given, robot)


def as_data(given: RowsLike, robot: Robot, *, require_measured: bool = True) -> Dataset:
    """A Dataset as it is; the path of a measurement file, or a pandas table with its columns, as SI arrays.

    Raises:
        InvalidInput: It is something else, and the sentence says what was meant; ParseError: as `load_measurements`.
    """
    if isinstance(given, Dataset):
        if len(given) == 0:
            raise InvalidInput(f"{given.source}: the data hold no rows; expected at least one")
        return given
    if isinstance(given, str | os.PathLike):
        data: Dataset = late.call("load_measurements", given, robot, require_measured=require_measured)
        return data
    pandas = sys.modules.get("pandas")
    if pandas is not None and isinstance(given, pandas.DataFrame):
        return Dataset.from_frame(given, robot, require_measured=require_measured)
    if isinstance(given, Robot):
        raise InvalidInput("the robot comes first and the data second, got a Robot for the data")
    if isinstance(given, LongDataset):
        raise InvalidInput(f"expected rows in memory, got {len(given)} rows in files: only calibrate takes these")
    raise InvalidInput(
        "expected a Dataset (fastcal.load_measurements, Dataset.from_arrays), the path of a measurement file or a "
        f"pandas table, got {type(given).__name__}"
    )
