# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a measured condition explain what looks like a move? Payload, forces, temperature, approach, currents.

If poses without a load are followed by poses with one, or the arm warms up during the measurement, the points shift
between the two parts although nothing was moved. So before a move is reported, each effect that depends on a varying
condition is fitted together with the parameters, on all joints or links that can have it, to the linearized residuals.
Effects and a motion of s parameters are compared by n log(cost) + s log n (G. Schwarz 1978).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fastcal.arrays import BoolArray, FloatArray, IndexArray
from fastcal.calibration.consensus import GROSS
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals
from fastcal.calibration.shifted_rows import EXPLAINED, Shift, huber_fit
from fastcal.effects.entries import effect_names, label, parse_effects, traits_of
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.said import chained, said

CLEARLY = 20.0  # of the criterion, by which one of two readings is the better
_ROUNDS = 8
_APART = 0.8  # share of the rows left out less that of the others, on one side of a condition's value


@dataclass(frozen=True, eq=False)
class Explained:
    """An effect that a condition would have.

    Attributes:
        effect: Its name, as `--effects` takes it.
        columns: Of the data, that it reads and that vary: "payload_kg".
        J: (m, k) whitened columns of its parameters.
        left: What it leaves of the cost that `huber_fit` returns.
        criterion: Of this reading.
        asked: What `--effects` would be with it.
    """

    effect: str
    columns: tuple[str, ...]
    J: FloatArray
    left: float
    criterion: float
    asked: str

    @property
    def said(self) -> str:
        """What varies, and through which effect it would show: `payload_kg, by joint_compliance`."""
        return said("{columns}, by {effect}", columns=chained("{first} and {second}", self.columns), effect=self.effect)


def criterion(cost: float, numbers: int, parameters: int) -> float:
    """Less is better; of a cost (sum of squares) of so many numbers, with so many parameters."""
    return float(numbers * np.log(max(cost, 1e-300)) + parameters * np.log(numbers))


def varying(data: Dataset) -> dict[str, str]:
    """Conditions that change from row to row: what effects call that they depend on, to the column's name."""

    def varies(values: FloatArray | None) -> bool:
        return values is not None and bool(np.any(np.ptp(np.nan_to_num(np.asarray(values)), axis=0) > 0))

    loads = [name for name, values in (("payload_kg", data.payload), ("fx_n ... mz_nm", data.wrench)) if varies(values)]
    out = dict.fromkeys(("load", "torque"), " and ".join(loads)) if loads else {}
    for field, depends, name in (
        ("temperature", "temperature_c", "temperature_c"),
        ("approach", "approach{n}", "approach"),
        ("current", "current{n}_a", "currents"),
    ):
        if varies(getattr(data, field)):
            out[depends] = name
    return out


def share_a_condition(data: Dataset, left_out: IndexArray, judged: BoolArray) -> bool:
    """Are the rows that a fit leaves out, of those `judged` (N,), just about those beyond some value of a condition?

    A payload, a temperature, a side from which a joint approached: what is missing depends on it.
    """
    out = np.zeros(len(judged), dtype=bool)
    out[left_out] = True
    out = out[judged]
    measured = (data.payload, data.temperature, data.approach)
    columns = np.column_stack([np.zeros((len(judged), 0)), *(c for c in measured if c is not None)])[judged]
    if not out.any() or out.all():
        return False
    for values in columns.T:
        order = np.argsort(values, kind="stable")
        steps = np.flatnonzero(np.diff(values[order]) > 0)
        part = np.cumsum(out[order])[steps] / out.sum() - np.cumsum(~out[order])[steps] / np.sum(~out)
        if np.any(np.abs(part) >= _APART):
            return True
    return False


def explaining_effect(problem: CalibrationProblem, near: Residuals) -> Explained | None:
    """The effect of a condition that varies which explains most of the residual; None where none can."""
    there, found = varying(problem.data), []
    own = {entry["effect"] for entry in problem.robot.entries}
    for name in effect_names() if there else []:
        traits = traits_of(name)
        read = [there[d] for d in traits.depends_on if d in there]
        if not read or name in own or traits.role != "cause" or traits.of_the_measurement or traits.searched:
            continue
        J, lower = _columns(problem, near, name)
        if J.shape[1] == 0:
            continue
        left, J = _fitted(near, J, lower)
        value = criterion(left, len(near.residual), J.shape[1])
        columns, asked = tuple(dict.fromkeys(read)), _asked_with(problem, name)
        found.append((traits.place != "joint", Explained(name, columns, J, left, value, asked)))
    least = min((each.criterion for _, each in found), default=0.0)
    # Joints give sooner than links: of effects that do as well theirs is named.
    near_best = [(rare, each.criterion, k) for k, (rare, each) in enumerate(found) if each.criterion < least + CLEARLY]
    return found[min(near_best)[2]][1] if near_best else None


