# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The model that a cell's diagnosis writes: what its ways found, as far as postures held out bear it out together.

Each way is judged by its own readings. Put together, curves of two ways over one joint, or names that are no more than
their place, may predict worse than none; so the cell without them, and what anyone would try, are tried beside it. And
no way is written with what predicts it worse than its frames alone, which are where its members stand with the arms as
their files say: the arms that move it and nothing else are then left without what was found of them, or as they are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.asked import with_effects
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Arm, Cell
from fastcal.cells.errors import view_errors
from fastcal.cells.never_worse import arms_to_blame, cost, worse_sights
from fastcal.cells.readings import Readings
from fastcal.effects.entries import effect_names, effect_owners, traits_of
from fastcal.effects.traits import Traits
from fastcal.errors import FastcalError, InvalidInput

_FOLDS = 4  # parts of the postures, each held out once
_MANY, _HELD = 200, 2  # postures, of which so many parts are enough
_SEED = 7
_LESS = 0.95  # of the mean square of what was found: what is written in its place must be that much better
_NOTE = "model.yaml has {}: so the cell predicts postures that were held out better than with all that was found"
_HELD_NOTE = (
    "model.yaml has {arms} {kept}: with more the cell predicts what was held out of {views} worse than with all arms "
    "as their files say"
)


@dataclass(frozen=True, eq=False)
class _Try:
    """A cell that may be written.

    Attributes:
        cell: Before its fit.
        effects: Are those of its arms identified too?
        arms: Whose numbers are; of others only where they stand. None: of all.
    """

    cell: Cell
    effects: bool = False
    arms: frozenset[str] | None = None

    def fitted(self, readings: Readings, options: Mapping[str, Any]) -> CellResult:
        """With its effects as all readings together have them, or else as the ways found them."""
        if self.effects:
            found = calibrate_cell(self.cell, readings, effects=True, arms=self.arms, **options)
            if found.status == "converged":
                return found
        return calibrate_cell(self.cell, readings, arms=self.arms, **options)


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
        is_sure: Is none of this a mere place? Then only its frames alone are tried beside it, where it has no curves.
        exclude: Effects that are not to be in it.
        mend: As of `calibrate_cell`.
        threads: Cores.
    """
    options: dict[str, Any] = {"mend": mend, "threads": threads, "as_read": True}  # each way has judged its columns
    tried = {"": _Try(found, found is not plain)}
    bare = replace(found, arms=tuple(_without_curves(arm, plain.arm(arm.name)) for arm in found.arms))
    has_curves = _entries(bare) != _entries(found)
    if found is not plain and (has_curves or not is_sure):
        tried = {"none of what was found": _Try(plain), **_yielding(plain, exclude)}
        tried |= {"no curve": _Try(bare, True)} if has_curves else {}
        tried[""] = _Try(found, True)
    held_out = _HeldOut(readings, options)
    try:
        frames = held_out.errors(_Try(plain, arms=frozenset()))
        errors = {name: held_out.errors(each) for name, each in tried.items()}
    except FastcalError:  # so few postures that a part of them fixes no cell
        return tried[""].fitted(readings, options).cell, []
    best = _best(errors)
    chosen, said = _no_worse(tried[best], plain, held_out, frames, errors[best])
    return chosen.fitted(readings, options).cell, [*([_NOTE.format(best)] if best else []), *said]


def _yielding(plain: Cell, exclude: Collection[str]) -> dict[str, _Try]:
    """What anyone would try where the files have masses: all joints yield, and their bearings too."""
    if not any(joint.mass_kg > 0 for arm in plain.arms for joint in arm.robot.joints):
        return {}
    names: list[str] = []
    out = {}
    for follows in ("torque", "load"):
        tried = [name for name in effect_names() if name not in exclude and _is_plain(traits_of(name), follows)]
        names += [name for name in tried if any(effect_owners(name, arm.robot.core) for arm in plain.arms)]
        try:
            there = with_effects(plain, ",".join(["geometry", *names]))
        except InvalidInput:
            continue  # postures of this cell cannot tell it
        out[f"{' and '.join(names)} of all joints"] = _Try(there, True)
    return out


def _is_plain(traits: Traits, follows: str) -> bool:
    of_joint = traits.role == "cause" and traits.place == "joint" and not traits.without_masses
    return of_joint and traits.depends_on == (follows,) and not traits.generalizes


@dataclass(frozen=True, eq=False)
class _HeldOut:
    """Readings, parts of which are held out of the fit, one after the other."""

    readings: Readings
    options: dict[str, Any]

    def errors(self, of: _Try) -> dict[str, FloatArray]:
        """(N,) of each view, such as `position@smr:camera`, the size of its errors in postures it was not fitted to."""
        count = len(self.readings)
        folds = np.array_split(np.random.default_rng(_SEED).permutation(count), _FOLDS)
        out: dict[str, FloatArray] = {}
        for fold in folds[: _HELD if count > _MANY else _FOLDS]:
            held = self.readings.pick(np.sort(fold))
            kept = self.readings.pick(np.setdiff1d(np.arange(count), fold))
            for view, each in view_errors(of.fitted(kept, self.options).cell, held).items():
                out[view] = np.concatenate([out.get(view, np.zeros(0)), each.after.ravel()])
        return out


def _best(errors: dict[str, dict[str, FloatArray]]) -> str:
    """What predicts best postures it was not fitted to; "", what was found, where none is clearly better."""
    first = next(iter(errors.values()))
    costs = {name: cost(first.keys(), of, first) for name, of in errors.items()}
    best = min(costs, key=lambda name: costs[name])
    count = sum(int(np.isfinite(of).sum()) for of in first.values())
    return best if costs[best] < costs[""] + count * np.log(_LESS) else ""


def _no_worse(
    of: _Try, plain: Cell, held_out: _HeldOut, frames: dict[str, FloatArray], errors: dict[str, FloatArray]
) -> tuple[_Try, list[str]]:
    """The same with no view worse than with its frames alone, and a note on what was left out for that.

    Args:
        of: What predicts best as a whole.
        plain: The cell as its file says.
        held_out: The readings.
        frames: Errors with all arms as their files say.
        errors: Those of `of`.
    """
    everyone = frozenset(arm.name for arm in of.cell.arms)
    held, worse = frozenset[str](), set[str]()
    while now := worse_sights(plain, errors, frames) - worse:
        worse |= now
        held |= arms_to_blame(plain, frames.keys(), now, worse)
        arms = tuple(plain.arm(arm.name) if arm.name in held else arm for arm in of.cell.arms)
        without = replace(of, cell=replace(of.cell, arms=arms))
        as_said = replace(without, arms=everyone - held)
        for tried in (without, as_said) if _entries(without.cell) < _entries(of.cell) else (as_said,):
            of, errors = tried, held_out.errors(tried)
            if not worse_sights(plain, errors, frames):
                break
    if not worse:
        return of, []
    kept = "without what was found of it" if of.arms is None else "as its file says"
    return of, [_HELD_NOTE.format(arms=" and ".join(sorted(held)), kept=kept, views=", ".join(sorted(worse)))]


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
