# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the joints repeat so badly that errors grow with the arm's reach? Asked beside the rich model.

There no missing effect passes for it, as far as rows show one. What rows leave has to grow with what the joints move
them by (`may_repeat_badly`), and the likelihood to prefer joints that repeat badly, anew in each row or in each stay,
clearly, and to errors that come again whenever a posture is visited (`likeliest_noise`). Fine waves of the joints, or a
column that is wrong, look like it where no posture is visited twice: unless nothing remains with it, the diagnosis
begins again and counts none of it as noise (`Problem.joints_repeat`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.joint_noise import JointNoise, likeliest_noise, may_repeat_badly
from fastcal.calibration.repeatability import pose_groups
from fastcal.calibration.tall import taken
from fastcal.diagnosis.problem import Noise
from fastcal.diagnosis.rich_model import RichModel
from fastcal.place import joint_name

# Times that k is found anew beside the fit that it is whitened with, and its change that ends that.
_ROUNDS, _SETTLED = 3, 0.1


def with_joint_noise(beside: RichModel, *, of_stays: bool = True) -> RichModel:
    """The rich model with the noise of joints that repeat badly, as it is where they need not.

    `of_stays`: may rows of one stay share it? Where they are repeats of each other, these show what noise is.
    """
    problem = beside.problem
    if problem.joints_repeat or problem.repeatability is not None or problem.start.robot.passive:
        return beside
    found, stay = beside, problem.stays[problem.rows] if of_stays else np.arange(len(problem.rows))
    has_stays = len(np.unique(stay)) < len(stay)
    near = may_repeat_badly(_lever(beside), beside.left.left, beside.left.hats, has_stays=has_stays)
    if near == 0:
        return beside
    for _ in range(_ROUNDS):
        before = found.noise.repeatability
        noise = _likeliest(found, before or near / found.noise.factor, stay)
        if noise is None:
            return beside
        settled = abs(noise.repeatability / before - 1) < _SETTLED if before else False
        if settled and noise.by_stay == found.noise.by_stay:
            break
        found = found.again(noise).by_kind
    return found


def _likeliest(beside: RichModel, near: float, stay: IndexArray) -> Noise | None:
    """The noise with which what a rich model leaves is likeliest, if that is clear; `near` to begin with.

    `stay` (N,) is of each fitted row.
    """
    problem, noise = beside.problem, beside.noise
    _A, r, row = beside.fit.whitened
    kept = np.flatnonzero((row >= 0) & ~np.isin(row, beside.left.wrong))
    row, X, r, lever = row[kept], taken(beside.columns, kept), r[kept], _lever(beside)[kept]
    begun = noise.repeatability * noise.factor
    if begun:
        raw = JointNoise.of(lever, stay[row] if noise.by_stay else row)
        X, r = raw.whitened(X, 0.0, begun), raw.whitened(r, 0.0, begun)
    found = likeliest_noise(X, r, lever, row, stay, pose_groups(problem.kept), near * noise.factor)
    return None if found is None else replace(noise, repeatability=found.k / noise.factor, by_stay=found.by_stay)


def _lever(beside: RichModel) -> FloatArray:
    """(m, n) by what each joint moves the measured numbers, as `Fit.standardized` has these."""
    frames, count = beside.offered.frames, beside.problem.start.robot.joint_count
    return np.column_stack([frames[joint_name(i)][:, 0] for i in range(count)])
