# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where model and measurements disagree, which effect is missing, and what adding it gains: docs/diagnosis.md."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.calibration.alignment import measurements
from fastcal.calibration.calibrate import calibrate, check_touched
from fastcal.calibration.data_notes import shared_row_notes
from fastcal.calibration.inspection import check_columns, check_fit
from fastcal.calibration.kind_misfits import gross_misfits
from fastcal.calibration.lens_start import with_started_lenses
from fastcal.calibration.parallel import workers
from fastcal.calibration.pictures import check_pictures, judged_pictures
from fastcal.calibration.placed_test import other_place_notes, placing_notes
from fastcal.calibration.postures import check_postures, too_few_postures
from fastcal.calibration.touch_columns import is_touched
from fastcal.diagnosis import rivals, rules, suspect_columns, unexplained
from fastcal.diagnosis.against_load import is_against_load, with_deflections_against_load
from fastcal.diagnosis.branch_posture import unrecorded_branch
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.found import Asked, Found, verdict_of
from fastcal.diagnosis.held_out_gains import borne_out
from fastcal.diagnosis.library import build_library, parse_exclusions
from fastcal.diagnosis.loop_causes import found_loop_cause
from fastcal.diagnosis.many_rows import all_moved, searched_rows
from fastcal.diagnosis.noise import with_estimated_noise
from fastcal.diagnosis.one_curve import waves_of_one_curve, with_orders_between
from fastcal.diagnosis.periodic import is_periodic
from fastcal.diagnosis.plain_models import beside_plain, best_of_all, best_of_few
from fastcal.diagnosis.problem import prepared_problem
from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.diagnosis.rig_causes import found_rig_causes
from fastcal.diagnosis.rounds import claimed, searched
from fastcal.diagnosis.scans import beside_lost_rows
from fastcal.diagnosis.scattered_rows import are_noise, may_hide, scattered_rows
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.sure_names import Told, sure_names
from fastcal.diagnosis.surrogate_bases import best_with_surrogate
from fastcal.diagnosis.words import sentence_of
from fastcal.effects.rig_traits import ALIKE, RIG_TRAITS
from fastcal.errors import InvalidInput
from fastcal.measurements.copied_rows import counted_once
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.measuring_order import in_order, of_unknown_order
from fastcal.measurements.observations import without_kinds, without_measured
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot
from fastcal.said import capital, joined, said

# Rows that may lie off together and be left out [of all]: of more, the rest is no majority.
MAX_MOVED_SHARE = 0.35


