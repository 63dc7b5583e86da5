# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A model without some of its effects, by their names as they are written on a command line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.effects.entries import Spec, identity_options, label
from fastcal.errors import InvalidInput
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot

CORRECTION = "correction"  # the name of what `fastcal train` adds


def drop_effects(robot: Robot, names: str | Sequence[str]) -> Robot:
    """The model without the effects that are named: `backlash@joint3`, `gear_harmonic@joint1:order=2`, `backlash`.

    A name without an owner means all its owners, one without options all entries of that owner; `correction` is the
    trained correction. Geometry and all other parameters stay as they were identified together with what goes, and so
    do their covariances: calibrate again to let them take up what they can.

    Args:
        robot: The model.
        names: One name, several in a list, or several with commas between.

    Raises:
        InvalidInput: The model has no such effect; the message lists those that it has.
    """
    entries = kept = robot.entries
    correction = robot.correction
    for name in (part.strip() for part in (names.split(",") if isinstance(names, str) else names)):
        if name == CORRECTION and correction is not None:
            correction = None
            continue
        left = [entry for entry in kept if not _is_meant(entry, name)]
        if len(left) == len(kept) and not any(_is_meant(entry, name) for entry in entries):
            there = [*map(name_of, entries), *([CORRECTION] if robot.correction else [])]
            what = f"there are {', '.join(there)}" if there else "it has none"
            raise InvalidInput(f"{robot.name} has no effect '{name}'; {what}")
        kept = left
    bare = robot.with_(effects=kept, correction=correction)
    if robot.record is None:
        return bare
    return bare.with_(calibration=_without(robot.record, set(bare.parameter_names)).to_spec())


def name_of(entry: Spec) -> str:
    """`EFFECT@OWNER`, and the options that tell it from another entry of that effect and owner."""
    options = "".join(f":{key}={_text(value)}" for key, value in identity_options(entry).items())
    return label(entry) + options


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _is_meant(entry: Spec, name: str) -> bool:
    head, *options = name.split(":")
    effect, _, owner = head.partition("@")
    if entry["effect"] != effect or (owner and entry["owner"] != owner):
        return False
    own = identity_options(entry)
    return all(_is_same(own.get(key), value) for key, _, value in (option.partition("=") for option in options))


def _is_same(own: object, given: str) -> bool:
    """Is an option as it was written? Numbers to six digits, as `name_of` writes them."""
    if isinstance(own, float):
        try:
            return math.isclose(own, float(given), rel_tol=1e-5)
        except ValueError:
            return False
    return own is not None and str(own) == given


def _without(record: CalibrationRecord, known: set[str]) -> CalibrationRecord:
    """The record of the parameters that are left: their rows of L, made triangular, and of what moves them.

    With C = L L^T the covariance of some of the parameters is M M^T, M being their rows of L; of M^T = Q R it is R^T R.
    """
    at = [i for i, name in enumerate(record.parameters) if name in known]
    if len(at) == len(record.parameters):
        return record
    root = np.asarray(np.linalg.qr(record.root[at].T, mode="r")).T
    root = root * np.where(np.diag(root) < 0, -1.0, 1.0)
    moved = [i for i, name in enumerate(record.moved) if name in known]
    return replace(
        record,
        parameters=[record.parameters[i] for i in at],
        root=root,
        moved=[record.moved[i] for i in moved],
        directions=record.directions[moved],
    )
