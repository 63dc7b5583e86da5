# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From the set of effects found to the result: the written model, the findings with their grades, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.kind_misfits import kind_misfits
from fastcal.calibration.parallel import each
from fastcal.calibration.pose_folds import along_a_path
from fastcal.diagnosis import adaptation, grading, rivals, rules, sensitivity, unexplained
from fastcal.diagnosis.doubts import is_beyond_bounds
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.gap import GapStep
from fastcal.diagnosis.heavy_tails import weighed
from fastcal.diagnosis.hypothesis import Hypothesis, Key
from fastcal.diagnosis.library import Library, build_library
from fastcal.diagnosis.many_rows import on_all_rows
from fastcal.diagnosis.memory import with_memory_named
from fastcal.diagnosis.noise import (
    NoiseLevel,
    out_of_reach,
    over_claim,
    row_run_notes,
    sharing_no_posture,
    with_estimated_noise,
    with_joints_of_pictures,
)
from fastcal.diagnosis.noise_scales import noise_by_kind
from fastcal.diagnosis.periodic import fine_looks, is_periodic
from fastcal.diagnosis.plain_models import Judged
from fastcal.diagnosis.plan import SeparatingPlan, separating_plan
from fastcal.diagnosis.problem import Problem, prepared_problem
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.remaining_surrogate import with_surrogate
from fastcal.diagnosis.result import AdaptedModel, Diagnosis, Finding, Unexplained
from fastcal.diagnosis.robust_rows import gross_rows
from fastcal.diagnosis.rounds import claimed
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.sure_names import Told, replacement
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import jumps_itself
from fastcal.diagnosis.words import noise_doubts, sentence_of
from fastcal.effects.entries import curve_of, label
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import KindMisfit
from fastcal.place import place_of
from fastcal.robot.robot import Robot, Spec
from fastcal.said import first_few, said


