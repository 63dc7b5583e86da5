# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From target poses to the joint positions that bring the calibrated robot's tool there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.prediction import correction_notes
from fastcal.compensation import motion
from fastcal.compensation.following import follow
from fastcal.compensation.one_step import one_step, pose_errors
from fastcal.display.shown import Shown
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import InverseKinematics, inverse_kinematics
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.targets import Targets, targets_of
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.units import from_si

METHODS = ("full", "one-step")
_MOST_LISTED = 5  # rows of a kind that get a sentence of their own
_STANDS = 1e-6  # m: a command that its own moves take further from its target does not agree with itself


@dataclass(frozen=True, eq=False, repr=False)
class Compensation(Shown):
    """Commands for N targets.

    Attributes:
        q: (N, n) joint positions to command [rad or m]; of the nearest pose where the target is not reached, NaN for a
            bad target.
        status: (N,) reached, limit, unreachable, singular or bad_target, as `inverse_kinematics` gives them.
        position_error: (N,) remaining distance [m] by the model, NaN for a bad target.
        rotation_error: (N,) angle [rad] that is left.
        sigma: (N,) standard deviation [m] of a coordinate of the predicted point, the root mean square of the three
            that `predict` gives; NaN for a robot that was not calibrated.
        correction_weight: (N,) share of a trained correction that its guard lets pass at the command, NaN for a bad
            target; None for a model without one.
        nominal_q: (N, n) what the nominal robot would be sent to, NaN where it reaches nothing.
        jumps: Rows that no smooth path joins to the previous row.
        notes: What a reader should know, a sentence each.
        joint_types: `revolute` or `prismatic`, one a joint.
        conditions: Under which the commands hold: those of the targets and, where these do not say how the joints come,
            the approach and the move (N, n) of a path through q, each row from the one before; 0 of single points.
    """

    q: FloatArray
    status: NDArray[np.str_]
    position_error: FloatArray
    rotation_error: FloatArray
    sigma: FloatArray
    nominal_q: FloatArray
    correction_weight: FloatArray | None = None
    jumps: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()
    joint_types: tuple[str, ...] = ()
    conditions: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.q)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(N,) is the tool at its target, in a singular posture or not?"""
        return np.asarray((self.status == "reached") | (self.status == "singular"))


def compensate(
    model: Robot,
    targets: ArrayLike | Targets,
    seed: ArrayLike | None = None,
    *,
    nominal: Robot | None = None,
    method: str = "full",
    along_path: bool = True,
    hold: Sequence[int] = (),
    threads: int = 1,
    **conditions: Any,
) -> Compensation:
    """Joint positions that bring the model's tool, all effects included, to target poses.

    The nominal robot goes through the targets first; from its joints the model is brought to each target, so that the
    command keeps the nominal configuration and, on a redundant arm, its redundant joint.

    Args:
        model: A calibrated robot.
        targets: (N, 4, 4) poses of the tool in the measuring frame, or `Targets`.
        seed: (n,) for the first row or (N, n), NaN where there is none.
        nominal: What the controller believes; None: what the model keeps of it.
        method: `full`: iterated until the model's tool is at the target; `one-step`: the SR210D paper's.
        along_path: The rows are a path: each keeps the configuration of the one before. False: single points, each by
            itself.
        hold: Joints, counted from 1, that stay where the first row's are (without a path: where each seed has them): a
            redundant arm moves the others.
        threads: Cores; the result does not depend on it.
        **conditions: payload [kg], approach ... as `Robot.forward` takes them. Approach and move that are not given are
            those of the path through the commands, as `predict` reads a table; single points have none, and a note
            says which effects would look at them.

    Raises:
        InvalidInput: A shape does not fit, a number is invalid, or a condition that an effect needs is missing.
    """
    if method not in METHODS:
        raise InvalidInput(f"method must be {' or '.join(METHODS)}, got '{method}'")
    if not isinstance(targets, Targets):
        targets = targets_of(targets, seed, model.joint_count, conditions)
    elif seed is not None or conditions:
        raise InvalidInput("seed and conditions must be among the Targets where those are given")
    before = nominal_robot(model, nominal)
    q_nominal, reached, jumps = _nominal(before, targets, along_path, hold, threads)
    start = np.where(np.isfinite(q_nominal), q_nominal, 0.0)
    solve = partial(_solve, model, start=start, along_path=along_path, hold=hold, threads=threads)
    aimed = motion.moved_along(targets, None, model.joint_count)
    found, changed = solve(aimed)
    readers = motion.readers(model, targets)
    if readers and along_path:
        aimed = motion.settled(lambda moving: _sent(solve(moving)[0]), targets, _sent(found))
        found, changed = solve(aimed)
    if method == "one-step":
        found = _stepped(model, before, aimed, q_nominal, reached, found, hold)
    told = list(targets.notes)
    if along_path:
        targets, found, more = _as_driven(model, targets, found, readers)
        told += more
    else:
        targets = aimed
        told += [_no_order(readers)] if readers else []
    bad = found.status == "bad_target"
    sigma = np.full(len(targets), np.nan)
    if (good := np.flatnonzero(~bad)).size:
        sigma[good] = deviation(model, found.q[good], targets.conditions_of(good))
    notes = [*told, *_sentences(found), *notes_on_ranges(model, found.q[good], targets.conditions_of(good))]
    weight = None
    if model.correction is not None:
        weight = np.full(len(targets), np.nan)
        weight[good] = model.correct(found.q[good], targets.conditions_of(good).get("payload")).weight
    jumps = sorted({*jumps, *changed}) if along_path else []
    if jumps:
        notes.append(f"no smooth path leads from the previous row to {_listed(jumps)}: the joints jump there")
    return Compensation(
        np.where(bad[:, np.newaxis], np.nan, found.q),
        found.status,
        found.position_error,
        found.rotation_error,
        sigma,
        q_nominal,
        weight,
        tuple(jumps),
        tuple(notes),
        tuple(model.joint_types),
        dict(targets.conditions),
    )


def shifts(
    model: Robot, found: Compensation, targets: Targets, rows: NDArray[np.int64], nominal: Robot | None = None
) -> tuple[FloatArray, FloatArray]:
    """By how much the controller's robot is sent away from the targets, and by how much the tool would miss without.

    Args:
        model: The calibrated robot.
        found: What `compensate` gave for it.
        targets: Those that it was given.
        rows: The ones that are asked about, all reached.
        nominal: What the controller believes; None: what the model keeps of it.

    Returns:
        (R, 6) shift [m] and turn (rotation vector) [rad] along the axes of the measuring frame, and (R,) the miss [m].
    """
    before = nominal_robot(model, nominal)
    wanted, sent = targets.poses[rows], before.forward(found.q[rows])
    known = replace(targets, conditions=found.conditions).conditions_of(rows)
    missed = model.forward(found.nominal_q[rows], **known) - wanted
    turns = np.array([_core.log_so3(b[:3, :3] @ a[:3, :3].T) for a, b in zip(wanted, sent, strict=True)])
    shift = np.column_stack([sent[:, :3, 3] - wanted[:, :3, 3], turns.reshape(-1, 3)])
    return shift, np.asarray(np.linalg.norm(missed[:, :3, 3], axis=1))


def _solve(
    model: Robot, targets: Targets, start: FloatArray, along_path: bool, hold: Sequence[int], threads: int
) -> tuple[InverseKinematics, list[int]]:
    """The model's joints near `start` (N, n); and the rows that are reached only in another configuration.

    Rows of a path that are not reached at all stay near `start` too; others take the nearest pose anywhere.
    """
    every = targets.conditions_of(slice(None))
    near = inverse_kinematics(model, targets.poses, seed=start, hold=hold, restarts=0, threads=threads, **every)
    again = np.flatnonzero(~near.reached & (near.status != "bad_target"))
    if not again.size:
        return near, []
    retried = inverse_kinematics(
        model, targets.poses[again], seed=start[again], hold=hold, threads=threads, **targets.conditions_of(again)
    )
    better = retried.reached if along_path else retried.reached | (retried.position_error < near.position_error[again])
    names = [field.name for field in fields(InverseKinematics) if field.name != "robot"]
    merged: dict[str, Any] = {name: np.array(getattr(near, name)) for name in names}
    merged["status"][again] = retried.status  # a search that begins anywhere knows best why a target is not reached
    for name, values in merged.items():
        values[again[better]] = getattr(retried, name)[better]
    return replace(near, **merged), again[retried.reached].tolist()


def _sent(found: InverseKinematics) -> FloatArray:
    """(N, n) the commands, NaN where none is sent."""
    return np.where((found.status == "bad_target")[:, np.newaxis], np.nan, found.q)


def _as_driven(
    model: Robot, targets: Targets, found: InverseKinematics, readers: dict[str, str]
) -> tuple[Targets, InverseKinematics, list[str]]:
    """The targets with the moves of the commands themselves, what these then leave, and notes on it.

    Args:
        model: The calibrated robot.
        targets: Those that were given.
        found: The commands.
        readers: The effects that look at moves which the targets do not give.
    """
    q = _sent(found)
    if not readers:
        return motion.moved_along(targets, q, model.joint_count), found, []
    q = motion.at_rest(q)
    driven = motion.moved_along(targets, q, model.joint_count)
    rows = np.flatnonzero(np.isfinite(q).all(axis=1))
    left = pose_errors(targets.poses[rows], model.forward(q[rows], **driven.conditions_of(rows)))
    position, rotation, before = np.array(found.position_error), np.array(found.rotation_error), found.position_error
    position[rows], rotation[rows] = np.linalg.norm(left[:, :3], axis=1), np.linalg.norm(left[:, 3:], axis=1)
    hint = "; columns approach1 ... would count instead" if "approach" in readers.values() else ""
    notes = [
        f"{', '.join(readers)}: each row is taken to be driven to from the row before it, which gives directions and "
        f"moves of the joints; before the first nothing moves{hint}"
    ]
    off = np.flatnonzero(found.reached & (position > before + _STANDS))
    if off.size:
        most = from_si(float(position[off].max()), "mm")
        notes.append(
            f"{_listed(off.tolist())}: a joint moves there by so little that its direction turns with its correction; "
            f"up to {most:.3g} mm are left"
        )
    sent = np.where(np.isfinite(q), q, found.q)
    return driven, replace(found, q=sent, position_error=position, rotation_error=rotation), notes


def _no_order(readers: dict[str, str]) -> str:
    """What single points do not say."""
    columns = "columns approach1 ..., or " if "approach" in readers.values() else ""
    return (
        f"{', '.join(readers)}: single points do not say how the joints come to them; they are taken as if nothing had "
        f"moved, and the residual leaves out what moves do; give {columns}the rows as a path"
    )


def _stepped(
    model: Robot,
    nominal: Robot,
    targets: Targets,
    q_nominal: FloatArray,
    reached: NDArray[np.bool_],
    found: InverseKinematics,
    hold: Sequence[int],
) -> InverseKinematics:
    """What one step from the nominal joints gives, in the rows that the nominal robot reaches."""
    rows = np.flatnonzero(reached)
    conditions = targets.conditions_of(rows)
    q, status = np.array(found.q), np.array(found.status)
    position, rotation = np.array(found.position_error), np.array(found.rotation_error)
    q[rows] = one_step(model, nominal, targets.poses[rows], q_nominal[rows], hold=hold, **conditions)
    left = pose_errors(targets.poses[rows], model.forward(q[rows], **conditions))
    position[rows], rotation[rows] = np.linalg.norm(left[:, :3], axis=1), np.linalg.norm(left[:, 3:], axis=1)
    beyond = np.any((q < model.limits[:, 0]) | (q > model.limits[:, 1]), axis=1)
    status[beyond & (status == "reached")] = "limit"
    return replace(found, q=q, status=status, position_error=position, rotation_error=rotation)


def deviation(model: Robot, q: FloatArray, conditions: dict[str, Any]) -> FloatArray:
    """(N,) root mean square of the deviations of the three coordinates, as `predict` has them; NaN where not known."""
    of_each = model.position_deviation(q, **conditions)
    if model.correction is not None:
        of_each = np.hypot(np.nan_to_num(of_each), model.correct(q, conditions.get("payload")).sigma)
    return np.asarray(np.sqrt(np.mean(of_each**2, axis=1)))


def notes_on_ranges(model: Robot, q: FloatArray, conditions: dict[str, Any]) -> list[str]:
    """Where commands lie outside of what joint profiles and a trained correction have seen."""
    if not len(q):
        return []
    data = Dataset.from_arrays(q, payload=0.0 if conditions.get("payload") is None else conditions["payload"])
    return [*range_notes(model, data), *correction_notes(model, data)]


def _nominal(
    robot: Robot, targets: Targets, along_path: bool, hold: Sequence[int], threads: int
) -> tuple[FloatArray, NDArray[np.bool_], list[int]]:
    """The nominal robot's joints (N, n), where it reaches its targets (N), and where its path jumps."""
    if along_path:
        return follow(robot, targets, hold, threads)
    q = np.zeros((len(targets), robot.joint_count))
    reached = np.zeros(len(targets), dtype=bool)
    for rows, seeds in ((targets.seeded, targets.seed), (~targets.seeded, None)):
        found = inverse_kinematics(
            robot, targets.poses[rows], seed=None if seeds is None else seeds[rows], hold=hold, threads=threads
        )
        q[rows], reached[rows] = found.q, found.reached
    return q, reached, []


def _sentences(found: InverseKinematics) -> list[str]:
    """What became of the rows that are not simply reached, the first few of each status by themselves."""
    notes = []
    for kind in ("bad_target", "unreachable", "limit", "singular"):
        rows = np.flatnonzero(found.status == kind).tolist()
        notes += [f"row {row}: {found.message(row)}" for row in rows[:_MOST_LISTED]]
        if len(rows) > _MOST_LISTED:
            notes.append(f"{len(rows) - _MOST_LISTED} more are {kind}: {_listed(rows[_MOST_LISTED:])}")
    return notes


def _listed(rows: list[int]) -> str:
    shown = ", ".join(map(str, rows[:20]))
    return f"{'row' if len(rows) == 1 else 'rows'} {shown}{' ...' if len(rows) > 20 else ''}"
