# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Partial residuals of one effect, pose by pose, against the variable that it depends on.

The residual with the effect put back, r + C theta (component-plus-residual plot, Ezekiel 1924; Larsen and McCleary
1972). An effect of a joint is read as that joint's error, a motion of the base where the tool works, the growth of an
arm as its strain, and everything else along its own signature.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.diagnosis.blocks import Blocks
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.problem import core_entry
from fastcal.diagnosis.row_projections import Effect, Reading
from fastcal.diagnosis.search import SearchNode
from fastcal.effects.entries import build_effects, core_options, edge_name, traits_of
from fastcal.effects.traits import filled
from fastcal.place import joint_position, place_of
from fastcal.robot.robot import Spec

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Finding
    from fastcal.measurements.dataset import Dataset


@dataclass(frozen=True, eq=False)
class PartialResidual:
    """An effect in the data.

    Attributes:
        depends_on: "q4", "torque", "time_s", "temperature_c", "approach4", "station", "itself", a column's name ...
        x: (K, 1) or, of what depends on two variables, (K, 2) or (K, 3), SI.
        x_units: "m" for the position of a slider, "rad" for that of any other joint, "" where its name implies it.
        quantity: What y is: "joint", "growth", "motion" (of the base where the tool works), "shift" (of the target),
            "displacement" (of the measured point, along the effect's signature where it depends on "itself").
        unit: Of y: "rad", "m" or "1".
        reading: y before and after with the fitted curve.
        labels: What the numbers x count, where they stand for words.
        left_out: Poses that show nothing of it.
    """

    depends_on: tuple[str, ...]
    x: FloatArray
    x_units: tuple[str, ...]
    quantity: str
    unit: str
    reading: Reading
    labels: tuple[str, ...] = ()
    left_out: int = 0


def of_finding(state: SearchNode, finding: Finding) -> PartialResidual:
    """The partial residual of one effect that is in the fit."""
    fit = state.fit
    entry, place = _entry(fit, finding)
    return _of_effect(Effect.fitted(fit, place), entry, state.blocks)


def of_unexplained(state: SearchNode, owner: str, depends_on: tuple[str, ...]) -> PartialResidual | None:
    """The block without a name that explains most of what remains; None where the state or the data have none like it.

    Directions of gravity and of sight, angles of an instrument and last moves are no column of the data.
    """
    blocks, fit = state.blocks, state.fit
    at = [k for k, g in enumerate(blocks.generics) if (g.owner, g.curves.depends_on) == (owner, depends_on)]
    found = [_variable(name, owner, fit) for name in depends_on]
    columns = [column for column in found if column is not None]
    if not at or len(columns) < len(found):
        return None
    effect = Effect.added(fit, blocks.of(blocks.count + at[0]))
    if owner.startswith("joint"):
        return _joint(effect, owner, blocks, depends_on, columns)
    if len(effect.points[0]) == 0:
        return None
    if owner == "base":
        reading = effect.motion_by(blocks.directions[at[0]], blocks.generics[at[0]].curves.values)
        return _result(effect, depends_on, columns, "motion", "m", reading)
    if owner == "tool":
        return _result(effect, depends_on, columns, "shift", "m", effect.in_frame(blocks.frames["tool"]))
    return _result(effect, depends_on, columns, "displacement", "m", effect.displacement())


def _entry(fit: Fit, finding: Finding) -> tuple[Spec, slice]:
    """The entry of a finding and the indices of its parameters."""
    at = fit.problem.own
    for entry, effect in zip(fit.entries, fit.model_effects, strict=True):
        place = slice(at, at + len(effect.parameters))
        at = place.stop
        if not finding.is_of(entry):
            continue
        names = {edge_name(p, geometry=False) for p in effect.parameters}  # others of another form of the effect
        is_form = traits_of(finding.effect).is_wave or not finding.parameters or names & set(finding.parameters)
        if is_form:
            return entry, place
    raise KeyError(finding.label)


