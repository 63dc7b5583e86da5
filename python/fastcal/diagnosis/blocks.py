# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Score tests of everything that could be added to a fit: named effects and generic blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each
from fastcal.calibration.tall import moved
from fastcal.diagnosis import generic
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.generic import Curves, Generic
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.priors import moves_nothing
from fastcal.diagnosis.problem import ONE, Problem
from fastcal.diagnosis.projection import score_tests, score_tests_beside
from fastcal.diagnosis.reasons import Label
from fastcal.diagnosis.starting_values import corner_start, values_by_name
from fastcal.effects.entries import curve_of
from fastcal.place import joint_name
from fastcal.robot.robot import Robot, Spec


@dataclass(frozen=True, eq=False)
class Columns:
    """What could be added to a fit, as columns: names first, then blocks without a name.

    Attributes:
        values: (m, c) over the numbers and priors of the fit, as `Fit.whitened` has them; 0 in the rows of priors.
        sizes: Columns of each block.
        directions: (m', d) of each block without a name: what its curves are multiplied by.
        frames: (m', k) columns of a motion of base, joints, tool, as `Fit.standardized` has them, without the priors.
    """

    names: list[Hypothesis]
    generics: list[Generic]
    values: FloatArray
    sizes: list[int]
    directions: list[FloatArray]
    frames: dict[str, FloatArray]

    def of(self, index: int) -> FloatArray:
        """(m, k) of one block."""
        first = sum(self.sizes[:index])
        return self.values[:, first : first + self.sizes[index]]


@dataclass(frozen=True, eq=False)
class Blocks:
    """What could be added to a fit: names first, then blocks without a name, and their score tests.

    Columns are not kept, since a search looks at many fits and they take most of the memory: those of a few blocks are
    computed again.
    """

    at: Fit
    names: list[Hypothesis]
    generics: list[Generic]
    tests: _core.ScoreTests
    sizes: list[int]
    directions: list[FloatArray]
    frames: dict[str, FloatArray]

    def columns_of(self, named: Sequence[int]) -> FloatArray:
        """(m, k) of some names, one after the other, as `Columns.values` has them."""
        return columns_at(self.at, [self.names[i] for i in named]).values

    def of(self, index: int) -> FloatArray:
        """(m, k) of one block, as `Columns.values` has them."""
        if index < self.count:
            return self.columns_of([index])
        block, direction = self.generics[index - self.count], self.directions[index - self.count]
        row = self.at.near.row
        values = np.zeros((len(row) + len(self.at.free), self.sizes[index]), order="F")
        _fill(values[: len(row)], block, direction, row)
        values[: len(row)] = decorrelated(self.at.problem, values[: len(row)], row)
        return values

    def label(self, index: int) -> Label:
        """What a block is."""
        return self.names[index].label if index < self.count else self.generics[index - self.count].label

    def worth(self, statistic: FloatArray, rank: NDArray[np.int32], among: NDArray[np.intp]) -> FloatArray:
        """BIC's: what blocks `among` all explain less log m a parameter; -inf where the fit absorbs them."""
        m = len(self.at.near.r) + len(self.at.free)
        return np.where(rank > 0, statistic - (rank + self._searched[among]) * np.log(m), -np.inf)

    @property
    def bytes(self) -> float:
        """Of what its score tests keep: products of all columns."""
        return 8.0 * float(sum(self.sizes)) ** 2

    @cached_property
    def _searched(self) -> NDArray[np.intp]:
        """Of each block, how many of its parameters were searched for."""
        return np.array([*(name.searched for name in self.names), *(0 for _ in self.generics)], dtype=np.intp)

    @property
    def count(self) -> int:
        """Of names; generic blocks have the indices from there on."""
        return len(self.names)


def blocks(at: Fit, columns: Columns | None = None) -> Blocks:
    """Score tests of all names and generic blocks at a fit; `columns` where they are known."""
    found = columns_at(at) if columns is None else columns
    A, r, _row = at.whitened
    tests = score_tests_beside(A, at.normal, found.values, r, found.sizes)
    tests = score_tests(at.basis, found.values, r, found.sizes) if tests is None else tests
    return Blocks(at, found.names, found.generics, tests, found.sizes, found.directions, found.frames)


