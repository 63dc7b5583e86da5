# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The result of a diagnosis as a program reads it: the content of diagnosis.json."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fastcal.arrays import FloatArray
from fastcal.calibration.evaluation import Evaluation
from fastcal.diagnosis import words
from fastcal.diagnosis.columns import columns_of
from fastcal.diagnosis.gap import Gap, GapStep
from fastcal.diagnosis.library import Untestable
from fastcal.diagnosis.reasons import Because, CauseLabel
from fastcal.display import late
from fastcal.display.shown import Plotted
from fastcal.effects.entries import TOLD_APART_BY, options_of
from fastcal.measurements.kinds import KindMisfit, KindNoise, noise_in_mm
from fastcal.robot.robot import Robot, Spec

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from fastcal.diagnosis.plan import SeparatingPlan
    from fastcal.diagnosis.search import Search, SearchNode


VERDICTS = ("none", "named", "one_of", "several", "unexplained")


@dataclass(frozen=True)
class NamedValue:
    """A parameter with its standard deviation, in the unit at the end of its name."""

    value: float
    std: float | None


@dataclass(frozen=True)
class Finding:
    """One cause that the data ask for.

    Attributes:
        grade: A it is this; B the data are consistent with it; C the place is known, the form is not.
        parameters: By their names at the edge, such as gap_rad.
        snr: Root of the chi square by which the fit is worse without it.
        p_value: Of that chi square, times the number of names that were tried.
        equivalents: (effect, owner) of names that would do as well.
        gain: By how much the mean square of held-out rows is lower with it, as a share, and its standard error.
        stability: Share of the folds in which the same name comes first.
        limits: Why the grade is not better; `reasons` says it in a sentence each.
        in_model: Is it sure enough to be in the model that is written?
    """

    effect: str
    owner: str
    grade: str
    parameters: dict[str, NamedValue]
    snr: float
    p_value: float
    equivalents: tuple[tuple[str, str], ...] = ()
    gain: tuple[float, float] = (0.0, 0.0)
    stability: float = 1.0
    limits: tuple[Because, ...] = ()
    in_model: bool = True

    @property
    def label(self) -> str:
        """effect@owner."""
        return f"{self.effect}@{self.owner}"

    def is_of(self, entry: Spec) -> bool:
        """Is it this entry's cause? Waves of one owner are told apart by their order, steps by their moment."""
        same = (entry["effect"], entry["owner"]) == (self.effect, self.owner)
        own = options_of(entry)
        return same and all(own.get(key) == value for key, value in self.told_apart_by.items())

    @property
    def told_apart_by(self) -> dict[str, float]:
        """Its order or moment, which tells it from others of its effect and owner."""
        return {key: self.parameters[key].value for key in TOLD_APART_BY if key in self.parameters}

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the grade is not better."""
        return tuple(map(words.reason_text, self.limits))

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `effects` in diagnosis.json."""
        return {
            "effect": self.effect,
            "owner": self.owner,
            "grade": self.grade,
            "in_model": self.in_model,
            "parameters": {name: vars(value) for name, value in self.parameters.items()},
            "snr": self.snr,
            "p_value": self.p_value,
            "equivalents": [{"effect": effect, "owner": owner} for effect, owner in self.equivalents],
            "held_out_gain": {"share": self.gain[0], "standard_error": self.gain[1]},
            "stability": self.stability,
            "reasons": list(self.reasons),
        }


@dataclass(frozen=True)
class Unexplained:
    """What remains: where it is best placed, what it depends on, and the share of the misfit that this explains.

    The misfit is what the geometry alone leaves above the noise, as chi square.

    Attributes:
        added: The surrogates that stand for it in the model, such as "surrogate@joint5"; None: nothing was added.
        formulas: Up to three that would describe the curve, the best first: hints to a person.
    """

    owner: str
    share: float
    depends_on: tuple[str, ...]
    added: str | None = None
    formulas: tuple[str, ...] = ()


@dataclass(frozen=True)
class RankedHypothesis:
    """A hypothesis that was looked at, and why it is not given.

    Attributes:
        estimate: Of its parameters when it alone is added, in the unit of their names.
        snr: Root of its score statistic over the calibrated geometry.
        share: Of the misfit that it alone explains.
        because: Why it is, or is not, given; `reason` says it in a sentence.
    """

    label: CauseLabel
    snr: float
    share: float
    estimate: dict[str, float]
    because: Because

    @property
    def name(self) -> str:
        """effect@owner, and its variant."""
        return str(self.label)

    @property
    def reason(self) -> str:
        """Why it is, or is not, given."""
        return words.reason_text(self.because)


@dataclass(frozen=True)
class DetectableEffect:
    """The smallest effect that these data would have shown four times in five, in the unit of its name."""

    effect: str
    owner: str
    parameter: str
    value: float


