# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Mislabelled columns: a payload in pounds, shifted by a row, or with exchanged labels.

A payload that is wrong makes causes: a mass, a compliance that bends, a drift. So where a set of names leaves something
or needs more than plain compliances, other readings of the column are fitted beside these. Directions of approach that
are a row late hide a backlash altogether, so those of the rows beside are always tried. One is believed where it does
the work of all that was named, with odds of 1 : 22 000, and leaves less than half of what else remains.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.hypothesis import SLOW, Hypothesis
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.effects.entries import traits_of
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.last_moves import last_moves
from fastcal.measurements.observations import without_measured
from fastcal.units import from_si, to_si

_POUND = to_si(0.45359237, "kg")
_SAME = 0.01  # of a load: within it two are one
_LOADS, _MOST_LOAD = 13, 1.5  # that rows of a doubtful label may carry instead, up to so many times the largest


@dataclass(frozen=True, eq=False)
class Reading:
    """Another reading of a column.

    Attributes:
        words: What does not fit and what does, as a sentence without its capital and full stop.
        payload: (N,) that fits [kg]; None: it is believed, or not known in the rows `without`.
        approach: (N, n) that fits; None: it is believed.
        without: Rows that no fit should hold.
    """

    words: str
    payload: FloatArray | None = None
    approach: FloatArray | None = None
    without: NDArray[np.intp] | None = None

    def of(self, data: Dataset) -> Dataset:
        """The rows as they are read so."""
        data = data if self.payload is None else replace(data, payload=self.payload)
        if self.approach is not None:
            data = replace(data, approach=self.approach, move=last_moves(data.q, self.approach))
        return data if self.without is None else without_measured(data, self.without)


def may_be_wrong(data: Dataset) -> bool:
    """Do the rows differ in a column that could be read otherwise?"""
    return bool(np.ptp(data.payload) > 0) or data.approach is not None


def suspected(search: Search, best: SearchNode) -> Reading | None:
    """The reading of a column that does the work of what was named; None: the columns are believed."""
    return _suspected_payload(search, best) or _suspected_approach(search, best)


def _suspected_payload(search: Search, best: SearchNode) -> Reading | None:
    data = search.problem.data
    if not data.payload.any() or not _asks(best):
        return None
    plain = _plain(search, best)
    if plain is None:
        return None
    return _better(search, best, plain, _readings(data)) or _labels(plain, best)


def _suspected_approach(search: Search, best: SearchNode) -> Reading | None:
    """The directions of another row, with which joints have play that have none with those of their own."""
    approach = search.problem.data.approach
    plays = {name.owner: name for name in search.problem.names if _turns_with_approach(name)}
    if approach is None or not plays:
        return None
    readings = [
        Reading(f"the approach columns do not fit these rows: {words}", approach=shifted)
        for words, shifted in (
            ("those of the row before do", np.vstack([approach[:1], approach[:-1]])),
            ("those of the row behind do", np.vstack([approach[1:], approach[-1:]])),
        )
    ]
    return _better(search, best, search.state(list(plays.values()), search.start), readings)


def _turns_with_approach(name: Hypothesis) -> bool:
    sources = name.traits.depends_on
    return not name.variant and bool(sources) and all(source.startswith("approach") for source in sources)


def _better(search: Search, best: SearchNode, plain: SearchNode, readings: Iterable[Reading]) -> Reading | None:
    """The reading with which the plain names do the work of the best set; None: none does."""
    problem = search.problem
    found = [
        (reading, fit(replace(problem, data=reading.of(problem.data)), plain.names, plain.fit)) for reading in readings
    ]
    enough = min(best.bic, plain.bic) - rules.SLOW_MOTION_BIC
    better = [(_bic(one, plain), reading) for reading, one in found if _leaves_half(one, plain.fit)]
    value, reading = min(better, key=lambda pair: pair[0], default=(np.inf, None))
    return reading if value < enough else None


def _asks(best: SearchNode) -> bool:
    """Does a set leave something, or need what a wrong payload makes?"""
    return not best.suffices or any(
        name.traits.place == "payload" or name.traits.generalizes or not SLOW.isdisjoint(name.traits.depends_on)
        for name in best.names
    )


def _plain(search: Search, best: SearchNode) -> SearchNode | None:
    """The set of all joints that yield; None where none does."""
    yielding = search.yielding_joints()
    if yielding:
        return yielding[0]
    found = search.start.blocks
    single = [
        name
        for name in found.names
        if traits_of(name.effect).depends_on == ("torque",)
        and not name.traits.generalizes
        and any(n.owner == name.owner and {"torque", "load"} & set(n.traits.depends_on) for n in best.names)
    ]
    return search.state(single, search.start) if single else None


