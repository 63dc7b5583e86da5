# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where model and measurement disagree, which effect is missing, and what adding it mends: docs/diagnosis.md."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.data_notes import shared_row_notes
from fastcal.calibration.inspection import check_columns, check_fit
from fastcal.calibration.kind_misfits import gross_misfits, kind_misfits
from fastcal.calibration.parallel import each, workers
from fastcal.calibration.pictures import judged_pictures
from fastcal.calibration.placed_test import placing_notes
from fastcal.calibration.pose_folds import along_a_path
from fastcal.calibration.postures import check_postures, too_few_postures
from fastcal.diagnosis import adaptation, grading, rivals, rules, sensitivity, suspect_columns, unexplained
from fastcal.diagnosis.fits import Fit, fit, is_beyond_bounds
from fastcal.diagnosis.heavy_tails import weighed
from fastcal.diagnosis.library import Hypothesis, Library, build_library, parse_exclusions
from fastcal.diagnosis.many_rows import all_moved, on_all_rows, searched_rows
from fastcal.diagnosis.memory import with_memory_named
from fastcal.diagnosis.noise import (
    NoiseLevel,
    out_of_reach,
    over_claim,
    row_run_notes,
    sharing_no_posture,
    with_estimated_noise,
)
from fastcal.diagnosis.noise_scales import noise_by_kind
from fastcal.diagnosis.one_curve import waves_of_one_curve, with_orders_between
from fastcal.diagnosis.periodic import fine_looks, is_periodic
from fastcal.diagnosis.plain_models import Judged, beside_plain, best_of_all
from fastcal.diagnosis.plan import SeparatingPlan, separating_plan
from fastcal.diagnosis.problem import Problem, prepared_problem
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.remaining_surrogate import with_surrogate
from fastcal.diagnosis.result import AdaptedModel, Diagnosis, Finding, Unexplained
from fastcal.diagnosis.rig_causes import found_rig_causes
from fastcal.diagnosis.robust_rows import gross_rows
from fastcal.diagnosis.rounds import claimed, searched
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.sure_names import Told, replacement, sure_names
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.words import noise_doubts, sentence_of
from fastcal.effects.entries import curve_of, label
from fastcal.effects.rig_traits import RIG_TRAITS
from fastcal.errors import InvalidInput
from fastcal.measurements.copied_rows import counted_once
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import KindMisfit
from fastcal.measurements.measuring_order import in_order, of_unknown_order
from fastcal.measurements.observations import without_kinds, without_measured
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot, Spec


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
    looked = judged_pictures(robot, counted_once(in_order(as_data(data, robot))), mend=mend, threads=threads)
    data = looked.data
    test = None if test is None else of_unknown_order(as_data(test, robot))
    notify("looking at the columns")
    check_postures(data)
    suspected = check_columns(robot, data, as_read=as_read)
    misfits = gross_misfits(robot, data, threads)
    data = without_kinds(data, [misfit.kind.name for misfit in misfits])
    of_the_arm = [name for name in exclude if name.partition("@")[0] not in RIG_TRAITS]
    library = build_library(robot, data, parse_exclusions(of_the_arm, robot))
    notify("looking at cameras and boards")
    robot, of_the_rig = found_rig_causes(robot, data, library.names, exclude, threads)
    with workers(threads):
        found = _found(robot, data, test, library, sigma, threads, notify)
        for _ in range(rules.MAX_REFITS):
            gross = found.gross
            if not gross:
                break
            lost = sorted({*found.lost, *gross})
            notify(f"without {len(lost)} rows that nothing explains")
            found = _found(robot, data, test, library, sigma, threads, notify, lost)
        reading = None if found.rows is not None else suspect_columns.suspected(found.search, found.told.best)
        if reading is not None:
            notify("with another reading of the payload")
            data = reading.of(data)
            library = build_library(robot, data, library.excluded)
            found = _found(robot, data, test, library, sigma, threads, notify, found.lost)
        notify("adding what was found")
        result = found.result(misfits)
        if reading is not None:
            sentence = f"{reading.words[0].upper()}{reading.words[1:]}. {result.sentence}"
            result = replace(result, sentence=sentence, notes=[reading.words, *result.notes])
    unexplained_by_any = check_fit(robot, result.steps[0].train, as_read=as_read)
    shared = [] if test is None else [*shared_row_notes([data], test), *placing_notes(result.model, test)]
    result = _beside(of_the_rig, result)
    told = [misfit.text for misfit in result.misfits]
    return replace(result, notes=[*looked.notes, *told, *suspected, *unexplained_by_any, *shared, *result.notes])


