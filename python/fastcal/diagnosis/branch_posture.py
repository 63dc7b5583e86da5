# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Did another arm, whose posture is not in the data, load the joints that carry both?

Joints that do not move the tool load those that carry them: a compliant torso deflects differently in each
posture of the other arm. Where their columns are missing (or hold one value), this angle is one more random number a
row. With whitened residuals r_i (k,) of row i and the levers g_i = dr_i/dq_j of a joint j that carries them

    r_i ~ N(0, phi (1 + t^2 g_i g_i^T)),   gain_j = 2 (max l(phi, t) - max l(phi, 0)).

Other joints of the chain are tested in the same way: poor repeatability of a joint has the same signature. If a joint
that carries no other branch fits equally well, nothing is reported; the carrying joint itself may have poor
repeatability, so the grade is never better than B.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import noise_by_observation
from fastcal.calibration.levers import levers, number_sigma
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Finding, NamedValue
from fastcal.effects.rig_traits import BRANCH_POSTURE
from fastcal.measurements.dataset import Dataset
from fastcal.robot.loops import parents
from fastcal.robot.robot import Robot

_TURNS = np.geomspace(1e-7, 1e-1, 121)  # t times sigma over which the likelihood is looked at [rad, m]


def unrecorded_branch(robot: Robot, data: Dataset, at: Fit, excluded: Collection[str]) -> Finding | None:
    """The link on which something moved that the data do not tell; None where nothing shows it.

    Args:
        robot: As its file has it.
        data: What was measured.
        at: The fit of all that was found.
        excluded: Names that are not to be given, EFFECT or EFFECT@OWNER.
    """
    still = [i for i in robot.beside if np.ptp(data.q[:, i]) == 0]
    on = parents(robot.description)
    heavy = [i for i in still if robot.joints[i].mass_kg > 0]
    links = sorted({on[i] for i in still if on[i] not in robot.beside and _carries(on, heavy, on[i])})
    if not links or links[-1] < 0 or at.problem.pictures is not None:
        return None
    way = [i for i in range(robot.joint_count) if i not in robot.beside]
    _, r, row = at.standardized
    r, number, G = r[row >= 0], at.near.number, _levers(at)
    row = row[row >= 0]
    gains, turns = np.array([_gain(r, G[:, joint], row) for joint in way]).T
    carrying = np.array([any(_is_on(on, link, joint) for link in links) for joint in way])
    first = int(np.argmax(np.where(carrying, gains, -np.inf)))
    p = min(1.0, float(stats.chi2.sf(max(gains[first], 0.0), 1)) * len(way))
    link = next(link for link in links if _is_on(on, link, way[first]))
    owner = f"link{link + 1}"
    if p > rules.ALPHA_RIG or {BRANCH_POSTURE, f"{BRANCH_POSTURE}@{owner}"} & set(excluded) or len(number) == 0:
        return None
    if (gains[~carrying] > gains[first] - rules.RIG_LEAD).any():
        return None
    unit = "rad" if robot.joint_types[way[first]] == "revolute" else "m"
    return Finding(
        BRANCH_POSTURE,
        owner,
        "B",
        {f"turn_{unit}": NamedValue(float(turns[first]), None)},
        float(np.sqrt(gains[first])),
        p,
        limits=(Because(Reason.ZERO_CREEPS),),
        in_model=False,
    )


def _carries(on: list[int], joints: list[int], link: int) -> bool:
    return any(_is_on(on, joint, link) for joint in joints)


def _is_on(on: list[int], joint: int, link: int) -> bool:
    """Does a joint stand on a link, by way of others or not? A link is its joint's; it stands on itself."""
    while joint > link:
        joint = on[joint]
    return joint == link


def _levers(at: Fit) -> FloatArray:
    """(m, n) of the measured numbers, each over its standard deviation."""
    problem = at.problem
    row, number = at.near.row, at.near.number
    moved = levers(problem.start.robot.core, problem.kept, problem.measured, problem.unknowns, problem.threads)
    common = noise_by_observation(problem.measured, problem.noise.common)
    sigma = number_sigma(problem.measured, list(common), row, number) * problem.noise.factor
    return np.asarray(moved[row, number] / sigma[:, np.newaxis])


def _gain(r: FloatArray, g: FloatArray, row: NDArray[np.intp]) -> tuple[float, float]:
    """(gain, t) of one joint, r and its levers g (m,) in rows."""
    groups = np.unique(row, return_inverse=True)[1]
    square, along, lever = (np.bincount(groups, weights=w) for w in (r * r, r * g, g * g))
    t2 = _TURNS[:, np.newaxis] ** 2
    left = (square - t2 * along**2 / (1 + t2 * lever)).sum(axis=1)
    cost = len(r) * np.log(left / square.sum()) + np.log1p(t2 * lever).sum(axis=1)
    best = int(np.argmin(cost))
    return float(max(-cost[best], 0.0)), float(_TURNS[best] * np.sqrt(left[best] / len(r)))
