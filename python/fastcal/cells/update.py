# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated cell brought up to date by a few new postures, as `known_fit` has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.cells.calibrate import CellResult, parameter_table
from fastcal.cells.cell import Cell
from fastcal.cells.errors import kind_errors, view_errors
from fastcal.cells.fit import there
from fastcal.cells.known_fit import KnownFit, known_record
from fastcal.cells.motions import to_written
from fastcal.cells.readings import Readings
from fastcal.cells.records import cell_record, updated_records
from fastcal.cells.rig_start import judged_readings
from fastcal.measurements.kinds import KindNoise, of_observation
from fastcal.monitoring.causes import LEVEL
from fastcal.robot.identified_spec import Values
from fastcal.said import chained, said

FloatArray = NDArray[np.float64]


def update_cell(cell: Cell, readings: Readings, *, threads: int = 1) -> CellResult:
    """Brings a calibrated cell up to date with a few new postures, twelve or so.

    What is read from the world may be read by an instrument that stands elsewhere: the cell's world is then its frame.

    Args:
        cell: Calibrated, with what it keeps of its certainty: model.yaml.
        readings: New postures and what was read in them, pictures too.
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The cell keeps no covariance, or something was read of a kind that its calibration had none of.
        Undetermined: Too few points to say where the instrument stands.
    """
    record = known_record(cell)
    readings = judged_readings(cell, readings, known=True)
    fit = KnownFit.of(cell, readings, record, threads)
    fit, moved = fit.with_all_that_moved()
    rest = fit.settled()
    start, own = fit.cell, len(fit.cell.model.start)
    root = fit.G @ np.linalg.cholesky(rest.covariance)
    free = np.flatnonzero((root != 0).any(axis=1)).tolist()
    solution = Values(rest.theta, free, (root @ root.T)[np.ix_(free, free)])
    model = there(start, fit.measured, solution)
    gross = np.setdiff1d(np.arange(len(readings)), fit.rows).tolist()
    explained = rest.p_value >= LEVEL
    names = [chained("{first} or {second}", group) for group in moved]
    notes = [said("{name} has moved", name=name) for name in names]
    kinds = {of_observation(of).name: of_observation(of) for of in fit.measured.observations}
    count = fit.near(rest.theta).numbers
    freedom = record.degrees_of_freedom + count
    as_written = to_written(start, rest.theta, model)
    new = cell_record(solution, fit.measured, fit.parameters[:own], record.noise, freedom, as_written)
    held = {name: row for name, row in zip(fit.names, fit.held, strict=True) if row.any()}
    new = replace(new, moved=list(held), directions=np.array([*held.values()]).reshape(len(held), fit.held.shape[1]))
    model = replace(model, record=new.to_spec(), records=updated_records(cell, readings.pick(fit.rows), threads))
    return CellResult(
        cell=model,
        nominal=start,
        status="converged" if explained else "not_converged",
        message="" if explained else said("the readings are not explained by what may have moved"),
        parameters=parameter_table(solution, fit.parameters, np.asarray(start.model.start)),
        unidentifiable=[],
        rank=len(free),
        degrees_of_freedom=new.degrees_of_freedom,
        noise={name: KindNoise(of, record.sigma(name) or 0.0, "calibration") for name, of in kinds.items()},
        outliers=gross,
        train=kind_errors(model, readings, start),
        views=view_errors(model, readings, start),
        readings=readings,
        moved=names,
        notes=[*readings.notes, *notes],
    )
