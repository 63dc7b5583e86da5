# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was found is added to the robot, one effect after the other, and each model is calibrated and judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.evaluation import Evaluation, evaluate
from fastcal.diagnosis.library import Name
from fastcal.diagnosis.problem import with_nuisances
from fastcal.diagnosis.result import GapStep, NamedValue
from fastcal.diagnosis.search import MOST_EFFECTS, State
from fastcal.effects.entries import identity
from fastcal.effects.values import written_parameters
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec


def calibrations(
    robot: Robot,
    data: Dataset,
    test: Dataset | None,
    best: State,
    names: Sequence[Name],
    profiles: list[Spec],
    threads: int,
) -> list[CalibrationResult]:
    """The calibrated geometry, then with one effect more each time."""
    out = []
    entries: list[Spec] = list(robot.spec.get("effects") or [])
    steps = [[], *([_for_file(best, name) for name in group] for group in groups(names))]
    if profiles:
        steps.append(profiles)
    for added in steps:
        entries = entries + added
        whole = with_nuisances(entries, robot)
        spec = dict(robot.spec) | {"effects": whole}
        # Outliers are known and left out: a robust loss would have nothing left to do.
        found = calibrate(
            Robot(spec), best.fit.problem.data.select(best.fit.problem.used), loss="none", as_read=True, threads=threads
        )
        frame: dict[str, Any] = {"before": found.nominal, "threads": threads}
        other = None if test is None else evaluate(found.model, test, **frame)
        out.append(replace(found, train=evaluate(found.model, data, **frame), test=other))
    return out


def groups(names: Sequence[Name]) -> list[list[Name]]:
    """The names one by one; where there are many, all at once: nobody reads the fifth step of a waterfall."""
    return [[name] for name in names] if len(names) <= MOST_EFFECTS else [list(names)]


def _for_file(best: State, name: Name) -> Spec:
    """The entry as a robot file has it, with a start where the solver needs one."""
    entry = {key: value for key, value in name.entry.items() if key not in ("corner", "at_s")}
    if name.effect == "joint_compliance_nonlinear":
        place = best.fit.place(name)
        effect = best.fit.model_effects[[e is name.entry for e in best.fit.entries].index(True)]
        nan = np.full((3, 3), np.nan)
        entry["parameters"] = written_parameters(entry, effect, best.fit.theta[place], nan)
    return entry


def values(model: Robot, entry: Spec) -> dict[str, NamedValue]:
    """Parameters of an effect as the calibrated model has them."""
    wanted = (entry["effect"], entry["owner"], entry.get("order"), entry.get("side"))
    for found in model.spec.get("effects") or []:
        order = identity(found)[2]
        if (found["effect"], found["owner"], order, found.get("side")) == wanted:
            return {name: NamedValue(v["value"], v["std"]) for name, v in found["parameters"].items()}
    raise KeyError(wanted)


def gap(steps: Sequence[CalibrationResult], names: Sequence[Name], profiles: Sequence[Spec]) -> list[GapStep]:
    """RMS errors of the geometry alone and of each model after it."""
    added: list[str | None] = [None, *(",".join("@".join(name.key) for name in group) for group in groups(names))]
    if profiles:
        added.append(",".join(f"{p['effect']}@{p['owner']}" for p in profiles))
    return [
        GapStep(name, _rms(found.train), None if found.test is None else _rms(found.test))
        for name, found in zip(added, steps, strict=True)
    ]


def _rms(part: Evaluation) -> float:
    return part.after.to_mm()["rms"] if part.after is not None else float("nan")
