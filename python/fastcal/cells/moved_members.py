# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Steps of ways told as the cell's: which of its members was moved, the instrument, the base of an arm or a target.

A way that steps at its begin tells no more than that its arm and its instrument moved against each other. Where the
instrument reads other arms too, these decide: if all step together by one motion, the instrument was moved, else the
bases of those that do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell
from fastcal.cells.diagnosis import CellFinding, Step, WayDiagnosis
from fastcal.cells.knocked import turned_step
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Finding
from fastcal.effects.entries import traits_of
from fastcal.effects.rig_traits import PLACEMENT_STEP
from fastcal.place import Place
from fastcal.said import said
from fastcal.units import parse_name, to_si

_NEAR = 2  # rows by which the moments of one motion may differ in two ways
_SURE = 4.0  # standard deviations
_SHARE = 0.05  # of a motion, which the geometry of two arms may take up
_WORLD = "world"


def moved_members(ways: Sequence[WayDiagnosis], readings: Readings) -> dict[int, Step]:
    """The steps of ways' begins and targets, by the `id` of their findings.

    Args:
        ways: All of a cell.
        readings: What was read, in the order of measuring.
    """
    steps = [step for each in ways for finding in each.found.effects if (step := _step(each, finding)) is not None]
    out: dict[int, Step] = {}
    for end in dict.fromkeys((of.begins, _end(of)) for of in steps):
        own = [of for of in steps if (of.begins, _end(of)) == end]
        others = [each.way for each in ways if each.way.instrument == end[1]]
        for group in _together(own, readings):
            roots = {way.root for way in others if _is_read_beside(way, group[0], readings)}
            for of in group:
                out[id(of.finding)] = _named(of, {each.each.way.root for each in group}, roots, group[0].moment)
    return out


def _is_read_beside(way: Way, step: Step, readings: Readings) -> bool:
    """Were enough rows of a way read before and after a step to show it?"""
    if way is step.each.way:
        return True
    read = np.isfinite(readings.tables[f"position@{way.name}"]).any(axis=1)
    early = when(readings, step.finding) < step.moment
    return min(int((read & early).sum()), int((read & ~early).sum())) >= rules.MIN_ROWS_BESIDE_STEP


def _step(each: WayDiagnosis, finding: Finding) -> Step | None:
    place = step_of(finding.effect)
    if place not in ("base", "tool") or each.way.seeing:
        return None
    moment = next(finding.parameters[key].value for key in ("at_s", "at_row") if key in finding.parameters)
    return Step(each, finding, place == "base", moment)


def step_of(effect: str) -> str:
    """Where an effect steps that is there from a moment on; empty: it is no such effect."""
    traits = traits_of(effect)
    return traits.place if traits.searched == "at_s" else ""


def motion_of(of: Step) -> tuple[FloatArray, FloatArray]:
    """(6,) shift [m] and turn [rad] about the origin of what the way begins at, in its axes; standard deviations.

    Those of the shift are about the base of the way's first arm, where it is known best.
    """
    parts = [(parse_name(name)[1] or "", value) for name, value in of.finding.parameters.items() if _is_axis(name)]
    values = np.array([to_si(value.value, unit) for unit, value in parts])
    std = np.array([np.inf if value.std is None else to_si(value.std, unit) for unit, value in parts])
    values[:3] -= np.cross(values[3:], _base_of(of))
    return values, std


def _is_axis(name: str) -> bool:
    return name.startswith("step_")


def _base_of(of: Step) -> FloatArray:
    """(3,) where the base of the way's first arm stands, from what the way begins at."""
    return of.each.way.robot.T_world_base[:3, 3]


def _is_one_motion(a: Step, b: Step, rows: FloatArray) -> bool:
    """Are two steps of one end of two ways the same? `rows`: when each row was measured."""
    early, late = sorted((a.moment, b.moment))
    if ((rows >= early) & (rows < late)).sum() > _NEAR:
        return False
    if not a.begins:
        return True
    (of_a, std_a), (of_b, std_b), p = motion_of(a), motion_of(b), _base_of(b)
    apart, size = of_a - of_b, of_b.copy()
    for each in (apart, size):
        each[:3] += np.cross(each[3:], p)
    within = np.hypot(std_a, std_b)
    within[:3] = np.hypot(within[:3], np.linalg.norm(p - _base_of(a)) * np.linalg.norm(std_a[3:]))
    share = _SHARE * np.repeat([np.linalg.norm(size[:3]), np.linalg.norm(size[3:])], 3)
    return bool((np.abs(apart) <= _SURE * within + share).all())


def _end(of: Step) -> str:
    """The member of the cell that may have been moved."""
    return of.each.way.instrument if of.begins else of.each.way.target.name