def diagnose(
    robot: RobotLike,
    data: DataLike,
    *,
    test: DataLike | None = None,
    exclude: Collection[str] = (),
    sigma: float | None = None,
    as_read: bool = False,
    mend: bool = False,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Finds what a robot's model is missing, names it or reports that the data cannot decide, and adds it.

    Args:
        robot: Nominal, or identified with effects: those stay and are identified again. A path, the name of a shipped
            arm and a mapping are read.
        data: Measured poses, or the path of their file, or a pandas table.
        test: Held-out poses, never used for fitting.
        exclude: Names that are not to be given, `EFFECT` or `EFFECT@OWNER`.
        sigma: Standard deviation of a measured coordinate [m], where the data have no column for it.
        as_read: Take the columns of `data` as they are, as in `calibrate`.
        mend: Put pictures that are in the wrong rows where they fit, as in `calibrate`.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown effect or owner to exclude, a sigma that is none, data without a measured column, or
            columns that were probably meant otherwise.
    """
    notify = progress or (lambda text: None)
    if sigma is not None and not (np.isfinite(sigma) and sigma > 0):
        raise InvalidInput(f"sigma must be a standard deviation above 0, got {sigma}")
    robot = as_robot(robot)
    if robot.of_poses:
        raise InvalidInput(
            f"{robot.name} is known only by the poses of its flange (robot: pose), in which causes of an arm's error "
            "cannot be told apart; give the arm's file and its joint positions"
        )
    rows = counted_once(in_order(as_data(data, robot)))
    robot, of_lenses = with_started_lenses(robot, rows)
    looked = judged_pictures(robot, rows, mend=mend, threads=threads)
    data = looked.data
    test = None if test is None else of_unknown_order(as_data(test, robot))
    notify(said("checking the columns"))
    check_postures(data)
    suspected = [*check_pictures(looked, as_read=as_read), *check_columns(robot, data, as_read=as_read)]
    suspected += _of_touches(robot, data, threads, as_read=as_read)
    misfits = gross_misfits(robot, data, threads)
    data = without_kinds(data, [misfit.kind.name for misfit in misfits])
    of_the_arm = [name for name in exclude if name.partition("@")[0] not in RIG_TRAITS]
    library = build_library(robot, data, parse_exclusions(of_the_arm, robot))
    notify(said("locating cameras and boards"))
    robot, of_the_rig = found_rig_causes(robot, data, library.names, exclude, threads)
    with workers(threads):
        asked = Asked(robot, data, test, library, sigma, threads, notify)
        found = _without_wrong_rows(asked)
        reading = None
        if found.rows is None:
            beside = found
            if suspect_columns.may_be_wrong(data) and found.search.problem.noise.repeatability > 0:
                # Rows that miss by loads they did not have look like noise of the joints.
                beside = _found(asked, found.lost, joints_repeat=True)
            reading = suspect_columns.suspected(beside.search, beside.told.best)
        if reading is not None:
            notify(said("trying another reading of a column"))
            data = reading.of(data)
            library = build_library(robot, data, library.excluded)
            found = _found(replace(asked, data=data, library=library), found.lost)
        notify(said("adding the effects found"))
        result = found.result(misfits)
        if reading is not None:
            sentence = joined("", [capital(reading.words), ". ", result.sentence])
            result = replace(result, sentence=sentence, notes=[reading.words, *result.notes])
    unexplained_by_any = check_fit(robot, result.steps[0].train, as_read=as_read)
    shared = [] if test is None else [*shared_row_notes([data], test), *placing_notes(result.model, test)]
    shared += [] if result.test is None else other_place_notes(result.test)
    of_the_file = [
        found_loop_cause(robot, found.fit, exclude, all_found=result.unexplained is None),
        unrecorded_branch(robot, data, found.fit, exclude),
    ]
    result = _beside([*of_the_rig, *filter(None, of_the_file)], result)
    alike = [ALIKE[f.effect] for f in of_the_rig if f.grade != "A" and f.effect in ALIKE]
    told = [*of_lenses, *looked.notes, *(misfit.text for misfit in result.misfits), *suspected, *alike]
    return replace(result, notes=[*told, *unexplained_by_any, *shared, *result.notes])


def _of_touches(robot: Robot, data: Dataset, threads: int, *, as_read: bool) -> list[str]:
    """`check_touched` of the geometry, held no more than `calibrate` holds it, where no point was measured."""
    if not is_touched(data):
        return []
    try:
        free = calibrate(robot, data, as_read=True, checks=False, threads=threads)
    except InvalidInput:  # of what no geometry can be found from, which the diagnosis says itself
        return []
    how: dict[str, Any] = {"shows_scale": measurements(data, robot).shows_scale, "looks": True, "as_read": as_read}
    return check_touched(robot, data, (free.parameters, free.train), **how, threads=threads)


def _beside(findings: Sequence[Finding], found: Diagnosis) -> Diagnosis:
    """A diagnosis of the arm, and what is wrong with cameras and boards."""
    if not findings:
        return found
    effects = [*findings, *found.effects]
    named = replace(found, effects=effects, verdict=verdict_of(effects, found.unexplained))
    if not found.effects and found.unexplained is None:
        return replace(named, sentence=sentence_of(named))
    own = sentence_of(replace(named, effects=[*findings], gap=[]))
    return replace(named, sentence=joined(" ", [own, found.sentence]))


def _without_wrong_rows(asked: Asked) -> Found:
    """`_found`, again without rows that are grossly wrong beside it, or that a robust fit leaves out and rightly."""
    found = _found(asked)
    for _ in range(rules.MAX_REFITS):
        gross = found.gross
        if not gross:
            break
        found = _again_without(gross, found)
    scattered = scattered_rows(asked.robot, asked.data)
    if not scattered or not may_hide(found, scattered):
        return found
    fewer = _again_without(scattered, found)
    return fewer if are_noise(found, fewer) else found


def _again_without(rows: Sequence[int], found: Found) -> Found:
    """What is found where some rows more are not looked at."""
    lost = sorted({*found.lost, *rows})
    found.asked.notify(said("trying without {count} rows that nothing explains", count=len(lost)))
    return _found(found.asked, lost)


def _found(asked: Asked, lost: Sequence[int] = (), *, joints_repeat: bool = False) -> Found:
    """`diagnose` without its result, its arguments checked; `lost` are rows that are not looked at.

    `joints_repeat`: as `Problem` has it.
    """
    robot, data, sigma, notify = asked.robot, asked.data, asked.sigma, asked.notify
    notify(said("fitting the geometry"))
    trusted = without_measured(data, np.array(lost, dtype=np.intp)) if lost else data
    rows = searched_rows(trusted, robot)
    looked_at = trusted if rows is None else trusted.select(rows)
    problem = prepared_problem(
        robot, looked_at, asked.library.names, claimed(looked_at, sigma), asked.threads, asked.library.excluded
    )
    problem = replace(problem, joints_repeat=joints_repeat)
    geometry = fit(problem, [])
    few = _too_few_postures(looked_at, geometry)
    notify(said("estimating the noise"))
    problem, level = with_estimated_noise(problem, geometry, sigma)
    if few:
        plain = rivals.Rivals(Search(replace(problem, names=[]), notify))
        told = Told(plain.search.start, plain.search.start, remains=False, unsure={})
        written = best_of_few(plain)
        return Found(asked, rows, plain.search, written, told, level, few=few)
    moved = all_moved(level.moved, trusted, rows)
    if moved and len(lost) + len(moved) <= MAX_MOVED_SHARE * data.measured.sum():
        notify(said("trying without {count} rows that are off together", count=len(moved)))
        gone = sorted({*lost, *moved})
        return _found(asked, gone, joints_repeat=joints_repeat)
    plain, best, level = searched(problem, level, sigma, notify)
    search = plain.search
    if not best.suffices and (search.explains_little(best) or unexplained.one_block_does_better(search, best)):
        best = search.start  # what explains so little is no name
    best = with_orders_between(search, best)
    curve = waves_of_one_curve(search, best)
    best = search.pruned(best) if curve is None else curve[1]
    best = beside_lost_rows(search, borne_out(search, best))
    notify(said("testing alternative causes"))
    model = rivals.bare(best)
    remains = unexplained.remains(best)
    other = _against_load(asked, search, best, lost, joints_repeat=joints_repeat) if remains else None
    if other is not None:
        return other
    is_curved = remains or sum(map(is_periodic, best.names)) > 1  # waves of several orders draw any curve
    if is_curved and search.problem.noise.repeatability > 0:
        notify(said("trying without noise of the joints"))
        return _found(asked, lost, joints_repeat=True)
    if is_curved:
        profiles = unexplained.curved_joints(best) if curve is None else [rivals.profile(curve[0])]
        model = plain.best_predicting(best, profiles)
    level = level.calmer(model.noise) if model.profiles else level
    final = model.state if not model.profiles else SearchNode(model.fit, search.start.family)
    remains = remains if final is best else unexplained.remains(final)
    sure, unsure = sure_names(search, best) if final is best else (best, {})
    told = Told(model.state, final, remains, unsure)
    model = rivals.bare(sure) if unsure else model
    notify(said("comparing with plain models"))
    written = best_of_all(plain, model, remains=remains)
    if rows is None and remains:
        simpler = {id(one.fit): one for one in map(rivals.bare, (search.start, model.state))}
        written = best_with_surrogate(written, list(simpler.values()), level, asked.threads)
    told = beside_plain(told, written) if written.is_plain else told
    return Found(asked, rows, search, written, told, level, tuple(lost))


def _against_load(
    asked: Asked, search: Search, best: SearchNode, lost: Sequence[int], *, joints_repeat: bool
) -> Found | None:
    """What is found with deflections against their loads, if that leaves nothing; else None."""
    library = with_deflections_against_load(asked.library, search, best)
    if library is None:
        return None
    asked.notify(said("trying deflections against their loads"))
    found = _found(replace(asked, library=library), lost, joints_repeat=joints_repeat)
    return found if not found.told.remains and any(map(is_against_load, found.best.names)) else None


def _too_few_postures(data: Dataset, plain: Fit) -> str:
    """Why no cause can be looked for: the rows hold no more numbers than the geometry has parameters; else empty."""
    if not too_few_postures(data, len(plain.free)):
        return ""
    A, _, row = plain.whitened
    seen = A[row >= 0] / np.maximum(np.linalg.norm(A[row >= 0], axis=0), np.finfo(np.float64).tiny)
    return too_few_postures(data, int(np.linalg.matrix_rank(seen))) or ""


__all__ = ["Diagnosis", "diagnose"]
