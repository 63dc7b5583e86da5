# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated cell still hold, by all that was read in it together?

Where a sensor stands on an arm, pictures were taken or arms have effects that no longer arm brings along, no way is one
serial arm with a record of its own. The cell as a whole is then the model, with the covariance that it keeps: what
`update` would move is what has changed, and nothing is written.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.kind_errors import KindErrors
from fastcal.cells.cell import Cell
from fastcal.cells.errors import kind_errors, kinds_json
from fastcal.cells.expected import expected_rms
from fastcal.cells.fit import there
from fastcal.cells.known_fit import MOVED, KnownFit, Settled, known_record, suspects
from fastcal.cells.next_postures import next_postures, posture_json
from fastcal.cells.readings import Readings
from fastcal.cells.rig_start import judged_readings
from fastcal.errors import InvalidInput
from fastcal.measurements.kinds import POINTS, KindNoise, of_observation
from fastcal.monitoring.causes import LEVEL
from fastcal.monitoring.check import within_tolerance
from fastcal.monitoring.result import FEWEST_DEGREES
from fastcal.robot.identified_spec import Values
from fastcal.robot.rig import PLACEMENT
from fastcal.said import Said, chained, joined, said
from fastcal.units import from_si

_BLIND = 0.9  # of how far it may be: what is known no better in any direction was not seen
_SIDE = {"m": "mm", "rad": "deg"}


@dataclass(frozen=True)
class MovedNumber:
    """One number of what has moved: by how much, its standard deviation, in the unit of its name."""

    name: str
    change: float
    std: float


@dataclass(frozen=True)
class MovedMember:
    """What has moved.

    Attributes:
        label: A member of the cell or a joint's zero: `camera wrist`, `left.joint3 zero`.
        equivalents: What the readings do not tell from it.
        changes: Its numbers, a member's in the axes of what it stands on.
    """

    label: str
    equivalents: tuple[str, ...]
    changes: tuple[MovedNumber, ...]

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `causes`."""
        return {**vars(self), "changes": [vars(of) for of in self.changes]}


@dataclass(frozen=True, eq=False)
class WholeCheck:
    """What `check_whole` found.

    Attributes:
        kinds: Errors of each kind of reading against the model, the instrument on the world where it stands now.
        noise: Of each kind, as the calibration found it.
        moved: What has changed.
        rows: Postures that are off and that no move explains.
        p_value: Of what is left when the rest has moved.
        enough: Were there readings enough to decide?
        expected: RMS error of each kind [m, rad, px] as noise, joints and the model's uncertainty make it.
        blind: What may have moved without these readings showing it.
        next: (M, n) postures to measure next, where they would decide something.
        postures: How many there were.
        within: Are all points within the tolerance? None without one, or where the readings do not decide it.
        there: The cell, the instrument where it stands now.
        readings: What was read.
    """

    cell: Cell
    there: Cell
    readings: Readings
    kinds: dict[str, KindErrors]
    noise: dict[str, KindNoise]
    moved: tuple[MovedMember, ...]
    rows: tuple[int, ...]
    p_value: float
    enough: bool
    expected: dict[str, float]
    blind: tuple[str, ...]
    next: FloatArray
    postures: int
    notes: tuple[str, ...] = ()
    tolerance: float | None = None
    within: bool | None = None

    @property
    def verdict(self) -> str:
        """holds, changed or cannot_tell."""
        if not self.enough:
            return "cannot_tell"
        if self.moved or self.p_value < LEVEL:
            return "changed"
        undecided = self.rows or (self.tolerance is not None and self.within is None)
        return "cannot_tell" if undecided else "holds"

    @property
    def sentence(self) -> Said:
        """What was found, in words."""
        if not self.enough:
            return said("Too few readings to decide: what is fitted to them could hide any change.")
        told: list[str] = []
        if self.moved:
            each = [chained("{first} or {second}", [of.label, *of.equivalents]) for of in self.moved]
            told.append(said("The cell has changed: {what} moved.", what=joined(", ", each)))
        if self.rows:
            off = ", ".join(map(str, self.rows))
            told.append(said("Everything fits except the readings in postures {rows}; measure them again.", rows=off))
        if self.p_value < LEVEL:
            told.append(said("The readings differ from the model by more than the noise, and no move explains it."))
        if not told:
            told.append(said("The cell's model still holds: the readings agree with it to within the noise."))
        if self.within is False:
            told.append(said("The largest error of a point is beyond the tolerance."))
        elif self.within is None and self.tolerance is not None:
            told.append(said("The largest error of a point is too close to the tolerance to decide."))
        return joined(" ", told)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of check.json."""
        points = self.kinds.get(POINTS)
        kinds = kinds_json(self.kinds)
        for name, of in self.kinds.items():
            kinds[name]["expected_rms"] = of.kind.shown(self.expected[name])
        return {
            "verdict": self.verdict,
            "sentence": str(self.sentence),
            "rms_mm": None if points is None else points.rms,
            "expected_rms_mm": None if points is None else from_si(self.expected[POINTS], "mm"),
            "tolerance_mm": None if self.tolerance is None else from_si(self.tolerance, "mm"),
            "within_tolerance": self.within,
            "p_value": self.p_value,
            "kinds": kinds,
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "causes": [of.to_json_dict() for of in self.moved],
            "rows": list(self.rows),
            "blind": list(self.blind),
            "next_poses": [posture_json(self.cell, q) for q in self.next],
            "count": self.postures,
            "robot": self.cell.name,
        }


