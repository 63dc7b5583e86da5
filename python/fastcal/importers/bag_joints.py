# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The joints of an arm out of joint states: messages of one device, or of several that name a part of them each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput

_MOST_NAMED = 8
_OLDEST = 0.5  # [s] a position that is held while the others come
LARGEST = 1e100  # whose square is a number as well


@dataclass
class Stream:
    """The values of one topic over time."""

    topic: str = ""
    times: list[float] = field(default_factory=list)  # [s] since 1970
    values: list[list[float]] = field(default_factory=list)  # joints, or x y z [qx qy qz qw]

    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Times (N,) in order and values (N, k)."""
        order = np.argsort(self.times, kind="stable")
        return np.array(self.times)[order], np.array(self.values)[order]


Devices = Mapping[tuple[str, ...], Stream]  # by the joints that each of its messages names


@dataclass(frozen=True)
class JointStates:
    """Positions of an arm's joints.

    Attributes:
        names: Of the joints.
        times: (N,) [s] since 1970, in order.
        q: (N, n) finite positions [rad or m].
        notes: Where they come from, and what was left out.
    """

    names: tuple[str, ...] = ()
    times: FloatArray = field(default_factory=lambda: np.zeros(0))
    q: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    notes: tuple[str, ...] = ()


def joint_states(path: str, devices: Devices, wanted: Sequence[str], count: int | None) -> JointStates:
    """The arm among the devices of a bag.

    Args:
        path: The bag, for messages.
        devices: Joint states by the names that each message has.
        wanted: The names of the robot's joints; empty where it has none.
        count: The number of its joints; None where no robot is given.

    Raises:
        InvalidInput: Messages name a part of the joints each, and nothing says which of them are the arm's.
    """
    if not devices:
        return JointStates()
    chosen = _of_the_arm(path, devices, wanted, count)
    names = tuple(name for name in wanted if any(name in each for each in chosen)) or tuple(
        dict.fromkeys(name for each in chosen for name in each)
    )
    topics = ", ".join(dict.fromkeys(devices[each].topic for each in chosen))
    notes = [f"joints read from the topic {topics}"]
    if len(chosen) > 1:
        notes.append(f"joints come in {len(chosen)} kinds of messages, which are put together")
    others = sorted({name for each in devices for name in each} - set(names))
    if others:
        more = f" and {len(others) - _MOST_NAMED} more" if len(others) > _MOST_NAMED else ""
        notes.append(f"other joints in the bag are left out: {', '.join(others[:_MOST_NAMED])}{more}")
    times, q = _together({each: devices[each] for each in chosen}, names)
    names, times, q, left_out = _finite(names, times, q)
    return JointStates(names, times, q, (*notes, *left_out))


def _of_the_arm(path: str, devices: Devices, wanted: Sequence[str], count: int | None) -> list[tuple[str, ...]]:
    """The devices whose joints are the arm's."""
    whole = [names for names in devices if wanted and set(wanted) <= set(names)]
    parts = [names for names in devices if set(wanted) & set(names)]
    if whole or (set(wanted) <= {name for names in parts for name in names} and wanted):
        # Beside whole messages, parts of them keep what they name up to date.
        return [*whole, *(names for names in parts if names not in whole)]
    groups = _sharing_joints(devices)
    sizes = [len({name for names in group for name in names}) for group in groups]
    fits = [group for group, size in zip(groups, sizes, strict=True) if size == count]
    if not fits and sum(sizes) == count:
        return [names for group in groups for names in group]
    if not fits:  # a gripper or a rail has fewer joints
        fits = [
            g for g, size in zip(groups, sizes, strict=True) if 2 * size > max(sizes) and (size > 1 or len(sizes) == 1)
        ]
    if len(fits) != 1:
        listed = "; ".join(", ".join(group[0]) for group in (fits or groups)[:3])
        raise InvalidInput(
            f"{path}: joints come in messages of their own, {listed:.300}: --robot URDF says which are the arm's"
        )
    return fits[0]


def _sharing_joints(devices: Devices) -> list[list[tuple[str, ...]]]:
    """The devices in groups that have no joint in common with another."""
    groups: list[list[tuple[str, ...]]] = []
    for names in devices:
        near = [group for group in groups if any(set(names) & set(each) for each in group)]
        groups = [group for group in groups if group not in near] + [[each for g in near for each in g] + [names]]
    return groups


def _together(devices: Devices, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Times and positions of the joints: a row each time that all have come since the row before."""
    messages = sorted(
        (time, place, row) for place, stream in enumerate(devices.values()) for row, time in enumerate(stream.times)
    )
    column = {name: k for k, name in enumerate(names)}
    targets = [[(k, column[name]) for k, name in enumerate(listed) if name in column] for listed in devices]
    streams = list(devices.values())
    held, since = np.full(len(names), np.nan), np.full(len(names), -np.inf)
    fresh = np.zeros(len(names), dtype=bool)
    times, rows = [], []
    for time, place, row in messages:
        values = streams[place].values[row]
        for k, to in targets[place]:
            held[to], since[to], fresh[to] = values[k], time, True
        if fresh.all():
            fresh[:] = False
            if time - since.min() <= _OLDEST:
                times.append(time)
                rows.append(held.copy())
    return np.array(times), np.array(rows).reshape(len(rows), len(names))


def _finite(
    names: tuple[str, ...], times: FloatArray, q: FloatArray
) -> tuple[tuple[str, ...], FloatArray, FloatArray, list[str]]:
    """Joints that ever have a number, and the samples in which all have one; what was left out is said."""
    notes = []
    good = sized(q)
    ever = np.asarray(good.any(axis=0))
    if len(q) and not ever.all() and ever.any():
        silent = ", ".join(name for name, any_ in zip(names, ever, strict=True) if not any_)
        notes.append(f"joints without a number in any message are left out: {silent}")
        names, q, good = tuple(n for n, any_ in zip(names, ever, strict=True) if any_), q[:, ever], good[:, ever]
    kept = np.asarray(good.all(axis=1))
    if not kept.all():
        notes.append(left_out_samples(int((~kept).sum()), len(kept), "joint states"))
    return names, times[kept], q[kept], notes


def sized(values: FloatArray) -> NDArray[np.bool_]:
    """Which values are finite numbers whose squares are finite too."""
    return np.asarray(np.abs(values) < LARGEST)


def left_out_samples(count: int, of: int, what: str) -> str:
    """The sentence on samples that hold no sized number."""
    return f"{count} of {of} {what} hold NaN or a number beyond all sizes, and are left out"
