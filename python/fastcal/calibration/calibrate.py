# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibration: from a robot and measured poses to the identified model and its uncertainty."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import align as align
from fastcal.calibration.alignment import measurements as measurements
from fastcal.calibration.critical_loads import with_critical_loads
from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.geometry_anchoring import pulls
from fastcal.calibration.inspection import check_columns, check_fit
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.parameter_limits import parameter_limits
from fastcal.calibration.parameter_table import (
    anchor_places,
    correlated_pairs,
    outlier_rows,
    parameter_table,
    sigma_note,
)
from fastcal.calibration.result import CalibrationResult as CalibrationResult
from fastcal.calibration.result import IdentifiedParameter as IdentifiedParameter
from fastcal.calibration.result import Unidentifiable as Unidentifiable
from fastcal.calibration.setups import added_setups, with_setups
from fastcal.calibration.unset_options import with_open_effects_set
from fastcal.effects.entries import extra_columns, full_name, parse_effects, without_repeats
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import CalibrationRecord, lower_root
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.identified_spec import identified, with_frames
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]

LOSSES = ("tukey", "huber", "cauchy", "none")
METHODS = ("nls", "bfgs", "bfgs_mean_distance")


class Prepared(NamedTuple):
    """A robot with the effects asked for, and its model with base and tool fitted to the data."""

    robot: Robot
    model: _core.ErrorModel
    samples: _core.Samples
    measured: _core.Measurements
    alignment: _core.Alignment
    asked: list[int]


def prepare(
    robot: Robot,
    data: Dataset,
    *,
    effects: str | Sequence[str],
    parameters: Sequence[str] | None = None,
    equilibrium: bool | None = None,
    threads: int = 1,
) -> Prepared:
    """Adds effects, fits base and tool, and says which parameters of the model are asked for; arguments of `calibrate`.

    Raises:
        InvalidInput: An unknown effect or parameter, data without a measured column, or poses that fix no base.
    """
    geometry, added = parse_effects(effects, robot.core)
    spec = copy.deepcopy(robot.spec)
    spec.pop("correction", None)  # it was trained on what another identification left
    spec["effects"] = without_repeats(
        [with_origins(entry, robot, data) for entry in (spec.get("effects") or []) + added]
    )
    if equilibrium is not None:
        spec["equilibrium"] = equilibrium
    start = Robot(with_setups(spec, data))
    samples, measured = start.samples(data), measurements(data)
    alignment = _core.align(start.error_model, samples, measured, threads)
    if not alignment.found:
        raise Undetermined(f"{data.source}: {alignment.message}")
    model = start.error_model.with_robot(start.core.with_base_and_tool(alignment.T_world_base, alignment.T_flange_tool))
    placed = data.position is not None or data.rotation is not None
    asked = asked_parameters(model, geometry or parameters is not None, turned=data.rotation is not None, placed=placed)
    if parameters is not None:
        names = parameter_names(model)
        for name in parameters:
            if name not in names:
                raise InvalidInput(f"there is no parameter '{name}' to identify; there are {', '.join(names)}")
        asked = [i for i in asked if names[i] in parameters or model.parameters[i].owner in ("base", "tool")]
    return Prepared(start, model, samples, measured, alignment, asked)


def parameter_names(model: _core.ErrorModel) -> list[str]:
    """Names such as "joint2 a", in the order of the model."""
    return [full_name(parameter) for parameter in model.parameters]


