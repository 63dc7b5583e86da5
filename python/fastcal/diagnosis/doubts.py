# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reasons to reject a fit: implausible values, load laws without varying loads, another arm.

Each is a symptom of another cause, however small the residuals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.repeatability import pose_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.variants import effect_has_moment, rows_between_steps
from fastcal.place import place_of
from fastcal.robot.se3 import inverse

# Share of the moment on a joint that turns it, below which its load is made by how the axis is tilted [0.6 deg].
MIN_LOAD_SHARE = 1e-2
_OTHERWISE = 0.1  # of the moves of the nominal arm: a real one's lengths and ratios are off by a hundredth at most


def is_impossible(at: Fit, name: Hypothesis) -> bool:
    """Is an added name beyond its bounds, or does its law bend where no rows are, or follow no load?"""
    return is_beyond_bounds(at, name) or bends_unseen(at, name) or bears_little(at, name)


def step_around_few_rows(at: Fit) -> bool:
    """Does something step, and the same or something else step soon after, around fewer than MIN_ROWS_BESIDE_STEP rows?

    Where one undoes the other, as a base that turns back what joint 1's zero did, it is these rows that are wrong. What
    steps together, with no row in between, is one event.
    """
    steps = [name for name in at.added if effect_has_moment(name.effect)]
    if len(steps) < 2:
        return False
    between = rows_between_steps(steps, at.problem.kept)
    return bool(np.any((between > 0) & (between < rules.MIN_ROWS_BESIDE_STEP)))


def is_beyond_bounds(at: Fit, name: Hypothesis) -> bool:
    """Has an added effect a parameter that it cannot have, such as a negative compliance, or is it another arm?"""
    place = at.place(name)
    return is_another_arm(at) or any(
        not p.lower - 1e-9 * p.sigma <= value <= p.upper + 1e-9 * p.sigma
        for p, value in zip(at.model.parameters[place], at.theta[place], strict=True)
    )


def is_plausible(parameters: Sequence[_core.Parameter], theta: FloatArray) -> bool:
    """Are values no larger than MAX_PLAUSIBLE_SIZE times what arms have? A load at which a law bends may be any."""
    return all(
        abs(value) <= rules.MAX_PLAUSIBLE_SIZE * p.sigma or p.name.startswith("critical") or not np.isfinite(p.sigma)
        for p, value in zip(parameters, theta, strict=True)
    )


def is_another_arm(at: Fit) -> bool:
    """Does the last frame move otherwise than the nominal one's, where nothing measured shows by how much it moves?

    All that touches of unknown points leave vanishes with the size of the arm, its ratios, or where the tool stands
    still: least squares of a coarse arm ends there, however wrong that is.
    """
    if at.problem.measured.shows_scale:
        return False
    share = _moves(at, at.theta) / _moves(at, np.asarray(at.model.start))
    return not 1 - _OTHERWISE < share < 1 + _OTHERWISE


def _moves(at: Fit, theta: NDArray[np.float64]) -> float:
    """How far the last frame is from its mean place, RMS over the rows [m]."""
    theta = theta[: len(at.model.parameters)]
    tool = at.model.robot.base_and_tool(theta[: at.problem.own])[1]
    T = np.asarray(at.model.predict(at.samples, theta, at.problem.threads)) @ inverse(tool)
    places = T[:, :3, 3]
    return float(np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))))


def bends_unseen(at: Fit, name: Hypothesis) -> bool:
    """Do fewer than MIN_ROWS_BESIDE_STEP poses load the joint less, or more, than where an added law bends?

    Its slope on that side is then that of a few poses: a step at no load, or a line that other loads do not follow.
    """
    if name.traits.searched != "critical" or "torque" in name.entry:  # of a part of the load
        return False
    place = at.place(name)
    corners = [
        value
        for p, value in zip(at.model.parameters[place], at.theta[place], strict=True)
        if p.name.startswith("critical")
    ]
    first = np.unique(pose_groups(at.problem.kept), return_index=True)[1]  # a pose that is repeated shows one load
    load = np.abs(at.loads[first, place_of(name.owner).index])
    below = [int(np.sum(load < corner)) for corner in corners]
    return any(min(count, len(load) - count) < rules.MIN_ROWS_BESIDE_STEP for count in below)


def bears_little(at: Fit, name: Hypothesis) -> bool:
    """Does an added law of a joint's load follow less than MIN_LOAD_SHARE of the moment, or of a slide's force, on it?

    An upright axis bears what its tilt and the middle of the weights make: what is missing elsewhere can turn it by any
    angle, in other postures by another one. Of the arm as it starts: where a fit has taken the weight from a joint, it
    is the weight that is wrong. Of a sag without masses it is the share of the stretched and level arm's moment.
    """
    if name.traits.without_masses and name.traits.place == "joint":
        return _share_of_stretched(at, name) < MIN_LOAD_SHARE
    if name.traits.depends_on != ("torque",):
        return False
    joint = place_of(name.owner).index
    load = np.asarray(at.model.loads(at.samples, at.model.start, False, at.problem.threads))[:, 2 * joint + 1]
    part = load[:, 3:] if at.problem.start.robot.joint_types[joint] == "revolute" else load[:, :3]
    return bool(np.linalg.norm(part[:, 2]) < MIN_LOAD_SHARE * np.linalg.norm(part))


def _share_of_stretched(at: Fit, name: Hypothesis) -> float:
    """How far a joint turns, or slides, by its sag, over the sag of the stretched and level arm, RMS over the rows."""
    place = at.place(name)
    size = at.model.parameters[place][0].sigma
    ends = []
    for value in (0.0, size):
        theta = at.theta[: len(at.model.parameters)].copy()
        theta[place] = 0.0
        theta[place.start] = value
        ends.append(np.asarray(at.model.predict(at.samples, theta, at.problem.threads)))
    if at.problem.start.robot.joint_types[place_of(name.owner).index] == "revolute":
        moved = np.linalg.norm(ends[1][:, :3, :3] - ends[0][:, :3, :3], axis=(1, 2)) / np.sqrt(2)  # 2 sin(turn / 2)
    else:
        moved = np.linalg.norm(ends[1][:, :3, 3] - ends[0][:, :3, 3], axis=1)
    return float(np.sqrt(np.mean(moved**2)) / size)
