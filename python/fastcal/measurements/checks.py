# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the values of a data set must satisfy, whether they come from arrays or from a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.measurements.observations import present_numbers
from fastcal.units import from_si, to_si

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastcal.measurements.dataset import Dataset

LIMIT_MARGIN = to_si(360.0, "deg")
SCALE_LIMIT = 200.0  # reaches; a base may stand far from the instrument, but not this far
NEAREST = to_si(100.0, "mm")  # to its instrument that a point can be
QUATERNION_TOLERANCE = 0.01  # of its length: three written decimals lose 0.001


class ControllerJoints(Protocol):
    """How what a controller shows and the joints of the chain follow from one another; arrays (..., n), rad or m."""

    @property
    def is_chain(self) -> bool:
        """Does the controller count as the chain does?"""

    @property
    def axis_count(self) -> int:
        """Axes that the controller counts."""

    def axis(self, joint: int) -> int | None:
        """The controller's axis of a joint, both from 0; None: it has none."""

    def chain(self, shown: NDArray[np.float64]) -> NDArray[np.float64]:
        """The chain's joints."""

    def shown(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the controller shows."""


class RobotFacts(Protocol):
    """What must be known of an arm to judge measurements of it."""

    @property
    def joint_types(self) -> Sequence[str]:
        """`revolute` or `prismatic`, one a joint."""

    @property
    def limits(self) -> NDArray[np.float64]:
        """(n, 2) least and greatest joint positions [rad or m]."""

    @property
    def reach(self) -> float:
        """The farthest that the arm can get from its base [m]."""

    @property
    def pendant(self) -> ControllerJoints:
        """How the controller counts the joints."""

    @property
    def mimics(self) -> Sequence[tuple[int, int, float, float]]:
        """Joints that others drive: joint and driver from 0, multiplier, offset [rad or m]."""

    @property
    def passive(self) -> Sequence[int]:
        """Joints, from 0, that closed loops move."""

    @property
    def beside(self) -> Sequence[int]:
        """Joints, from 0, that do not move the tool and load it by their weight alone."""

    def follow(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joint positions (N, n) with mimic and passive joints where others put them."""


class BadRow(InvalidInput):
    """An invalid value, with its place, so that a reader of files can name line and column.

    Attributes:
        field, row, index: The place: dataset.field[row, index].
        expected: What would do.
    """

    def __init__(self, field: str, row: int, index: int, expected: str, got: str) -> None:
        super().__init__(field, row, index, expected, got)
        self.field, self.row, self.index, self.expected, self.got = field, row, index, expected, got

    def __str__(self) -> str:
        return f"{self.field}, row {self.row}, entry {self.index}: expected {self.expected}, got {self.got}"


def check_values(data: Dataset, robot: RobotFacts | None) -> None:
    """Raises BadRow for the first invalid value of each kind."""
    _require("q", data.q, np.isfinite(data.q), "a finite number")
    if robot is not None:
        _check_limits(data.q, robot)
    for field in ("q_read", "position", "rotation", "distance"):
        values = getattr(data, field)
        if values is not None:
            _require(field, values, ~np.isinf(values), "a finite number, or nothing where it was not measured")
    for field in ("payload", "wrench", "current", "speed", "temperature", "time", "approach"):
        values = getattr(data, field)
        if values is not None:
            _require(field, values, np.isfinite(values), "a finite number in every row")
    _require("payload", data.payload, data.payload >= 0, "a mass of at least 0")
    if data.temperature is not None:
        _require("temperature", data.temperature, data.temperature >= 0, "a temperature above absolute zero")
    if data.approach is not None:
        _require("approach", data.approach, np.isin(data.approach, (-1, 0, 1)), "+1 or -1 (0 where it is unknown)")
    for field, values in data.observed.items():
        _require(field, values, ~np.isinf(values), "a finite number, or nothing where it was not measured")
    _check_measured(data)
    _check_instrument(data)
    _check_sigmas(data)
    if robot is not None:
        _check_scale(data, robot)


def check_whole_rows(field: str, values: NDArray[np.float64]) -> None:
    """Raises BadRow for the first row of (N, k) of which only a part is NaN, or that is infinite."""
    _require(field, values, ~np.isinf(values), "a finite number")
    empty = np.isnan(values)
    _require(field, values, ~empty | empty.all(axis=1, keepdims=True), "the whole orientation in a row, or none of it")


def _check_measured(data: Dataset) -> None:
    if data.rotation is not None:
        check_whole_rows("rotation", data.rotation)
        with np.errstate(over="ignore"):
            length = np.linalg.norm(data.rotation, axis=1)
        off = np.abs(length - 1.0) > QUATERNION_TOLERANCE
        if off.any():
            row = int(np.argmax(off))
            expected = f"a quaternion of length 1 (here it is {length[row]:.6g})"
            raise BadRow("rotation", row, 0, expected, f"{data.rotation[row, 0]:.6g}")
    if data.distance is not None and data.anchor is not None:
        _require("distance", data.distance, ~(data.distance <= 0), "a length greater than 0")
        _require(
            "anchor", data.anchor, np.isnan(data.distance) | (data.anchor >= 0), "the label of this length's anchor"
        )


def _check_instrument(data: Dataset) -> None:
    """A point that was seen from somewhere is whole, and not where the instrument stood."""
    place = data.instrument
    if place is None or data.position is None:
        return
    fits = np.isfinite(place) | np.isnan(place).all(axis=1, keepdims=True)
    _require("instrument", place, fits, "all three coordinates of where the instrument stood")
    seen = np.asarray(~np.isnan(place).any(axis=1) & ~np.isnan(data.position).all(axis=1))
    whole = ~np.isnan(data.position) | ~seen[:, np.newaxis]
    _require("position", data.position, whole, "a number, as a point that was seen from an instrument is whole")
    apart = np.linalg.norm(data.position - place, axis=1)
    least = from_si(NEAREST, "mm")
    expected = f"a point at least {least:g} mm from the instrument, which by default stands at the origin"
    _require("position", data.position, ~seen[:, np.newaxis] | (apart >= NEAREST)[:, np.newaxis], expected)


def _check_sigmas(data: Dataset) -> None:
    """Standard deviations are positive where what they are of was measured."""
    used: dict[str, NDArray[np.bool_]] = {}
    for kind in _core.observation_names():
        sigmas = [f for f in _core.observation_entry(kind).fields if f.role == "sigma"]
        for field in sigmas:
            if data.table(field.name) is not None:
                width = len(field.columns)
                needed = used.setdefault(field.name, np.zeros((len(data), width), dtype=bool))
                needed |= present_numbers(data, kind, width)
    for field_name, needed in used.items():
        values = data.table(field_name)
        if values is not None:
            fits = (values > 0) & np.isfinite(values) | np.isnan(values) & ~needed
            _require(field_name, values, fits, "a standard deviation greater than 0")


def _check_limits(q: NDArray[np.float64], robot: RobotFacts) -> None:
    limits = np.asarray(robot.limits, dtype=np.float64)
    turns = np.array([kind == "revolute" for kind in robot.joint_types])
    margin = np.where(turns, LIMIT_MARGIN, robot.reach)
    outside = (q < limits[:, 0] - margin) | (q > limits[:, 1] + margin)
    if not outside.any():
        return
    row, joint = (int(place) for place in np.argwhere(outside)[0])
    unit = "deg" if turns[joint] else "mm"
    low, high, much = (from_si(float(value), unit) for value in (*limits[joint], margin[joint]))
    bounds = f"joint {joint + 1}'s limits of {low:.6g} to {high:.6g} {unit}"
    expected = f"at most {much:.6g} {unit} outside {bounds} (is its unit right?)"
    raise BadRow("q", row, joint, expected, f"{from_si(float(q[row, joint]), unit):.6g} {unit}")


def _check_scale(data: Dataset, robot: RobotFacts) -> None:
    for field, values in (("position", data.position), ("distance", data.distance)):
        if values is not None:
            fits = ~(np.abs(values) > SCALE_LIMIT * robot.reach)
            reach = from_si(robot.reach, "mm")
            expected = f"a number that fits an arm with a reach of {reach:.4g} mm (is its unit right?)"
            _require(field, values, fits, expected)


def _require(field: str, values: NDArray[np.generic], fits: NDArray[np.bool_], expected: str) -> None:
    if not fits.all():
        row, *rest = (int(place) for place in np.argwhere(~fits)[0])
        got = values[(row, *rest)].item()
        raise BadRow(field, row, rest[0] if rest else 0, expected, f"{got:.6g}")
