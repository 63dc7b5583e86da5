# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One set of the wide world: drawn, diagnosed, and set beside what is true and what anyone would try by hand."""

from __future__ import annotations

import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from diagnosis_arms import HELD_OUT
from diagnosis_causes import along_sensor, different, named, outside, yielding
from diagnosis_given import paper, real
from diagnosis_page import TWIN
from diagnosis_sets import Truth
from diagnosis_slips import NEEDS, SLIPS
from diagnosis_worlds import World, world
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fastcal import _core, calibrate
from fastcal.calibration.evaluation import evaluate
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis.blocks import columns_at
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.library import build_library
from fastcal.errors import FastcalError
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

WIDE_KINDS = {
    "none": 0.15,
    "single": 0.23,
    "several": 0.11,
    "yields": 0.10,
    "outside": 0.13,
    "mixed": 0.06,
    "sensor": 0.05,
    "slip": 0.08,
    "paper": 0.04,
    "real": 0.05,
}
PLAIN = ("geometry", "geometry,joint_compliance", "geometry,gravity_sag", "geometry,joint_profile")
FLOOR = 1.03  # times the noise: no calibration leaves less
CLOSED = 0.9  # of the gap, squared, from which on a name at the right place is fair whatever its form
BASE, TOOL = ("station_offset", "base"), ("tool_shift", "tool")
SET_UP_NAMES = {"one": set(), "stations": {BASE}, "files": {BASE}, "mounts": {TOOL}, "both": {BASE, TOOL}}


@dataclass(frozen=True)
class WideRecord:
    """What was hidden in a set of the wide world and what was said.

    Attributes:
        factors: What was drawn of each factor of the world.
        truth: Hidden causes, `snr` their sizes; `shown` those of them that the file's columns can show.
        found: Of each of those, is its name or a twin's among those returned?
        wrong: Names without a right one among their equivalents, by their grade.
        noise_um, geometry_um, model_um: RMS of a point's error at rows held out: noise, geometry, what is written.
        plain_um: Of the best plain calibration, `plain` which.
        error: What was raised instead of an answer.
    """

    number: int
    kind: str
    factors: dict[str, str]
    truth: list[str]
    snr: list[float]
    shown: list[str] = field(default_factory=list)
    verdict: str = ""
    said: list[str] = field(default_factory=list)
    named: int = 0
    b_names: int = 0
    found: list[bool] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    noise_um: float = 0.0
    geometry_um: float = 0.0
    model_um: float = 0.0
    plain_um: float = 0.0
    plain: str = ""
    seconds: float = 0.0
    error: str = ""

    @property
    def closed(self) -> float:
        """Share of the squared gap between geometry and noise that the model closes."""
        gap = self.geometry_um**2 - self.noise_um**2
        return 1.0 if gap <= 0 else 1 - (self.model_um**2 - self.noise_um**2) / gap

    @property
    def ratio(self) -> float:
        """RMS over that of the best plain calibration, at rows held out."""
        return self.model_um / self.plain_um if self.plain_um else 1.0


def wide_record(number: int, seed: int, only: str | None) -> WideRecord:
    """Simulates set `number` of a seed, asks, and compares."""
    for attempt in range(20):
        random = np.random.default_rng([seed, number, attempt])
        kind = only or str(random.choice(list(WIDE_KINDS), p=list(WIDE_KINDS.values())))
        try:
            return _given(number, kind, random) if kind in ("paper", "real") else _drawn(number, kind, random)
        except LookupError:
            continue
    raise LookupError(f"set {number} of seed {seed}: no cause that its rows show")


def _given(number: int, kind: str, random: np.random.Generator) -> WideRecord:
    if kind == "paper":
        name, own = paper(random)
        robot, data, test = own.nominal, own.data, own.test
        hidden = [f"{e['effect']}@{e['owner']}" for e in own.true.spec.get("effects", [])]
    else:
        name, robot, data, test = real(random)
        hidden = []
    factors = {"arm": name, "rows": str(len(data))}
    base = WideRecord(number, kind, factors, hidden, [0.0] * len(hidden))

    def judged(model: Robot) -> float:
        return 1e6 * float(np.sqrt(np.mean(np.sum(evaluate(model, test).error_after ** 2, axis=1))))

    return _asked(base, robot, data, judged)[0]


