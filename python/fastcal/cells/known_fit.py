# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New readings of a calibrated cell: what was known is the prior, what has moved is free.

With theta all parameters of the cell, L the root of the covariance that it keeps, H what the gauge held and the new
readings show, W the motions of all that stands on the world, as an instrument that was set up again sees them, and D
the directions of what has moved, all times how far each may be,

    theta = theta_0 + [L H W D] u,    u ~ N(0, 1),

with the noise of `evidence`. D is found step by step: of all members and joints the one, or of all rows the gross one,
that chance would make explain so much the least often, until none explains more than chance does.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln
from scipy.stats import chi2

from fastcal import _core
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.errors import is_of_rig, unknowns_as_they_are
from fastcal.cells.evidence import Near, joint_zeros
from fastcal.cells.knocked import name_since
from fastcal.cells.motions import carried, motions_of_world, stands_at, turned
from fastcal.cells.readings import Readings
from fastcal.cells.records import JOINTS
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.kinds import of_observation
from fastcal.monitoring.causes import LEVEL
from fastcal.place import Place
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.rig import PLACEMENT, corner_counts
from fastcal.units import to_si

FloatArray = NDArray[np.float64]

MOVED = {"m": to_si(20.0, "mm"), "rad": to_si(2.0, "deg")}  # how far what has moved may be
_ANEW = 10.0  # [m, rad] how far an instrument may stand from where the points put it: any distance
_UNSEEN = 0.1  # standard deviations: less of a held direction leaves it held
_ALIKE = 9.0  # of chi square: what explains nearly as much as the likeliest may be it
_KEPT = 0.75  # of the rows at least: where more are off, it is not the rows
_ROUNDS = 20


def known_record(cell: Cell) -> CalibrationRecord:
    """What a calibrated cell keeps of its certainty. InvalidInput where it keeps nothing."""
    record = CalibrationRecord.from_spec(cell.record)
    if record is None:
        raise InvalidInput(
            f"{cell.name} keeps no covariance of all its parameters; expected a model.yaml of this version's `fastcal "
            "calibrate`"
        )
    return record


@dataclass(frozen=True, eq=False)
class Settled:
    """A fit at rest.

    Attributes:
        theta: (T,) parameters of the cell and unknowns.
        u: (u,) by its columns, and their covariance (u, u).
        p_value: The chance of residuals this large.
    """

    theta: FloatArray
    u: FloatArray
    covariance: FloatArray
    p_value: float


