# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The robot with what was found: each model is the very fit that was judged, written as a robot file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.data_notes import covered
from fastcal.calibration.evaluation import ErrorStatistics, distances, evaluate
from fastcal.calibration.parallel import each
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.held_out import HeldOut
from fastcal.diagnosis.library import Hypothesis
from fastcal.diagnosis.problem import core_entry
from fastcal.diagnosis.result import AdaptedModel, GapStep, NamedValue
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.effects.entries import full_name, identity
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.identified_spec import identified_spec, with_frames
from fastcal.robot.robot import Robot, Spec
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Judge:
    """The rows on which models are judged: all of the data, and the test poses."""

    data: Dataset
    test: Dataset | None
    threads: int = 1

    def adapted(self, fit: Fit, sigma: float) -> AdaptedModel:
        """A fit as a robot, with its errors; `sigma` of a coordinate [m] is kept in its record."""
        before = nominal(fit)
        return self.of(robot_of(fit, sigma), before, fit.unknowns)

    def of(self, model: Robot, before: Robot, unknowns: dict[str, FloatArray]) -> AdaptedModel:
        """A robot with its errors, beside those of another one."""
        frame: dict[str, Any] = {"before": before, "unknowns": unknowns, "unknowns_before": unknowns}
        frame |= {"threads": self.threads}
        test = None if self.test is None else evaluate(model, self.test, **frame)
        return AdaptedModel(model, evaluate(model, self.data, **frame), test)


def fits(search: Search, best: SearchNode, names: Sequence[Hypothesis]) -> list[Fit]:
    """The fitted geometry, then the fits with one effect of `names` more each time; the last is that of the set."""
    out, near = [search.start.fit if names else best.fit], search.start
    added: list[Hypothesis] = []
    for group in groups(names):
        added = [*added, *group]
        near = best if len(added) == len(best.names) else search.state(added, near)
        out.append(near.fit)
    return out


def nominal(fit: Fit) -> Robot:
    """The robot as it came, with base and tool fitted to the data."""
    start = fit.problem.start
    return Robot(with_frames(start.robot.spec, start.alignment.T_world_base, start.alignment.T_flange_tool))


def robot_of(fit: Fit, sigma: float) -> Robot:
    """A fit as a robot file, how sure it is among it."""
    start = fit.problem.start.robot
    bare = Robot(dict(start.spec) | {"effects": [core_entry(entry) for entry in fit.entries]})
    spec = identified_spec(bare, fit.model, fit)
    parameters = fit.model.parameters
    kept = [k for k, i in enumerate(fit.free) if i < len(parameters)]
    record = CalibrationRecord(
        [full_name(parameters[fit.free[k]]) for k in kept],
        fit.root(kept),
        from_si(sigma, "mm"),
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
    for found in model.spec.get("effects") or []:
        if identity(found) == identity(entry):
            return {name: NamedValue(v["value"], v["std"]) for name, v in found["parameters"].items()}
    raise KeyError(identity(entry))


def gap(
    steps: Sequence[AdaptedModel],
    fits: Sequence[Fit],
    kept: BoolArray,
    names: Sequence[Hypothesis],
    profiles: Sequence[Spec],
) -> list[GapStep]:
    """RMS errors of the geometry alone and of each model after it, over the rows that are `kept` (N,): no outliers."""
    added: list[str | None] = [None, *(",".join("@".join(name.key) for name in group) for group in groups(names))]
    if profiles:
        added.append(",".join(f"{p['effect']}@{p['owner']}" for p in profiles))
    held_out = each(lambda at: from_si(HeldOut(at, as_measured=True).rms(kept), "mm"), fits)
    return [gap_step(*step, kept) for step in zip(added, steps, held_out, strict=True)]


def gap_step(added: str | None, found: AdaptedModel, held_out: float, kept: BoolArray) -> GapStep:
    """RMS errors of one model, and what was added to it; `held_out` [mm] of poses held out of its fit."""
    part = found.train
    train = ErrorStatistics.of(distances(part.error_after, part.length_after)[kept])
    test = None if found.test is None or found.test.after is None else found.test.after.to_mm()["rms"]
    return GapStep(added, 0.0 if train is None else train.to_mm()["rms"], held_out if held_out >= 0 else None, test)
