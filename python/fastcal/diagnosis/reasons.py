# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Why a cause is not reported or has no better grade, as data: `words.reason_text` makes the sentences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

# Models in place of the calibrated geometry, as steps of a gap name them: base and tool alone; held near nominal.
NOMINAL_ARM, HELD_ARM = "base,tool", "geometry"


class Reason(Enum):
    """Why a hypothesis is, or is not, given; why a finding has no better grade."""

    GIVEN = "it is reported"
    IMPOSSIBLE = "its parameters lie beyond their bounds"
    NOT_SIGNIFICANT = "it explains no more than chance would"
    NOT_NEEDED = "it fits no better than what is reported, or is not needed beside it"
    LEAVES_MORE = "something else stays significant with it in the model"

    SOMETHING_REMAINS = "part of the misfit is unexplained"
    SHADOW = "it absorbs an unexplained error"
    EQUIVALENTS = "other hypotheses fit equally well"
    WEAK_SIGNAL = "its signal-to-noise ratio is below that of grade A"
    LOOKS_LIKE_OTHERS = "its signal is too weak next to what it may compensate for"
    UNNAMED_RIVALS = "blocks without a physical cause fit equally well"
    SIMPLER_DOES = "the data do not distinguish it from a simpler one"
    IMPLAUSIBLE = "its size is implausible"
    NOT_HELD_OUT = "held-out poses are not predicted better"
    WORSE_ON_TEST_POSES = "test poses are predicted worse"
    UNSTABLE = "parts of the data put another hypothesis first"
    OWN_MODEL = "the diagnosis of its own model finds more"
    TURNED_DIRECTION = "its lost motion is negative"
    AGAINST_LOAD = "it deflects against its load"
    LOAD_MODIFIER = "a large effect of loads may have this form"
    UNSURE_COMPANION = "another effect in the set is uncertain"
    NAMES_EXCLUDED = "not every cause was tested"
    NOISE_OVER_CLAIM = "more remains than the stated noise"
    SLOW_WAVE_ALIKE = "a slow wave fits equally well in a short range"
    ORDERS_ALIKE = "waves of other orders fit equally well"
    OWN_JUMP = "the joint that decides may jump itself"
    ZERO_JUMPED = "a joint whose zero jumped looks the same"
    ZERO_CREEPS = "a joint whose zero drifts looks the same"
    CURVE_WITHOUT_NAME = "the error of a joint depends on its own position"
    OTHER_FORM = "another form of it fits equally well"
    NO_MASSES = "without masses the load law cannot be identified"
    PART_OF_A_PLAIN_MODEL = "part of a plain model that predicts held-out poses best"
    PLAIN_MODEL_PREDICTS = "not written: a plain model without it predicts held-out poses better"
    MAY_BE_CHANCE = "not written: noise may have made it"
    NOT_OF_OTHER_POSTURES = "not written: other postures may not show it"
    CHANGES_OTHERWISE = "not written: the underlying cause may behave differently"


# Reasons with which a finding of grade C may still be the right cause.
MAY_BE_ANOTHER = frozenset(
    [
        Reason.LOOKS_LIKE_OTHERS,
        Reason.UNSTABLE,
        Reason.IMPLAUSIBLE,
        Reason.NO_MASSES,
        Reason.SOMETHING_REMAINS,
        Reason.OWN_JUMP,
        Reason.SLOW_WAVE_ALIKE,
        Reason.AGAINST_LOAD,
        Reason.UNSURE_COMPANION,
    ]
)


@dataclass(frozen=True)
class CauseLabel:
    """A hypothesis by its name: effect, owner, and what tells its variants apart, such as "order=2"."""

    effect: str
    owner: str
    variant: str = ""

    def __str__(self) -> str:
        return f"{self.effect}@{self.owner}" + (f":{self.variant}" if self.variant else "")


@dataclass(frozen=True)
class BlockLabel:
    """Something without a name at an owner, by what it depends on."""

    owner: str
    depends_on: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.owner} by {', '.join(self.depends_on)}"


Label = CauseLabel | BlockLabel
Speak = Callable[[Label], str]


@dataclass(frozen=True)
class Because:
    """A reason with its particulars.

    Attributes:
        value: The p value of what is left, a signal-to-noise ratio, a share of the folds.
        limit: What the value would have to reach.
        subjects: The hypotheses or blocks that it speaks of.
        waves: (cycles a turn, amplitude [rad]) of a curve's main orders.
        orders: Cycles a turn that the data can't tell from that of a wave.
    """

    reason: Reason
    value: float = 0.0
    limit: float = 0.0
    subjects: tuple[Label, ...] = ()
    waves: tuple[tuple[int, float], ...] = ()
    orders: tuple[float, ...] = ()
