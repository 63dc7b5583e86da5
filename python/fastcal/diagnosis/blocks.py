# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Score tests of everything that could be added to a fit: names, and blocks without one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.diagnosis import generic
from fastcal.diagnosis.fits import Fit, corner_start, identity_of, moves_nothing
from fastcal.diagnosis.generic import Curves, Generic
from fastcal.diagnosis.library import Hypothesis
from fastcal.diagnosis.memory import without_memory
from fastcal.diagnosis.problem import ONE, Problem, core_entry
from fastcal.diagnosis.reasons import Label
from fastcal.effects.entries import build_effects, curve_of
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]

_MANY = 3  # times as many rows as columns: from there on a triangle is worth its making


@dataclass(frozen=True, eq=False)
class Blocks:
    """What could be added to a fit: names first, then blocks without a name, and their score tests."""

    names: list[Hypothesis]
    generics: list[Generic]
    tests: _core.ScoreTests
    columns: FloatArray
    sizes: list[int]
    # (m, k) columns of a motion of base, joints, tool, as `Fit.standardized` has them; rows of priors are not in them
    frames: dict[str, FloatArray]

    def columns_of(self, index: int) -> FloatArray:
        """(m, k) of one block."""
        first = sum(self.sizes[:index])
        return self.columns[:, first : first + self.sizes[index]]

    def label(self, index: int) -> Label:
        """What a block is."""
        return self.names[index].label if index < self.count else self.generics[index - self.count].label

    def worth(self, statistic: FloatArray, rank: NDArray[np.int32], among: NDArray[np.intp]) -> FloatArray:
        """BIC's: what blocks `among` all explain less log m a parameter; -inf where the fit absorbs them."""
        searched = np.array([self.names[i].searched if i < self.count else 0 for i in among])
        return np.where(rank > 0, statistic - (rank + searched) * np.log(len(self.columns)), -np.inf)

    @property
    def count(self) -> int:
        """Of names; generic blocks have the indices from there on."""
        return len(self.names)


def blocks(at: Fit) -> Blocks:
    """Columns and score tests of all names and generic blocks at a fit."""
    problem = at.problem
    there = {name.cause for name in at.added}
    names = [n for n in problem.names if n.cause not in there]
    frames = _frames(problem)
    entries = [*at.entries, *(n.entry for n in names), *frames]
    model, samples = problem.model(entries, problem.kept)
    count = len(at.model.parameters)
    theta = np.concatenate([at.theta[:count], np.zeros(len(model.parameters) - count), at.theta[count:]])
    effects = build_effects([core_entry(e) for e in entries], model.robot)
    sizes = [len(e.parameters) for e in effects]
    first = problem.own + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    offset = len(at.entries)
    for k, name in enumerate(names):
        if "corner" in name.entry:
            part = slice(first[offset + k], first[offset + k + 1])
            known = {
                identity_of({"effect": n.effect, "owner": n.owner}): at.value(n)
                for n in at.added
                if n.effect in name.traits.generalizes
            }
            theta[part] = corner_start(name.entry, effects[offset + k], at, known)
            theta[part.start : part.start + 2] = 0.0
    near = _core.linearize(model, samples, problem.measured, theta, problem.common_noise, problem.threads)
    J = np.where(moves_nothing(problem, model, near), 0.0, np.asarray(near.J) / problem.noise.factor)
    A, r, _row = at.whitened
    n_measured = len(near.row)
    columns = [J[:, first[offset + k] : first[offset + k + 1]] for k in range(len(names))]
    frame_columns = {
        entry["owner"]: J[:, first[offset + len(names) + k] : first[offset + len(names) + k + 1]]
        for k, entry in enumerate(frames)
    }
    generics, generic_columns = _generic_columns(at, frame_columns, np.asarray(near.row))
    columns += generic_columns
    C = np.zeros((len(r), sum(c.shape[1] for c in columns)))
    C[:n_measured] = without_memory(problem, np.hstack(columns), np.asarray(near.row, dtype=np.intp))
    sizes = [c.shape[1] for c in columns]
    return Blocks(names, generics, _core.ScoreTests(*triangle(A, C, r), sizes), C, sizes, frame_columns)