def _beside(findings: Sequence[Finding], found: Diagnosis) -> Diagnosis:
    """A diagnosis of the arm, and what is wrong with cameras and boards."""
    if not findings:
        return found
    effects = [*findings, *found.effects]
    named = replace(found, effects=effects, verdict=_verdict(effects, found.unexplained))
    if not found.effects and found.unexplained is None:
        return replace(named, sentence=sentence_of(named))
    return replace(named, sentence=f"{sentence_of(replace(named, effects=[*findings], gap=[]))} {found.sentence}")


def _found(
    robot: Robot,
    data: Dataset,
    test: Dataset | None,
    library: Library,
    sigma: float | None,
    threads: int,
    notify: Callable[[str], None],
    lost: Sequence[int] = (),
) -> _Found:
    """`diagnose` without its result, its arguments checked; `lost` are rows that are not looked at."""
    notify("fitting the geometry")
    trusted = without_measured(data, np.array(lost, dtype=np.intp)) if lost else data
    rows = searched_rows(trusted, robot)
    looked_at = trusted if rows is None else trusted.select(rows)
    problem = prepared_problem(robot, looked_at, library.names, claimed(looked_at, sigma), threads, library.excluded)
    geometry = fit(problem, [])
    _refuse_few_postures(looked_at, geometry)
    notify("how large the noise is")
    problem, level = with_estimated_noise(problem, geometry, sigma)
    moved = all_moved(level.moved, trusted, rows)
    if moved and len(lost) + len(moved) <= rules.MAX_MOVED_SHARE * data.measured.sum():
        notify(f"without {len(moved)} rows that lie off together")
        return _found(robot, data, test, library, sigma, threads, notify, sorted({*lost, *moved}))
    plain, best, level = searched(problem, level, sigma, notify)
    search = plain.search
    if not best.suffices and (search.explains_little(best) or unexplained.one_block_does_better(search, best)):
        best = search.start  # what explains so little is no name
    best = with_orders_between(search, best)
    curve = waves_of_one_curve(search, best)
    best = search.pruned(best) if curve is None else curve[1]
    best = grading.borne_out(search, best)
    notify("weighing what else it could be")
    model = rivals.bare(best)
    remains = unexplained.remains(best)
    if remains or sum(map(is_periodic, best.names)) > 1:  # waves of several orders draw any curve
        profiles = unexplained.curved_joints(best) if curve is None else [rivals.profile(curve[0])]
        model = plain.best_predicting(best, profiles)
    level = level.calmer(model.noise) if model.profiles else level
    final = model.state if not model.profiles else SearchNode(model.fit, search.start.family)
    remains = remains if final is best else unexplained.remains(final)
    sure, unsure = sure_names(search, best) if final is best else (best, {})
    told = Told(model.state, final, remains, unsure)
    model = rivals.bare(sure) if unsure else model
    notify("beside what anyone would try")
    written = best_of_all(plain, model, remains=remains)
    told = beside_plain(told, written) if written.is_plain else told
    return _Found(robot, data, rows, test, search, written, told, library, level, sigma, threads, tuple(lost))


def _refuse_few_postures(data: Dataset, plain: Fit) -> None:
    if too_few_postures(data, len(plain.free)):
        A, _, row = plain.whitened
        seen = A[row >= 0] / np.maximum(np.linalg.norm(A[row >= 0], axis=0), np.finfo(np.float64).tiny)
        if few := too_few_postures(data, int(np.linalg.matrix_rank(seen))):
            raise InvalidInput(f"{data.source}: {few}")


