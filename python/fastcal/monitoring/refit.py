# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The fit of an update: the model's parameters by a few new rows, with what it knew as the prior.

    r = B b + J (R z + Q d + D k + H h) + e,    z, d, h ~ N(0, 1),  k ~ N(0, (3 S)^2)

R the root of the model's covariance, Q each parameter's gradual drift, D the directions of what has changed by a check
of the same rows, its rivals among them, with typical sizes S; H what the gauge held, where the new rows show it.
Gauss-Newton iteration, each step judged by its end and held back where it does not lead down (K. Levenberg 1944): a
model may know next to nothing of some directions, and far along them nothing is linear. The noise's variance is pooled
with the calibration's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg

from fastcal.arrays import FloatArray
from fastcal.effects.entries import full_name, identity
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.drift import drift_of
from fastcal.monitoring.hypotheses import Hypothesis
from fastcal.monitoring.linear import LinearRows, as_known, linear_rows, record_of
from fastcal.monitoring.setting import Setting
from fastcal.monitoring.setups import SetUp, set_ups
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.identified_spec import Values, identified_spec
from fastcal.robot.robot import Robot

EVENT_SIZES = 3.0  # typical sizes: how far what has changed may be from the model
# Mostly three: a zero off by a degree is linear to a ten-thousandth after the second. A hundred where the model knows
# directions to no more than 0.1 rad: the rows' bend, which Gauss-Newton leaves out, then outweighs the prior.
_ROUNDS = 200
_SETTLED = 1e-3  # of the cost: a thirtieth of a standard deviation
_LEAST, _STIFFER, _EASED = 0.1, 10.0, 5.0  # damping, in priors: where what the model hardly knows bends the arm
_UNSEEN = 0.1  # standard deviations: less of a held direction leaves it held


@dataclass(frozen=True, eq=False)
class Refit:
    """Where the iteration ended.

    Attributes:
        spec: Of the model, its base that of the first set-up.
        start: The model that the fit began from, its new effects at 0.
        rows: The last linear problem; scale the root of the pooled variance over the old one.
        theta: (P,) of `start`'s parameters, the base's included.
        covariance: (P, P) of them.
        free: Indices of what has a covariance.
        held: (P, j) directions that the new rows don't show either.
        converged: Was what is left of the cost to fall nothing?
    """

    spec: dict[str, Any]
    start: Robot
    places: list[SetUp]
    rows: LinearRows
    scale: float
    freedom: float
    theta: FloatArray
    covariance: FloatArray
    free: list[int]
    held: FloatArray
    converged: bool


