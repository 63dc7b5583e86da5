# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which postures of a cell to measure next, where those that were measured do not show what may have moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.greedy_gain import most_telling
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.design import joint_limits
from fastcal.cells.known_fit import KnownFit
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.units import from_si

_MOST = 6
_CANDIDATES = 200
_SEED = 0
_SHOWN = 1.0  # standard deviations of a reading by as far as a member may have moved


def next_postures(fit: KnownFit, watched: Mapping[str, FloatArray]) -> FloatArray:
    """(M, n) postures of the tree; none where nothing is watched, or pictures, touches and lengths are what was read.

    Greedily, the greatest gain log det(1 + J C J^T) each, C the covariance of what is known and of what is watched,
    after what was measured already.

    Args:
        fit: Of the readings that there are.
        watched: Columns (T, k) of what may have moved, by its name.
    """
    none = np.zeros((0, fit.readings.q.shape[1]))
    kinds = {name.partition("@")[0] for name in fit.readings.tables if not name.startswith("sigma")}
    seen = fit.readings.tables.get(CORNERS)
    if not watched or fit.readings.labels or (seen is not None and np.isfinite(seen).any()):
        return none
    if not kinds - {CORNERS} or not kinds <= {"position", "rotation", CORNERS}:
        return none
    pool = _pool(fit)
    measured = pool.measured(fit.cell)
    theta = fit.start[: len(fit.cell.model.start)]
    rows = _core.linearize(fit.cell.model, pool.samples(fit.cell), measured, theta, fit.noise(measured), fit.threads)
    J = np.asarray(rows.J)[np.argsort(np.asarray(rows.row), kind="stable")]
    shown = [own for own in watched.values() if np.abs(J @ own[: len(theta)]).max() > _SHOWN]
    if not shown:  # by none of what is read
        return none
    wider = replace(fit, G=np.hstack([fit.G, *shown]))
    near, count = wider.near(fit.start), wider.G.shape[1]
    C = near.posterior(1.0, fit.repeats, np.zeros(count), np.ones(count)).covariance
    A = (J @ wider.G[: len(theta)]).reshape(len(pool), -1, count)
    return np.asarray(pool.q[most_telling(A, C, _MOST)])


def posture_json(cell: Cell, q: FloatArray) -> dict[str, float]:
    """A posture (n,) as `next_poses` has it: `left.q1_deg`."""
    units = ["deg" if kind == "revolute" else "mm" for kind in cell.joint_types]
    names = [f"{titles[0]}_{unit}" for titles, unit in zip(cell.joint_columns, units, strict=True)]
    return {name: round(from_si(float(value), unit), 3) for name, value, unit in zip(names, q, units, strict=True)}


def _pool(fit: KnownFit) -> Readings:
    """Postures within the joints' limits, in the conditions of the first row, in which the same views are read."""
    limits = joint_limits(fit.cell)
    q = np.random.default_rng(_SEED).uniform(limits[:, 0], limits[:, 1], (_CANDIDATES, len(limits)))
    first = fit.readings.pick(np.zeros(_CANDIDATES, dtype=np.intp))
    own = {name: np.ascontiguousarray(q[:, _columns(fit.cell, name)]) for name in first.arms}
    arms = {name: replace(data, q=own[name]) for name, data in first.arms.items()}
    turned = any(name.startswith("rotation@") for name in fit.readings.tables)
    postures = replace(first, q=q, tables={}, arms=arms, speed=None, row=None)
    return simulate_cell(fit.cell, postures, fit.readings.views, noise_rotation=0.0 if turned else None)


def _columns(cell: Cell, arm: str) -> list[int]:
    """Of an arm's joints, among all."""
    branch = next(of for of in cell.core.branches if of.name == arm)
    return list(range(branch.first_joint, branch.first_joint + branch.joint_count))
