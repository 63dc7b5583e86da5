# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibration of a cell: all its arms, and where everything stands, from readings of its targets, in one fit."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.inspection import check_columns
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.kind_noise import noise_record, scaled
from fastcal.calibration.known_lengths import KnownLength, known_lengths, length_notes
from fastcal.calibration.lens_start import started_lenses
from fastcal.calibration.result import IdentifiedParameter, Unidentifiable
from fastcal.cells.cell import Cell
from fastcal.cells.data_notes import data_notes
from fastcal.cells.errors import kind_errors, kinds_json, view_errors
from fastcal.cells.evidence import SharedNoise
from fastcal.cells.fit import Fit, never_worse
from fastcal.cells.misfit import check_cell_fit
from fastcal.cells.motions import to_written
from fastcal.cells.paths import serial_ways
from fastcal.cells.placements import Placement, placements
from fastcal.cells.readings import Readings
from fastcal.cells.records import JOINTS, cell_directions, cell_record, way_records
from fastcal.cells.rig_start import judged_readings, rig_start
from fastcal.cells.start import started
from fastcal.cells.told import found_distances, without_what_is_contradicted
from fastcal.display.shown import PlottedCell
from fastcal.effects.entries import edge_name, edge_unit, full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.kinds import KindNoise
from fastcal.robot.identified_spec import Solution
from fastcal.said import said
from fastcal.units import factor, from_si

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
_NO_NOISE = 1e-9  # [m, rad, px] of readings that are exact


@dataclass(frozen=True, eq=False)
class CellResult(PlottedCell):
    """What `calibrate_cell` found.

    Attributes:
        cell: Identified; also the start of a next calibration.
        nominal: The cell before, with its places as the closed-form start has them.
        status: converged, not_converged or too_few_equations.
        parameters: Identified numbers in edge units; owners carry the arm: `left.joint3`.
        train, test: Errors of each kind of reading, before and after.
        views, test_views: Errors of each view, such as `position@smr:camera`, `corner@BOARD:CAMERA`.
        readings: What was read, of which `train` and `views` are the errors.
        outliers: Rows whose error the noise does not explain.
        shared: What all corners of a picture share, and how far the geometry may be off; None where it was not asked.
        known_distances: Of each distance that the file knows, what it says and what the fit has.
        moved: Of an update, what has moved since the calibration; None of a calibration.
    """

    cell: Cell
    nominal: Cell
    status: str
    message: str
    parameters: list[IdentifiedParameter]
    unidentifiable: list[Unidentifiable]
    rank: int
    degrees_of_freedom: int
    noise: dict[str, KindNoise]
    outliers: list[int]
    train: dict[str, KindErrors]
    views: dict[str, KindErrors]
    readings: Readings
    test: dict[str, KindErrors] | None = None
    test_views: dict[str, KindErrors] | None = None
    shared: SharedNoise | None = None
    moved: list[str] | None = None
    known_distances: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def held(self) -> str:
        """By how much the geometry is held, in words."""
        if self.shared is None or self.shared.held is None:
            return ""
        return said(
            "the geometry is held within {size:.2g} plausible sizes of what the files say, as the readings make most "
            "likely",
            size=float(self.shared.held),
        )

    @cached_property
    def placements(self) -> list[Placement]:
        """Where all members stand."""
        return placements(self.cell, self.parameters)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "status": self.status,
            "message": self.message,
            "kinds": kinds_json(self.train),
            "train": {"kinds": kinds_json(self.train), "views": kinds_json(self.views)},
            "test": None
            if self.test is None or self.test_views is None
            else {"kinds": kinds_json(self.test), "views": kinds_json(self.test_views)},
            "placements": [of.to_json_dict() for of in self.placements],
            "parameters": [p.to_json_dict() for p in self.parameters],
            "rank": self.rank,
            "unidentifiable": [vars(u) for u in self.unidentifiable],
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "degrees_of_freedom": self.degrees_of_freedom,
            "outliers": self.outliers,
            "joints_repeat_deg": None if self.shared is None else from_si(self.shared.repeats, "deg"),
            "held": self.held,
            **({"known_distances": self.known_distances} if self.known_distances else {}),
            **({} if self.moved is None else {"method": "update", "moved": self.moved}),
            "notes": self.notes,
        }


