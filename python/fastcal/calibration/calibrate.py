# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibration: from a robot and measured poses to the identified model and its uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.alignment import align as align
from fastcal.calibration.best_fit import BestFit, Way, best_fit
from fastcal.calibration.bounds import bounds_reached
from fastcal.calibration.camera_places import camera_places, exchanged_names, turned_pictures
from fastcal.calibration.critical_loads import with_critical_loads
from fastcal.calibration.data_notes import (
    covered,
    instrument_notes,
    shared_row_notes,
    thin_data_notes,
    unseen_directions,
)
from fastcal.calibration.evaluation import Evaluation, judged
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.freed_lenses import with_freed_lenses
from fastcal.calibration.inspection import check_columns, check_fit, check_lengths
from fastcal.calibration.kind_misfits import kind_misfits
from fastcal.calibration.kind_noise import noise_record
from fastcal.calibration.known_lengths import known_lengths, length_notes
from fastcal.calibration.known_rig import without_contradicted_places
from fastcal.calibration.lens_start import with_started_lenses
from fastcal.calibration.long_rows import covered_by_all, judged_on_all, long_notes, shown
from fastcal.calibration.nominal_arm import nominal_arm
from fastcal.calibration.parallel import one_blas_thread
from fastcal.calibration.parameter_table import (
    correlated_pairs,
    parameter_table,
)
from fastcal.calibration.picture_outliers import outlier_notes
from fastcal.calibration.pictures import Pictures, check_pictures, judged_pictures, seen_by_model
from fastcal.calibration.placed_test import evaluated_test, other_place_notes
from fastcal.calibration.postures import check_postures, saturated
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.result import CalibrationResult as CalibrationResult
from fastcal.calibration.result import IdentifiedParameter as IdentifiedParameter
from fastcal.calibration.result import Unidentifiable as Unidentifiable
from fastcal.calibration.setups import added_setups, thrown_out
from fastcal.calibration.shape import shape_of
from fastcal.calibration.touch_columns import check_touches
from fastcal.calibration.unknowns import (
    CORNERS,
    given_rig,
    kept_unknowns,
    unknowns_by_owner,
    unknowns_found,
    unknowns_with_covariance,
)
from fastcal.calibration.unset_options import fill_unset_options
from fastcal.calibration.variance_components import freedom_of_parameters
from fastcal.effects.entries import extra_columns, full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.measurements.measuring_order import in_order, of_unknown_order
from fastcal.robot.calibration_record import LACKS_EFFECT, CalibrationRecord
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.given import DataLike, RobotLike, RowsLike, as_data, as_robot, as_rows
from fastcal.robot.identified_spec import identified_spec
from fastcal.robot.made_by import made_by
from fastcal.robot.rig import with_found
from fastcal.robot.robot import Robot
from fastcal.said import joined, said

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]

LOSSES = ("tukey", "huber", "cauchy", "none")
METHODS = ("nls", "bfgs", "bfgs_mean_distance")
SOLVERS = ("newton", "ceres")


