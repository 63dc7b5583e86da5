# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The model that a cell's diagnosis writes: what its ways found, as far as postures held out bear it out together.

Each way is judged by its own readings. Put together, curves of two ways over one joint, or names that are no more than
their place, may predict worse than none; so the cell without them, and what anyone would try, are tried beside it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.asked import with_effects
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Arm, Cell
from fastcal.cells.errors import kind_errors
from fastcal.cells.readings import Readings
from fastcal.effects.entries import effect_names, effect_owners, traits_of
from fastcal.effects.traits import Traits
from fastcal.errors import FastcalError, InvalidInput

_FOLDS, _HELD = 4, 2  # parts of the postures, and how many of them are held out, one after the other
_SEED = 7
_LESS = 0.95  # of the mean square of what was found: what is written in its place must be that much better
_NOTE = "model.yaml has {}: so the cell predicts postures that were held out better than with all that was found"
_FAR = 10.0  # medians of the plain cell's errors: what is farther counts as that far, so that gross rows do not decide


def written_cell(
    plain: Cell,
    found: Cell,
    readings: Readings,
    *,
    is_sure: bool,
    exclude: Collection[str] = (),
    mend: bool = False,
    threads: int = 1,
) -> tuple[Cell, list[str]]:
    """The calibrated cell that is written, and notes on what it has in place of what was found.

    Args:
        plain: As its file says.
        found: The same with what its ways found, as they found it.
        readings: All that was read.
        is_sure: Is none of this a mere place? Then nothing is tried beside it, where it has no curves.
        exclude: Effects that are not to be in it.
        mend: As of `calibrate_cell`.
        threads: Cores.
    """
    options: dict[str, Any] = {"mend": mend, "threads": threads}
    if found is plain:
        return calibrate_cell(plain, readings, **options).cell, []
    bare = replace(found, arms=tuple(_without_curves(arm, plain.arm(arm.name)) for arm in found.arms))
    tried = {"none of what was found": plain, **_yielding(plain, exclude), "no curve": bare, "": found}
    if _entries(bare) == _entries(found):
        del tried["no curve"]
        if is_sure:
            return _fitted(found, plain, readings, options).cell, []
    best = _best(tried, readings, options)
    there = _fitted(tried[best], plain, readings, options).cell
    return there, [_NOTE.format(best)] if best else []


def _yielding(plain: Cell, exclude: Collection[str]) -> dict[str, Cell]:
    """What anyone would try where the files have masses: all joints yield, and their bearings too."""
    if not any(joint.mass_kg > 0 for arm in plain.arms for joint in arm.robot.joints):
        return {}
    names: list[str] = []
    out = {}
    for follows in ("torque", "load"):
        tried = [name for name in effect_names() if name not in exclude and _is_plain(traits_of(name), follows)]
        names += [name for name in tried if any(effect_owners(name, arm.robot.core) for arm in plain.arms)]
        try:
            out[f"{' and '.join(names)} of all joints"] = with_effects(plain, ",".join(["geometry", *names]))
        except InvalidInput:
            continue  # postures of this cell cannot tell it
    return out


def _is_plain(traits: Traits, follows: str) -> bool:
    of_joint = traits.role == "cause" and traits.place == "joint" and not traits.without_masses
    return of_joint and traits.depends_on == (follows,) and not traits.generalizes


def _fitted(cell: Cell, plain: Cell, readings: Readings, options: dict[str, Any]) -> CellResult:
    """With the numbers of its effects as all readings together have them, or else as the ways found them."""
    if cell is not plain:
        found = calibrate_cell(cell, readings, effects=True, **options)
        if found.status == "converged":
            return found
    return calibrate_cell(cell, readings, **options)


def _best(cells: Mapping[str, Cell], readings: Readings, options: dict[str, Any]) -> str:
    """Which cell predicts postures best that it was not fitted to; "", what was found, where none is clearly better."""
    folds = np.array_split(np.random.default_rng(_SEED).permutation(len(readings)), _FOLDS)[:_HELD]
    errors: dict[str, dict[str, FloatArray]] = {name: {} for name in cells}
    plain = next(iter(cells.values()))
    for fold in folds:
        held = readings.pick(np.sort(fold))
        kept = readings.pick(np.setdiff1d(np.arange(len(readings)), fold))
        for name, cell in cells.items():
            own = errors[name]
            try:
                fitted = _fitted(cell, plain, kept, options).cell
            except FastcalError:
                return ""  # so few postures that a part of them fixes no cell
            for kind, of in kind_errors(fitted, held).items():
                own[kind] = np.concatenate([own.get(kind, np.zeros(0)), of.after.ravel()])
    costs, count = dict.fromkeys(cells, 0.0), 0
    for kind, first in next(iter(errors.values())).items():
        far = _FAR * float(np.nanmedian(first))
        for name in cells:
            square = float(np.nanmean(np.minimum(errors[name][kind], far) ** 2))
            costs[name] += np.count_nonzero(np.isfinite(first)) * float(np.log(max(square, 1e-300)))
        count += int(np.count_nonzero(np.isfinite(first)))
    best = min(costs, key=lambda name: costs[name])
    return best if costs[best] < costs[""] + count * np.log(_LESS) else ""


def _without_curves(arm: Arm, before: Arm) -> Arm:
    """The arm without the effects that a penalty smooths, but for those that its file has."""
    robot = arm.robot
    own = [
        entry
        for entry, effect in zip(robot.entries, robot.effects, strict=True)
        if not effect.penalty or entry in before.robot.entries
    ]
    return arm if len(own) == len(robot.entries) else replace(arm, robot=robot.with_(effects=own))


def _entries(cell: Cell) -> int:
    return sum(len(arm.robot.entries) for arm in cell.arms)