def calibrate_cell(
    cell: Cell,
    readings: Readings,
    *,
    test: Readings | None = None,
    effects: bool = False,
    arms: Collection[str] | None = None,
    mend: bool = False,
    loss: str = "tukey",
    as_read: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> CellResult:
    """Identifies the geometry of all arms of a cell and where its members stand.

    Where the postures are few for the parameters, the geometry is held near what the files say, by as much as the
    readings make most likely. Corners of a picture err together as the joints repeat, which is found with it.

    Args:
        cell: As its file says, or an identified one as a new start.
        readings: Postures and what was read in them.
        test: Others, only reported on.
        effects: Identify the effects that the arms' files have; without it they stay as they are.
        arms: Of which arms, by name; of others only where they stand. None: of all.
        mend: Put pictures that are of other postures where they fit, instead of leaving them out.
        loss: Robust loss on the whitened error of a row: tukey, huber, cauchy, none.
        as_read: Take the columns as they are, though the arms say that they were meant otherwise.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: Nothing was read, or of a frame that the cell does not have, or columns that were probably meant
            otherwise.
    """
    report = progress or (lambda text: None)
    if not readings.sights(cell):
        raise InvalidInput(f"{readings.source}: holds no reading; expected columns such as x_mm@TARGET, or corners")
    report("checking the columns")
    suspected = _checked_columns(cell, readings, as_read=as_read)
    readings = replace(readings, notes=(*readings.notes, *suspected))
    report("placing the members of the cell")
    readings = readings.in_order
    lenses, of_lenses = started_lenses(cell, readings.tables)
    cell = replace(cell, cameras={**cell.cameras, **lenses})
    readings = replace(readings, notes=(*readings.notes, *of_lenses))
    readings = judged_readings(cell, readings, mend=mend)
    given = cell
    cell, against = without_what_is_contradicted(cell, readings, effects=effects, arms=arms, loss=loss, threads=threads)
    readings = replace(readings, notes=(*readings.notes, *against))
    start, used, wrong = started(cell, readings, as_read=as_read)
    places = rig_start(start, used)
    report("identifying")
    fit = Fit.of(start, used, places, effects=effects, arms=arms, loss=loss, threads=threads, report=report)
    of_data = data_notes(start, used, fit.asked)
    fit, status, message, held = never_worse(fit.of_more_rows(report), report)
    found, solution, noise, shared, measured = fit.found, fit.solution, fit.noise, fit.shared, fit.measured
    model = replace(fit.model, records=way_records(fit.model, given, readings, threads))
    readings = replace(readings, notes=(*readings.notes, *of_data, *held))
    names = [full_name(parameter) for parameter in found.parameters]
    own = len(start.core.nominal)
    if found.status == "converged":
        count = len(start.model.start)
        kinds = record_of(noise, shared)
        theta = np.asarray(solution.theta)
        as_written = to_written(start, theta, model)
        freedom = found.degrees_of_freedom
        record = cell_record(solution, measured, found.parameters[:count], kinds, freedom, as_written)
        noise_there = [of or _NO_NOISE for of in found.common_noise]
        near = _core.linearize(start.model, used.samples(start), measured, theta, noise_there, threads)
        unseen, directions = cell_directions(found, theta, near, measured, as_written)
        model = replace(model, record=replace(record, moved=unseen, directions=directions).to_spec())
    lengths = _touched_lengths(given, solution, measured)
    readings = replace(readings, notes=(*readings.notes, *length_notes([of.entry for of in given.touched], lengths)))
    views = view_errors(model, readings)
    readings = replace(readings, notes=(*readings.notes, *check_cell_fit(given, readings, views, as_read=as_read)))
    test = None if test is None else judged_readings(model, test, known=True, mend=mend)
    unknowns = measured.parameters
    before = start.with_rig(unknowns, places.of(unknowns), np.full(len(unknowns), np.nan))
    return CellResult(
        cell=model,
        nominal=before,
        status=status,
        message=message,
        parameters=parameter_table(
            solution, found.parameters, np.asarray(start.model.start), range(own, len(start.model.start))
        ),
        unidentifiable=[
            Unidentifiable(text, [names[i] for i in parts])
            for text, parts in zip(found.unidentifiable, found.unidentifiable_parts, strict=True)
        ],
        rank=found.rank,
        degrees_of_freedom=found.degrees_of_freedom,
        noise=noise,
        outliers=sorted({*found.outliers, *wrong}),
        train=kind_errors(model, readings, before),
        views=view_errors(model, readings, before),
        readings=readings,
        test=None if test is None else kind_errors(model, test, before),
        test_views=None if test is None else view_errors(model, test, before),
        shared=shared,
        known_distances=[
            *found_distances(given, model, readings, list(solution.free), np.asarray(solution.covariance)),
            *({**of.to_json_dict(), "used": False} for of in lengths),
        ],
        notes=list(readings.notes),
    )


def _checked_columns(cell: Cell, readings: Readings, *, as_read: bool) -> list[str]:
    """`check_columns` of each arm with what was read from the world of a target on it, each sentence once."""
    out: dict[str, None] = {}
    for way in serial_ways(cell.without_effects, readings.views):
        try:
            found = check_columns(way.robot, way.rows(cell, readings), as_read=as_read)
        except InvalidInput as error:
            raise InvalidInput(said("target {name}: {text}", name=way.name, text=str(error))) from None
        out |= dict.fromkeys(said("target {name}: {text}", name=way.name, text=text) for text in found)
    return list(out)


def _touched_lengths(cell: Cell, found: Solution, measured: _core.Measurements) -> list[KnownLength]:
    """The known lengths of a cell between points that were touched; they are reported and not imposed."""
    own, count = [(of.owner, of.name) for of in measured.parameters], len(cell.model.start)
    covariance = np.zeros((len(own), len(own)))
    free = [(k, i - count) for k, i in enumerate(found.free) if i >= count]
    here, to = [k for k, _ in free], [i for _, i in free]
    covariance[np.ix_(to, to)] = np.asarray(found.covariance)[np.ix_(here, here)]
    return known_lengths([of.entry for of in cell.touched], own, np.asarray(found.theta)[count:], covariance)


def record_of(noise: dict[str, KindNoise], shared: SharedNoise | None) -> dict[str, tuple[float, str]]:
    """The noise of each kind as a record has it, and what joints repeat to."""
    if shared is None:
        return noise_record(noise)
    return noise_record(scaled(noise, shared.scale)) | {JOINTS: (from_si(shared.repeats, "deg"), "deg")}


def parameter_table(
    found: Solution, parameters: list[_core.Parameter], nominal: FloatArray, of_effects: range = range(0)
) -> list[IdentifiedParameter]:
    """Identified numbers in edge units; those of cameras and boards are changes of what the file has.

    Args:
        found: The values.
        parameters: What they are.
        nominal: (P,) those of the tree and its effects before.
        of_effects: Which belong to effects.
    """
    nominal = np.append(nominal, np.zeros(len(found.theta) - len(nominal)))
    theta, deviations = np.asarray(found.theta), np.sqrt(np.diag(found.covariance))
    out = []
    for i, deviation in zip(found.free, deviations.tolist(), strict=True):
        parameter = parameters[i]
        is_geometry = i not in of_effects
        unit = edge_unit(parameter, geometry=is_geometry)
        value, before = from_si(float(theta[i]), unit), from_si(float(nominal[i]), unit)
        name = edge_name(parameter, geometry=is_geometry)
        out.append(IdentifiedParameter(name, parameter.owner, value, deviation / factor(unit), unit, before))
    return out
