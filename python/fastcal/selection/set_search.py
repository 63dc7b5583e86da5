# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Searches over sets of columns for the least K-fold error: all of them or step by step; ties go to the smaller set."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray

Members = NDArray[np.bool_]  # (S, m), a row a set, a column a parameter

TIE = 1e-9  # relative: errors as close are those of sets that make the same predictions


class Searched(NamedTuple):
    """Sets that were looked at, their K-fold errors (S,) and the standard errors of these."""

    members: Members
    error: FloatArray
    standard_error: FloatArray


class Sets:
    """Subsets of m columns and their K-fold errors, the mean over several deals of the rows into folds."""

    def __init__(self, deals: list[_core.SubsetSearch]) -> None:
        self._deals = deals
        self.column_count = deals[0].optional_count

    def all(self) -> Searched:
        """All 2^m sets."""
        m = self.column_count
        bits = np.unpackbits(np.arange(2**m, dtype="<u4").view(np.uint8).reshape(-1, 4), axis=1, bitorder="little")
        return self._mean(bits[:, :m].astype(np.bool_), (deal.all() for deal in self._deals))

    def of(self, members: Members) -> Searched:
        """The given sets."""
        return self._mean(members, (deal.of(members) for deal in self._deals))

    def _mean(self, members: Members, found: Iterable[_core.FoldErrors]) -> Searched:
        error, standard_error = np.zeros(len(members)), np.zeros(len(members))
        for one in found:
            error += np.asarray(one.mean) / len(self._deals)
            standard_error += np.asarray(one.standard_error) / len(self._deals)  # of one deal: deals share their data
        return Searched(members, error, standard_error)


def stepwise(sets: Sets) -> Searched:
    """The sets met while the best single step, to add or drop one, is taken until none helps; from none, from all."""
    m = sets.column_count
    met: dict[bytes, tuple[Members, float, float]] = {}

    def errors(members: Members) -> FloatArray:
        found = sets.of(members)
        for one, error, standard_error in zip(members, found.error, found.standard_error, strict=True):
            met[one.tobytes()] = one, float(error), float(standard_error)
        return found.error

    for start in (np.zeros(m, dtype=np.bool_), np.ones(m, dtype=np.bool_)):
        here, error = start, float(errors(start[None])[0])
        while m > 0:
            steps = here ^ np.eye(m, dtype=np.bool_)
            found = errors(steps)
            tied = np.flatnonzero(found <= found.min() * (1 + TIE))
            best = tied[np.argmin(steps[tied].sum(axis=1))]
            better = found[best] < error * (1 - TIE)
            smaller = found[best] <= error * (1 + TIE) and steps[best].sum() < here.sum()
            if not (better or smaller):
                break
            here, error = steps[best], float(found[best])
    members, mean, spread = zip(*met.values(), strict=True)
    return Searched(np.array(members), np.array(mean), np.array(spread))


def shortlist(searched: Searched, count: int, *, one_standard_error: bool = False) -> list[int]:
    """Indices of the sets worth a nonlinear fit, at most `count`: the best, of those that tie the smallest alone.

    With `one_standard_error` the best and then the smallest sets whose error is within its standard error.
    """
    size = searched.members.sum(axis=1)
    order = np.argsort(searched.error, kind="stable")
    error = searched.error[order]
    out: list[int] = []
    at = 0
    while at < len(order) and len(out) < (1 if one_standard_error else count):
        end = int(np.searchsorted(error, error[at] * (1 + TIE), side="right"))
        tied = np.sort(order[at:end])
        out.append(int(tied[np.argmin(size[tied])]))
        at = end
    if one_standard_error:
        limit = (searched.error[out[0]] + searched.standard_error[out[0]]) * (1 + TIE)
        within = np.flatnonzero(searched.error <= limit)
        smallest = within[np.lexsort((within, searched.error[within], size[within]))]
        out += [int(s) for s in smallest[:count] if s != out[0]][: count - 1]
    return out
