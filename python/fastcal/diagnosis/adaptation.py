# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The robot with the effects found: each model is exactly the fit that was judged, written as a robot file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal.arrays import BoolArray, FloatArray
from fastcal.calibration.data_notes import covered
from fastcal.calibration.error_statistics import ErrorStatistics
from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.kind_noise import noise_record
from fastcal.calibration.nominal_arm import NominalArm, nominal_arm
from fastcal.calibration.parallel import each
from fastcal.calibration.placed_test import evaluated_test
from fastcal.calibration.unknowns import given_rig, unknowns_found
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.gap import GapStep, KindGap
from fastcal.diagnosis.held_out import HeldOut
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.noise_scales import noise_by_kind
from fastcal.diagnosis.problem import core_entry
from fastcal.diagnosis.result import AdaptedModel, NamedValue
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.effects.entries import full_name, identity
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.identified_spec import identified_spec
from fastcal.robot.rig import with_found
from fastcal.robot.robot import Robot, Spec


@dataclass(frozen=True, eq=False)
class Judge:
    """The rows on which models are judged: all of the data, and the test poses."""

    data: Dataset
    test: Dataset | None
    threads: int = 1

    def adapted(self, fit: Fit, sigma: float) -> AdaptedModel:
        """A fit as a robot, with its errors; `sigma` of a coordinate [m] is kept in its record."""
        before = nominal(fit)
        model = robot_of(fit, sigma)
        return self.of(model, before, fit.unknowns | given_rig(model, self.data))

    def of(self, model: Robot, before: NominalArm, unknowns: dict[str, FloatArray]) -> AdaptedModel:
        """A robot with its errors, beside those of another one."""
        frame: dict[str, Any] = {"before": before.judged, "unknowns": unknowns, "unknowns_before": before.unknowns}
        frame |= {"threads": self.threads}
        test = None if self.test is None else evaluated_test(model, before.judged, self.test, frame)[0]
        return AdaptedModel(model, evaluate(model, self.data, **frame), test, unknowns)


def fits(search: Search, best: SearchNode, names: Sequence[Hypothesis]) -> list[Fit]:
    """The fitted geometry, then the fits with one effect of `names` more each time; the last is that of the set."""
    out, near = [search.start.fit if names else best.fit], search.start
    added: list[Hypothesis] = []
    for group in groups(names):
        added = [*added, *group]
        near = best if len(added) == len(best.names) else search.state(added, near)
        out.append(near.fit)
    return out


def nominal(fit: Fit) -> NominalArm:
    """The robot as it came, with base and tool, anchors, planes and mountings fitted to the data."""
    return nominal_arm(fit.problem.start)


def robot_of(fit: Fit, sigma: float) -> Robot:
    """A fit as a robot file, how sure it is among it."""
    start = fit.problem.start.robot
    bare = start.with_(effects=[core_entry(entry) for entry in fit.entries])
    spec = identified_spec(bare, fit.model, fit)
    places = unknowns_found(fit, len(fit.model.parameters), fit.covariance)
    spec = with_found(spec, fit.problem.measured.parameters, *places)
    parameters = fit.model.parameters
    kept = [k for k, i in enumerate(fit.free) if i < len(parameters)]
    record = CalibrationRecord(
        [full_name(parameters[fit.free[k]]) for k in kept],
        fit.root(kept),
        noise_record(noise_by_kind(fit.problem, sigma)),
        int(fit.freedom),
        covered=covered(start, fit.problem.data),
    )
    spec["calibration"] = record.to_spec() | {"nominal": nominal_record(start.spec)}
    return Robot(spec)


def groups(names: Sequence[Hypothesis]) -> list[list[Hypothesis]]:
    """The names one by one; where there are many, all at once: a waterfall of many steps is hard to read."""
    return [[name] for name in names] if len(names) <= rules.MAX_EFFECTS else [list(names)]


def values(model: Robot, entry: Spec) -> dict[str, NamedValue]:
    """Parameters of an effect as the adapted model has them."""
    for found in model.entries:
        if identity(found) == identity(entry):
            return {name: NamedValue(v["value"], v["std"]) for name, v in found["parameters"].items()}
    raise KeyError(identity(entry))


def gap(
    steps: Sequence[AdaptedModel],
    fits: Sequence[Fit],
    kept: BoolArray,
    names: Sequence[Hypothesis],
    beside: str | None,
) -> list[GapStep]:
    """RMS errors of the geometry alone and of each model after it, over the rows that are `kept` (N,): no outliers.

    `beside` is what the last model has beside the names.
    """
    added: list[str | None] = [None, *(",".join("@".join(name.key) for name in group) for group in groups(names))]
    if beside is not None:
        added.append(beside)
    held_out = each(lambda of: held_out_rms(*of, kept), list(zip(fits, steps, strict=True)))
    return [gap_step(*step, kept) for step in zip(added, steps, held_out, strict=True)]


def gap_step(added: str | None, found: AdaptedModel, held_out: float | None, kept: BoolArray) -> GapStep:
    """RMS errors of one model over the rows `kept` (N,), and what was added to it.

    `held_out`, in the unit of the kind that is spoken of, is that of poses held out of its fit.
    """
    test = {} if found.test is None else {name: of.rms for name, of in found.test.kinds.items()}
    train = found.train.kinds
    kinds = {name: KindGap(of.kind.unit, _rms(of, kept), None, test.get(name)) for name, of in train.items()}
    main = next(iter(kinds), None)
    if main is not None:
        kinds[main] = replace(kinds[main], held_out_rms=held_out)
    return GapStep(added, kinds)


def held_out_rms(fit: Fit, found: AdaptedModel, kept: BoolArray) -> float | None:
    """RMS error of poses held out of a fit, in the unit of the kind that is spoken of; None where nothing is known."""
    main = found.train.main
    rms = np.nan if main is None else HeldOut(fit, as_measured=True).rms(kept, main.kind, main.after)
    return None if main is None or np.isnan(rms) else float(main.kind.shown(rms))


def _rms(of: KindErrors, kept: BoolArray) -> float | None:
    found = ErrorStatistics.of(of.after[kept].ravel())
    return None if found is None else float(of.kind.shown(found.rms))