@dataclass(frozen=True, eq=False)
class _Found:
    """The set that was found, before its result is made."""

    robot: Robot
    data: Dataset
    rows: NDArray[np.intp] | None  # that were searched; None: all
    test: Dataset | None
    search: Search
    written: Judged
    told: Told
    offered: Library
    level: NoiseLevel
    sigma: float | None
    threads: int
    lost: tuple[int, ...]  # rows that were not looked at

    @property
    def model(self) -> rivals.Model:
        """The one that is written."""
        return self.written.model

    @property
    def best(self) -> SearchNode:
        """The names."""
        return self.told.best

    @cached_property
    def told_fit(self) -> Fit:
        """That of all names, sure or not."""
        if not self.told.unsure and not self.written.is_plain:
            return self.fit
        return self.best.fit if self.rows is None else fit(self.whole, self.best.names, self.best.fit)

    @cached_property
    def whole(self) -> Problem:
        """All rows but for those out of reach."""
        at = self.search.start.fit if self.written.holds_the_arm else self.model.fit
        return self.search.problem if self.rows is None else on_all_rows(at, self.data)

    @cached_property
    def fit(self) -> Fit:
        """The model, fitted to all rows."""
        return self.model.fit if self.rows is None else rivals.refitted(self.model, self.whole)

    @property
    def reaches(self) -> NDArray[np.bool_]:
        """(N,) rows of all that the model reaches."""
        return self.model.reaches if self.rows is None else self.whole.used

    @property
    def gross(self) -> list[int]:
        """Rows that the fit of the model holds and that are far off it: nothing that was found explains them."""
        problem = self.model.fit.problem
        A, r, row = self.model.fit.whitened
        at = problem.rows[sharing_no_posture(gross_rows(A, r, row), problem.kept)]
        return [int(i) for i in (at if self.rows is None else self.rows[at])]

    def result(self, left_out: Sequence[KindMisfit] = ()) -> Diagnosis:
        """Calibrated models, grades, what remains, and all else that a reader should know; kinds that were left out."""
        best, search = self.best, self.search
        is_named = not self.told.remains and not self.model.profiles
        outliers = self._outliers(is_named)
        stands = is_named or (self.written.is_plain and best.suffices)
        few = stands and len(best.names) <= search.most
        equivalents = search.alternatives(best) if few else [[] for _ in best.names]
        proofs = [grading.evidence(search, best, name) for name in best.names]
        order = sorted(range(len(best.names)), key=lambda k: -proofs[k].statistic)
        names = [best.names[k] for k in order if best.names[k] in self.model.state.names]
        judge = adaptation.Judge(self.data, self.test, self.threads)
        written = [of_corners(at) for at in self._written(names)]
        steps = each(lambda at: judge.adapted(at, self.level.sigma), written)
        profiles = self.model.profiles
        remaining = self._remaining(steps[0], outliers)
        kept = self.data.measured.copy()
        kept[outliers] = False
        gap = adaptation.gap(steps, written, kept, names, self.written.added)
        last = replace(written[-1], problem=self.fit.problem, squares=None)
        more, step = None, None
        if not self.written.holds_the_arm:  # what is left then are the arm's own errors
            more, step, remaining = with_surrogate(
                steps[-1], gap[-1], last, self.reaches, judge, remaining, drifts=self.level.slow.drifts
            )
        findings = [self._finding(best.names[k], proofs[k], equivalents[k], steps[-1].model, remaining) for k in order]
        if findings and all(f.grade == "A" for f in findings) and not self._stands(steps[-1].model):
            findings = [replace(f, grade="B", limits=(Because(Reason.OWN_MODEL),)) for f in findings]
        if any(f.grade != "A" for f in findings):
            findings = [_as_sure_as_the_least(f) for f in findings]
        there = {finding.label for finding in findings}
        findings += [_unnamed(steps[-1].model, entry) for entry in profiles if label(entry) not in there]
        if more is not None and step is not None:
            steps, gap = [*steps, more], [*gap, step]
        end = steps[-1]
        misfits = [*left_out, *kind_misfits(end.model, self.data, end.train, end.unknowns, self.threads)]
        runs = row_run_notes(self.data, outliers, steps[-1].train.error_after)
        doubts = noise_doubts(over_claim(self.level, self.data, self.sigma), search.problem.noise.memory)
        found = Diagnosis(
            verdict=_verdict(findings, remaining),
            sentence="",
            effects=findings,
            unexplained=remaining,
            untestable=sensitivity.untestable(search, self.offered),
            outliers=outliers,
            noise=noise_by_kind(self.search.problem, self.level.sigma, self.level.source),
            sigma_source=self.level.source,
            sigma_note=with_memory_named(self.level.note, search.problem.noise.memory),
            gap=gap,
            ranking=sensitivity.ranking(search, best),
            smallest=sensitivity.smallest(best),
            confusion=sensitivity.confusion(search),
            steps=steps,
            search=search,
            state=best,
            final=self.told.final,
            plan=self._plan(equivalents),
            plain=self.written.words if self.written.is_plain else None,
            notes=[*self.data.notes, *runs, *doubts, *self._limits(remaining)],
            misfits=misfits,
        )
        rows_left_out = [f"{len(outliers)} rows that nothing explains were left out"] if runs else []
        return replace(found, sentence=sentence_of(found, [*rows_left_out, *doubts]))

    def _remaining(self, geometry: AdaptedModel, outliers: list[int]) -> Unexplained | None:
        """What the names leave: where the most of it is."""
        placed = unexplained.located(self.search, self.told.final) if self.told.remains else None
        found = [one for one in (placed, unexplained.in_order(self.level.slow)) if one is not None]
        if not found:
            return unexplained.at_a_posture(geometry.train, outliers, self.level.sigma)
        return max(found, key=lambda one: one.share)

    def _limits(self, remaining: Unexplained | None) -> list[str]:
        """What the search did not look at, or can't tell apart, in sentences."""
        out = []
        if (remaining is not None or self.model.profiles) and along_a_path(self.data):
            out.append(
                "successive poses lie near each other, so that noise which changes slowly looks like a cause without a "
                "name: measure some of these poses again in another order"
            )
        if self.rows is not None:
            share = f"{len(self.rows)} of {int(self.data.measured.sum())} measured rows"
            out.append(f"causes were searched for in {share}, spread evenly; the models are fitted to all of them")
        if self.search.is_cut_short:
            out.append(
                f"the search for causes was cut short after {len(self.search.seen)} sets of effects: larger sets and "
                "exchanges of their members were left untried; with effects excluded it goes further"
            )
        return out

    def _stands(self, model: Robot) -> bool:
        """Does the diagnosis of the model that is written, from its first fit and noise on, find nothing new?"""
        asked = {name.key for name in self.offered.names}
        names = [name for name in build_library(model, self.data).names if name.key in asked]
        data = self.search.problem.data
        problem = prepared_problem(model, data, names, claimed(data, self.sigma), self.threads)
        problem, _level = with_estimated_noise(problem, fit(problem, []), self.sigma)
        return Search(problem).start.suffices

    def _plan(self, equivalents: list[list[SearchNode]]) -> SeparatingPlan | None:
        """Poses that would tell the names of a set apart, where there is one and points were measured."""
        if self.data.position is None:
            return None
        others = [[replacement(self.best, state) for state in states] for states in equivalents]
        return separating_plan(self.best, others)

    def _written(self, names: Sequence[Hypothesis]) -> list[Fit]:
        """The fits that are written: with each name, then with the curves; or the geometry, and what holds the arm."""
        if self.written.holds_the_arm:
            start = self.search.start.fit
            return [start if self.rows is None else fit(self.whole, [], start), self.fit]
        fits = adaptation.fits(self.search, self.model.state, names)
        if self.rows is not None:
            whole = self.whole
            fits = each(lambda at: self.fit if at is self.model.fit else fit(whole, at.added, at), fits)
        if self.model.profiles:
            return [*fits, self.fit]
        if self.told.remains or self.written.is_plain:
            return fits  # a row that is far off may show what is missing; a plain model is the one that was judged
        problem = weighed(self.whole, self.fit)
        again = fits if problem is self.whole else each(lambda at: fit(problem, at.added, at), fits)
        return again if all(at.converged for at in again) else fits

    def _outliers(self, is_named: bool) -> list[int]:
        """Rows that the model can't reach."""
        if self.rows is None and is_named:
            return sorted({*out_of_reach(self.best.fit), *self.lost})
        # What is missing from a poorer model puts no row on the list.
        return [int(i) for i in np.flatnonzero(self.data.measured & ~self.reaches)]

    def _finding(
        self,
        name: Hypothesis,
        proof: grading.Evidence,
        equivalents: list[SearchNode],
        model: Robot,
        remaining: Unexplained | None,
    ) -> Finding:
        others = tuple(dict.fromkeys(replacement(self.best, state).key for state in equivalents))
        grade, limits = grading.grade(
            proof, name, others, remaining is not None or len(self.best.names) > self.search.most
        )
        if remaining is not None and grading.is_shadow(self.search, self.best, proof):
            grade, limits = "C", (Because(Reason.SHADOW), *limits)
        if is_beyond_bounds(self.told_fit, name):
            grade, limits = "C", (Because(Reason.IMPOSSIBLE), *limits)
        freedom = self.best.fit.problem.noise.freedom
        alone = p_values(np.array([proof.statistic]), np.array([proof.rank], dtype=np.int32), freedom)[0]
        p = min(1.0, float(alone) * (self.search.start.family.named + fine_looks(self.best.fit.problem, name)))
        if self.written.is_plain and not self.written.shows(name):
            grade, limits = "C", (Because(Reason.SHADOW), *limits)
        unsure = self.told.unsure.get(repr(name))
        model = model if unsure is None else adaptation.robot_of(self.told_fit, self.level.sigma)
        values = adaptation.values(model, name.entry)
        if grading.is_turned(self.best.fit.effect(name).data_columns, values):
            grade, limits = "B", (*limits, Because(Reason.TURNED_DIRECTION))
        doubts = grading.doubts(bool(self.offered.excluded), over_claim(self.level, self.data, self.sigma))
        if grade == "A" and doubts:
            grade, limits = "B", doubts
        if unsure is not None:
            grade = "C" if unsure.reason is Reason.PLAIN_MODEL_PREDICTS else "B" if grade == "A" else grade
            limits = (unsure, *limits)
        return Finding(
            effect=name.effect,
            owner=name.owner,
            grade=grade,
            parameters=values,
            snr=float(np.sqrt(proof.statistic)),
            p_value=p,
            equivalents=others,
            gain=proof.gain,
            stability=proof.stability,
            limits=limits,
            in_model=unsure is None,
        )


