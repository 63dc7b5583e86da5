# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The gap between measured and predicted readings, and how much each added effect closes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal.diagnosis import rules


@dataclass(frozen=True)
class KindGap:
    """RMS error of a kind of reading, in its unit.

    Attributes:
        unit: Of the others.
        train_rms: Of the rows that the fits hold, without those that are listed as outliers.
        held_out_rms: Of the same rows, each part of the poses predicted by a fit to the others; None where that is not
            known, as of all kinds but the one that is spoken of.
        test_rms: Of the test poses.
    """

    unit: str
    train_rms: float | None
    held_out_rms: float | None
    test_rms: float | None


@dataclass(frozen=True)
class GapStep:
    """RMS error of the model with one effect more, of each kind of reading, that which is spoken of first.

    Attributes:
        added: The effect; None: the geometry alone. NOMINAL_ARM, HELD_ARM: these in its place.
        kinds: By name.
    """

    added: str | None
    kinds: Mapping[str, KindGap]

    @property
    def main(self) -> KindGap:
        """Of the kind that is spoken of: points where they were measured."""
        return next(iter(self.kinds.values()))

    @property
    def _in_mm(self) -> KindGap | None:
        """Of points, or of the lengths that were measured in their place."""
        return self.main if self.main.unit == "mm" else None

    @property
    def train_rms_mm(self) -> float | None:
        """Of points or lengths; None where neither was measured. So are the next two."""
        return None if self._in_mm is None else self._in_mm.train_rms

    @property
    def held_out_rms_mm(self) -> float | None:
        """Of these in poses held out."""
        return None if self._in_mm is None else self._in_mm.held_out_rms

    @property
    def test_rms_mm(self) -> float | None:
        """Of these in test poses."""
        return None if self._in_mm is None else self._in_mm.test_rms

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `gap`."""
        return {
            "added": self.added,
            "train_rms_mm": self.train_rms_mm,
            "held_out_rms_mm": self.held_out_rms_mm,
            "test_rms_mm": self.test_rms_mm,
            "kinds": {name: vars(of) for name, of in self.kinds.items()},
        }


@dataclass(frozen=True)
class Gap:
    """The gap in one kind of numbers, as it is spoken of.

    Attributes:
        on: "test", "held out", or "fitted" where neither is known: the poses that it is of.
        sizes: RMS errors of the steps.
        floor: What noise alone accounts for.
        unit: Of both.
    """

    on: str
    sizes: list[float]
    floor: float
    unit: str

    @property
    def rises(self) -> bool:
        """Is the last model worse than the geometry alone, by more than a user would notice?"""
        return self.sizes[-1] > rules.MAX_RISE * self.sizes[0]

    @property
    def closed(self) -> float:
        """Share of the mean square beyond the noise that is gone."""
        before, after = self.sizes[0], self.sizes[-1]
        return float(np.clip((before**2 - after**2) / max(before**2 - self.floor**2, 1e-30), 0.0, 1.0))
