# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The fit of an update: the model's parameters by a few new rows, with what it knew as the prior.

    r = B b + J (R z + Q d + D k + H h) + e,    z, d, h ~ N(0, 1),  k ~ N(0, (3 S)^2)

R the root of the model's covariance, Q each parameter's gradual drift, D the directions of what has changed by a check
of the same rows, its rivals among them, with typical sizes S; H what the gauge held, where the new rows show it.
Gauss-Newton iteration; the noise's variance is pooled with the calibration's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.effects.entries import full_name, identity
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.drift import drift_of
from fastcal.monitoring.hypotheses import Hypothesis
from fastcal.monitoring.linear import MOTIONS, LinearRows, as_known, linear_rows, record_of
from fastcal.monitoring.setting import Setting
from fastcal.monitoring.setups import SetUp, set_ups
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.identified_spec import Values, identified_spec
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

EVENT_SIZES = 3.0  # typical sizes: how far what has changed may be from the model
_ROUNDS = 3  # a zero off by a degree is linear to a ten-thousandth after the second
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


def refit(setting: Setting, changed: list[Hypothesis], data: Dataset, threads: int) -> Refit:
    """The arm of a check fitted to its rows; `changed` is what is free to be an event away from the model."""
    arm = _with_named_effects(setting, changed)
    record = record_of(setting.arm)
    known, _ = as_known(data, record)
    names = [full_name(p) for p in arm.error_model.parameters]
    at = _places_of(setting.extended_arm, arm)
    robot, spread, u = arm, np.zeros((0, 0)), np.zeros(0)
    for _ in range(_ROUNDS):
        places = set_ups(robot, known, threads=threads)
        rows = linear_rows(places, record, threads=threads)
        B, J = rows.B, rows.J
        F = len(record.parameters)
        seen, held = _held(rows, F)
        k = [h.directions[at] * (EVENT_SIZES * h.sizes) for h in changed if h.directions is not None]
        G = np.hstack([rows.R[:, :F], _gradual_drift(arm, record, names), *k, seen])
        u = u if len(u) == G.shape[1] else np.zeros(G.shape[1])
        A = np.block([[B, J @ G], [np.zeros((G.shape[1], B.shape[1])), np.eye(G.shape[1])]])
        y = np.concatenate([rows.r, -u])
        size = np.linalg.norm(A, axis=0)
        Q, T = np.linalg.qr(A / size)
        step = np.linalg.solve(T, Q.T @ y) / size
        spread = np.linalg.solve(T, np.eye(len(T))) / size[:, None]
        u = u + step[B.shape[1] :]
        left = y - A @ step
        theta = places[0].robot.error_model.start + G @ step[B.shape[1] :]
        base = [i for i, p in enumerate(rows.parameters[: rows.own]) if p.owner == "base"]
        theta[base] += step[:MOTIONS]
        robot = Robot(identified_spec(places[0].robot, places[0].robot.error_model, Values(theta)))
    freedom = rows.freedom + len(rows.r) - B.shape[1]
    scale = float(np.sqrt((rows.freedom + left @ left) / freedom))
    to_theta = np.zeros((len(theta), len(step)))
    to_theta[base, :MOTIONS] = np.eye(MOTIONS)
    to_theta[:, B.shape[1] :] = G
    root = scale * to_theta @ spread
    free = [i for i in range(len(theta)) if np.any(root[i] != 0)]
    covariance = root[free] @ root[free].T
    held[base] = -np.linalg.lstsq(B[:, :MOTIONS], J @ held, rcond=None)[0]
    spec = identified_spec(places[0].robot, places[0].robot.error_model, Values(theta, free, covariance))
    return Refit(spec, arm, places, rows, scale, freedom, theta, covariance, free, held)


def _with_named_effects(setting: Setting, changed: list[Hypothesis]) -> Robot:
    """The arm with those of the effects it did not have that are among what has changed."""
    named = {h.label for h in changed if h.kind == "new effect"}
    there = {identity(entry) for entry in setting.arm.spec["effects"]}
    effects = [
        entry
        for entry in setting.extended_arm.spec["effects"]
        if identity(entry) in there or f"{entry['effect']}@{entry['owner']}" in named
    ]
    return Robot(setting.arm.spec | {"effects": effects})


def _places_of(larger: Robot, smaller: Robot) -> list[int]:
    """Indices of the smaller model's parameters among those of the larger."""
    own = len(larger.core.parameters)
    out, at = list(range(own)), own
    kept = {identity(entry) for entry in smaller.spec["effects"]}
    for entry, effect in zip(larger.spec["effects"], larger.effects, strict=True):
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