def of_corners(at: Fit) -> Fit:
    """The same fitted to corners as they were seen: what is written predicts pictures.

    While causes are looked for, they may hide in what the joints' noise is taken to be, which then weighs too much.
    """
    if at.problem.repeatability is None:
        return at
    problem = replace(at.problem, repeatability=0.0)
    again = fit(problem, at.added, at)
    _, r, row = again.whitened
    by = float(np.sqrt(np.sum(r[row >= 0] ** 2) / again.freedom))  # of the six numbers of a picture: postures' noise
    again = fit(problem.with_noise(replace(problem.noise, factor=problem.noise.factor * by)), at.added, again)
    return again if again.converged else at


def _as_sure_as_the_least(finding: Finding) -> Finding:
    """One effect of a set that is not sure may mend the wrong form of another: then none of them is."""
    if finding.grade != "A":
        return finding
    return replace(finding, grade="B", limits=(Because(Reason.UNSURE_COMPANION),))


def _unnamed(model: Robot, entry: Spec) -> Finding:
    """What is in the model without being named: a joint that errs by its own position, or a part of a plain model."""
    if entry["effect"] == curve_of("joint"):
        because = Because(Reason.CURVE_WITHOUT_NAME, waves=tuple(unexplained.main_orders(model, entry)))
        return Finding(entry["effect"], entry["owner"], "C", {}, 0.0, 0.0, limits=(because,))
    limits = (Because(Reason.PART_OF_A_PLAIN_MODEL),)
    return Finding(entry["effect"], entry["owner"], "C", {}, 0.0, 0.0, limits=limits)


def _verdict(findings: Sequence[Finding], remaining: Unexplained | None) -> str:
    if remaining is not None:
        return "unexplained"
    if not findings:
        return "none"
    if len(findings) > 1:
        return "several"
    return "one_of" if findings[0].equivalents else "named"


__all__ = ["Diagnosis", "diagnose"]