def calibrate(
    robot: RobotLike,
    data: DataLike,
    *,
    test: DataLike | None = None,
    effects: str | Sequence[str] = "geometry",
    parameters: Sequence[str] | None = None,
    method: str = "nls",
    loss: str = "tukey",
    priors: bool = False,
    equilibrium: bool | None = None,
    max_iterations: int = 100,
    as_read: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Identifies a robot from measured poses.

    Args:
        robot: Nominal robot, or an identified one as a new start; its effects stay and are identified again. A path,
            the name of a shipped arm and a mapping are read.
        data: Measured poses, or the path of their file, or a pandas table; read-back joint positions are never used.
        test: Other poses, only reported on.
        effects: Names as on the command line; base and tool are always identified.
        parameters: Exactly these besides base and tool, such as "joint2 a" (`Robot.parameter_names`); the others keep
            their values. None: all parameters of `effects`.
        method: nls (Levenberg-Marquardt), bfgs (PMC paper: BFGS on the root of the mean squared distance),
            bfgs_mean_distance (its printed cost).
        loss: Robust loss on the whitened error of a row: tukey, huber, cauchy, none.
        priors: Hold parameters near nominal with a standard deviation of three plausible sizes.
        equilibrium: Take loads in the deflected posture (True) or in the undeflected one, to first order (False, as the
            papers do); the model keeps it. None: as the robot says, which is True unless its file has `equilibrium:
            false`.
        max_iterations: Of one solve.
        as_read: Take the columns of `data` as they are, though another reading of them may fit far better, and return
            a fit that explains nothing: `notes` say so. Not checking saves some 0.05 s.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown effect, parameter, loss or method, data without a measured column, or columns that
            were probably meant otherwise.
    """
    if loss not in LOSSES:
        raise InvalidInput(f"loss must be one of {', '.join(LOSSES)}, got '{loss}'")
    if method not in METHODS:
        raise InvalidInput(f"method must be one of {', '.join(METHODS)}, got '{method}'")
    robot = as_robot(robot)
    data = as_data(data, robot)
    test = None if test is None else as_data(test, robot)
    say = progress or (lambda text: None)
    say("looking at the columns")
    suspected = check_columns(robot, data, as_read=as_read)
    say("aligning base and tool")
    start, model, samples, measured, alignment, asked = prepare(
        robot, data, effects=effects, parameters=parameters, equilibrium=equilibrium, threads=threads
    )
    names = parameter_names(model)

    say("identifying")
    start = with_critical_loads(start, model, samples, measured, asked, alignment.anchors, loss=loss, threads=threads)
    start = with_open_effects_set(
        start, model, samples, measured, asked, alignment.anchors, data, loss=loss, threads=threads
    )
    model = start.error_model.with_robot(model.robot)
    pulled = pulls(start, model, samples, measured, asked, alignment.anchors, loss=loss, threads=threads)
    found = _core.identify(
        model,
        samples,
        measured,
        asked=asked,
        anchors=alignment.anchors,
        method=method,
        loss=loss,
        max_iterations=max_iterations * (5 if pulled else 1),  # curves creep along what they share with geometry
        threads=threads,
        **parameter_limits(start, model, len(alignment.anchors), priors=priors),
        **pulled,
    )

    say("reporting")
    aligned = Robot(with_frames(start.spec, alignment.T_world_base, alignment.T_flange_tool))
    identified_spec = identified(start, model, found)
    free_names = [full_name(found.parameters[i]) for i in found.free]
    covariance = np.asarray(found.covariance)
    sigma = found.sigma[0] if found.sigma[0] > 0 else found.sigma[2]
    kept = [k for k, i in enumerate(found.free) if i < len(names)]
    if kept:
        record = CalibrationRecord(
            [free_names[k] for k in kept],
            lower_root(covariance[np.ix_(kept, kept)]),
            from_si(sigma, "mm"),
            found.degrees_of_freedom,
        )
        identified_spec["calibration"] = record.to_spec() | {"nominal": nominal_record(start.spec)}
    result_model = Robot(identified_spec)
    places = anchor_places(found, data, len(names))
    places_before = (
        dict(zip(data.anchor_names, np.asarray(alignment.anchors), strict=True)) if data.distance is not None else {}
    )
    judge: dict[str, Any] = {"before": aligned, "anchors": places, "anchors_before": places_before, "threads": threads}
    table, table_covariance = parameter_table(start, model, found, data)
    beyond = [] if test is None else [f"{test.source}: {note}" for note in range_notes(result_model, test)]
    train = evaluate(result_model, data, **judge)
    return CalibrationResult(
        status=found.status,
        message=found.message,
        model=result_model,
        nominal=aligned,
        loss=loss,
        method=method,
        parameters=table,
        covariance=table_covariance,
        unidentifiable=[
            Unidentifiable(text, [names[i] for i in parts if i < len(names)])
            for text, parts in zip(found.unidentifiable, found.unidentifiable_parts, strict=True)
        ],
        correlated=correlated_pairs(free_names, covariance),
        rank=found.rank,
        asked_count=len(found.free) + len(found.held),
        degrees_of_freedom=found.degrees_of_freedom,
        iterations=found.iterations,
        sigma=sigma,
        sigma_note=sigma_note(found, data),
        outliers=outlier_rows(found),
        weights=np.asarray(found.weights),
        train=train,
        test=None if test is None else evaluate(result_model, test, **judge),
        notes=[
            *suspected,
            *check_fit(robot, train, as_read=as_read),
            *_notes(result_model, data),
            *added_setups(start, robot, effects),
            *beyond,
        ],
        anchors=places,
    )


def _notes(model: Robot, data: Dataset) -> list[str]:
    """The data's own, but for columns that are used, and where directions of approach come from."""
    used = extra_columns(model.spec.get("effects") or [])
    out = [note for note in data.notes if not any(note.startswith(f"column '{name}' is not known") for name in used)]
    sided = [column for effect in model.effects for column in effect.data_columns if column.startswith("approach")]
    if sided and data.approach is None:
        out.append("there is no approach column: the direction of each joint is that from the row before")
    return out


def asked_parameters(model: _core.ErrorModel, geometry: bool, *, turned: bool, placed: bool) -> list[int]:
    """Base and tool always (as far as the kind of measurement can show them), geometry where asked, every effect."""
    out = []
    own = len(model.robot.parameters)
    for i, parameter in enumerate(model.parameters):
        if i >= own:
            out.append(i)
        elif parameter.owner == "base":
            if placed:
                out.append(i)
        elif parameter.owner == "tool":
            if turned or not parameter.name.startswith("r"):
                out.append(i)
        elif geometry:
            out.append(i)
    return out