def _readings(data: Dataset) -> Iterator[Reading]:
    """What the payload may be instead."""
    load = data.payload

    def read(words: str, values: FloatArray) -> Reading:
        return Reading(f"the payload column does not fit these rows: {words}", values)

    place = np.arange(len(load)) if data.time is None else data.time
    gone = (place - place.min()) / max(float(np.ptp(place)), 1e-300)
    for share in rules.LOAD_FALLS:
        yield read(f"a load that falls by {share:.0%} from the first row to the last does", load * (1 - share * gone))
    if np.ptp(load) == 0:
        return
    yield read("read as pounds it does", load * _POUND)
    yield read("that of the row before fits", np.r_[load[:1], load[:-1]])
    yield read("that of the row behind fits", np.r_[load[1:], load[-1:]])
    levels = np.unique(load)
    in_pounds = [x for x in levels if x > 0 and (np.abs(x * _POUND - levels) < _SAME * x * _POUND).any()]
    if in_pounds:
        rows = np.flatnonzero(np.isin(load, in_pounds))
        first = ", ".join(map(str, rows[:3]))
        values = np.where(np.isin(load, in_pounds), load * _POUND, load)
        yield read(f"rows {first} ..., with {' and '.join(map(_kg, in_pounds))} kg, fit as pounds", values)
    if len(levels) <= rules.MAX_PAYLOADS:
        for one, other in combinations(levels, 2):
            values = np.where(load == one, other, np.where(load == other, one, load))
            yield read(f"with {_kg(one)} and {_kg(other)} kg exchanged it does", values)


def _kg(load: float) -> str:
    return f"{from_si(float(load), 'kg'):.4g}"


def _bic(found: Fit, plain: SearchNode) -> float:
    return float(found.remaining + plain.bic - plain.fit.remaining)


def _leaves_half(found: Fit, plain: Fit) -> bool:
    """And nothing beyond what noise may leave."""
    beyond = found.remaining - found.freedom
    return found.converged and beyond < min(rules.READING_SHARE * (plain.remaining - plain.freedom), _noise_of(found))


def _labels(plain: SearchNode, best: SearchNode) -> Reading | None:
    """Rows of one payload that do not carry it, such as a column that is 0 in every second row.

    The others must be fitted by themselves, down to the noise and better than what was named fits all, and their model
    must miss these rows by more than it is unsure of them, but not with another load in each. Where that is so of
    several payloads, what is missing merely grows with them.
    """
    at = plain.fit
    problem, data = at.problem, at.problem.data
    levels = np.unique(data.payload)
    found: list[Reading] = []
    by_names = min(one.remaining / one.freedom for one in (at, best.fit))
    for level in levels if len(levels) <= rules.MAX_PAYLOADS else ():
        among = data.payload == level
        least = min(among.mean(), 1 - among.mean())
        if least <= rules.MIN_PAYLOAD_SHARE or not np.ptp(data.payload[~among]) > 0:
            continue
        rest = fit(problem.with_rows(problem.used & ~among), plain.names, at)
        own = rest.remaining / rest.freedom
        is_all = rest.remaining - rest.freedom < _noise_of(rest)
        is_clear = rest.converged and is_all and own < rules.CLEARLY_LESS * by_names and _misses(rest, among, own)
        if is_clear and _carry_another(rest, among):
            rows = np.flatnonzero(among)
            first = ", ".join(map(str, rows[:3]))
            words = f"the payload column does not fit rows {first} ..., which have {_kg(level)} kg"
            found.append(Reading(f"{words}: these {len(rows)} rows are left out", without=rows))
    return found[0] if len(found) == 1 else None


def _carry_another(rest: Fit, among: NDArray[np.bool_]) -> bool:
    """Does another load in each of the rows (N,), from none to more than any, take away half of the misfit?

    What bends with the load and is not in the model misses the rows of the largest as well: there no load fits.
    """
    every = rest.on_every_row
    problem = every.problem
    there = problem.rows[every.near.row]

    def missed(load: FloatArray) -> FloatArray:
        read = replace(problem, data=replace(problem.data, payload=load))
        model, samples = read.model(every.entries, read.kept)
        r = read.linearized(model, samples, every.theta, columns=False).r / read.noise.factor
        return np.asarray(np.bincount(there, r**2, len(among))[among], dtype=np.float64)

    load = problem.data.payload
    as_labelled = missed(load)
    least = as_labelled
    for other in np.linspace(0, _MOST_LOAD * load.max(), _LOADS):
        least = np.minimum(least, missed(np.where(among, other, load)))
    numbers = np.bincount(there, minlength=len(among))[among]
    return bool(np.sum(least - numbers) < rules.READING_SHARE * np.sum(as_labelled - numbers))


def _noise_of(found: Fit) -> float:
    """What noise may leave beyond the degrees of freedom, in chi square."""
    return rules.READING_DEVIATIONS * float(np.sqrt(2 * found.freedom))


def _misses(rest: Fit, among: NDArray[np.bool_], own: float) -> bool:
    """Are other rows (N,) clearly further off a fit than noise, `own` of a number, and its covariance make them?"""
    every = rest.on_every_row
    here = among[every.problem.rows[every.near.row]]
    missed = float(np.mean((every.near.r[here] / every.problem.noise.factor) ** 2))
    J = every.near.J[here][:, rest.free] / every.problem.noise.factor
    expected = own * (1 + float(np.mean(np.sum((J @ rest.covariance) * J, axis=1))))
    return rules.CLEARLY_LESS * missed > expected