def _of_effect(effect: Effect, entry: Spec, blocks: Blocks) -> PartialResidual:
    """Read as the error of its joint, the growth of its link, a motion of base or target; else along itself."""
    traits, owner, fit = traits_of(entry["effect"]), entry["owner"], effect.fit
    data, on = fit.problem.kept, filled(traits.plotted_over, owner)
    joint = owner.partition("<-")[0]
    (core,) = build_effects([core_entry(entry)], fit.problem.start.model.robot)
    if traits.place == "joint" and on != "itself" and core.follows_loads and not core.data_columns:
        on = "torque"  # a gap that the load closes asks for no side of approach
    x = None if on == "itself" else _variable(on, joint, fit)
    is_whole = data.position is not None
    if x is not None and traits.place == "joint":
        return _joint(effect, joint, blocks, (on,), [x])
    if x is not None and traits.place == "link" and on == "temperature_c":
        h = x - float(core_options(entry).get("t0", x.mean()))
        strain = np.where(h != 0, h, np.inf)
        return _result(effect, (on,), [x], "growth", "1", effect.along(effect.C[:, 0] / strain[effect.row]))
    if x is not None and traits.place == "base" and on in ("time_s", "station") and is_whole:
        return _result(effect, (on,), [x], "motion", "m", effect.motion(_courses(entry, data)))
    if x is not None and traits.place == "tool" and is_whole:
        return _result(effect, (on,), [x], "shift", "m", effect.in_frame(blocks.frames["tool"]))
    reading = effect.along_itself()
    x = np.zeros(len(data))
    x[reading.kept] = reading.fitted[:, 0]
    return _result(effect, ("itself",), [x], "displacement", "m", reading)


def _courses(entry: Spec, data: Dataset) -> list[FloatArray]:
    """(N,) each: over the rows, what a motion of the base follows: its stations, a step, or time as it goes on."""
    options = core_options(entry)
    if data.station is not None and traits_of(entry["effect"]).labels == "stations":
        return [(data.station == s).astype(float) for s in range(len(data.station_names))]
    time = np.zeros(len(data)) if data.time is None else data.time
    if "at" in options:
        return [(time >= float(options["at"])).astype(float)]
    return [np.asarray(time - float(options.get("t0", time.mean())), dtype=np.float64)]


def _joint(
    effect: Effect, owner: str, blocks: Blocks, on: tuple[str, ...], columns: list[FloatArray]
) -> PartialResidual:
    revolute = effect.fit.problem.start.robot.joint_types[place_of(owner).index] == "revolute"
    reading = effect.along(blocks.frames[owner][:, 0])
    return _result(effect, on, columns, "joint", "rad" if revolute else "m", reading)


def _variable(name: str, owner: str, fit: Fit) -> FloatArray | None:
    """(N,) the variable of this name over the fitted rows, SI; None where the data have none."""
    data = fit.problem.kept
    values: object = data.extra.get(name)
    of_joint = re.fullmatch(r"(q|approach|current)(\d+)(?:_a)?", name)
    if of_joint:
        columns = {"q": data.q, "approach": data.approach, "current": data.current}[of_joint[1]]
        values = None if columns is None else columns[:, int(of_joint[2]) - 1]
    elif name == "torque" and owner.startswith("joint"):
        values = fit.loads[:, place_of(owner).index]
    elif name in ("x", "y", "z") and data.position is not None:
        values = data.position[:, "xyz".index(name)]
    elif values is None:
        conditions = {"time_s": data.time, "temperature_c": data.temperature, "payload_kg": data.payload}
        values = {**conditions, "station": data.station, "mount": data.mount}.get(name)
    return None if values is None else np.asarray(values, dtype=np.float64)


def _result(
    effect: Effect, on: tuple[str, ...], columns: list[FloatArray], quantity: str, unit: str, reading: Reading
) -> PartialResidual:
    data = effect.fit.problem.kept
    x = np.column_stack(columns)[reading.kept]
    names = {"station": data.station_names, "mount": data.mount_names}
    labels = tuple(names.get(on[0]) or ())
    left_out = len(columns[0]) - len(reading.kept)
    return PartialResidual(on, x, _units(on, effect), quantity, unit, reading, labels, left_out)


def _units(on: tuple[str, ...], effect: Effect) -> tuple[str, ...]:
    kinds = effect.fit.problem.start.robot.joint_types
    unit = {joint_position(k): "rad" if kind == "revolute" else "m" for k, kind in enumerate(kinds)}
    return tuple(unit.get(name, "") for name in on)
