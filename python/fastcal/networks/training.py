# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Trains a network on what a model leaves, judges it beside its rivals on held-out regions, and keeps the best."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.applicability import Guard
from fastcal.correction.experts import Expert
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.networks import NETWORKS, installed
from fastcal.networks.device import device_of, one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.judging import Judged, judge
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem, lengths_mm, problem_of, turns_deg
from fastcal.networks.rivals import fit_boosting, fit_neighbours, profile_errors, with_profiles
from fastcal.networks.transfer import ALONE, NOTHING, PRIOR, SHIFTED, Transfer, transfer
from fastcal.robot.robot import Robot
from fastcal.units import from_si

Scores = dict[str, dict[str, float]]
Fit = Callable[[Problem, Sequence[IndexArray], Options], Sequence[Expert]]

FITS: dict[str, Fit] = {
    "mlp": fit_mlp,
    "gp": fit_gaussian_process,
    "knn": fit_neighbours,
    "boosting": fit_boosting,
}
MEMBERS = {"mlp": 3, "gp": 1, "knn": 1, "boosting": 1}  # of the ensemble, a fold
INSTALLED_MEMBERS = 2  # of a network that another package offers
RIVALS = ("gp", "knn", "boosting", "joint-profiles")
MIN_GAIN = 3.0  # standard errors: the guard's reach was chosen on the same rows, which flatters a little
WORSE = 1.1  # a region is reported as worse where its mean error rises by more than a tenth


