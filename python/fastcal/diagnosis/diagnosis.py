# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where do model and measurement disagree, which effect is missing, and what does it mend? (docs/diagnosis.md)"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal import _core
from fastcal.calibration import CalibrationResult, calibrate, prepare
from fastcal.dataset import Dataset
from fastcal.diagnosis import grading, sensitivity
from fastcal.diagnosis.library import Library, Name, build_library, parse_exclusions
from fastcal.diagnosis.noise import OUTLIER_LEVEL, NoiseLevel, noise_level, off_by, rich_fit
from fastcal.diagnosis.problem import Fit, Noise, Problem, blocks, fit, with_nuisances
from fastcal.diagnosis.result import Diagnosis, Finding, GapStep, NamedValue, Unexplained
from fastcal.diagnosis.search import Search, State
from fastcal.diagnosis.words import sentence_of
from fastcal.effect_values import written_parameters
from fastcal.effects import identity
from fastcal.evaluation import Evaluation
from fastcal.robot import Robot, Spec
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

_GUESS = 1e-4  # [m, rad] a common noise to begin with, where the data claim none
_CALMER = 0.85  # of the mean square: the noise was taken too large, and all begins again
_ROUNDS = 3
_HOPELESS = 0.5  # share of the misfit that names must explain where something remains, to be given


