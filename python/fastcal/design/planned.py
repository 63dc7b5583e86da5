# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a design is made for: the model to identify, the directions it asks for, and the postures to work in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.design.candidates import Candidates
from fastcal.effects import registered
from fastcal.effects.entries import Spec, conditions_read, identity_at_any_moment, label, parse_effects, without_repeats
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot


def planned_model(
    robot: Robot, effects: str | Sequence[str], rivals: list[list[Spec]]
) -> tuple[Robot, bool, list[str]]:
    """The robot with all effects that the poses are to determine, is its geometry among them, and notes.

    Effects of the robot's own that look at what no design chooses, as of heat or of another station, are left out:
    they hardly change what a pose shows of the others.

    Raises:
        InvalidInput: An effect that was asked for needs a condition that a design cannot choose.
    """
    geometry, entries = parse_effects(effects, robot.core, robot.entries)
    added = [*entries, *(entry for rival in rivals for entry in rival)]
    asked = {identity_at_any_moment(entry) for entry in added}
    kept, left_out = list[Spec](), list[str]()
    for entry, effect in zip(robot.entries, robot.effects, strict=True):
        if unvaried(entry, effect) and identity_at_any_moment(entry) not in asked:
            left_out.append(label(entry))
        else:
            kept.append(entry)
    gone = {"calibration": None} if left_out else {}  # of effects that are left out
    model = robot.with_(effects=without_repeats([*kept, *added]), **gone)
    for entry, effect in zip(model.entries, model.effects, strict=True):
        for column in unvaried(entry, effect):
            raise InvalidInput(f"{label(entry)} depends on '{column}', which no choice of poses varies")
    notes = [f"the poses are not chosen for {', '.join(left_out)}: no choice of poses makes it observable"]
    return model, geometry, notes if left_out else []


def unvaried(entry: Spec, effect: _core.Effect) -> list[str]:
    """Columns that an effect looks at and no choice of poses varies."""
    own = registered.find(entry["effect"])
    needs = [*conditions_read(entry, effect), *(own.extra if own else ())]
    return [c.removeprefix("extra:") for c in needs if c.rstrip("0123456789") not in ("payload", "approach")]


def approached(model: Robot) -> list[int]:
    """Joints, from 0, whose direction of approach some effect asks for."""
    joints = set()
    for entry, effect in zip(model.entries, model.effects, strict=True):
        for column in conditions_read(entry, effect):
            if column == "approach":
                joints |= set(range(model.joint_count))
            elif column.startswith("approach"):
                joints.add(int(column.removeprefix("approach")) - 1)
    return sorted(joints)


def target_postures(
    model: Robot, targets: ArrayLike | Dataset | Targets | None, everywhere: Candidates, *, threads: int
) -> tuple[Candidates, list[str]]:
    """Where the arm will work, as postures with conditions, and what a reader should know.

    Raises:
        InvalidInput: A shape that does not fit, or no target within reach.
    """
    if targets is None:
        return everywhere, []
    notes: list[str] = []
    if isinstance(targets, Dataset):
        q, payload, approach = targets.q, targets.payload, targets.approach
    elif isinstance(targets, Targets) or np.ndim(targets) == 3:
        wanted = targets if isinstance(targets, Targets) else Targets(np.asarray(targets, dtype=float))
        q, rows = _reached(model, wanted, threads)
        if len(rows) < len(wanted):
            notes = [f"{len(wanted) - len(rows)} of {len(wanted)} targets are out of reach and do not count"]
        conditions = wanted.conditions_of(rows)
        payload = np.broadcast_to(np.asarray(conditions.get("payload", 0.0), dtype=float), (len(q),))
        approach = conditions.get("approach")
    else:
        q = np.asarray(targets, dtype=float)
        payload, approach = np.zeros(len(q)), None
    if q.ndim != 2 or q.shape[1] != model.joint_count or len(q) == 0 or not np.isfinite(q).all():
        raise InvalidInput(
            f"targets must be finite postures (T, {model.joint_count}) or poses (T, 4, 4), got shape {q.shape}"
        )
    if approach is None and approached(model):
        approach = np.zeros(q.shape)  # the middle of both directions
    return Candidates(np.ascontiguousarray(q), payload, approach), [*notes]


def _reached(model: Robot, targets: Targets, threads: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Postures of the targets that the bare arm reaches, and their rows."""
    bare = model.with_(effects=[])
    found = inverse_kinematics(bare, targets.poses, targets.seed if targets.seeded.all() else None, threads=threads)
    rows = np.flatnonzero(np.asarray(found.status) == "reached")
    if len(rows) == 0:
        raise InvalidInput(f"none of the {len(targets)} targets is within reach")
    return np.asarray(found.q)[rows], rows
