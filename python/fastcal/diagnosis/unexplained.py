# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Unexplained error: curves of joints whose error depends on their own position, else the likeliest place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.evaluation import Evaluation
from fastcal.diagnosis import rules
from fastcal.diagnosis.held_out import HeldOut, gain, is_better
from fastcal.diagnosis.noise import shared_posture
from fastcal.diagnosis.result import Unexplained
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.slow_motion import SlowMotions
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.effects.entries import curve_of
from fastcal.place import joint_name, joint_position, place_of
from fastcal.robot.robot import Robot, Spec
from fastcal.robot.robot_spec import Joint, RobotSpec, content

FloatArray = NDArray[np.float64]

# Names that may come first in a part of the data: those of the largest statistics in all of them.
MAX_CONTENDERS = 12
# Orders that are looked for in a joint's curve, and the share of its square from which on one is stated.
PROFILE_ORDERS = 6
MAIN_ORDER_SHARE = 0.25


def curved_joints(best: SearchNode) -> list[Spec]:
    """A profile for each joint whose error significantly follows its own position, beside those of the joints before.

    The joint first whose curve explains most: a curve casts shadows on the other joints.
    """
    found = best.blocks
    own = [
        i
        for i, block in enumerate(found.generics, found.count)
        if block.curves.depends_on == (place_of(block.owner).position,)
    ]
    chosen: list[int] = []
    while len(chosen) < len(own):
        left = found.tests.given(chosen)
        statistic, rank = np.asarray(left.statistic), np.asarray(left.rank)
        p = p_values(statistic, rank, best.fit.problem.noise.freedom) * best.family.generic
        curved = [i for i in own if i not in chosen and p[i] < rules.ALPHA_GENERIC]
        if not curved:
            break
        worth = found.worth(statistic[curved], rank[curved], np.array(curved))
        chosen.append(curved[int(np.argmax(worth))])
    owners = sorted((found.generics[i - found.count].owner for i in chosen), key=lambda owner: place_of(owner).number)
    return [{"effect": curve_of("joint"), "owner": owner} for owner in owners]


def remains(state: SearchNode) -> bool:
    """Is a set impossible, or does something significant beyond it predict rows held out of it?

    The strongest of many blocks is significant by chance, or by noise that is not white, more often than it predicts.
    What is certain need predict them by MIN_RIVAL_GAIN only, as a name.
    """
    if state.impossible or state.suffices:
        return state.impossible
    level = rules.ALPHA_FURTHER if state.names else rules.ALPHA_DETECT
    own = len(state.fit.free)
    certain = set(state.significant(rules.ALPHA_CERTAIN, rules.ALPHA_CERTAIN))
    for index in state.significant(level / 2, level / 2)[:MAX_CONTENDERS]:
        held = HeldOut(state.fit, more=state.blocks.of(index))
        less, error = gain(held.squares(), held.squares(range(own, own + state.blocks.sizes[index])))
        if less >= (rules.MIN_RIVAL_GAIN if index in certain else rules.MIN_GAIN) * error:
            return True
    return False


def main_orders(model: Robot, entry: Spec) -> list[tuple[int, float]]:
    """(cycles a turn, amplitude [rad]) of the largest waves in an identified profile of a revolute joint.

    By least squares of sines and cosines of orders 1 ... PROFILE_ORDERS over the range that the profile was fitted on.
    """
    at = [(e["effect"], e["owner"]) for e in model.entries].index((entry["effect"], entry["owner"]))
    found = model.entries[at]
    if "low_rad" not in found:
        return []
    joint = place_of(entry["owner"]).index
    q = np.zeros((200, model.joint_count))
    q[:, joint] = np.linspace(found["low_rad"], found["high_rad"], len(q))
    curve = profile_curve(model, entry["owner"], q[:, joint])
    orders = [n for n in range(1, PROFILE_ORDERS + 1) if n * (found["high_rad"] - found["low_rad"]) > np.pi]
    if not orders:
        return []
    # One order at a time beside a straight line: together they would be ill-conditioned over less than a turn.
    each = []
    for n in orders:
        X = np.column_stack([np.ones(len(q)), q[:, joint], np.sin(n * q[:, joint]), np.cos(n * q[:, joint])])
        each.append(float(np.hypot(*np.linalg.lstsq(X, curve, rcond=1e-3)[0][2:])))
    size = np.minimum(each, float(np.ptp(curve)))
    total = float(np.sum(size**2))
    return [(n, float(a)) for n, a in zip(orders, size, strict=True) if a**2 >= MAIN_ORDER_SHARE * total > 0]


