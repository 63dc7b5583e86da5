# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Did the base move, or a joint's zero? A base that turned about joint 1's axis looks like a jump of its zero.

A crash, or a mastering that slipped, moves the zero of a joint for all rows from then on. That is no effect of the
library; of joint 1 it moves the tool exactly as a base that turned about joint 1's axis (slid along it, where the joint
slides), and of the last joint as a target that was mounted elsewhere on its circle. A motion of base, instrument or
target is sure only where the rest of it is seen as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.diagnosis import rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.projection import basis, score_tests
from fastcal.diagnosis.reasons import Because, BlockLabel, Reason
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import effect_has_moment, jumps_itself, jumps_with_posture, order_of_rows
from fastcal.effects.entries import position_option
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_name, source_of
from fastcal.units import to_si

if TYPE_CHECKING:
    from fastcal.diagnosis.search import SearchNode

OTHER_JUMP_LOSS = 25.0  # chi square: five standard deviations


def moved_zeros(state: SearchNode, name: Hypothesis) -> tuple[Because, ...]:
    """The joints of which a moved zero would do in place of a name of a set; none where it is no motion of a frame.

    By score tests at the fit, with the columns of the name put back: what the name explains beyond the moved zero is
    chi square (F) of as many degrees of freedom as it has parameters more.
    """
    if not name.traits.of_the_measurement or name.owner not in ("base", "tool"):
        return ()
    over = _courses(name, state.fit.problem.kept)
    if over is None:
        return ()
    problem = state.fit.problem
    A, r, row = state.fit.whitened
    own = state.fit.columns(name)
    row = row[row >= 0]  # numbers that were measured come before priors
    zeros = []
    for joint in range(problem.start.robot.joint_count):
        columns = np.zeros((len(A), over.shape[1]))
        columns[: len(row)] = decorrelated(problem, over[row] * state.blocks.frames[joint_name(joint)], row)
        zeros.append(columns)
    Q = basis(np.delete(A, own, axis=1))
    sizes = [len(own), *(len(over.T) for _ in zeros)]
    scores = score_tests(Q, np.hstack([A[:, own], *zeros]), r + A[:, own] @ state.fit.value(name), sizes).scores
    statistic, rank = np.asarray(scores.statistic), np.asarray(scores.rank)
    more = np.maximum(rank[0] - rank[1:], 0).astype(np.int32)
    p = p_values(np.maximum(statistic[0] - statistic[1:], 0.0), more, problem.noise.freedom)
    moved = np.flatnonzero((rank[1:] > 0) & (p > rules.ALPHA_MOVED_ZERO))
    reason = Reason.ZERO_CREEPS if _creeps(name) else Reason.ZERO_JUMPED
    joints = tuple(BlockLabel(joint_name(int(joint)), name.traits.depends_on) for joint in moved)
    return (Because(reason, subjects=joints),) if joints else ()


def own_jump(state: SearchNode, name: Hypothesis) -> tuple[Because, ...]:
    """The joint that decides, where it jumps itself: its encoder counts wrongly from that position on, and none beside.

    By score tests at the fit, with the jump of the name put back: of one parameter each, the likelier is the cause, and
    what is within OTHER_JUMP_LOSS of chi square may be.
    """
    if not jumps_with_posture(name.effect) or jumps_itself(name):
        return ()
    problem, decides = state.fit.problem, source_of(name.owner)
    option, unit = position_option(problem.start.robot.joint_types[decides.index])
    side = np.where(problem.kept.q[:, decides.index] > to_si(float(name.entry[option]), unit), 0.5, -0.5)
    A, r, row = state.fit.whitened
    own = state.fit.columns(name)
    row = row[row >= 0]  # numbers that were measured come before priors
    jump = np.zeros((len(A), 1))
    turn = state.blocks.frames[joint_name(decides.index)]
    jump[: len(row)] = decorrelated(problem, side[row, np.newaxis] * turn, row)
    Q = basis(np.delete(A, own, axis=1))
    scores = score_tests(Q, np.hstack([A[:, own], jump]), r + A[:, own] @ state.fit.value(name), [len(own), 1]).scores
    of_name, of_jump = np.asarray(scores.statistic)
    if of_jump < of_name - OTHER_JUMP_LOSS:
        return ()
    return (Because(Reason.OWN_JUMP, subjects=(BlockLabel(joint_name(decides.index), (decides.position,)),)),)


def _creeps(name: Hypothesis) -> bool:
    """Does it move all the time, rather than from a moment, a station or a mount on?"""
    return name.traits.depends_on == ("time_s",) and not effect_has_moment(name.effect)


def _courses(name: Hypothesis, data: Dataset) -> FloatArray | None:
    """(N, k) how much of the motion each row has: from a moment on, by time, or one a station or mount."""
    depends_on = name.traits.depends_on
    if depends_on == ("time_s",):
        over = order_of_rows(data)
        at = name.entry.get("at_s", name.entry.get("at_row"))
        return np.asarray(over - over.mean() if at is None else over >= at, dtype=float)[:, np.newaxis]
    label = data.station if depends_on == ("station",) else data.mount if depends_on == ("mount",) else None
    return None if label is None else np.asarray(label[:, np.newaxis] == np.unique(label)[1:], dtype=float)
