# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where something may be missing, and what it may depend on: the blocks that a surrogate is chosen from.

A place is a motion of the arm (directions of `surrogate.cpp`), its inputs are named as in `surrogate_inputs.hpp`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

SLOW = frozenset(["time", "temperature"])  # inputs whose later values no row has
_CONSTANT = 1e-9  # of its size: an input that varies by less is constant


@dataclass(frozen=True)
class Candidate:
    """A place and what its function depends on.

    Attributes:
        owner: jointN, linkN, base, tool, robot (all lengths), instrument, workspace.
        inputs: Names of what it depends on, one to three.
    """

    owner: str
    inputs: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.owner} by {', '.join(self.inputs)}"


def directions(owner: str) -> int:
    """How many directions a place moves in."""
    if owner.startswith("joint") or owner == "robot":
        return 1
    return 3 if owner in ("instrument", "workspace") else 6


def candidates(robot: Robot, data: Dataset, threads: int) -> list[Candidate]:
    """All blocks whose inputs the data hold and vary."""
    known = {f"q{i + 1}" for i in range(robot.joint_count) if _varies(data.q[:, i])}
    known |= _varying_loads(robot, data, threads)
    for word, table in (("approach", data.approach), ("move", data.move)):
        if table is not None:
            known |= {f"{word}{i + 1}" for i in range(robot.joint_count) if _varies(table[:, i])}
    for word, column in (("time", data.time), ("temperature", data.temperature), ("payload", data.payload)):
        if column is not None and _varies(column):
            known.add(word)
    if "payload" in known:
        known |= {"weight_x", "weight_y", "weight_z"}
    known |= {"gravity_x", "gravity_y", "gravity_z"}
    known |= {f"down{i + 1}_{axis}" for i in range(robot.joint_count) for axis in "xyz"}
    if data.position is not None:
        known |= {"forward_x", "forward_y", "height", "range", "x", "y", "z", "sight_x", "sight_y", "sight_z"}
    return [c for c in _all(robot.joint_count) if set(c.inputs) <= known]


def posture_inputs(joints: int) -> frozenset[str]:
    """The inputs that postures and their order decide."""
    others = (*SLOW, "payload", "approach")
    return frozenset(name for c in _all(joints) for name in c.inputs if not name.startswith(others))


def _varying_loads(robot: Robot, data: Dataset, threads: int) -> set[str]:
    """Of joints whose load varies beside the largest of all: about an upright axis it is rounding."""
    names = [f"load{i + 1}" for i in range(robot.joint_count)]
    core = robot.error_model
    loads = np.asarray(_core.surrogate_inputs(core, robot.samples(data), core.start, " ".join(names), threads))
    least = _CONSTANT * float(np.max(np.abs(loads)))
    return {name for name, values in zip(names, loads.T, strict=True) if np.ptp(values) > least}


def _varies(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> bool:
    return bool(np.ptp(values) > _CONSTANT * max(1.0, float(np.max(np.abs(values)))))


def _all(n: int) -> Iterator[Candidate]:
    for i in range(1, n + 1):
        owner = f"joint{i}"
        for inputs in (
            (f"q{i}",),
            (f"load{i}",),
            ("time",),
            ("temperature",),
            (f"move{i}",),
            (f"approach{i}", f"q{i}"),
            (f"approach{i}", f"load{i}"),
            (f"move{i}", f"q{i}"),
            (f"q{i}", f"load{i}"),
            (f"q{i}", "payload"),
        ):
            yield Candidate(owner, inputs)
        for j in (i - 1, i + 1):
            if 1 <= j <= n:
                yield Candidate(owner, (f"q{i}", f"q{j}"))
                yield Candidate(owner, (f"approach{j}", f"q{i}"))
                yield Candidate(owner, (f"load{j}",))
    for i in range(1, n):
        yield Candidate(f"link{i}", (f"q{i}", f"q{i + 1}"))
        yield Candidate(f"link{i}", (f"down{i}_x", f"down{i}_y", f"down{i}_z"))
    yield Candidate("robot", ("time",))
    yield Candidate("robot", ("temperature",))
    yield Candidate("base", ("time",))
    yield Candidate("base", ("q1",))
    yield Candidate("base", ("q1", "q2"))
    yield Candidate("base", ("x", "y", "z"))
    yield Candidate("base", ("temperature",))
    yield Candidate("tool", ("gravity_x", "gravity_y", "gravity_z"))
    yield Candidate("tool", ("weight_x", "weight_y", "weight_z"))
    yield Candidate("tool", ("time",))
    yield Candidate("tool", ("sight_x", "sight_y", "sight_z"))
    yield Candidate("instrument", ("sight_x", "sight_y", "sight_z"))
    yield Candidate("instrument", ("forward_x", "forward_y"))
    yield Candidate("instrument", ("height",))
    yield Candidate("instrument", ("range",))
    yield Candidate("workspace", ("x", "y", "z"))