def profile_curve(model: Robot, owner: str, q: FloatArray) -> FloatArray:
    """Joint error [rad or m] of a model's profile at positions q (k,): of a robot that has this one joint alone."""
    joint = place_of(owner).index
    kind = model.joints[joint].type
    (entry,) = (e for e in model.entries if (e["effect"], e["owner"]) == (curve_of("joint"), owner))
    alone = RobotSpec(model.name, "dh", (Joint(kind),), effects=[entry | {"owner": joint_name(0)}])
    T = Robot(content(alone)).forward(q[:, np.newaxis])
    if kind == "prismatic":
        return np.asarray(T[:, 2, 3] - q)
    turn = np.arctan2(T[:, 1, 0], T[:, 0, 0]) - q
    return np.asarray((turn + np.pi) % (2 * np.pi) - np.pi)


def located(search: Search, state: SearchNode) -> Unexplained:
    """Where what remains is best placed: the block without a name that explains most for the functions it takes."""
    found = state.blocks
    statistic, rank = np.asarray(found.tests.scores.statistic), np.asarray(found.tests.scores.rank)
    generic = np.arange(found.count, len(rank))
    worth = found.worth(statistic[generic], rank[generic], generic)
    index = int(np.argmax(worth))
    block = found.generics[index]
    share = (statistic[generic][index] - rank[generic][index]) / misfit(search)
    share *= (state.fit.problem.noise.factor / search.problem.noise.factor) ** 2  # in one unit
    return Unexplained(block.owner, float(np.clip(share, 0.0, 1.0)), block.curves.depends_on)


def misfit(search: Search) -> float:
    """What the geometry alone leaves above the noise, as chi square."""
    return max(search.start.fit.remaining - search.start.fit.freedom, 1.0)


def in_order(slow: SlowMotions) -> Unexplained | None:
    """A base or a tool that drifts, or was knocked, where no row has a time; None: there is none."""
    return None if slow.untimed is None else Unexplained(slow.untimed, slow.share, ("order",))


def at_a_posture(geometry: Evaluation, outliers: Sequence[int], sigma: float) -> Unexplained | None:
    """What is wrong over a part of a joint's way that holds too few rows to show more; None: outliers share none.

    Its share is theirs of the squared distances that the geometry leaves beyond noise of `sigma` a coordinate [m].
    """
    shared = shared_posture(np.array(outliers, dtype=np.intp), geometry.data)
    if shared is None:
        return None
    joint, rows = shared
    beyond = np.nan_to_num(np.sum(geometry.error_after**2, axis=1) - 3 * sigma**2)
    if geometry.length_after is not None:
        beyond += np.nan_to_num(geometry.length_after**2 - sigma**2)
    share = float(beyond[rows].sum()) / max(float(beyond.sum()), float(beyond[rows].sum()), 1e-300)
    return Unexplained(joint_name(joint), float(np.clip(share, 0.0, 1.0)), (joint_position(joint),))


def one_block_does_better(search: Search, best: SearchNode) -> bool:
    """Does one block without a name explain more, by BIC, than the names of a set that leaves something?

    And predict rows held out as well as they do: of few rows a block of many functions explains whatever there is.
    """
    found = search.start.blocks
    scores = found.tests.scores
    generic = np.arange(found.count, len(found.sizes))
    worth = found.worth(np.asarray(scores.statistic)[generic], np.asarray(scores.rank)[generic], generic)
    if worth.max() <= search.start.bic - best.bic:
        return False
    block = found.of(int(generic[np.argmax(worth)]))
    return not is_better(best.predicted, HeldOut(search.start.fit, more=block).squares())