@one_blas_thread()
def calibrate(
    robot: RobotLike,
    data: RowsLike,
    *,
    test: DataLike | None = None,
    effects: str | Sequence[str] = "geometry",
    parameters: Sequence[str] | None = None,
    method: str = "nls",
    solver: str = "newton",
    loss: str = "tukey",
    priors: bool | None = None,
    equilibrium: bool | None = None,
    max_iterations: int = 100,
    as_read: bool = False,
    mend: bool = False,
    checks: bool = True,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Identifies a robot from measured poses.

    Args:
        robot: Nominal robot, or an identified one as a new start; its effects stay and are identified again. A path,
            the name of a shipped arm and a mapping are read.
        data: Measured poses, or the path of their file, or a pandas table, or a LongDataset, as which a file of very
            many rows is opened; read-back joint positions are never used.
        test: Held-out poses, never used for fitting.
        effects: Names as on the command line; base and tool are always identified.
        parameters: Exactly these besides base and tool, such as "joint2 a" (`Robot.parameter_names`); the others keep
            their values. None: all parameters of `effects`.
        method: nls (nonlinear least squares), bfgs (PMC paper: BFGS on the root of the mean squared distance),
            bfgs_mean_distance (its printed cost).
        solver: Of nls. newton: Newton's steps with the exact second derivatives of the loss first, Ceres' trust region
            where one is refused or bounds are in the way. ceres: Ceres' trust region alone.
        loss: Robust loss on the whitened error of a row: tukey, huber, cauchy, none.
        priors: Hold parameters near nominal. None: the geometry, where the poses are few for their noise, by as much
            as the measurements say (`shrinkage`). True: all, with a standard deviation of three plausible sizes.
            False: none.
        equilibrium: Take loads in the deflected posture (True) or in the undeflected one, to first order (False, as the
            papers do); the model keeps it. None: as the robot says, which is True unless its file has `equilibrium:
            false`.
        max_iterations: Of one solve.
        as_read: Take the columns of `data` as they are, though another reading of them may fit far better, and return
            a fit that explains nothing: `notes` say so.
        mend: Put pictures that are in the wrong rows where they fit, instead of leaving them out, and identify a lens
            that the pictures contradict (`freed_lenses`), though the file says that it is known; not with `as_read`.
        checks: Look for other readings of the columns, for a part of the rows that moved, for noise with a memory and
            for what depends on the posture: ten times as long as the fit of a hundred rows. False: the fit alone.
        who: What the model shall keep beside hashes of robot and data: serial, instrument, operator, date (YYYY-MM-DD).
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
    if solver not in SOLVERS:
        raise InvalidInput(f"solver must be one of {', '.join(SOLVERS)}, got '{solver}'")
    if solver == "ceres":
        if method != "nls":
            raise InvalidInput(f"the solver ceres is for the method nls, got '{method}'")
        method = "ceres"
    robot = as_robot(robot)
    if robot.of_poses:
        parameters = _none_of_poses(robot, effects, parameters)
    given = as_rows(data, robot)
    data, rows = (in_order(given), None) if isinstance(given, Dataset) else shown(given)
    long = given if isinstance(given, LongDataset) and rows is not None else None
    test = None if test is None else of_unknown_order(as_data(test, robot))
    origin = made_by(robot, given, who)
    report = progress or (lambda text: None)
    report(said("checking the columns"))
    robot, of_lenses = with_started_lenses(robot, data)
    looked = judged_pictures(robot, data, mend=mend, threads=threads) if checks else Pictures(data)
    looked = replace(looked, notes=(*of_lenses, *looked.notes))
    data = looked.data
    suspected = [*check_postures(data, parameters), *check_pictures(looked, as_read=as_read)]
    suspected += check_columns(robot, data, as_read=as_read) if checks else []
    report(said("aligning base and tool"))
    prepared_of = partial(
        prepare,
        data=data,
        effects=effects,
        parameters=parameters,
        equilibrium=equilibrium,
        loss=loss,
        threads=threads,
        long=long,
    )
    robot, against = without_contradicted_places(robot, data, prepared_of, looks=checks and long is None)
    prepared = partial(prepared_of, robot)
    problem = prepared()

    report(said("identifying"))
    way = Way(method, max_iterations, bool(priors), priors is None and parameters is None, checks)
    fit = _fitted(prepared, problem, way, len(given), may_add=parameters is None and long is None)
    fit, of_lens = with_freed_lenses(fit, way, len(given), mend=mend and not as_read) if checks else (fit, [])
    problem, found, seen = fit.problem, fit.found, fit.checks
    # Rows of columns that are taken as they are agree on nothing: they are no gross points.
    agrees_on_nothing = bool(suspected) and found.status == "converged" and fit.status == "not_converged"

    few = saturated(data, found) if long is None and not priors else None
    report(said("reporting"))
    start, model, names = problem.robot, problem.model, problem.names
    before = nominal_arm(problem)
    found_spec = identified_spec(start, model, found)
    free = found.free  # a copy each time it is asked for, as all of the core's lists are
    every = [full_name(parameter) for parameter in found.parameters] if problem.unknown_count else names
    free_names = [every[i] for i in free]
    covariance, root, noise, freedom = fit.uncertainty()
    kept = [k for k, i in enumerate(free) if i < len(names)]
    places, std = unknowns_found(found, len(names), covariance)
    found_spec = with_found(found_spec, problem.measured.parameters, places, std)
    lacks_effect = any(caveat != seen.bent for caveat in seen.caveats)
    if kept or CORNERS in data.kinds:
        record = CalibrationRecord(
            [free_names[k] for k in kept],
            root[: len(kept), : len(kept)],  # anchors come last
            noise_record(noise),
            freedom,
            *unseen_directions(found, names),
            covered(start, data) if long is None else covered_by_all(start, long),
            *kept_unknowns(found, problem.measured, len(names), covariance),
        )
        lacks = {LACKS_EFFECT: True} if lacks_effect else {}
        found_spec["calibration"] = record.to_spec() | {"nominal": nominal_record(start.spec)} | lacks
    result_model = Robot.keeping(found_spec | {"made_by": origin})
    unknowns = unknowns_by_owner(problem.measured, places) | given_rig(result_model, data)
    judge: dict[str, Any] = {
        "before": before.judged,
        "unknowns": unknowns,
        "unknowns_before": before.unknowns,
        "threads": threads,
    }
    reached = bounds_reached(problem, found, fit.limits)
    table, table_covariance = parameter_table(start, model, found, covariance, reached)
    beyond = [] if test is None else [joined(": ", [test.source, note]) for note in range_notes(result_model, test)]
    if test is not None:
        seen_in_test = seen_by_model(result_model, test, threads, mend=mend)
        test, beyond = seen_in_test.data, [*(joined(": ", [test.source, note]) for note in seen_in_test.notes), *beyond]
    tested, placing = (None, []) if test is None else evaluated_test(result_model, before.judged, test, judge)
    # Without effects all robots of a kind read the same of the rows.
    train = judged(result_model, data, **judge, samples=None if start.effects else problem.samples)
    shape = shape_of(result_model, data) if kept else None
    misfits = (
        []
        if fit.status == "too_few_equations"
        else kind_misfits(result_model, data, train, unknowns, threads, lacks_effect=lacks_effect)
    )
    if long is not None and rows is not None:
        train = judged_on_all(train, rows, long, result_model, **judge)
    asked: dict[str, Any] = {"effects": effects, "parameters": parameters, "threads": threads}
    judged_touches = {"shows_scale": problem.measured.shows_scale, "looks": checks and long is None, "as_read": as_read}
    of_touches = check_touched(robot, data, (table, train), **judged_touches, **asked)
    doubts = [*suspected, *check_fit(robot, train, as_read=as_read), *of_touches, *seen.choices]
    touched = unknowns_with_covariance(found, problem.measured, len(names), covariance)
    lengths = known_lengths(start.description.known_distances, *touched)
    cameras = camera_places(problem, found, covariance, freedom, result_model) if long is None else []
    return CalibrationResult(
        status="too_few_equations" if few else "converged" if agrees_on_nothing else fit.status,
        message=few or fit.message,
        model=result_model,
        nominal=before.robot,
        loss=found.loss if loss != "none" else loss,
        method=method,
        parameters=table,
        covariance=table_covariance,
        unidentifiable=[
            Unidentifiable(text, [names[i] for i in parts if i < len(names)])
            for text, parts in zip(found.unidentifiable, found.unidentifiable_parts, strict=True)
        ],
        correlated=correlated_pairs(free_names, covariance),
        rank=found.rank,
        asked_count=len(free) + len(found.held),
        degrees_of_freedom=freedom,
        iterations=found.iterations,
        noise=noise,
        outliers=sorted({*found.outliers, *seen.set_aside}),
        weights=np.asarray(found.weights),
        train=train,
        test=tested,
        misfits=misfits,
        caveats=seen.caveats,
        bent=seen.bent,
        doubts=doubts,
        shape=shape,
        notes=[
            *(misfit.text for misfit in misfits),
            *seen.caveats,
            *looked.notes,
            *of_lens,
            *against,
            *([] if shape is None else [shape.note]),
            *doubts,
            *(outlier_notes(result_model, data, found.outliers, train.kinds[CORNERS]) if cameras else []),
            *exchanged_names(robot.description, result_model.description),
            *turned_pictures(robot.description, result_model.description),
            *_notes(result_model, data),
            *length_notes(start.description.known_distances, lengths),
            *([] if long is None else long_notes(long, data)),
            *instrument_notes(result_model, data),
            *added_setups(start, robot, effects),
            *thin_data_notes(found, loss),
            *(p.bound.note(f"{p.owner} {p.name}", p.value, p.unit) for p in table if p.bound is not None),
            *(note for note in seen.notes if note not in (*seen.caveats, *doubts)),
            *([fit.message] if agrees_on_nothing else []),
            *([] if test is None else shared_row_notes([data] if long is None else long.parts(moves=False), test)),
            *([] if tested is None else other_place_notes(tested)),
            *placing,
            *beyond,
        ],
        held="" if fit.held is None else fit.held.note,
        unknowns=unknowns,
        known_lengths=lengths,
        cameras=cameras,
        own_freedom=freedom_of_parameters(problem, found) if fit.held is None else None,
        reaches=fit.reaches,
    )


def _none_of_poses(robot: Robot, effects: str | Sequence[str], parameters: Sequence[str] | None) -> list[str]:
    """The parameters of an arm of which only the flange's pose is known: it has none."""
    if parameters or effects not in ("geometry", "", [], ["geometry"]):
        raise InvalidInput(
            f"{robot.name} is known only by the poses of its flange (robot: pose), so it has no parameters to "
            "identify; give the arm's file and its joint positions for that"
        )
    return []


def check_touched(
    robot: Robot,
    data: Dataset,
    found: tuple[Sequence[IdentifiedParameter], Evaluation],
    *,
    shows_scale: bool,
    looks: bool,
    as_read: bool,
    **options: Any,
) -> list[str]:
    """`check_lengths` of a calibration, where nothing shows a scale, and `check_touches`, where one looks.

    Args:
        robot: As it came.
        data: What was read.
        found: What was identified, and its errors.
        shows_scale: Shows what was read the scale of all lengths?
        looks: Are other readings of the columns tried?
        as_read: Tell instead of refusing.
        options: Of `calibrate`.
    """

    def refit(other: Dataset) -> Evaluation:
        return calibrate(robot, data=other, as_read=True, checks=False, **options).train

    shrunk = [] if shows_scale else check_lengths(robot, found[0], data, as_read=as_read)
    return [*shrunk, *(check_touches(robot, data, found[1], refit, as_read=as_read) if looks else [])]


def _fitted(
    prepared: Callable[..., CalibrationProblem],
    problem: CalibrationProblem,
    way: Way,
    row_count: int,
    *,
    may_add: bool,
) -> BestFit:
    """The best fit; where it leaves out most rows of a station or a mount, beside a set-up of their own."""

    def fitted(problem: CalibrationProblem) -> BestFit:
        return best_fit(fill_unset_options(with_critical_loads(problem)), way, row_count)

    def left_out(fit: BestFit) -> set[int]:
        return {*fit.found.outliers, *fit.checks.set_aside}

    fit = fitted(problem)
    moved = thrown_out(problem.robot, problem.data, sorted(left_out(fit))) if may_add else set()
    if not moved:
        return fit
    again = fitted(prepared(moved=moved))
    return again if again.status == "converged" and len(left_out(again)) < len(left_out(fit)) else fit


def _notes(model: Robot, data: Dataset) -> list[str]:
    """The data's own, but for columns that are used, and where directions of approach come from."""
    used = extra_columns(model.entries)
    out = [note for note in data.notes if not any(note.startswith(f"column '{name}' is not known") for name in used)]
    sided = [column for effect in model.effects for column in effect.data_columns if column.startswith("approach")]
    if sided and data.approach is None:
        out.append("there is no approach column: the direction of approach of each joint is taken from the row before")
    return out