@dataclass(frozen=True, eq=False)
class KnownFit:
    """New readings of a cell, by columns G (T, u) of its parameters, u ~ N(0, 1).

    Attributes:
        cell: On the world where the instrument stands now.
        rows: (N,) of the readings, those that are used.
        world: (T, w) what is found anew: motions of all that stands on the world, where the instrument there may stand
            elsewhere, and unknowns of observations, such as a floor.
        held: (T, h) directions that these readings do not show either.
    """

    cell: Cell
    readings: Readings
    rows: NDArray[np.intp]
    record: CalibrationRecord
    G: FloatArray
    held: FloatArray
    world: FloatArray
    threads: int
    measured: _core.Measurements
    parameters: list[_core.Parameter] = field(repr=False)

    @staticmethod
    def of(cell: Cell, readings: Readings, record: CalibrationRecord, threads: int) -> KnownFit:
        """With what is known and where the instrument stands."""
        if cell.boards and CORNERS not in readings.tables:  # so that cameras and boards keep their numbers
            unseen = np.full((len(readings), 2 * len(cell.cameras) * sum(corner_counts(cell))), np.nan)
            readings = replace(readings, tables={**readings.tables, CORNERS: unseen})
        measured = readings.measured(cell)
        parameters = [*cell.model.parameters, *measured.parameters]
        names = [full_name(parameter) for parameter in parameters]
        none = np.zeros(len(record.parameters) + len(record.unknowns))
        L = np.array([record.roots.get(name, none) for name in names])
        columns = dict(zip(record.moved, record.directions, strict=True))
        H = np.array([columns.get(name, np.zeros(record.directions.shape[1])) for name in names])
        W = np.zeros((len(names), 0))
        if readings.is_read_from_world:
            X = stands_at(cell, readings)
            L, H, cell = turned(cell, X, L), turned(cell, X, H), carried(cell, X)
            W = _ANEW * motions_of_world(cell, measured.parameters)
        first = len(cell.model.parameters)
        anew = [first + i for i, of in enumerate(measured.parameters) if not is_of_rig(of)]
        W = np.hstack([W, _ANEW * np.eye(len(names))[:, anew]])
        rows = np.arange(len(readings))
        fit = KnownFit(cell, readings, rows, record, H, H, W, threads, measured, parameters)
        near = fit.near(fit.start)
        shown = np.sqrt(np.diag(near.H + near.J.T @ near.J)) > _UNSEEN
        return replace(fit, G=np.hstack([L, H[:, shown], W]), held=H[:, ~shown])

    @property
    def names(self) -> list[str]:
        """(T,) of the parameters."""
        return [full_name(parameter) for parameter in self.parameters]

    @cached_property
    def start(self) -> FloatArray:
        """(T,) the cell as it is, and unknowns of observations where these readings put them."""
        return np.append(np.asarray(self.cell.model.start), unknowns_as_they_are(self.cell, self.readings))

    @property
    def repeats(self) -> float:
        """What joints repeat to [rad]."""
        return self.record.sigma(JOINTS) or 0.0

    def near(self, theta: FloatArray, rows: NDArray[np.intp] | None = None) -> Near:
        """The readings, or some rows of them, at theta; raises as of `noise`."""
        used = self.readings.pick(self.rows if rows is None else rows)
        measured = used.measured(self.cell)
        return Near.of(self.cell, measured, used, theta, self.G, self.noise(measured), self.threads)

    def noise(self, measured: _core.Measurements) -> list[float]:
        """Of each observation, 0 where it claims its own. InvalidInput where that of a kind is not known."""
        noise = []
        for of in measured.observations:
            known = self.record.sigma(of_observation(of).name)
            if known is None and not of.claims_sigma:
                expected = ", ".join(kind for kind in self.record.noise if kind != JOINTS)
                raise InvalidInput(
                    f"{self.readings.source}: the calibration had no reading of the kind "
                    f"{of_observation(of).name}; expected {expected}"
                )
            noise.append(0.0 if of.claims_sigma or known is None else known)
        return noise

    def cost(self, near: Near) -> float:
        """Chi square of what is left, priors included."""
        return near.posterior(1.0, self.repeats, np.zeros(near.J.shape[1]), np.ones(near.J.shape[1])).cost

    def with_all_that_moved(self) -> tuple[KnownFit, list[list[str]]]:
        """The fit with what has moved free and without gross rows; and what moved, in groups that are alike."""
        fit, moved = self, list[list[str]]()
        left = dict(suspects(self.cell, self.parameters))
        while True:
            before = fit.cost(fit.near(fit.start))
            gain, chance = {}, {}
            for name, columns in left.items():
                wider = replace(fit, G=np.hstack([fit.G, columns]))
                gain[name] = before - wider.cost(wider.near(fit.start))
                chance[name] = _log_chance(gain[name], columns.shape[1]) + np.log(len(left))
            by_row = {}
            for row in fit.rows if len(fit.rows) > max(_KEPT * len(self.rows), 1) else ():
                alone = fit.near(fit.start, np.array([row]))
                without = before - fit.cost(fit.near(fit.start, fit.rows[fit.rows != row]))
                by_row[row] = _log_chance(without, alone.numbers) + np.log(len(fit.rows))
            best, worst = (min(of, key=lambda key, of=of: of[key], default=None) for of in (chance, by_row))
            least = [0.0 if key is None else of[key] for key, of in ((best, chance), (worst, by_row))]
            if min(least) >= np.log(LEVEL):
                return fit, moved
            if best is None or least[1] < least[0]:
                fit = replace(fit, rows=fit.rows[fit.rows != worst])
                continue
            moved.append([best, *(name for name in left if name != best and gain[name] > gain[best] - _ALIKE)])
            fit = replace(fit, G=np.hstack([fit.G, *(left.pop(name) for name in moved[-1])]))

    def settled(self) -> Settled:
        """Where the fit comes to rest."""
        theta, u = self.start, np.zeros(self.G.shape[1])
        for _ in range(_ROUNDS):
            near = self.near(theta)
            found = near.posterior(1.0, self.repeats, -u, np.ones(len(u)))
            theta, u = theta + self.G @ found.u, u + found.u
            if found.is_at_rest:
                break
        return Settled(theta, u, found.covariance, float(chi2.sf(found.cost, near.numbers)))


def _log_chance(chi_square: float, freedom: int) -> float:
    """Of as much or more; by the first term of the tail's series where doubles end."""
    a, x = freedom / 2, chi_square / 2
    tail = float(chi2.sf(chi_square, freedom))
    return float(np.log(tail) if tail > 0 else (a - 1) * np.log(x) - x - gammaln(a))


def suspects(cell: Cell, parameters: list[_core.Parameter]) -> Iterable[tuple[str, FloatArray]]:
    """What may have moved: each member of a cell, and each joint's zero, as columns (T, k) times how far."""

    def columns(indices: Iterable[int]) -> FloatArray:
        at = list(indices)
        out = np.zeros((len(parameters), len(at)))
        out[at, range(len(at))] = [MOVED[parameters[i].unit] for i in at]
        return out

    arms = {arm.name for arm in cell.arms}
    for branch in cell.core.branches:
        if name_since(branch.name) != branch.name:  # where a member stood before
            continue
        name = f"{branch.name}.base" if branch.name in arms else branch.name
        yield name, columns(range(branch.first_parameter, branch.first_parameter + len(PLACEMENT)))
    for kind, members in (("camera", cell.cameras), ("board", cell.boards)):
        for member in members:
            own = f"{kind} {member}"
            if at := [i for i, p in enumerate(parameters) if p.owner == own and p.name in PLACEMENT]:
                yield own, columns(at)  # one that is fixed has none
    for arm, joint, kind, column in joint_zeros(cell, len(parameters)):
        size = MOVED["rad" if kind == "revolute" else "m"]
        yield f"{Place(arm, 'joint', joint + 1)} zero", size * column[:, np.newaxis]
