# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The public rows of two real arms as their authors publish them (docs/public-data.md), and how they are split."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fastcal.errors import InvalidInput
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import to_si

LEARNT = 0.7  # share of the rows


@dataclass(frozen=True)
class Campaign:
    """One published file.

    Attributes:
        name: As the page has it.
        robot: Name of the shipped arm.
        file: Below the folder with the data.
        delimiter, decimal: Of its numbers.
        joints, joint_unit: Columns of q.
        points: Columns that are added to give x, y, z [mm].
    """

    name: str
    robot: str
    file: str
    delimiter: str
    decimal: str
    joints: Sequence[str]
    joint_unit: str
    points: Sequence[Sequence[str]]

    def rows(self, folder: Path) -> Dataset:
        """The rows (N) of the file.

        Raises:
            InvalidInput: It is not there, or lacks a column or a number.
        """
        path = folder / self.file
        try:
            with path.open(encoding="utf-8", newline="") as text:
                table = list(csv.DictReader(text, delimiter=self.delimiter))
        except OSError as error:
            raise InvalidInput(f"expected the published rows of the {self.name} at {path}: {error.strerror}") from error
        q = np.column_stack([self._column(path, table, name) for name in self.joints])
        position = np.column_stack([sum(self._column(path, table, name) for name in parts) for parts in self.points])
        return Dataset.from_arrays(to_si(q, self.joint_unit), position=to_si(position, "mm"))

    def _column(self, path: Path, table: Sequence[Mapping[str, str]], name: str) -> np.ndarray:
        try:
            return np.array([float(row[name].replace(self.decimal, ".")) for row in table])
        except (KeyError, ValueError, AttributeError) as error:
            raise InvalidInput(f"{path}: expected numbers in a column '{name}'") from error

    def nominal(self) -> Robot:
        """The shipped arm."""
        return load_robot(self.robot)


_UR10_JOINTS = [
    f"{joint}_joint" for joint in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
]


def _ur10(letter: str, file: str) -> Campaign:
    points = [[f"measurement_{axis}"] for axis in "xyz"]
    return Campaign(f"UR10 {letter}", "ur10", f"ur10_tmac/raw/{file}", ";", ",", _UR10_JOINTS, "rad", points)


CAMPAIGNS = (
    Campaign(
        name="UR5",
        robot="ur5",
        file="ur5_tracker/raw/3D_UR5_uncalibrated_grid_cleaned.csv",
        delimiter=",",
        decimal=".",
        joints=[f"joint_{k}" for k in range(1, 7)],
        joint_unit="deg",
        points=[[f"{axis}_t", f"{axis}_dif"] for axis in "xyz"],  # target and difference: what was measured
    ),
    _ur10("b", "measurements_joint_configurations.csv"),
    _ur10("c", "measurements_random_poses.csv"),
)


def split(data: Dataset, seed: int) -> tuple[Dataset, Dataset]:
    """Rows to learn, LEARNT of all, and the others, dealt at random."""
    order = np.random.default_rng((seed, 21)).permutation(len(data))
    count = round(LEARNT * len(data))
    return data.select(np.sort(order[:count])), data.select(np.sort(order[count:]))