def refit(setting: Setting, changed: list[Hypothesis], data: Dataset, threads: int) -> Refit:
    """The arm of a check fitted to its rows; `changed` is what is free to be an event away from the model."""
    arm = _with_named_effects(setting, changed)
    record = record_of(setting.arm)
    known, _ = as_known(data, record)
    names = [full_name(p) for p in arm.error_model.parameters]
    at = _places_of(setting.extended_arm, arm)
    own = len(arm.core.parameters)
    base = [i for i, p in enumerate(arm.error_model.parameters[:own]) if p.owner == "base"]
    first = _Fitted.to(arm, known, record, None, threads)
    F = len(record.parameters)
    seen, held = _held(first.rows, F)
    k = [h.directions[at] * (EVENT_SIZES * h.sizes) for h in changed if h.directions is not None]
    G = np.hstack([first.rows.R[:, :F], _gradual_drift(arm, record, names), *k, seen])

    best, damping, converged = replace(first, u=np.zeros(G.shape[1])), 0.0, False
    for _ in range(_ROUNDS):
        b, du, gain = best.step(G, damping)
        if converged := gain < _SETTLED:
            break
        theta = best.theta + G @ du
        theta[base] += best.rows.base_motion(b)
        moved = Robot(identified_spec(best.robot, best.robot.error_model, Values(theta)))
        there = _Fitted.to(moved, known, record, best.u + du, threads)
        if there.cost < best.cost:
            best, damping = there, damping / _EASED if damping > _LEAST else 0.0
        else:
            damping = max(_STIFFER * damping, _LEAST)

    rows, B = best.rows, best.rows.B
    spread = best.spread(G)
    freedom = rows.freedom + len(rows.r) - B.shape[1]
    scale = float(np.sqrt((rows.freedom + best.cost) / freedom))
    theta = best.theta
    theta[base] += rows.base_motion(np.linalg.lstsq(B, rows.r, rcond=None)[0])
    to_theta = np.zeros((len(theta), len(spread)))
    to_theta[base, : B.shape[1]] = rows.base_motion(np.eye(B.shape[1]))
    to_theta[:, B.shape[1] :] = G
    root = scale * to_theta @ spread
    free = [i for i in range(len(theta)) if np.any(root[i] != 0)]
    covariance = root[free] @ root[free].T
    held[base] = -rows.base_motion(np.linalg.lstsq(B, rows.J @ held, rcond=None)[0])
    spec = identified_spec(best.robot, best.robot.error_model, Values(theta, free, covariance))
    return Refit(spec, arm, best.places, rows, scale, freedom, theta, covariance, free, held, converged)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """Where an iteration is: the arm before its set-ups, the linear problem there, and u, all of z, d, k and h.

    Attributes:
        cost: Sum of squares of what the rows and the priors are off, the bases at their best.
    """

    places: list[SetUp]
    rows: LinearRows
    u: FloatArray

    @staticmethod
    def to(robot: Robot, data: Dataset, record: CalibrationRecord, u: FloatArray | None, threads: int) -> _Fitted:
        places = set_ups(robot, data, threads=threads)
        return _Fitted(places, linear_rows(places, record, threads=threads), np.zeros(0) if u is None else u)

    @property
    def robot(self) -> Robot:
        return self.places[0].robot

    @property
    def theta(self) -> FloatArray:
        return np.array(self.robot.error_model.start)

    @cached_property
    def cost(self) -> float:
        left = self.rows.r - self.rows.B @ np.linalg.lstsq(self.rows.B, self.rows.r, rcond=None)[0]
        return float(left @ left + self.u @ self.u)

    def step(self, G: FloatArray, damping: float) -> tuple[FloatArray, FloatArray, float]:
        """Of b and of u, held back by `damping`, and by how much the cost would fall were all linear.

        With w = 1 + damping and du = e - u / w the least of |r + M u / w - B b - M e|^2 + w |e|^2, M = J G, is wanted:
        where M has fewer rows than columns, by the covariance 1 + M M^T / w of its rows (R. Kalman 1960).
        """
        r, B, M, w = self.rows.r, self.rows.B, self.rows.J @ G, 1 + damping
        y = r + M @ self.u / w
        if len(M) < M.shape[1]:
            L = linalg.cholesky(np.eye(len(M)) + M @ M.T / w, lower=True)
            y, B_white = (linalg.solve_triangular(L, x, lower=True) for x in (y, B))
            b = np.linalg.lstsq(B_white, y, rcond=None)[0]
            e = M.T @ linalg.solve_triangular(L, y - B_white @ b, lower=True, trans="T") / w
        else:
            A = np.block([[B, M], [np.zeros((M.shape[1], B.shape[1])), np.sqrt(w) * np.eye(M.shape[1])]])
            size = np.linalg.norm(A, axis=0)
            Q, T = np.linalg.qr(A / size)
            b, e = np.split(np.linalg.solve(T, Q[: len(y)].T @ y) / size, [B.shape[1]])
        du = e - self.u / w
        left, priors = r - B @ b - M @ du, self.u + du
        return b, du, self.cost - float(left @ left + priors @ priors)

    def spread(self, G: FloatArray) -> FloatArray:
        """The root of the covariance of b and u at noise 1."""
        B, count = self.rows.B, G.shape[1]
        A = np.block([[B, self.rows.J @ G], [np.zeros((count, B.shape[1])), np.eye(count)]])
        size = np.linalg.norm(A, axis=0)
        T = np.linalg.qr(A / size, mode="r")
        return np.asarray(linalg.solve_triangular(T, np.eye(len(T))) / size[:, None])


def _with_named_effects(setting: Setting, changed: list[Hypothesis]) -> Robot:
    """The arm with those of the effects it did not have that are among what has changed."""
    named = {h.label for h in changed if h.kind == "new effect"}
    there = {identity(entry) for entry in setting.arm.entries}
    effects = [
        entry
        for entry in setting.extended_arm.entries
        if identity(entry) in there or f"{entry['effect']}@{entry['owner']}" in named
    ]
    return setting.arm.with_(effects=effects)


def _places_of(larger: Robot, smaller: Robot) -> list[int]:
    """Indices of the smaller model's parameters among those of the larger."""
    own = len(larger.core.parameters)
    out, at = list(range(own)), own
    kept = {identity(entry) for entry in smaller.entries}
    for entry, effect in zip(larger.entries, larger.effects, strict=True):
        if identity(entry) in kept:
            out += range(at, at + len(effect.parameters))
        at += len(effect.parameters)
    return out


def _gradual_drift(arm: Robot, record: CalibrationRecord, names: list[str]) -> FloatArray:
    """(P, p) gradual drift of each parameter that the calibration identified, but for the base."""
    model = arm.error_model
    own = len(arm.core.parameters)
    columns = []
    for i, (p, name) in enumerate(zip(model.parameters, names, strict=True)):
        if name in record.parameters and not (i < own and p.owner == "base"):
            column = np.zeros(len(names))
            column[i] = drift_of(p, float(model.start[i]), geometry=i < own).gradual
            columns.append(column)
    return np.array(columns).reshape(-1, len(names)).T


def _held(rows: LinearRows, known: int) -> tuple[FloatArray, FloatArray]:
    """(P, s) held directions that the new rows show beside the bases, and (P, j) those that they don't."""
    H = rows.R[:, known:]
    Q = np.linalg.qr(rows.B / np.linalg.norm(rows.B, axis=0))[0]
    g = rows.J @ H
    shown = np.linalg.norm(g - Q @ (Q.T @ g), axis=0) > _UNSEEN
    return H[:, shown], H[:, ~shown].copy()
