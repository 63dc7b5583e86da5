# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Test poses at stations, sockets or planes that were not in the fit: these are located from the test poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.evaluation import Evaluation, evaluate
from fastcal.calibration.unknowns import fitted_unknowns
from fastcal.effects.entries import Spec, traits_of
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import best_motion
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot
from fastcal.said import joined, said
from fastcal.units import from_si, to_si

_NAMED = 6  # of unknown places in a sentence
_TURNED = to_si(1.0, "deg")  # more than an orientation is measured wrong
_FEWEST = 6  # points that place a base by six numbers and leave something to judge


def evaluated_test(
    model: Robot, before: Robot | None, test: Dataset, judge: Mapping[str, Any]
) -> tuple[Evaluation, list[str]]:
    """The evaluation of a model beside that of the arm before, and what a reader should know.

    Args:
        model: The calibrated model.
        before: The nominal arm; None: nothing is told of it.
        test: Poses that no fit has seen.
        judge: Further arguments of `evaluate`.

    Raises:
        InvalidInput: As `placed`.
    """
    there, notes = placed(model, test)
    former = None if before is None else placed(before, test)[0]
    of_test = {p.owner for p in measurements(test, there).parameters}
    if new := sorted(of_test - judge["unknowns"].keys()):
        threads = judge["threads"]
        known = {"unknowns": there} | ({} if former is None else {"unknowns_before": former})
        judge = {**judge, **{key: fitted_unknowns(arm, test, threads) | judge[key] for key, arm in known.items()}}
        notes = [*notes, f"{test.source}: {_listed(new)}: not fitted, so the test itself says where that is"]
    return evaluate(there, test, **{**judge, "before": former}), notes


def placed(model: Robot, test: Dataset) -> tuple[Robot, list[str]]:
    """The model as it is, or with its base moved to where the test's points fit best, and a sentence that says so.

    Where it knows several stations and the test names none, B' = M B without what the stations add to the base B, M the
    rigid motion that leaves the least of |M p_i - x_i|^2, by W. Kabsch (1976).

    Raises:
        InvalidInput: The test names no mounts although the model knows several, or has too few points to be placed.
    """
    if test.mount is None and _entries(model, "mounts"):
        raise InvalidInput(f"{test.source}: has no column mount, which says with which of the tools it was measured")
    stations = _entries(model, "stations")
    if not stations or test.station is not None:
        return model, []
    measured = ~np.isnan(test.points).any(axis=1)
    if measured.sum() < _FEWEST:
        raise InvalidInput(
            f"{test.source}: has no column station, and fewer than {_FEWEST} points from which to see where the "
            "instrument stood"
        )
    bare = model.with_(effects=[entry for entry in model.entries if entry not in stations])
    motion = best_motion(bare.poses(test)[measured, :3, 3], test.points[measured])
    there = moved(bare, motion @ bare.T_world_base, bare.T_flange_tool)
    return there, placing_notes(model, test)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def placing_notes(model: Robot, test: Dataset) -> list[str]:
    """The sentence on a test that names no station of a model that knows several."""
    if test.station is not None or not _entries(model, "stations"):
        return []
    text = said("has no column station: its base is fitted to its own points, where its errors are judged")
    return [joined(": ", [test.source, text])]


def other_place_notes(test: Evaluation) -> list[str]:
    """A sentence where test rows fit far better once the tracker, the arm's base or the target sits elsewhere."""
    if test.remounted is not None:
        text = said(
            "these rows fit with {rms:.3g} mm RMS where the target sits elsewhere on the tool, by {x:.4g}, {y:.4g}, "
            "{z:.4g} mm: the error on them is that of its seat; rows of several mounts have a column mount",
            rms=test.remounted.after.to_mm()["rms"],
            **{axis: from_si(float(d), "mm") for axis, d in zip("xyz", test.remounted.shift, strict=True)},
        )
        return [joined(": ", [test.data.source, text])]
    if test.aligned is None:
        return []
    motion = test.aligned.motion
    away, turned = from_si(float(np.linalg.norm(motion[:3, 3])), "mm"), np.linalg.norm(_core.log_so3(motion[:3, :3]))
    note = (
        f"{test.data.source}: these rows fit with {test.aligned.after.to_mm()['rms']:.3g} mm RMS where the tracker or "
        f"the base stands elsewhere, moved by {away:.4g} mm and turned by {from_si(float(turned), 'deg'):.3g} deg: the "
        "error on them is that of the place; `fastcal check` fits it, and rows of several places have a column station"
    )
    turns = np.empty(0) if test.turn_after is None else test.turn_after[np.isfinite(test.turn_after)]
    off = float(np.median(turns)) if len(turns) else 0.0
    if off > turned + _TURNED:  # which no turn of the base alone can do
        note += (
            f"; orientations are off by {from_si(off, 'deg'):.3g} deg: the target sits turned on the flange, and rows "
            "of several mounts have a column mount"
        )
    return [note]


def _entries(model: Robot, labels: str) -> list[Spec]:
    """The effects of a model that are told apart by these labels."""
    return [entry for entry in model.entries if traits_of(entry["effect"]).labels == labels]