def columns_at(at: Fit, alone: list[Hypothesis] | None = None, *, as_measured: bool = False) -> Columns:
    """Columns of all names and generic blocks at a fit; those of the names `alone`, where they are given.

    With `as_measured` as `Fit.standardized` has its own.
    """
    problem = at.problem
    there = {name.cause for name in at.added}
    names = [n for n in problem.names if n.cause not in there] if alone is None else alone
    frames = _frames(problem) if alone is None else []
    entries = [*at.entries, *(n.entry for n in names), *frames]
    effects = problem.effects(entries)
    model, samples = problem.model(entries, problem.kept, effects)
    count = len(at.model.parameters)
    theta = np.concatenate([at.theta[:count], np.zeros(len(model.parameters) - count), at.theta[count:]])
    width = [len(e.parameters) for e in effects]
    first = problem.own + np.concatenate([[0], np.cumsum(width)]).astype(int)
    offset = len(at.entries)
    for k, name in enumerate(names):
        if "corner" in name.entry:
            part = slice(first[offset + k], first[offset + k + 1])
            known = values_by_name(at.entries, at.model_effects, at.theta[problem.own :])
            theta[part] = corner_start(name.entry, at, known)
            theta[part.start : part.start + 2] = 0.0
    near = problem.linearized(model, samples, theta)
    row = near.row
    J = near.J
    last = first[offset + len(names)]
    still = moves_nothing(problem, model, near)
    factor = np.where(still, np.inf, problem.noise.factor)
    frame = np.asfortranarray(J[:, last:] / factor[last:])
    ends = first[offset + len(names) :] - last
    frame_columns = {entry["owner"]: frame[:, ends[k] : ends[k + 1]] for k, entry in enumerate(frames)}
    generics, directions = _generic_blocks(at, frame_columns, row) if frames else ([], [])
    named = last - first[offset]
    sizes = width[offset : offset + len(names)] + [
        d.shape[1] * g.curves.count for g, d in zip(generics, directions, strict=True)
    ]
    values = np.zeros((len(row) + len(at.free), sum(sizes)), order="F")
    measured = values[: len(row)]

    def scale(rows: slice) -> None:
        np.divide(J[rows, first[offset] : last], factor[first[offset] : last], out=measured[rows, :named])

    def fill(part: tuple[int, Generic, FloatArray]) -> None:
        begin, block, direction = part
        _fill(measured[:, begin : begin + direction.shape[1] * block.curves.count], block, direction, row)

    each(scale, moved(len(row), named))
    begins = np.cumsum([named, *sizes[len(names) :]])[:-1]
    each(fill, zip(begins.tolist(), generics, directions, strict=True))
    if not problem.noise.is_white and not as_measured:
        measured[...] = decorrelated(problem, measured, row)
    return Columns(names, generics, values, sizes, directions, frame_columns)


def _fill(out: FloatArray, block: Generic, direction: FloatArray, row: NDArray[np.intp]) -> None:
    """Columns (m', k) of a block without a name: one direction after the other, the curves within."""
    curves = np.take(block.curves.values.T, row, axis=1).T
    for k, way in enumerate(direction.T):
        first = k * curves.shape[1]
        np.multiply(curves, way[:, np.newaxis], out=out[:, first : first + curves.shape[1]])


def _down(robot: Robot, base: FloatArray) -> FloatArray:
    """(3,) direction of gravity in the measuring frame; `base` (3, 3) turns the base into it."""
    gravity = np.asarray(robot.description.gravity_m_s2, dtype=np.float64)
    length = float(np.linalg.norm(gravity))
    if length == 0:
        return gravity
    return np.asarray((gravity if robot.description.gravity_frame == "measuring" else base @ gravity) / length)


def _places(problem: Problem) -> FloatArray:
    """(N, frames, 3) origins of the chain's frames [m], in the measuring frame."""
    return np.asarray(problem.start.model.robot.frame_origins(problem.kept.q))


def _frames(problem: Problem) -> list[Spec]:
    robot = problem.start.robot
    moved: Spec = {"effect": curve_of("frame"), "column": ONE}
    out: list[Spec] = [{**moved, "owner": "base"}]
    for i, kind in enumerate(robot.joint_types):
        out.append({**moved, "owner": joint_name(i), "axis": "rz" if kind == "revolute" else "z"})
    return [*out, {**moved, "owner": "tool"}]


def _generic_blocks(at: Fit, frame: dict[str, FloatArray], row: NDArray[Any]) -> tuple[list[Generic], list[FloatArray]]:
    """Blocks without a name and, of each, the directions (m, d) that are multiplied by its curves."""
    problem, data = at.problem, at.problem.kept
    robot = problem.start.robot
    still = {*robot.beside, *robot.passive}
    turns = {i: kind == "revolute" for i, kind in enumerate(robot.joint_types) if i not in still}
    found: list[Generic] = []
    directions: list[FloatArray] = []

    def add(owner: str, curves: Curves, direction: FloatArray) -> None:
        if curves.count:
            found.append(Generic(owner, curves))
            directions.append(direction)

    known = problem.curves
    for joint, of_joint in zip(turns, generic.joint_curves(data, at.loads, turns, known), strict=True):
        owner = joint_name(joint)
        for curves in of_joint:
            add(owner, curves, frame[owner])
    for curves in generic.frame_curves(data, known):
        add("base", curves, frame["base"])
        add("tool", curves, frame["tool"])
    base = np.asarray(problem.start.alignment.T_world_base)[:3, :3]
    down = _down(robot, base)
    if down.any():
        across = np.linalg.svd(down[np.newaxis])[2][1:]
        lean = frame["base"][:, 3:] @ (across @ base).T
        for curves in generic.lean_curves(across, data.q, partial(_places, problem), known):
            add("base", curves, lean)
    if data.position is not None:
        theta = at.theta[: len(at.model.parameters)]
        pose = np.asarray(at.model.predict(at.samples, theta, problem.threads, None))
        point, turn = pose[:, :3, 3], pose[:, :3, :3]
        add("workspace", generic.field_curves(point), frame["base"][:, :3])
        for curves, way in generic.sight_curves(point):
            along = np.einsum("mk,mk->m", frame["base"][:, :3], (way @ base)[row])
            add("instrument", curves, along[:, np.newaxis])
        away = point / np.maximum(np.linalg.norm(point, axis=1), 1e-12)[:, np.newaxis]
        add("tool", generic.tool_curves(np.einsum("nji,j->ni", turn, down), "gravity"), frame["tool"])
        add("tool", generic.tool_curves(np.einsum("nji,nj->ni", turn, away), "sight"), frame["tool"][:, :3])
    return found, directions