def _drawn(number: int, kind: str, random: np.random.Generator) -> WideRecord:
    at = world(random)
    slip = str(random.choice(list(SLIPS))) if kind == "slip" else ""
    truths = _beside(at, slip, random) if slip else _hidden(at, kind, random)
    data = at.data(truths, random)
    if slip:
        data = SLIPS[slip][1](data, random)
    points = at.seen(truths)[-HELD_OUT:]
    off = random.standard_normal(points.shape) * at.at.sigma
    entries = [f"{t.entry.get('order', '')}{t.effect}@{t.owner}" for t in truths]
    shown = _shown(at, truths, data)
    base = WideRecord(
        number,
        kind,
        at.factors | ({"slip": slip} if slip else {}),
        entries,
        [round(t.snr, 2) for t in truths],
        shown=[f"{t.effect}@{t.owner}" for t in shown],
        noise_um=round(1e6 * float(np.sqrt(np.mean(np.sum(off**2, axis=1)))), 3),
    )

    def judged(model: Robot) -> float:
        there = model.poses(at.at.poses)[-HELD_OUT:, :3, 3]
        return 1e6 * float(np.sqrt(np.mean(np.sum((there - points - off) ** 2, axis=1))))

    out, said = _asked(base, at.at.nominal, data, judged)
    return out if said is None else _compared(out, at, truths, shown, said)


def _hidden(at: World, kind: str, random: np.random.Generator) -> list[Truth]:
    """What is missing in a set of a kind."""
    if kind == "several":
        return different(at, int(random.integers(2, 4)), random)
    if kind == "yields":
        return yielding(at, random)
    if kind == "sensor":
        return [along_sensor(at, random)]
    inside = [named(at, random)] if kind in ("single", "mixed") else []
    return [*inside, outside(at, random)] if kind in ("outside", "mixed") else inside


def _beside(at: World, slip: str, random: np.random.Generator) -> list[Truth]:
    """What is hidden beside a column that is wrong: it must show, or the slip shows nowhere."""
    column = SLIPS[slip][0]
    poses = at.at.poses
    values = getattr(poses, column)
    if column == "payload" and (len(np.unique(poses.payload)) < 2 or at.factors["payload"] == "labels"):
        raise LookupError("one payload")
    if column != "payload" and (at.factors[column] == "none" or values is None):
        raise LookupError("no column")
    return [named(at, random, (NEEDS[column],))]


def _shown(at: World, truths: Sequence[Truth], data: Dataset) -> list[Truth]:
    """Those that have a name with the columns of the file."""
    names = {n.key for n in build_library(at.at.nominal, data).names}
    return [t for t in truths if (t.effect, t.owner) in names or t.effect == "regressor"]


def _asked(
    base: WideRecord, robot: Robot, data: Dataset, judged: Callable[[Robot], float]
) -> tuple[WideRecord, Diagnosis | None]:
    """The diagnosis, and beside it the plain calibrations."""
    start = time.process_time()
    try:
        said = diagnose(robot, data)
    except FastcalError as refused:
        return _beside_plain(replace(base, error=f"refused: {refused}"), robot, data, judged), None
    except Exception:  # noqa: BLE001 - what the benchmark looks for
        return replace(base, error=traceback.format_exc()), None
    seconds = time.process_time() - start
    geometry, model = judged(said.steps[0].model), judged(said.steps[-1].model)
    told = replace(
        base,
        verdict=said.verdict,
        said=[
            f"{f.grade} {f.label} {f.snr:.1f}"
            + " (not in the model)" * (not f.in_model)
            + "".join(f" | {e}@{o}" for e, o in f.equivalents)
            for f in said.effects
        ],
        named=len(said.effects),
        b_names=sum(f.grade == "B" and f.in_model for f in said.effects),
        notes=list(said.notes),
        geometry_um=round(geometry, 3),
        model_um=round(model, 3),
        seconds=round(seconds, 2),
    )
    return _beside_plain(told, robot, data, judged), said


