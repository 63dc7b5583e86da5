# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One cause that could be missing: an effect, its owner and its options."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import CauseLabel
from fastcal.effects.entries import identity, identity_at_any_moment, traits_of
from fastcal.effects.traits import Traits
from fastcal.robot.robot import Spec

Key = tuple[str, str]

SLOW = frozenset(["time_s", "temperature_c"])  # what an effect depends on that changes slowly
_SEARCHED = (
    "at_s",
    "at_row",
    "at_deg",
    "at_mm",
    "lag_s",
    "period_mm",
    "tau_s",
    "width_nm",
)  # options that a search finds, beside a wave's order

_PLACES_OF_STEPS = ("at_s", "at_row", "rows", "at_deg", "at_mm")


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One cause that could be missing, as an entry of a robot file with its parameters at 0.

    Attributes:
        entry: {effect, owner, options}.
        variant: Tells apart entries of one effect and owner (orders, corners, moments); "" where there is but one.
        has_its_moment: Is it a step at its own moment alone, beside others of its effect and owner? Else the moment is
            searched for, and whatever the moment, the cause is one.
    """

    entry: Spec
    variant: str = ""
    has_its_moment: bool = False

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return str(self.entry["effect"])

    @property
    def owner(self) -> str:
        """Its owner."""
        return str(self.entry["owner"])

    @property
    def key(self) -> Key:
        """Effect and owner."""
        return self.effect, self.owner

    @property
    def traits(self) -> Traits:
        """What its effect states about itself."""
        return traits_of(self.effect)

    @cached_property
    def cause(self) -> tuple[Any, ...]:
        """Equal for two names of one cause: waves of two orders are two, steps at two moments mostly one."""
        return identity(self.entry) if self.has_its_moment else identity_at_any_moment(self.entry)

    @property
    def is_start(self) -> bool:
        """Is it one of several starts of a search, of a corner or a moment, for the same cause?"""
        bare = {"effect": self.effect, "owner": self.owner}
        return bool(self.variant) and self.cause == identity_at_any_moment(bare)

    @property
    def bare(self) -> Spec:
        """Its entry without when or where it steps."""
        return {key: value for key, value in self.entry.items() if key not in _PLACES_OF_STEPS}

    @property
    def searched(self) -> int:
        """Numbers that are searched for outside the fit and count as its parameters: a moment, an order."""
        order = self.entry.get("order", rules.WAVE_ORDERS[0])
        return sum(option in self.entry for option in _SEARCHED) + int(order not in rules.WAVE_ORDERS)

    @property
    def label(self) -> CauseLabel:
        """As it is written and spoken of."""
        return CauseLabel(self.effect, self.owner, self.variant)

    def __repr__(self) -> str:
        return str(self.label)