@dataclass(frozen=True, eq=False)
class TrainingResult:
    """What training found.

    Attributes:
        model: The model with the best correction of those compared, or as it was where none helps.
        asked: The network that was asked for.
        used: Which of the compared is in the model: the network, a rival, or `model`, nothing.
        verdict: Why, in a sentence.
        scores: Held-out lengths of errors of each in mm: mean, rms, max.
        turn_scores: Held-out angles of errors of each in degrees, likewise; empty where points alone were measured.
        coverage: Share of held-out coordinates within their 90 % intervals; None without a correction.
        regions: How many cells were held out, in how many of them the mean error rises by more than a tenth, and by how
            much most.
        rows, left_out, gross: Rows learnt from, left out, and how many of these were gross.
        limit, turn_limit: No correction is longer [m], none turns by more [rad]; None without one.
        notes: What a reader should know, a sentence each.
    """

    model: Robot
    asked: str
    used: str
    verdict: str
    scores: dict[str, dict[str, float]]
    coverage: float | None
    regions: dict[str, float]
    rows: int
    left_out: list[int]
    gross: int
    limit: float | None
    turn_limit: float | None = None
    turn_scores: dict[str, dict[str, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of training.json."""
        names = ("asked", "used", "verdict", "coverage", "regions", "rows", "left_out", "gross", "notes")
        return {
            **{name: getattr(self, name) for name in names},
            "held_out_mm": self.scores,
            "held_out_deg": self.turn_scores or None,
            "limit_mm": None if self.limit is None else from_si(self.limit, "mm"),
            "limit_deg": None if self.turn_limit is None else from_si(self.turn_limit, "deg"),
        }


def train(
    robot: Robot,
    data: Dataset,
    *,
    network: str = "mlp",
    rivals: Sequence[str] = RIVALS,
    folds: int = 5,
    seed: int = 0,
    device: str = "auto",
    trials: int | None = None,
    storage: str | Path | None = None,
    full: bool = False,
    minutes: float | None = None,
    any_load: bool = False,
    prior: Robot | None = None,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> TrainingResult:
    """Trains a network on the residuals of a model, and keeps it only where it beats its rivals and the model alone.

    The rows are cells of joint space of about twenty rows each; cells are dealt into folds, every residual model is
    trained on all folds but one and judged on that one, as it will be used: guarded and limited. The networks of all
    folds are the ensemble that is kept.

    Args:
        robot: A calibrated model; a correction that it has is left aside.
        data: Measured poses, those it was calibrated on or others.
        network: mlp, gp, or one that an installed package offers, such as those of papers in fastcal-studies.
        rivals: Which of gp, knn, boosting, joint-profiles to compare with.
        folds: K.
        seed: The same seed gives the same model.
        device: auto, cpu or cuda.
        trials: Of the search for sizes, an axis (somm, ca-somm); None: 20; 0: the sizes of the paper's tables 2 and 3.
        storage: File in which a search keeps its trials; a second call with it goes on where the first one stopped.
        full: ga-dnn: the paper's whole budget, a population of 100, instead of successive halving.
        minutes: After which a search for sizes (somm, ca-somm, ga-dnn) ends with the best so far; with `storage` a
            later call goes on. None: when all is tried.
        any_load: Do not look at the load, neither in training nor in the guard: the model's compliances answer for it.
            This is the global compensation of the RX160L paper, (14): displacement of the network plus compliances.
        prior: A model with a network of another arm of the same kind: what few rows of this one start from. Where it
            does not gain on held-out rows, training goes on from nothing.
        threads: Cores for the rivals' calibrations and a search's trials; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown network or rival, too few rows, or no measured points.
    """
    known = (*NETWORKS, *installed())
    if network not in known:
        raise InvalidInput(
            f"expected a network of {', '.join(known)}, got {network!r} "
            "(pip install 'fastcal-studies[networks]' brings those of papers)"
        )
    if unknown := set(rivals) - set(RIVALS):
        raise InvalidInput(f"expected rivals of {', '.join(RIVALS)}, got {min(unknown)!r}")
    progress = progress or (lambda text: None)
    if minutes is not None and not minutes > 0:
        raise InvalidInput(f"minutes must be above 0, got {minutes}")
    deadline = None if minutes is None else time.monotonic() + 60 * minutes
    place = None if storage is None else Path(storage)
    options = Options(seed, device_of(device), progress, trials, place, full, threads, deadline)
    moved = None if prior is None else transfer(robot, data, prior, folds=folds, options=options)
    if moved is not None and moved.helps:
        return _transferred(network, moved, data)
    try:
        problem = problem_of(robot, data, folds=folds, any_load=any_load, seed=seed)
    except InvalidInput as error:
        if moved is None:
            raise
        return _transferred(network, moved, data, str(error))
    if moved is not None:
        options.notes.append("the prior does not gain on held-out rows of this arm: trained from nothing")
    judged: dict[str, Judged] = {}
    with one_thread():
        for name in dict.fromkeys((network, *(rival for rival in rivals if rival in FITS))):
            progress(f"training {name}")
            judged[name] = judge(name, problem, _experts(name, problem, options))
    errors = {ALONE: problem.residuals} | {name: found.errors for name, found in judged.items()}
    if "joint-profiles" in rivals:
        progress("fitting joint profiles")
        errors["joint-profiles"] = profile_errors(problem, threads)
    found = _result(network, problem, judged, errors, threads)
    return replace(found, notes=[*options.notes, *found.notes])


def _fit_of(name: str) -> Fit:
    """What trains a network or rival: fastcal's own, or what an installed package offers."""
    if name in FITS:
        return FITS[name]
    try:
        fit: Fit = installed()[name].load()
    except Exception as error:
        raise InvalidInput(f"the installed network '{name}' cannot be loaded: {error}") from error
    return fit


def _transferred(network: str, moved: Transfer, data: Dataset, why: str = "") -> TrainingResult:
    """The prior in force; or, where it does not gain, the arm's model as it was, and why nothing is trained."""
    problem, errors = moved.problem, moved.errors
    used = moved.used if moved.helps else ALONE
    scores, turn_scores = _scores(problem, errors)
    sizes = _sizes(scores, turn_scores)
    if moved.helps:
        what = "the prior, and what this arm differs by" if moved.used == SHIFTED else "the prior as it is"
        verdict = f"{what}: held-out mean error {sizes[used]}, {sizes[ALONE]} with this arm's model alone"
        verdict += f", {sizes[NOTHING]} with a Gaussian process from nothing"
    else:
        verdict = f"the prior is not used: held-out mean error {sizes[PRIOR]} with it, {sizes[ALONE]} without; {why}"
    model = problem.robot
    correction = moved.model.correction if moved.helps else None
    if correction is not None:
        record = {"rows": len(problem), "held_out_mm": scores[used], "model_mm": scores[ALONE], "verdict": verdict}
        model = moved.model.with_(correction=replace(correction, record=record))
    return TrainingResult(
        model=model,
        asked=network,
        used=used,
        verdict=verdict,
        scores=scores,
        coverage=moved.coverage if moved.helps else None,
        regions=_regions(problem, errors[used]),
        rows=len(problem),
        left_out=np.flatnonzero(~np.isfinite(np.asarray(data.position)).all(axis=1)).tolist(),
        gross=0,
        limit=None if correction is None else correction.limit,
        turn_limit=None if correction is None else correction.turn_limit,
        turn_scores=turn_scores,
    )


def _scores(problem: Problem, errors: dict[str, FloatArray]) -> tuple[Scores, Scores]:
    """Of points in mm and of turns in degrees; the latter empty where none was measured."""
    turned = problem.measured[:, 3:].any(axis=1)
    turns = {name: turns_deg(left[turned, 3:]) for name, left in errors.items()} if problem.has_turns else {}
    return {name: lengths_mm(left[:, :3]) for name, left in errors.items()}, turns


def _sizes(scores: Scores, turn_scores: Scores) -> dict[str, str]:
    """The mean errors in words."""
    turns = {name: f" and {turn['mean']:.4f} deg" for name, turn in turn_scores.items()}
    return {name: f"{score['mean']:.4f} mm{turns.get(name, '')}" for name, score in scores.items()}


def _experts(name: str, problem: Problem, options: Options) -> list[list[Expert]]:
    """For each fold the members that are trained without it; each also leaves out a tenth of the other regions."""
    members = MEMBERS.get(name, INSTALLED_MEMBERS)
    random = np.random.default_rng((options.seed, 4))
    rows = [
        _without_some(problem, own, random) if members > 1 else own
        for own in problem.training_rows()
        for _ in range(members)
    ]
    found = list(_fit_of(name)(problem, rows, options))
    return [found[k : k + members] for k in range(0, len(found), members)]


def _without_some(problem: Problem, own: IndexArray, random: np.random.Generator) -> IndexArray:
    regions = np.unique(problem.regions[own])
    dropped = random.permutation(regions)[: len(regions) // 10]
    return own[~np.isin(problem.regions[own], dropped)]


def _result(
    network: str, problem: Problem, judged: dict[str, Judged], errors: dict[str, FloatArray], threads: int
) -> TrainingResult:
    scores, turn_scores = _scores(problem, errors)
    means = {name: float(problem.lengths(left).mean()) for name, left in errors.items()}
    # Of equals the first: the network before its rivals.
    kinds = (scores, turn_scores)
    better = [
        name
        for name in errors
        if name != ALONE
        and _is_clearly_better(problem, errors[name])
        and all(kind[name]["mean"] <= kind[ALONE]["mean"] for kind in kinds if kind)
    ]
    used = min(better, key=lambda name: means[name], default=ALONE)
    verdict = _verdict(network, used, means, _sizes(scores, turn_scores))
    best = judged.get(used)
    model = problem.robot
    if best is not None:
        record = {"rows": len(problem), "held_out_mm": scores[used], "model_mm": scores[ALONE], "verdict": verdict}
        if turn_scores:
            record |= {"held_out_deg": turn_scores[used], "model_deg": turn_scores[ALONE]}
        correction = replace(best.correction, record=record)
        model = model.with_(correction=correction)
    elif used == "joint-profiles":
        model = with_profiles(model, problem, np.arange(len(problem)), threads)
    notes = []
    if problem.gross:
        notes.append(f"{problem.gross} rows with gross errors were not learnt from")
    if best is not None and (best.weight < 0.5).any():
        share = float(np.mean(best.weight < 0.5))
        notes.append(f"in {share:.0%} of the held-out rows the guard let pass less than half of the correction")
    if best is not None:
        notes += _gaps(best.correction.guard)
    return TrainingResult(
        model=model,
        asked=network,
        used=used,
        verdict=verdict,
        scores=scores,
        coverage=None if best is None else best.coverage,
        regions=_regions(problem, errors[used]),
        rows=len(problem),
        left_out=problem.left_out.tolist(),
        gross=problem.gross,
        limit=None if best is None else best.correction.limit,
        turn_limit=None if best is None else best.correction.turn_limit,
        turn_scores=turn_scores,
        notes=notes,
    )


def _gaps(guard: Guard) -> list[str]:
    """What to say where the rows leave gaps between the positions of a joint."""
    joints = [str(k) for k, gaps in enumerate(guard.gaps, start=1) if len(gaps)]
    if not joints:
        return []
    return [
        f"the rows leave wide gaps between positions of {'joint' if len(joints) == 1 else 'joints'} "
        f"{', '.join(joints)}, as a grid does: in the gaps the correction is 0, since no row tells what lies there"
    ]


def _verdict(network: str, used: str, means: dict[str, float], sizes: dict[str, str]) -> str:
    result = f"held-out mean error {sizes[used]} with {used}"
    if used == network:
        rivals = [name for name in means if name not in (network, ALONE)]
        beaten = f" and {sizes[min(rivals, key=lambda name: means[name])]} with the best rival" if rivals else ""
        return f"{network} is used: {result}, {sizes[ALONE]} with the model alone{beaten}"
    if used == ALONE:
        return f"{network} is not used, nor any rival: {result} alone, {sizes[network]} with {network}"
    return f"{network} is not used, but {used}: {result}, {sizes[network]} with {network}"


def _is_clearly_better(problem: Problem, errors: FloatArray) -> bool:
    """Is the mean gain over the regions more than MIN_GAIN standard errors?"""
    gain = problem.lengths(problem.residuals) - problem.lengths(errors)
    counts = np.bincount(problem.regions)
    means = np.bincount(problem.regions, gain) / counts
    return bool(means.mean() > MIN_GAIN * means.std(ddof=1) / np.sqrt(len(means)))


def _regions(problem: Problem, errors: FloatArray) -> dict[str, float]:
    before, after = (np.bincount(problem.regions, problem.lengths(values)) for values in (problem.residuals, errors))
    ratio = after / np.maximum(before, 1e-12)
    return {"count": len(ratio), "worse": int(np.sum(ratio > WORSE)), "worst_ratio": float(ratio.max())}
