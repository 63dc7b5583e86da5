# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What levels and touches contribute to a design: derivatives of their readings, from the observations themselves.

An observation (`cpp/fastcal/measurement/`) is linearized at what the nominal arm would read, a level mounted along the
axes of its link. The design knows none of their equations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.calibration.other_readings import other_readings
from fastcal.design.candidates import Candidates
from fastcal.design.instruments import Instruments
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of
from fastcal.robot.robot import Robot


class Readings:
    """Derivatives of what levels and touches read.

    Attributes:
        count: Numbers in a pose: two of each level, then one of a touch.
        parameters: The instruments' own: mountings and planes. They follow those of the model.
        planes: Labels of the planes.
        sigma_tilt: Standard deviation of a tilt [rad].
    """

    def __init__(self, robot: Robot, instruments: Instruments, sigma: float, threads: int) -> None:
        self._robot, self._of, self._threads = robot, instruments, threads
        self._noise = (sigma, instruments.sigma_tilt, sigma)
        self.sigma_tilt = instruments.sigma_tilt
        self.planes = tuple(instruments.planes)
        self.count = 2 * len(instruments.levels) + bool(instruments.planes)
        labels = np.array([*instruments.planes, ""], dtype=object)
        one = Candidates(np.zeros((len(labels), robot.joint_count)), np.zeros(len(labels)), plane=labels)
        self.parameters: list[_core.Parameter] = list(measurements(self._data(one), robot).parameters)
        self._place = {(p.owner, p.name): k for k, p in enumerate(self.parameters)}
        values = {
            (owner, name): value
            for owner, own in instruments.plane_values.items()
            for name, value in zip(("rx", "ry", "offset"), own, strict=True)
        }
        self._value = np.array([values.get((p.owner, p.name), 0.0) for p in self.parameters])

    def rows(self, poses: Candidates) -> FloatArray:
        """(N, count, P + U) by all parameters of the model and of the instruments, over the noise; 0: not read."""
        model = self._robot.error_model
        P = len(model.parameters)
        out = np.zeros((len(poses), self.count, P + len(self.parameters)))
        data = self._data(poses)
        if not kinds_of(data):
            return out
        measured = measurements(data, self._robot)
        unknowns = [self._place[p.owner, p.name] for p in measured.parameters]
        theta = np.concatenate([model.start, self._value[unknowns]])
        noise = noise_by_observation(measured, self._noise)
        near = _core.linearize(model, self._robot.samples(data), measured, theta, noise, self._threads)
        first = [self._first_number(of.field) for of in measured.observations]
        number = np.concatenate(
            [start + np.arange(len(of.components)) for start, of in zip(first, measured.observations, strict=True)]
        )
        columns = np.concatenate([np.arange(P), P + np.array(unknowns, dtype=np.int64)])
        out[near.row[:, np.newaxis], number[near.number][:, np.newaxis], columns] = near.J
        return out

    def _first_number(self, field: str) -> int:
        """Where the numbers of an observation begin."""
        levels = [f"tilt@{link}" for link in self._of.levels]
        return 2 * levels.index(field) if field in levels else 2 * len(levels)

    def _data(self, poses: Candidates) -> Dataset:
        """The poses with what their instruments would read in the nominal arm."""
        labels = [] if poses.plane is None else [str(label) for label in poses.plane]
        tilted = Dataset.from_arrays(
            poses.q,
            payload=poses.payload,
            approach=poses.approach,
            observed={f"tilt@{link}": np.zeros((len(poses), 2)) for link in self._of.levels},
            source="candidates",
        )
        read = other_readings(self._robot, tilted, {}, np.random.default_rng(0), self._threads)
        return replace(read, observed_labels={"plane": labels} if any(labels) else {})
