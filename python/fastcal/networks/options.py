# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Options of every training besides its rows."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import torch


def _silent(text: str) -> None:
    pass


@dataclass(frozen=True)
class Options:
    """How to train.

    Attributes:
        seed: The same seed gives the same networks.
        device: Where torch computes.
        progress: Called with a sentence at each step.
        trials: Of a search; None: as many as the search thinks right; 0: none, sizes as a paper prints them.
        storage: File in which a search keeps its trials, so that it can be stopped and taken up again; None: nowhere.
        full: Give a search its paper's whole budget instead of halving.
        jobs: Processes, or workers of the joblib backend in force, for what can be done side by side.
        deadline: By `time.monotonic`, when a search ends with what it has found; None: when all is tried. It tries
            something in any case.
        notes: Takes sentences about what a search or a classifier found.
    """

    seed: int = 0
    device: torch.device = field(default_factory=lambda: torch.device("cpu"))
    progress: Callable[[str], None] = _silent
    trials: int | None = None
    storage: Path | None = None
    full: bool = False
    jobs: int = 1
    deadline: float | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def is_over(self) -> bool:
        """Has a search's time run out?"""
        return self.deadline is not None and time.monotonic() >= self.deadline

    def seeds(self, count: int) -> list[int]:
        """One seed for each of some networks."""
        return [self.seed * 100_003 + k for k in range(count)]