def check_whole(cell: Cell, readings: Readings, *, tolerance: float | None = None, threads: int = 1) -> WholeCheck:
    """Holds a calibrated cell against new postures, by all that was read in them.

    Args:
        cell: Calibrated, with what it keeps of its certainty: model.yaml.
        readings: New postures and what was read in them, pictures too.
        tolerance: Largest distance of a point [m] that is accepted.
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The cell keeps no covariance, something was read of a kind that its calibration had none of, or a
            tolerance is given where no point was read.
        Undetermined: Too few points to say where the instrument stands.
    """
    record = known_record(cell)
    readings = judged_readings(cell, readings, known=True)
    before = KnownFit.of(cell, readings, record, threads)
    fit, groups = before.with_all_that_moved()
    columns = dict(suspects(before.cell, before.parameters))
    first = before.G.shape[1]
    alone = replace(before, rows=fit.rows, G=np.hstack([before.G, *(columns[group[0]] for group in groups)]))
    rest = alone.settled()
    moved, at = [], first
    for label, *others in groups:
        own = slice(at, at := at + columns[label].shape[1])
        moved.append(MovedMember(label, tuple(others), _changes(before, columns[label], rest, own)))
    there = _as_it_stands(before)
    kinds = kind_errors(there, readings)
    if tolerance is not None and POINTS not in kinds:
        raise InvalidInput(f"{readings.source}: a tolerance is of points, and none was measured")
    of_points = kinds[POINTS].statistics[1] if POINTS in kinds else None
    within = None
    if tolerance is not None and of_points is not None:
        within = within_tolerance(of_points.max, tolerance, record.sigma(POINTS) or 0.0)
    told = {name for group in groups for name in group}
    blind = tuple(_blind(fit, {name: of for name, of in columns.items() if name not in told}))
    enough = before.near(before.start).numbers - before.world.shape[1] >= FEWEST_DEGREES
    unsure = {*blind, *(name for group in groups if len(group) > 1 for name in group)}
    watched = {name: own for name, own in columns.items() if not enough or name in unsure}
    known = {of_observation(of).name: of_observation(of) for of in before.measured.observations}
    return WholeCheck(
        cell=cell,
        there=there,
        readings=readings,
        kinds=kinds,
        noise={name: KindNoise(of, record.sigma(name) or 0.0, "calibration") for name, of in known.items()},
        moved=tuple(moved),
        rows=tuple(np.setdiff1d(np.arange(len(readings)), fit.rows).tolist()),
        p_value=rest.p_value,
        enough=enough,
        expected=expected_rms(before),
        blind=blind,
        next=next_postures(fit, watched),
        postures=len(readings),
        notes=readings.notes,
        tolerance=tolerance,
        within=within,
    )


def _as_it_stands(fit: KnownFit) -> Cell:
    """The cell as it was calibrated, on the world where the instrument stands now."""
    if not fit.world.shape[1]:
        return fit.cell
    theta = replace(fit, G=fit.world).settled().theta
    return there(fit.cell, fit.measured, Values(theta, [], np.zeros((0, 0))))


def _changes(fit: KnownFit, columns: FloatArray, rest: Settled, own: slice) -> tuple[MovedNumber, ...]:
    """The numbers of what moved by `columns` (T, k), times u[own] of the fit."""
    u, std = rest.u[own], np.sqrt(np.diag(rest.covariance)[own])
    if len(u) == 1:  # a zero
        units = {of.unit for of, x in zip(fit.parameters, columns[:, 0], strict=True) if x}
        unit = "rad" if "rad" in units else "m"
        size = from_si(MOVED[unit], _SIDE[unit])
        return (MovedNumber(f"zero_{_SIDE[unit]}", float(size * u[0]), float(size * std[0])),)
    out = []
    for k, axis in enumerate(PLACEMENT[: len(u)]):
        unit = "rad" if axis.startswith("r") else "m"
        size = from_si(MOVED[unit], _SIDE[unit])
        out.append(MovedNumber(f"{axis}_{_SIDE[unit]}", float(size * u[k]), float(size * std[k])))
    return tuple(out)


def _blind(fit: KnownFit, columns: dict[str, FloatArray]) -> list[str]:
    """What may have moved, by any of its columns, and these readings would not show it."""
    out = []
    for name, own in columns.items():
        wider = replace(fit, G=np.hstack([fit.G, own]))
        near = wider.near(fit.start)
        count = wider.G.shape[1]
        found = near.posterior(1.0, fit.repeats, np.zeros(count), np.ones(count))
        k = own.shape[1]
        if np.sqrt(np.linalg.eigvalsh(found.covariance[-k:, -k:]).min()) > _BLIND:
            out.append(name)
    return out