def _columns(problem: CalibrationProblem, near: Residuals, name: str) -> tuple[FloatArray, FloatArray]:
    """Whitened columns (m, k) of an effect's parameters at 0, on all its owners, and their lower bounds (k,)."""
    robot = problem.robot
    none = np.zeros((len(near.residual), 0)), np.zeros(0)
    try:
        entries = [with_origins(entry, robot, problem.data) for entry in parse_effects(name, robot.core)[1]]
        wider = problem.with_(robot=robot.with_(effects=[*robot.entries, *entries]))
    except InvalidInput:  # the robot or the data have not what it needs
        return none
    first, last = len(problem.parameters), len(wider.parameters)
    theta = np.concatenate([near.theta[:first], np.zeros(last - first), near.theta[first:]])
    J = np.asarray(wider.linearize(theta, near.noise).J)[near.place, first:last]
    size = np.linalg.norm(J, axis=0)
    shown = np.isfinite(size) & (size > 0)
    lower = np.array([p.lower for p in wider.parameters[first:last]])
    return J[:, shown] / size[shown], lower[shown]


def _fitted(near: Residuals, J: FloatArray, lower: FloatArray) -> tuple[float, FloatArray]:
    """The cost that the columns J leave beside the fit's own, and those of them that stay on the right side of 0."""
    free = near.J[:, near.free]
    for _ in range(_ROUNDS):
        left, x = huber_fit(np.hstack([free, J]), near.residual, near.row)
        # The residual is predicted less measured: its columns are taken off.
        wrong = (lower == 0) & (-x[free.shape[1] :] < 0)
        if not wrong.any():
            break
        J, lower = J[:, ~wrong], lower[~wrong]
    return left, J


def _asked_with(problem: CalibrationProblem, name: str) -> str:
    """What `--effects` of this fit would be with one more effect."""
    own = len(problem.model.robot.nominal)
    arm = any(i < own and problem.parameters[i].owner not in ("base", "tool") for i in problem.asked)
    there = dict.fromkeys(label(entry) for entry in problem.robot.entries)
    return ",".join([*(["geometry"] if arm else []), *there, name])


Word = Literal["moved", "effect", "both", "undecidable"]


def reading(problem: CalibrationProblem, near: Residuals, shift: Shift) -> tuple[Word, Explained | None]:
    """What rows that lie elsewhere from one on say: something moved, a condition has an effect, both, or either."""
    effect = explaining_effect(problem, near)
    if effect is None:
        return "moved", None
    numbers = len(near.residual)
    moved = criterion(shift.left, numbers, shift.columns.shape[1] + len(shift.firsts))
    together, _ = huber_fit(np.hstack([near.J[:, near.free], effect.J, shift.columns]), near.residual, near.row)
    if together < EXPLAINED * min(shift.left, effect.left):
        return "both", effect
    if effect.criterion < moved - CLEARLY:
        return "effect", effect
    return ("moved", None) if moved < effect.criterion - CLEARLY else ("undecidable", effect)


def condition_that_explains(problem: CalibrationProblem, near: Residuals) -> Explained | None:
    """The effect of a condition that explains more than half of what remains; None where none does."""
    effect = explaining_effect(problem, near)
    if effect is None:
        return None
    alone, _ = huber_fit(near.J[:, near.free], near.residual, near.row)
    return effect if effect.left < EXPLAINED * alone else None


def explains_gross(problem: CalibrationProblem, near: Residuals, gross: BoolArray) -> Explained | None:
    """The effect that makes gross rows agree with the others; `gross` (m,) says which numbers are theirs."""
    effect = condition_that_explains(problem, near)
    if effect is None:
        return None
    both = np.hstack([near.J[:, near.free], effect.J])
    e = near.residual - both @ huber_fit(both, near.residual, near.row)[1]
    return effect if np.mean(e[gross] ** 2) < GROSS**2 * np.mean(e[~gross] ** 2) else None
