# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the joints repeat so badly that errors grow with the arm's reach? Asked beside the rich model.

There no missing effect passes for it, as far as rows show one. Three witnesses have to agree: what rows leave grows
with what the joints move them by (`grows_with_reach`), the likelihood prefers joints that repeat badly by GAIN, and
postures that were visited again scatter as that says. Where rows of one stay in a posture could share the errors of
its joints, the likelier of the two is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.joint_noise import DEVIATIONS, GAIN, JointNoise, grows_with_reach, likeliest
from fastcal.calibration.tall import taken
from fastcal.diagnosis.problem import Noise
from fastcal.diagnosis.rich_model import RichModel
from fastcal.place import joint_name

# Times that k is found anew beside the fit that it is whitened with, and its change that ends that.
_ROUNDS, _SETTLED = 3, 0.1


def with_joint_noise(beside: RichModel) -> RichModel:
    """The rich model with the noise of joints that repeat badly, as it is where they need not."""
    problem = beside.problem
    if problem.repeatability is not None or problem.start.robot.passive:
        return beside
    found, lever = beside, _lever(beside)
    far, near = grows_with_reach(lever, beside.left.left, beside.left.hats)
    if far < DEVIATIONS:
        return beside
    for _ in range(_ROUNDS):
        before = found.noise.repeatability
        noise = _likeliest(found, before or near / found.noise.factor)
        if noise is None:
            return beside
        settled = abs(noise.repeatability / before - 1) < _SETTLED if before else False
        if settled and noise.by_stay == found.noise.by_stay:
            break
        found = found.again(noise).by_kind
    return found


def _likeliest(beside: RichModel, near: float) -> Noise | None:
    """The noise with which what a rich model leaves is likeliest, if that is clear; `near` to begin with."""
    problem, noise = beside.problem, beside.noise
    _A, r, row = beside.fit.whitened
    kept = np.flatnonzero((row >= 0) & ~np.isin(row, beside.left.wrong))
    row, X, r, lever = row[kept], taken(beside.columns, kept), r[kept], _lever(beside)[kept]
    stay, begun = problem.stays[problem.rows], noise.repeatability * noise.factor
    blocks = {False: JointNoise.of(lever, row), True: JointNoise.of(lever, stay[row])}
    if begun:
        raw = blocks[noise.by_stay]
        X, r = raw.whitened(X, 0.0, begun), raw.whitened(r, 0.0, begun)
    best: tuple[float, Noise] | None = None
    for by_stay in [False, True][: 1 + (len(np.unique(stay)) < len(stay))]:
        k, gain = likeliest(X, r, blocks[by_stay], near * noise.factor)
        if gain > GAIN and (best is None or gain > best[0]):
            best = gain, replace(noise, repeatability=k / noise.factor, by_stay=by_stay)
    return None if best is None else best[1]


def _lever(beside: RichModel) -> FloatArray:
    """(m, n) by what each joint moves the measured numbers, as `Fit.standardized` has these."""
    frames, count = beside.offered.frames, beside.problem.start.robot.joint_count
    return np.column_stack([frames[joint_name(i)][:, 0] for i in range(count)])