def triangle(A: FloatArray, C: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same problem turned into as many rows as it has columns: no test of sums of squares sees the difference.

    [A C r] = Q R, part by part; what has few rows stays as it is.
    """
    width = A.shape[1] + C.shape[1] + 1
    if len(r) < _MANY * width:
        return A, C, r
    R: FloatArray = np.zeros((0, width))
    for k in range(0, len(r), _MANY * width):
        part = slice(k, k + _MANY * width)
        R = np.asarray(np.linalg.qr(np.vstack([R, np.column_stack([A[part], C[part], r[part]])]), mode="r"))
    return np.asfortranarray(R[:, : A.shape[1]]), np.asfortranarray(R[:, A.shape[1] : -1]), R[:, -1].copy()


def _down(robot: Robot, base: FloatArray) -> FloatArray:
    """(3,) direction of gravity in the measuring frame; `base` (3, 3) turns the base into it."""
    gravity = np.asarray(robot.spec.get("gravity_m_s2", [0.0, 0.0, -9.81]), dtype=np.float64)
    length = float(np.linalg.norm(gravity))
    if length == 0:
        return gravity
    return np.asarray((gravity if robot.spec.get("gravity_frame") == "measuring" else base @ gravity) / length)


def _frames(problem: Problem) -> list[Spec]:
    robot = problem.start.robot
    moved: Spec = {"effect": curve_of("frame"), "column": ONE}
    out: list[Spec] = [{**moved, "owner": "base"}]
    for i, kind in enumerate(robot.joint_types):
        out.append({**moved, "owner": f"joint{i + 1}", "axis": "rz" if kind == "revolute" else "z"})
    return [*out, {**moved, "owner": "tool"}]


def _generic_columns(
    at: Fit, frame: dict[str, FloatArray], row: NDArray[Any]
) -> tuple[list[Generic], list[FloatArray]]:
    problem, data = at.problem, at.problem.kept
    robot = problem.start.robot
    turns = [kind == "revolute" for kind in robot.joint_types]
    found: list[Generic] = []
    columns: list[FloatArray] = []

    def add(owner: str, curves: Curves, direction: FloatArray) -> None:
        if curves.values.shape[1] == 0:
            return
        values = curves.values[row]
        block = (direction[:, :, np.newaxis] * values[:, np.newaxis, :]).reshape(len(row), -1)
        found.append(Generic(owner, curves))
        columns.append(block)

    for joint in range(robot.joint_count):
        for curves in generic.joint_curves(joint, data, at.loads, turns):
            add(f"joint{joint + 1}", curves, frame[f"joint{joint + 1}"])
    for curves in generic.frame_curves(data):
        add("base", curves, frame["base"])
        add("tool", curves, frame["tool"])
    if data.position is not None:
        theta = at.theta[: len(at.model.parameters)]
        pose = np.asarray(at.model.predict(at.samples, theta, problem.threads, None))
        point, turn = pose[:, :3, 3], pose[:, :3, :3]
        add("workspace", generic.field_curves(point), frame["base"][:, :3])
        base = np.asarray(problem.start.alignment.T_world_base)[:3, :3]
        for curves, way in generic.sight_curves(point):
            along = np.einsum("mk,mk->m", frame["base"][:, :3], (way @ base)[row])
            add("instrument", curves, along[:, np.newaxis])
        down = _down(robot, base)
        away = point / np.maximum(np.linalg.norm(point, axis=1), 1e-12)[:, np.newaxis]
        add("tool", generic.tool_curves(np.einsum("nji,j->ni", turn, down), "gravity"), frame["tool"])
        add("tool", generic.tool_curves(np.einsum("nji,nj->ni", turn, away), "sight"), frame["tool"][:, :3])
    return found, columns