def diagnose(
    robot: Robot,
    data: Dataset,
    *,
    test: Dataset | None = None,
    exclude: Collection[str] = (),
    sigma: float | None = None,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Finds what a robot's model is missing, names it or says that it can't tell, and adds it.

    Args:
        robot: Nominal, or identified with effects: those stay and are identified again.
        data: Measured poses.
        test: Other poses, only reported on.
        exclude: Names that are not to be given, `EFFECT` or `EFFECT@OWNER`.
        sigma: Standard deviation of a measured coordinate [m], where the data have no column for it.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown effect or owner to exclude, a sigma that is none, data without a measured column.
    """
    say = progress or (lambda text: None)
    library = build_library(robot, data, parse_exclusions(exclude, robot))
    say("fitting the geometry")
    problem = _problem(robot, data, library, sigma, threads)
    say("how large the noise is")
    problem, level = _quieted(problem, fit(problem, []), sigma)
    search, levels = Search(problem, say), []
    for _ in range(_ROUNDS):
        levels = search.grow()
        best = _best(levels)
        checked, now = _rechecked(problem, best, sigma)
        if checked is None:
            break
        problem, level = checked, now
        search = Search(problem, say)
    best = _best(levels)
    say("weighing what else it could be")
    outcome = _outcome(search, levels, best)
    say("adding what was found")
    return _told(robot, data, test, search, outcome, library, level, threads)


def _problem(robot: Robot, data: Dataset, library: Library, sigma: float | None, threads: int) -> Problem:
    start = prepare(robot, data, effects="geometry", threads=threads)
    claimed = data.sigma_position is not None
    first = sigma if sigma is not None else (0.0 if claimed else _GUESS)
    turn = 0.0 if data.sigma_rotation is not None else _GUESS
    return Problem(start, data, data.measured, library.names, Noise((first, turn, first)), threads)


def _quieted(problem: Problem, at: Fit, sigma: float | None) -> tuple[Problem, NoiseLevel]:
    """The problem with the noise that a rich model leaves at a fit, and without the rows that it can't reach."""
    every = problem.with_rows(problem.data.measured)
    rich = rich_fit(at, blocks(at)) if np.array_equal(every.used, problem.used) else rich_fit(*_again(every, at))
    level = noise_level(every, rich, problem.data, sigma)
    used = every.used.copy()
    used[every.rows[rich.wrong]] = False
    return replace(every, used=used, noise=level.noise), level


def _again(every: Problem, at: Fit) -> tuple[Fit, Any]:
    found = fit(every, at.added, at)
    return found, blocks(found)


def _rechecked(problem: Problem, best: State, sigma: float | None) -> tuple[Problem | None, NoiseLevel | None]:
    """A new start where the set that was found shows that the noise is smaller than it seemed; else None."""
    again, level = _quieted(replace(problem), best.fit, sigma)
    if (level.noise.factor / problem.noise.factor) ** 2 < _CALMER:
        return again, level
    return None, None


def _best(levels: list[list[State]]) -> State:
    """The simplest set that suffices, else the most likely one of all."""
    enough = [state for state in levels[-1] if state.suffices]
    if enough:
        return min(enough, key=lambda s: s.bic)
    return min((state for level in levels for state in level if not state.impossible), key=lambda s: s.bic)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The set, its alternatives by member, and what remains."""

    best: State
    equivalents: list[list[State]]
    profiles: list[Spec]
    rest: Unexplained | None


def _outcome(search: Search, levels: list[list[State]], best: State) -> Outcome:
    if best.suffices:
        return Outcome(best, search.alternatives(best), [], None)
    gone = 1 - best.fit.remaining / search.start.fit.remaining
    if best.names and gone < _HOPELESS:
        best = search.start
    profiles = _profiles(best)
    rest = _rest(search, best)
    return Outcome(best, [[] for _ in best.names], profiles, rest)


def _profiles(best: State) -> list[Spec]:
    """A curve for each joint whose error depends on its own position in a way that no name has."""
    out = []
    found = best.blocks
    statistic, rank = np.asarray(found.tests.scores.statistic), np.asarray(found.tests.scores.rank)
    significant = set(best.significant())
    m = len(best.fit.near.r)
    for i, block in enumerate(found.generics, found.count):
        own = block.curves.depends_on == (f"q{block.owner.removeprefix('joint')}",)
        if own and i in significant and statistic[i] > rank[i] * np.log(m):
            out.append({"effect": "joint_profile", "owner": block.owner})
    return out


def _rest(search: Search, best: State) -> Unexplained | None:
    """Where what remains is best placed; a block of the fewest functions of those that do about as well."""
    found = best.blocks
    statistic, rank = np.asarray(found.tests.scores.statistic), np.asarray(found.tests.scores.rank)
    generic = np.arange(found.count, len(rank))
    worth = statistic[generic] - rank[generic] * np.log(len(best.fit.near.r))
    place = int(generic[int(np.argmax(worth))])
    block = found.generics[place - found.count]
    freedom = max(len(best.fit.near.r) - found.tests.null_rank, 1)
    misfit = max(search.start.fit.remaining - freedom, 1.0)
    share = float(np.clip((best.fit.remaining - freedom) / misfit, 0.0, 1.0))
    return Unexplained(block.owner, share, block.curves.depends_on)


def _told(
    robot: Robot,
    data: Dataset,
    test: Dataset | None,
    search: Search,
    outcome: Outcome,
    library: Library,
    level: NoiseLevel,
    threads: int,
) -> Diagnosis:
    best = outcome.best
    proofs = [grading.evidence(search, best, name) for name in best.names]
    order = sorted(range(len(best.names)), key=lambda k: -proofs[k].statistic)
    calibrations = _calibrations(robot, data, test, best, order, outcome.profiles, threads)
    final = calibrations[-1].model
    findings = []
    for k in order:
        name, proof = best.names[k], proofs[k]
        others = tuple(dict.fromkeys(_replacement(best, state).key for state in outcome.equivalents[k]))
        grade, reasons = grading.grade(proof, name, others, outcome.rest is not None)
        p = min(1.0, float(special.chdtrc(proof.rank, proof.statistic)) * search.start.family.named)
        findings.append(
            Finding(
                name.effect, name.owner, grade, _values(final, name.entry), float(np.sqrt(proof.statistic)), p, others,
                proof.gain, proof.stability, reasons,
            )
        )
    for entry in outcome.profiles:
        reason = "the joint errs by its position in a way that no name has"
        findings.append(Finding(entry["effect"], entry["owner"], "C", {}, 0.0, 0.0, reasons=(reason,)))
    verdict = _verdict(findings, outcome.rest)
    rows = _outliers(best, data)
    dead = sensitivity.untestable(search, library)
    gap = _gap(calibrations, [best.names[k] for k in order], outcome.profiles)
    said = Diagnosis(
        verdict=verdict,
        sentence="",
        effects=findings,
        unexplained=outcome.rest,
        untestable=dead,
        outliers=rows,
        sigma_mm=from_si(level.sigma, "mm"),
        sigma_source=level.source,
        sigma_note=level.note,
        gap=gap,
        ranking=sensitivity.ranking(search, best),
        smallest=sensitivity.smallest(best),
        confusion=sensitivity.confusion(search),
        calibrations=calibrations,
        notes=list(data.notes),
    )
    return replace(said, sentence=sentence_of(said))


def _verdict(findings: Sequence[Finding], rest: Unexplained | None) -> str:
    if rest is not None:
        return "unexplained"
    if not findings:
        return "none"
    if len(findings) > 1:
        return "several"
    return "one_of" if findings[0].equivalents else "named"


def _replacement(best: State, other: State) -> Name:
    """The name of `other` that is not in `best`."""
    there = {name.key for name in best.names}
    return next(name for name in other.names if name.key not in there or name not in best.names)


def _calibrations(
    robot: Robot, data: Dataset, test: Dataset | None, best: State, order: Sequence[int], profiles: list[Spec], threads: int
) -> list[CalibrationResult]:
    """The calibrated geometry, then with one effect more each time."""
    out = []
    entries: list[Spec] = list(robot.spec.get("effects") or [])
    steps: list[list[Spec]] = [[]] + [[_for_file(best, best.names[k])] for k in order] + ([profiles] if profiles else [])
    for added in steps:
        entries = entries + added
        whole = with_nuisances(entries, robot)
        spec = dict(robot.spec) | {"effects": whole}
        out.append(calibrate(Robot(spec), data, test=test, effects="geometry", threads=threads))
    return out


def _for_file(best: State, name: Name) -> Spec:
    """The entry as a robot file has it, with a start where the solver needs one."""
    entry = {key: value for key, value in name.entry.items() if key not in ("corner", "at_s")}
    if name.effect == "joint_compliance_nonlinear":
        place = best.fit.place(name)
        effect = best.fit.model_effects[[e is name.entry for e in best.fit.entries].index(True)]
        nan = np.full((3, 3), np.nan)
        entry["parameters"] = written_parameters(entry, effect, best.fit.theta[place], nan)
    return entry


def _values(model: Robot, entry: Spec) -> dict[str, NamedValue]:
    """Parameters of an effect as the calibrated model has them."""
    wanted = (entry["effect"], entry["owner"], entry.get("order"), entry.get("side"))
    for found in model.spec.get("effects") or []:
        order = identity(found)[2]
        if (found["effect"], found["owner"], order, found.get("side")) == wanted:
            return {name: NamedValue(v["value"], v["std"]) for name, v in found["parameters"].items()}
    raise KeyError(wanted)


def _gap(calibrations: Sequence[CalibrationResult], names: Sequence[Name], profiles: Sequence[Spec]) -> list[GapStep]:
    added: list[str | None] = [None, *("@".join(name.key) for name in names)]
    if profiles:
        added.append(",".join(f"{p['effect']}@{p['owner']}" for p in profiles))
    return [
        GapStep(name, _rms(found.train), None if found.test is None else _rms(found.test))
        for name, found in zip(added, calibrations, strict=True)
    ]


def _rms(part: Evaluation) -> float:
    assert part.after is not None
    return part.after.to_mm()["rms"]


def _outliers(best: State, data: Dataset) -> list[int]:
    """Rows that the set can't reach: where noise alone makes one row so large in one of a hundred such sets."""
    problem = best.fit.problem
    every = problem.with_rows(data.measured)
    model, samples = every.model(best.fit.entries, every.kept)
    near = _core.linearize(model, samples, every.measured, best.fit.theta, list(every.noise.common), every.threads)
    A, r, row = replace(best.fit, problem=every, model=model, samples=samples, near=near).whitened
    wrong = np.flatnonzero(~np.isin(every.rows, problem.rows))
    square, count = off_by(A, r, row, wrong)
    limit = special.chdtri(np.maximum(count, 1), OUTLIER_LEVEL / len(every.rows))
    return [int(every.rows[i]) for i in np.flatnonzero((count > 0) & (square > limit))]


__all__ = ["Diagnosis", "diagnose"]
