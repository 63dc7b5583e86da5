# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The search for a design among the rows of its candidates: growth, exchange, restarts, and the fewest that are enough.

Where a bound on the best there is can be given, the design comes with it: O1 and minus the variance are concave in M,
so that no n candidates are better than value + (n largest sensitivities) - (those of the members), which is the
equivalence theorem of J. Kiefer and J. Wolfowitz (1960) for designs that take each candidate at most once.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray

_MOST_TRIALS = 8  # designs that are tried on the way to the fewest poses


@dataclass(frozen=True, eq=False)
class Found:
    """Members of a design, and what share of the best possible it surely reaches (None: not known)."""

    members: list[int]
    efficiency: float | None = None


@dataclass(eq=False)
class Search:
    """A criterion over candidates.

    Attributes:
        candidates: Their rows.
        criterion: O1 to O5 or variance.
        known: (p, p) information that is there before.
        targets: (p, p) B, tr(M^-1 B) being the mean variance of a predicted coordinate.
        exchange: False: growth alone.
        restarts: Exchanges from random designs besides the grown one.
        seed: Of these.
        threads: Cores to use.
    """

    candidates: _core.Candidates
    criterion: str
    known: FloatArray
    targets: FloatArray
    exchange: bool = True
    restarts: int = 0
    seed: int = 0
    threads: int = 1
    _grown: list[int] = field(default_factory=list)

    def information(self, members: list[int]) -> FloatArray:
        """M (p, p) of a design."""
        return np.asarray(self.known + self.candidates.information(members))

    def variance(self, members: list[int]) -> float:
        """Mean variance of a predicted coordinate over the targets [m^2]."""
        return float(np.trace(np.linalg.solve(self.information(members), self.targets)))

    def run(self, count: int) -> Found:
        """The best design of `count` members that was found."""
        best, bound = self._exchanged(self._growth(count))
        for restart in range(self.restarts if self.exchange else 0):
            drawn = _core.draw_design(len(self.candidates), count, self.seed + 1 + restart)
            other, its_bound = self._exchanged(drawn)
            best, bound = max(best, other, key=lambda choice: choice.value), min(bound, its_bound)
        return Found(list(best.members), self._efficiency(best.value, bound))

    def fewest(self, most: int, sigma: float) -> Found:
        """The smallest design found whose predicted standard deviation is at most sigma [m], or one of `most`."""
        limit = sigma**2
        grown = self._growth(most)
        M = self.known.copy()
        guess = most
        for n, member in enumerate(grown, start=1):
            M += self.candidates.information([member])
            if np.trace(np.linalg.solve(M, self.targets)) <= limit:
                guess = n
                break
        too_few, enough, found = 0, most + 1, Found([])
        for _ in range(_MOST_TRIALS):
            trial = self.run(guess)
            variance = self.variance(trial.members)
            if variance <= limit:
                enough, found = guess, trial
            else:
                too_few = guess
            if too_few >= most:
                return trial
            if enough - too_few <= 1:
                break
            # The variance falls as one over the count.
            guess = min(max(int(np.ceil(guess * variance / limit)), too_few + 1), min(enough - 1, most))
        return found if found.members else self.run(most)

    def _growth(self, count: int) -> list[int]:
        """By O1 where exchanges follow: by the variance growth is led astray while little is known."""
        if self.exchange or self.criterion != "variance":
            if len(self._grown) < count:
                self._grown = self._grow("O1", count)
            return self._grown[:count]
        return self._grow("variance", count)

    def _grow(self, criterion: str, count: int) -> list[int]:
        return list(
            _core.grow_design(
                self.candidates, criterion, count, start=self.known, targets=self.targets, threads=self.threads
            )
        )

    def _exchanged(self, members: list[int]) -> tuple[_core.Choice, float]:
        choice = _core.exchange_design(
            self.candidates,
            self.criterion,
            start=self.known,
            targets=self.targets,
            members=members,
            rounds=20 if self.exchange else 0,
            threads=self.threads,
        )
        return choice, float(choice.bound)

    def _efficiency(self, value: float, bound: float) -> float | None:
        if self.criterion == "O1":  # log det M: of O1 itself, its root
            return float(np.exp((value - bound) / (2 * len(self.known))))
        if self.criterion == "variance":
            return max(0.0, bound / value)
        return None