@dataclass(frozen=True, eq=False)
class Asked:
    """What a diagnosis is asked: arm, rows, held-out rows, causes; the arguments of `diagnose`, checked."""

    robot: Robot
    data: Dataset
    test: Dataset | None
    library: Library
    sigma: float | None
    threads: int
    notify: Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Found:
    """The set that was found, before its result is made."""

    asked: Asked
    rows: NDArray[np.intp] | None  # that were searched; None: all
    search: Search
    written: Judged
    told: Told
    level: NoiseLevel
    lost: tuple[int, ...] = ()  # rows that were not looked at
    few: str = ""  # why no cause was looked for; empty: they were

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
        return self.search.problem if self.rows is None else on_all_rows(at, self.asked.data)

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
        equivalents = search.alternatives(best) if few else search.known_alternatives(best)
        proofs = [grading.evidence(search, best, name) for name in best.names]
        order = sorted(range(len(best.names)), key=lambda k: -proofs[k].statistic)
        names = [best.names[k] for k in order if best.names[k] in self.model.state.names]
        judge = adaptation.Judge(self.asked.data, self.asked.test, self.asked.threads)
        written = [of_corners(at) for at in self._written(names)]
        level = with_joints_of_pictures(replace(self.level, noise=search.problem.noise), written[-1])
        steps = each(lambda at: judge.adapted(at, level.sigma), written)
        profiles = self.model.profiles
        remaining = self._remaining(steps[0], outliers)
        kept = self.asked.data.measured.copy()
        kept[outliers] = False
        gap = adaptation.gap(steps, written, kept, names, self.written.added)
        last = replace(written[-1], problem=self.fit.problem, squares=None)
        more, step = None, None
        if not self.written.holds_the_arm:  # what is left then are the arm's own errors
            more, step, remaining = with_surrogate(
                steps[-1], gap[-1], last, self.reaches, judge, remaining, drifts=self.level.slow.drifts
            )
        findings = [self._finding(k, proofs, equivalents[k], steps[-1].model, remaining) for k in order]
        if findings and all(f.grade == "A" for f in findings) and not self._stands(steps[-1].model):
            findings = [replace(f, grade="B", limits=(Because(Reason.OWN_MODEL),)) for f in findings]
        if any(f.grade != "A" for f in findings):
            findings = [_as_sure_as_the_least(f) for f in findings]
        if _is_worse_on_test_poses(gap):
            worse = Because(Reason.WORSE_ON_TEST_POSES)
            findings = [replace(f, grade="C", limits=(worse, *f.limits)) for f in findings]
        there = {finding.label for finding in findings}
        findings += [self._unnamed(steps[-1].model, entry) for entry in profiles if label(entry) not in there]
        if more is not None and step is not None:
            steps, gap = [*steps, more], [*gap, step]
        end = steps[-1]
        misfits = [*left_out, *kind_misfits(end.model, self.asked.data, end.train, end.unknowns, self.asked.threads)]
        runs = row_run_notes(self.asked.data, outliers, steps[-1].train.error_after)
        doubts = noise_doubts(over_claim(self.level, self.asked.data, self.asked.sigma), search.problem.noise.memory)
        found = Diagnosis(
            verdict=verdict_of(findings, remaining),
            sentence="",
            effects=findings,
            unexplained=remaining,
            untestable=sensitivity.untestable(search, self.asked.library),
            outliers=outliers,
            noise=noise_by_kind(self.search.problem, level.sigma, level.source),
            sigma_source=level.source,
            sigma_note=with_memory_named(level.note, level.noise),
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
            notes=[*self.asked.data.notes, *runs, *doubts, *self._limits(remaining)],
            misfits=misfits,
            converged=self.fit.converged,
            few=self.few,
        )
        gone = said(
            "{count} rows that nothing explains were left out ({rows})", count=len(outliers), rows=first_few(outliers)
        )
        return replace(found, sentence=sentence_of(found, [*([gone] if runs else []), *doubts]))

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
        if (remaining is not None or self.model.profiles) and along_a_path(self.asked.data):
            out.append(
                "successive poses lie near each other, so that noise which changes slowly looks like a cause without a "
                "name: measure some of these poses again in another order"
            )
        if self.rows is not None:
            share = f"{len(self.rows)} of {int(self.asked.data.measured.sum())} measured rows"
            out.append(f"causes were searched for in {share}, spread evenly; the models are fitted to all of them")
        if self.search.is_cut_short:
            out.append(
                f"the search for causes was cut short after {len(self.search.seen)} sets of effects: larger sets and "
                "exchanges of their members were left untried; with effects excluded it goes further"
            )
        return out

    def _stands(self, model: Robot) -> bool:
        """Does the diagnosis of the model that is written, from its first fit and noise on, find nothing new?"""
        asked = {name.key for name in self.asked.library.names}
        names = [name for name in build_library(model, self.asked.data).names if name.key in asked]
        data = self.search.problem.data
        problem = prepared_problem(model, data, names, claimed(data, self.asked.sigma), self.asked.threads)
        problem = replace(problem, joints_repeat=self.search.problem.joints_repeat)
        problem, _level = with_estimated_noise(problem, fit(problem, []), self.asked.sigma)
        return Search(problem).start.suffices

    def _plan(self, equivalents: list[list[SearchNode]]) -> SeparatingPlan | None:
        """Poses that would tell the names of a set apart, where there is one and points were measured."""
        if self.asked.data.position is None:
            return None
        others = [[replacement(self.best, state) for state in states] for states in equivalents]
        return separating_plan(self.best, others)

    def _written(self, names: Sequence[Hypothesis]) -> list[Fit]:
        """The fits that are written: with each name, then with the curves, or with the arm held."""
        state = self.model.state
        if self.written.holds_the_arm:
            state = self.search.state(state.names, self.search.start) if state.names else self.search.start
        fits = adaptation.fits(self.search, state, names)
        if self.rows is not None:
            whole = self.whole
            fits = each(lambda at: self.fit if at is self.model.fit else fit(whole, at.added, at), fits)
        if self.model.profiles or self.written.holds_the_arm:
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
        return [int(i) for i in np.flatnonzero(self.asked.data.measured & ~self.reaches)]

    def _having(self, name: Hypothesis, model: Robot) -> Robot:
        """The written model where it has the name, and surely; else that of all names."""
        if repr(name) in self.told.unsure or name not in self.model.state.names:
            return adaptation.robot_of(self.told_fit, self.level.sigma)
        return model

    def _others(self, name: Hypothesis, equivalents: list[SearchNode]) -> tuple[Key, ...]:
        """What would do as well as a name; a curve of the joint for a jump, which may bend between two rows."""
        keys = dict.fromkeys(replacement(self.best, state).key for state in equivalents)
        return (*keys, (curve_of("joint"), name.owner)) if jumps_itself(name) else tuple(keys)

    def _finding(
        self,
        at: int,
        proofs: Sequence[grading.Evidence],
        equivalents: list[SearchNode],
        model: Robot,
        remaining: Unexplained | None,
    ) -> Finding:
        name, proof = self.best.names[at], proofs[at]
        others = self._others(name, equivalents)
        grade, limits = grading.grade(
            proof, name, others, remaining is not None or len(self.best.names) > self.search.most
        )
        if remaining is not None and grading.is_shadow(self.search, self.best, proof):
            grade, limits = "C", (Because(Reason.SHADOW), *limits)
        if is_beyond_bounds(self.told_fit, name):
            grade, limits = "C", (Because(Reason.IMPOSSIBLE), *limits)
        if self.written.is_plain and not self.written.shows(name):
            grade, limits = "C", (Because(Reason.SHADOW), *limits)
        unsure = self.told.unsure.get(repr(name))
        beside = [(proofs[k], other) for k, other in enumerate(self.best.names) if k != at]
        left = None if remaining is None else float(np.sqrt(remaining.share * unexplained.misfit(self.search)))
        weak = () if unsure else grading.may_be_another(proof, name, beside, others, left)
        if weak and grade == "B":
            told = {because.reason for because in weak}
            grade, limits = "C", (*weak, *(because for because in limits if because.reason not in told))
        values = adaptation.values(self._having(name, model), name.entry)
        if grading.is_turned(self.best.fit.effect(name).data_columns, values):
            grade, limits = max(grade, "B"), (*limits, Because(Reason.TURNED_DIRECTION))
        doubts = grading.doubts(
            bool(self.asked.library.excluded), over_claim(self.level, self.asked.data, self.asked.sigma)
        )
        if grade == "A" and doubts:
            grade, limits = "B", doubts
        if grade == "B" and remaining is not None:  # it may do the work of what has no name: most such names were wrong
            grade = "C"
        if grade != "C" and self._is_part_of_a_curve(name, remaining):
            grade, limits = "C", (Because(Reason.CURVE_WITHOUT_NAME), *limits)
        if unsure is not None:
            grade = max(grade, "B") if unsure.reason is Reason.CHANGES_OTHERWISE else "C"
            limits = (unsure, *limits)
        return Finding(
            effect=name.effect,
            owner=name.owner,
            grade=grade,
            parameters=values,
            snr=float(np.sqrt(proof.statistic)),
            p_value=self._chance(proof.statistic, proof.rank, name),
            equivalents=others,
            gain=proof.gain,
            stability=proof.stability,
            limits=limits,
            in_model=unsure is None,
        )

    def _is_part_of_a_curve(self, name: Hypothesis, remaining: Unexplained | None) -> bool:
        """Is a wave or a slope beside a curve over its joint's position, or what remains there by that position?"""
        if not is_periodic(name):
            return False
        if any(entry["owner"] == name.owner for entry in self.model.profiles if entry["effect"] == curve_of("joint")):
            return True
        own = place_of(name.owner).position
        return remaining is not None and remaining.owner == name.owner and own in remaining.depends_on

    def _unnamed(self, model: Robot, entry: Spec) -> Finding:
        """What is in the model without being named: a joint that errs by its own position, or a part of a plain model.

        A curve has hundreds of values and no unit of its own; its page draws it.
        """
        if entry["effect"] == curve_of("joint"):
            because = Because(Reason.CURVE_WITHOUT_NAME, waves=tuple(unexplained.main_orders(model, entry)))
            return Finding(entry["effect"], entry["owner"], "C", {}, 0.0, 0.0, limits=(because,))
        own = next(name for name in self.fit.added if label(name.entry) == label(entry))
        statistic = SearchNode(self.fit, self.search.start.family).wald(own)
        return Finding(
            effect=entry["effect"],
            owner=entry["owner"],
            grade="C",
            parameters=adaptation.values(model, own.entry),
            snr=float(np.sqrt(statistic)),
            p_value=self._chance(statistic, len(self.fit.columns(own)), own),
            limits=(Because(Reason.PART_OF_A_PLAIN_MODEL),),
        )

    def _chance(self, statistic: float, rank: int, name: Hypothesis) -> float:
        """That noise makes some name of the family as significant; what was searched for counts."""
        problem = self.best.fit.problem
        alone = p_values(np.array([statistic]), np.array([rank], dtype=np.int32), problem.noise.freedom)[0]
        return min(1.0, float(alone) * (self.search.start.family.named + fine_looks(problem, name)))


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


def _is_worse_on_test_poses(steps: Sequence[GapStep]) -> bool:
    """Does the error on test poses rise with the names, by more than a user would notice?"""
    before, after = steps[0].main.test_rms, steps[-1].main.test_rms
    return before is not None and after is not None and after > rules.MAX_RISE * before


def _as_sure_as_the_least(finding: Finding) -> Finding:
    """One effect of a set that is not sure may mend the wrong form of another: then none of them is."""
    if finding.grade != "A":
        return finding
    return replace(finding, grade="B", limits=(Because(Reason.UNSURE_COMPANION),))


def verdict_of(findings: Sequence[Finding], remaining: Unexplained | None) -> str:
    """The verdict on some findings and what remains beside them: one of VERDICTS."""
    if remaining is not None:
        return "unexplained"
    if not findings:
        return "none"
    if len(findings) > 1:
        return "several"
    return "one_of" if findings[0].equivalents else "named"