@dataclass(frozen=True, eq=False)
class AdaptedModel:
    """A robot with what was found so far, its errors on the data and the test poses, and the observations' unknowns."""

    model: Robot
    train: Evaluation
    test: Evaluation | None
    unknowns: Mapping[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Plotted):
    """What `diagnose` found; `model` is the robot with the effects in it that are sure.

    Attributes:
        verdict: none, named, one_of, several or unexplained.
        effects: Largest first.
        untestable: On which the data hold no information: neither present nor absent.
        outliers: Rows, from 0.
        noise: Of a number of each kind of reading; sigma_source, sigma_note say where it comes from.
        misfits: Kinds of reading that do not belong to the arm or to the other kinds.
        gap: Error of the geometry alone, then with each effect added.
        ranking: All names by what they explain, with the reason for which each is not given.
        smallest: What would have been seen.
        confusion: Names of the first in the ranking, and the largest correlation of each pair.
        steps: The model at each step of `gap`.
        search: Every set that was fitted; `state` is the one that is given, `final` the same beside joint profiles.
        plan: What to measure next, where a name has equivalents.
        plain: Which plain model is written, and why, where it predicts held-out rows better than what was found.
        converged: Did the fit of the model that is written?
        few: Why no cause was looked for: too few postures; empty where there are enough.
    """

    verdict: str
    sentence: str
    effects: list[Finding]
    unexplained: Unexplained | None
    untestable: list[Untestable]
    outliers: list[int]
    noise: Mapping[str, KindNoise]
    sigma_source: str
    sigma_note: str
    gap: list[GapStep]
    ranking: list[RankedHypothesis]
    smallest: list[DetectableEffect]
    confusion: tuple[list[CauseLabel], FloatArray]
    steps: list[AdaptedModel]
    search: Search
    state: SearchNode
    final: SearchNode
    plan: SeparatingPlan | None = None
    plain: str | None = None
    notes: list[str] = field(default_factory=list)
    misfits: list[KindMisfit] = field(default_factory=list)
    converged: bool = True
    few: str = ""

    @property
    def status(self) -> str:
        """converged, too_few_postures, not_converged, or predicts_worse: other poses' error rises by it."""
        if self.few:
            return "too_few_postures"
        if not self.converged:
            return "not_converged"
        return "predicts_worse" if self.judged_gap.rises else "converged"

    @property
    def sigma_mm(self) -> float | None:
        """Noise of a coordinate, or of the lengths that were measured in place of points; None where neither was."""
        return noise_in_mm(self.noise)

    @property
    def main_noise(self) -> KindNoise:
        """Of the kind that is spoken of: points where they were measured."""
        return next(iter(self.noise.values()))

    @property
    def floor(self) -> float:
        """RMS error that noise alone would make of the kind that is spoken of, in its unit."""
        main = self.train.main
        width = 1 if main is None else main.width
        return float(self.main_noise.kind.shown(self.main_noise.value) * width**0.5)

    @property
    def model(self) -> Robot:
        """The identified robot with everything that is sure."""
        return self.steps[-1].model

    @property
    def train(self) -> Evaluation:
        """Errors on the data, with everything that was found."""
        return self.steps[-1].train

    @property
    def test(self) -> Evaluation | None:
        """Errors on the test poses."""
        return self.steps[-1].test

    def fitted_with(self, finding: Finding) -> SearchNode:
        """The set whose fit has a finding: `final`, but for names that are told and not written."""
        return self.final if any(map(finding.is_of, self.final.fit.entries)) else self.state

    @property
    def judged_gap(self) -> Gap:
        """On the test poses where there are any, else on poses held out of the fits."""
        steps = [step.main for step in self.gap]
        unit = steps[0].unit
        for on, sizes in (("test", [at.test_rms for at in steps]), ("held out", [at.held_out_rms for at in steps])):
            known = [size for size in sizes if size is not None]
            if len(known) == len(sizes):
                return Gap(on, known, self.floor, unit)
        return Gap("fitted", [at.train_rms or 0.0 for at in steps], self.floor, unit)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        remaining = self.unexplained
        return {
            "status": self.status,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "effects": [f.to_json_dict() for f in self.effects],
            "unexplained": None
            if remaining is None
            else {
                "owner": remaining.owner,
                "share": remaining.share,
                "depends_on": list(remaining.depends_on),
                "added": remaining.added,
                "formulas": list(remaining.formulas),
            },
            "untestable": [vars(u) for u in self.untestable],
            "columns": {name: list(titles) for name, titles in vars(columns_of(self.train.data)).items()},
            "outliers": self.outliers,
            "sigma_mm": {"value": self.sigma_mm, "source": self.sigma_source, "note": self.sigma_note},
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "kinds": {name: of.to_json_dict() for name, of in self.train.kinds.items()},
            "train": self.train.to_json_dict(),
            "test": None if self.test is None else self.test.to_json_dict(),
            "misfits": [{"kind": of.kind.name, "text": of.text} for of in self.misfits],
            "gap": [step.to_json_dict() for step in self.gap],
            "ranking": [
                {"name": r.name, "snr": r.snr, "share": r.share, "estimate": r.estimate, "reason": r.reason}
                for r in self.ranking
            ],
            "smallest": [vars(s) for s in self.smallest],
            "next_measurement": None
            if self.plan is None
            else {
                "poses": len(self.plan.poses),
                "power_before": self.plan.power_before,
                "power_after": self.plan.power_after,
                "sentence": self.plan.sentence,
                "file": self.plan.file,
            },
            "confusion": {
                "names": [str(label) for label in self.confusion[0]],
                "correlation": self.confusion[1].tolist(),
            },
            "plain_model": self.plain,
            "notes": self.notes,
        }

    def plot_gap(self) -> Figure:
        """RMS error of the geometry alone, what each effect takes of it, and what noise alone would make."""
        return late.call("chart", self, "gap")

    def plot_effect(self, name: str | None = None) -> Figure:
        """What the data ask for against the effect's own variable, and the fitted effect with its 95 % band.

        Args:
            name: EFFECT@OWNER of a finding. None: the first.

        Raises:
            InvalidInput: Nothing of that name was found.
        """
        return late.call("chart", self, "effect", name)

    def plot_likeness(self) -> Figure:
        """How alike the signatures of the leading causes are in these data."""
        return late.call("chart", self, "likeness")

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes model.yaml, diagnosis.json and report.html into a folder, all or none."""
        late.call("write_diagnosis", self, folder)