def _beside_plain(base: WideRecord, robot: Robot, data: Dataset, judged: Callable[[Robot], float]) -> WideRecord:
    """With the best of the plain calibrations; a model that leaves little more than the noise needs none beside it."""
    if not base.error and base.model_um <= FLOOR * base.noise_um:
        return base
    plain: dict[str, float] = {}
    for effects in PLAIN:
        for loss in ("tukey", "none"):
            try:
                plain[f"{effects} {loss}"] = judged(calibrate(robot, data, effects=effects, loss=loss).model)
            except (FastcalError, ArithmeticError, np.linalg.LinAlgError):
                continue
    best = min(plain, key=lambda name: plain[name], default="")
    return replace(base, plain=best, plain_um=round(plain.get(best, 0.0), 3))


def _compared(
    base: WideRecord, at: World, truths: Sequence[Truth], shown: Sequence[Truth], said: Diagnosis
) -> WideRecord:
    """With which names are right."""
    right = [_right_names(at, said, t) for t in truths]
    everything: set[tuple[str, str]] = set().union(*right, SET_UP_NAMES[at.factors["set-ups"]])
    owners = {t.owner for t in truths} if base.closed >= CLOSED else set()
    graded = [f for f in said.effects if f.grade in "AB" and f.in_model]
    wrong = [
        f"{f.grade} {f.label}"
        for f in graded
        if not {(f.effect, f.owner), *f.equivalents} & everything and not (f.grade == "B" and f.owner in owners)
    ]
    returned = [{(f.effect, f.owner), *f.equivalents} for f in said.effects]
    found = [any(names & r for r in returned) for t, names in zip(truths, right, strict=True) if t in shown]
    return replace(base, wrong=wrong, found=found)


def _right_names(at: World, said: Diagnosis, truth: Truth) -> set[tuple[str, str]]:
    """The true name and its twins': those whose columns hold its signature all but whole."""
    out = {(truth.effect, truth.owner)}
    if truth.effect == "joint_compliance" and not at.at.has_masses:
        out.add(("gravity_sag", truth.owner))
    if truth.effect in ("joint_compliance", "joint_compliance_nonlinear"):
        out |= {("joint_compliance", truth.owner), ("joint_compliance_nonlinear", truth.owner)}
    if truth.effect == "gear_harmonic":
        out.add(("joint_profile", truth.owner))
    if not truth.entry:
        return set()
    start = said.search.start
    problem = start.fit.problem
    if at.factors["order"] == "shuffled" or at.factors["measured"] != "points" or problem.noise.memory:
        return out
    A, _r, row = start.fit.whitened
    d = np.zeros(len(row))
    shift = truth.shift[problem.rows[row[row >= 0][::3]]].ravel() / problem.noise.factor
    d[row >= 0] = decorrelated(problem, shift, row[row >= 0])
    blocks = start.blocks
    tests = _core.ScoreTests(A, columns_at(start.fit).values, d, blocks.sizes)
    share = np.asarray(tests.scores.statistic) / max(tests.remaining, 1e-300)
    rank = np.asarray(tests.scores.rank)
    own = [int(rank[i]) for i, n in enumerate(blocks.names) if n.key == (truth.effect, truth.owner)]
    for i, name in enumerate(blocks.names):
        richer = name.owner == truth.owner and truth.effect in name.traits.generalizes
        if share[i] > TWIN**2 and rank[i] <= max(own, default=6) and not richer:
            out.add(name.key)
    return out


def wide_tried(number: int, seed: int, only: str | None) -> WideRecord | str:
    """`wide_record`, or what went wrong in drawing it."""
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")
        try:
            return wide_record(number, seed, only)
        except Exception:  # noqa: BLE001 - one set must not cost the others
            return f"set {number}: {traceback.format_exc()}"


def wide_line(r: WideRecord) -> str:
    """A set in a line."""
    if r.error:
        return f"{r.number:5} {r.kind} ERROR {r.error.strip().splitlines()[-1]} {r.factors}"
    mark = "!" * (r.ratio > 1.05) + "w" * bool(r.wrong)
    truth = ", ".join(f"{t} ({s:.0f})" for t, s in zip(r.truth, r.snr, strict=True))
    return (
        f"{r.number:5} {mark:2} {r.kind} {r.factors['arm']} {r.factors['rows']}: {truth} -> {r.verdict}: "
        f"{'; '.join(r.said)} | {r.ratio:.3f} of {r.plain}, closed {r.closed:.2f}, wrong {r.wrong}, {r.seconds:.1f} s"
    )