def _together(steps: Sequence[Step], readings: Readings) -> list[list[Step]]:
    """Those that are one motion."""
    out: list[list[Step]] = []
    for step in steps:
        rows = when(readings, step.finding)
        group = next((of for of in out if all(_is_one_motion(step, other, rows) for other in of)), None)
        if group is None:
            out.append([step])
        else:
            group.append(step)
    return out


def when(readings: Readings, finding: Finding) -> FloatArray:
    """(N,) when each row was measured, as the moment of a finding is told: in seconds or by the order of rows."""
    times = [data.time for data in readings.arms.values() if data.time is not None]
    if "at_s" in finding.parameters and times:
        return times[0]
    return np.arange(len(readings), dtype=np.float64) if readings.row is None else readings.row.astype(np.float64)


def _named(of: Step, seen: set[str], roots: set[str], first: float) -> Step:
    """The step with its name.

    Args:
        of: One of those that are one motion.
        seen: The arms at which the ways of all of these begin.
        roots: The same of all ways from the instrument that would show it.
        first: The moment of the first of these.
    """
    way = of.each.way
    bases = _bases(way, of.finding.effect)
    instrument, several = (PLACEMENT_STEP, way.instrument), len(roots) > 1
    if not of.begins:
        return replace(of, name=(PLACEMENT_STEP, way.target.name), first=first)
    if not way.root or (several and seen == roots):
        return replace(of, name=instrument, first=first)
    if several or way.instrument == _WORLD:  # of one arm alone, a base that steps is the instrument's step too
        return replace(of, name=bases[0], alike=tuple(bases[1:]), first=first)
    return replace(of, name=instrument, alike=tuple(bases), first=first)


def _bases(way: Way, effect: str) -> list[tuple[str, str]]:
    """The bases that a step at the begin of a way may be of: on slides alone, that of the arm on them looks alike."""
    out = []
    for arm in way.stacked:
        out.append((effect, str(Place(arm.name, "base", 0))))
        if "revolute" in arm.robot.joint_types:
            break
    return out


def told_name(way: Way, effect: str, owner: str) -> tuple[str, str]:
    """An effect and owner of a way as the cell calls them, where the way alone is known."""
    place = "" if way.seeing else step_of(effect)
    if place == "tool":
        return PLACEMENT_STEP, way.target.name
    if place == "base" and way.instrument != _WORLD:
        return PLACEMENT_STEP, way.instrument
    return way.told(effect), way.owner(owner)


def limits_of(finding: Finding, moved: Mapping[int, Step]) -> tuple[Because, ...]:
    """Why the grade of a finding is not better, what else a step may be included."""
    step, known = moved.get(id(finding)), [of.reason for of in finding.limits]
    if step is None or not step.alike or Reason.EQUIVALENTS in known:
        return finding.limits
    return (*finding.limits, Because(Reason.EQUIVALENTS))


def with_moved(cell: Cell, of: CellFinding, readings: Readings) -> tuple[Cell, str]:
    """The cell in which a member was moved; or as it is, and a sentence on why.

    A target or sensor stood elsewhere before; the bases of arms have the step among their arms' effects.

    Args:
        cell: The cell.
        of: A finding with its steps.
        readings: All that was read, in the order of measuring.
    """
    points = {point.name: point for point in cell.points}
    label, owner = of.finding.label, of.finding.owner
    if owner not in points:
        return _with_base_steps(cell, of.steps), ""
    if points[owner].knocked is not None:
        return cell, said("{label} is not in model.yaml: it has a step of it already", label=label)
    rows = when(readings, of.finding)
    if (np.diff(rows) < 0).any():
        return cell, said("{label} is not in model.yaml: the rows are not in the order of time", label=label)
    at_row = int((rows < of.steps[0].moment).sum())
    knocked = {"at_row": at_row, "before_mm": [0.0] * 3, "before_deg": [0.0] * 3}
    moved = (replace(point, knocked=knocked) if point.name == owner else point for point in cell.points)
    return replace(cell, points=tuple(moved)), ""


def _with_base_steps(cell: Cell, steps: Sequence[Step]) -> Cell:
    """The cell whose arms have the steps of their bases, each once, in the axes of the world."""
    done = set[str]()
    for step in steps:
        way = step.each.way
        entry = next((of for of in step.each.found.model.entries if step.finding.is_of(of)), None)
        if entry is None or way.root in done:
            continue
        done.add(way.root)
        arms = [
            replace(arm, robot=arm.robot.with_(effects=[*arm.robot.entries, turned_step(entry, way.axes)]))
            if arm.name == way.root
            else arm
            for arm in cell.arms
        ]
        cell = replace(cell, arms=tuple(arms))
    return cell
