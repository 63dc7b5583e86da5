# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The hypotheses of a diagnosis: every effect, owner and option that the robot can have and the data can show."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from fastcal.calibration.alignment import measurements
from fastcal.calibration.options_from_data import with_origins
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.variants import VARIANTS, effect_has_moment, with_lags
from fastcal.effects import registered
from fastcal.effects.entries import build_effects, conditions_read, effect_names, effect_owners, label, traits_of
from fastcal.effects.traits import filled
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec

Exclusion = tuple[str, str | None]  # an effect and its owner; None: all of them

_NOT_SCREENED = ("nuisance", "curve", "scanned", "on request")  # roles: blocks without a name stand for the curves


@dataclass(frozen=True)
class Untestable:
    """A name on which the data hold no information, and what would show it."""

    effect: str
    owner: str
    needs: str


@dataclass(frozen=True)
class Library:
    """What can be named, what the data lack the columns for, and what the user left out (`parse_exclusions`)."""

    names: list[Hypothesis]
    untestable: list[Untestable]
    excluded: frozenset[Exclusion] = frozenset()


def parse_exclusions(texts: Collection[str], robot: Robot) -> set[Exclusion]:
    """`EFFECT` or `EFFECT@OWNER` to pairs; the owner None: all of them.

    Raises:
        InvalidInput: An effect or owner that this robot does not have.
    """
    out: set[Exclusion] = set()
    for text in texts:
        effect, at, owner = text.strip().partition("@")
        owners = effect_owners(effect, robot.core)
        if at and owner not in owners:
            there = ", ".join(owners) or "none"
            raise InvalidInput(f"--exclude {text}: {effect} has no owner '{owner}' on this robot; there are {there}")
        out.add((effect, owner if at else None))
    return out


def is_excluded(effect: str, owner: str, excluded: Collection[Exclusion]) -> bool:
    """Did the user leave this name out?"""
    return (effect, None) in excluded or (effect, owner) in excluded


def build_library(robot: Robot, data: Dataset, excluded: Collection[Exclusion] = ()) -> Library:
    """All names for a robot and data, without those in its file already and those excluded."""
    there = {Hypothesis(entry).cause for entry in robot.entries}
    names: list[Hypothesis] = []
    untestable: list[Untestable] = []
    for effect in effect_names():
        if traits_of(effect).role in _NOT_SCREENED:
            continue
        for owner in effect_owners(effect, robot.core):
            if is_excluded(effect, owner, excluded):
                continue
            try:
                entries = list(_entries(effect, owner, robot, data))
            except InvalidInput:
                untestable.append(Untestable(effect, owner, needs(effect, owner, columns=True)))
                continue
            names += [name for name in entries if name.cause not in there]
    return Library(names, untestable, frozenset(excluded))


def needs(effect: str, owner: str, *, columns: bool) -> str:
    """What would show an effect: the columns that the data lack, or other poses and conditions."""
    traits = traits_of(effect)
    return filled((traits.needs_data if columns else "") or traits.shown_by, owner)


def _check_measured(effect: str, name: str, robot: Robot, data: Dataset) -> None:
    """Raises InvalidInput where times, or an instrument that measures lengths, are what the data lack for an effect."""
    if data.kinds and traits_of(effect).place == "instrument" and not measurements(data, robot).shows_scale:
        raise InvalidInput(f"{effect} is of an instrument, and touches and turns have none that measures lengths")
    if effect_has_moment(effect) and data.time is None:
        raise InvalidInput(f"{name} needs the column time_s")


def _entries(effect: str, owner: str, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """The variants of one effect and owner; InvalidInput where the data lack a column."""
    bare: Spec = {"effect": effect, "owner": owner}
    traits = traits_of(effect)
    _check_measured(effect, label(bare), robot, data)
    if traits.searched:
        yield from VARIANTS[traits.searched](bare, robot, data)
        return
    if traits.without_masses and (not without_masses(robot) or np.ptp(data.payload) > 0):
        raise InvalidInput(f"{effect} is for robots without masses, beside a compliance where payloads show it")
    if traits.diagnosed_with:
        option, _, value = traits.diagnosed_with.partition("=")
        bare[option] = value
    entry = with_origins(bare, robot, data)
    known = registered.find(effect)
    for column in conditions_read(entry, build_effects([entry], robot.core)[0]):
        if getattr(data, column.rstrip("0123456789"), None) is None:
            raise InvalidInput(f"{effect} needs the column {column}")
    for column in known.extra if known else ():
        if column not in data.extra:
            raise InvalidInput(f"{effect} needs the column {column}")
    yield Hypothesis(entry)
    if "lag_s" in traits.among_parameters and data.time is not None:
        yield from with_lags(entry, data.time)


def without_masses(robot: Robot) -> bool:
    """Does the robot file say nothing of what the arm weighs?"""
    return not any(joint.mass_kg > 0 for joint in robot.joints)
