# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses for a check, before anything is measured: those that show most of what may change in service."""

from __future__ import annotations

import numpy as np

from fastcal.design.candidates import Candidates
from fastcal.design.poses import SIGMA
from fastcal.design.surroundings import Surroundings
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.hypotheses import extended, hypotheses
from fastcal.monitoring.linear import covariance_root, record_of
from fastcal.monitoring.next_poses import informative
from fastcal.monitoring.setups import bare_arm
from fastcal.robot.given import RobotLike, as_robot
from fastcal.robot.steady import assumed_temperature, warmed

FEWEST = 4


def check_poses(model: RobotLike, count: int = 8, *, surroundings: Surroundings | None = None) -> Candidates:
    """Poses within the joint ranges that the model was fitted on, with the least and the greatest payload of these.

    A joint whose side matters, as of play, comes from either. All are at one temperature (`assumed`).

    Args:
        model: A calibrated robot.
        count: How many.
        surroundings: What the arm must keep clear of; None: its own mounting face and column.

    Raises:
        InvalidInput: The model keeps no covariance, fewer than four poses are asked for, or nothing is left of them.
    """
    robot = as_robot(model)
    if count < FEWEST:
        raise InvalidInput(f"expected at least {FEWEST} poses for a check, got {count}")
    record = record_of(robot)
    nothing = Dataset.from_arrays(np.zeros((1, robot.joint_count)))
    arm, _ = bare_arm(robot, nothing)
    more, added = extended(arm, set())
    watched = [h for h in hypotheses(arm, more, added, False) if h.kind in ("zero", "tool", "effect")]
    parameters = more.error_model.parameters
    own = len(more.core.parameters)
    base = np.array([i < own and p.owner == "base" for i, p in enumerate(parameters)])
    R = covariance_root(record, [full_name(p) for p in parameters], base)
    return informative(more, record, None, watched, R, record.length_sigma or SIGMA, count, surroundings)


def assumed(model: RobotLike) -> list[str]:
    """What `check_poses` takes the conditions to be that nobody has measured yet, a sentence each."""
    robot = as_robot(model)
    asking = warmed(robot)
    if not asking:
        return []
    words = assumed_temperature(record_of(robot))
    return [f"{', '.join(asking)}: the poses are chosen for one temperature, {words}; measure temperature_c with them"]
