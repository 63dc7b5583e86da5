# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Why something is not given, or not surer, as data: `words.reason_text` makes the sentences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

# Models in place of the calibrated geometry, as steps of a gap name them: base and tool alone; held near nominal.
NOMINAL_ARM, HELD_ARM = "base,tool", "geometry"


class Reason(Enum):
    """Why a hypothesis is, or is not, given; why a finding has no better grade."""

    GIVEN = "it is given"
    IMPOSSIBLE = "its parameters lie beyond their bounds"
    NOT_SIGNIFICANT = "what it explains is no more than chance"
    NOT_NEEDED = "it does as well as what is given, or is not needed beside it"
    LEAVES_MORE = "something else stays significant with it in the model"

    SOMETHING_REMAINS = "something has no name"
    SHADOW = "it does the work of what has no name"
    EQUIVALENTS = "other hypotheses do as well"
    WEAK_SIGNAL = "its signal-to-noise ratio is below that of grade A"
    LOOKS_LIKE_OTHERS = "its signal is too weak beside what it may make up for"
    UNNAMED_RIVALS = "blocks without a name do as well"
    SIMPLER_DOES = "the data do not show what sets it apart from a simpler one"
    IMPLAUSIBLE = "its size is"
    NOT_HELD_OUT = "held-out poses are not predicted better"
    UNSTABLE = "parts of the data put another hypothesis first"
    OWN_MODEL = "the diagnosis of its own model finds more"
    TURNED_DIRECTION = "its lost motion is negative"
    LOAD_MODIFIER = "a large effect of loads may have this form"
    UNSURE_COMPANION = "another effect of the set is not sure"
    NAMES_EXCLUDED = "not every name was tried"
    NOISE_OVER_CLAIM = "more remains than the claimed noise"
    ORDERS_ALIKE = "waves of other orders do as well"
    ZERO_JUMPED = "a joint whose zero jumped does the same"
    ZERO_CREEPS = "a joint whose zero creeps does the same"
    CURVE_WITHOUT_NAME = "a joint errs by its own position"
    OTHER_FORM = "another form of it does as well"
    NO_MASSES = "without masses no law of the load shows"
    PART_OF_A_PLAIN_MODEL = "part of a plain model that predicts held-out poses best"
    PLAIN_MODEL_PREDICTS = "not written: a plain model without it predicts held-out poses better"
    MAY_BE_CHANCE = "not written: noise may have made it"
    NOT_OF_OTHER_POSTURES = "not written: other postures may not show it"
    CHANGES_OTHERWISE = "not written: what it stands for changes in another way"


# Reasons for which a name of grade C may be the cause all the same.
MAY_BE_ANOTHER = frozenset([Reason.LOOKS_LIKE_OTHERS, Reason.UNSTABLE, Reason.IMPLAUSIBLE, Reason.NO_MASSES])


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
