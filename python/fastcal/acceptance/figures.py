# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The figures of ISO 9283:1998 of a campaign, each with how its own visits scatter.

Figures of means are functions f of the errors e (K, 3) of all stations' mean points, or of their mean turns; their
uncertainty follows from that of e by the gradient of f. Figures of spread (RP, RD) and of drift have one of their own,
by the jackknife: u^2 = (n - 1) / n sum (f_(j) - mean f_(.))^2, f_(j) without the j-th visit (Efron and Stein 1981).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fastcal.acceptance.visits import Campaign, cycle_of
from fastcal.arrays import FloatArray
from fastcal.calibration.repeatability import ENOUGH_VISITS, accuracy, blocks_of_visits, distance_figures, spread

OfMeans = Callable[[FloatArray], FloatArray]  # (..., K, 3) -> (...,)

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Figure:
    """One figure.

    Attributes:
        symbol: AP, RP, vAP, AD, RD, dAP, dRP; with a subscript: AP_x along the base's x, AP_rx about the tool's x.
        where: The pose or poses.
        unit: m or rad.
        value: What was found.
        of_means: Its function of the mean errors; None for a figure of spread.
        spread: Its standard uncertainty by the jackknife, and `freedom` its degrees of freedom, where of_means is None.
    """

    symbol: str
    where: str
    unit: str
    value: float
    of_means: OfMeans | None = None
    spread: float = 0.0
    freedom: float = np.inf


def figures_of(found: Campaign) -> list[Figure]:
    """All figures that the visits show."""
    cycle = cycle_of(found.stations)
    enough = [k for k in cycle if len(found.stations[k].rows) >= ENOUGH_VISITS]
    means = np.array([found.errors(k).mean(axis=0) for k in range(len(found.stations))])
    out = [figure for k in cycle for figure in _accuracy(found, means, k)]
    out += [_of_spread("RP", found.stations[k].pose, spread, found.errors(k)) for k in enough]
    out += _distances(found, means, enough)
    out += _directions(found, means)
    if found.turns is not None:
        turned = np.array([found.turn_errors(k).mean(axis=0) for k in range(len(found.stations))])
        for axis, name in enumerate(AXES):
            out += [_of_means(f"AP_r{name}", found.stations[k].pose, "rad", turned, _component(k, axis)) for k in cycle]
            out += [
                _of_spread(
                    f"RP_r{name}", found.stations[k].pose, three_deviations, found.turn_errors(k)[:, axis], "rad"
                )
                for k in enough
            ]
            out += _turned_distances(found, turned, enough, axis)
            out += _turned_directions(found, turned, axis)
            out += [figure for k in enough for figure in _turned_drift(found, k, axis)]
    for k in enough:
        out += _drift(found, k)
    return out


def _of_means(symbol: str, where: str, unit: str, means: FloatArray, of: OfMeans) -> Figure:
    return Figure(symbol, where, unit, float(of(means)), of)


def _component(k: int, axis: int) -> OfMeans:
    return lambda e: np.asarray(e[..., k, axis])


def _accuracy(found: Campaign, means: FloatArray, k: int) -> list[Figure]:
    """AP and its parts along the base's axes."""
    pose = found.stations[k].pose
    out = [_of_means("AP", pose, "m", means, lambda e: np.linalg.norm(e[..., k, :], axis=-1))]
    return out + [_of_means(f"AP_{name}", pose, "m", means, _component(k, i)) for i, name in enumerate(AXES)]


def three_deviations(values: FloatArray) -> float:
    """3 S of (n,) values, S with n - 1."""
    return float(3 * values.std(ddof=1))


def _pairs(found: Campaign, enough: list[int]) -> list[tuple[str, int, int]]:
    """P2 and P4 where both are, as the standard has it, else poses that follow each other: name and stations."""
    at = {found.stations[k].pose: k for k in enough}
    pairs = [(at["P2"], at["P4"])] if {"P2", "P4"} <= at.keys() else list(pairwise(enough))
    return [(f"{found.stations[a].pose}\N{EN DASH}{found.stations[b].pose}", a, b) for a, b in pairs]


def _distances(found: Campaign, means: FloatArray, enough: list[int]) -> list[Figure]:
    """AD and RD, and along the base's axes: the distance there, from the lower to the higher commanded coordinate."""
    out = []
    for name, a, b in _pairs(found, enough):
        apart = found.stations[a].commanded[:3, 3] - found.stations[b].commanded[:3, 3]

        def of(e: FloatArray, a: int = a, b: int = b, apart: FloatArray = apart) -> FloatArray:
            between = np.linalg.norm(apart + e[..., a, :] - e[..., b, :], axis=-1)
            return np.asarray(between - np.linalg.norm(apart))

        count = min(len(found.stations[a].rows), len(found.stations[b].rows))
        between = found.points[found.stations[a].rows[:count]] - found.points[found.stations[b].rows[:count]]
        mean_distance, _ = distance_figures(between, apart)
        out.append(Figure("AD", name, "m", mean_distance, of))
        out.append(_of_spread("RD", name, lambda x, apart=apart: distance_figures(x, apart)[1], between))  # type: ignore[misc]
        for i, axis in enumerate(AXES):
            sign = -1.0 if apart[i] < 0 else 1.0
            out.append(_of_means(f"AD_{axis}", name, "m", means, _difference(a, b, i, sign)))
            out.append(_of_spread(f"RD_{axis}", name, three_deviations, between[:, i]))
    return out


def _difference(a: int, b: int, axis: int, sign: float = 1.0) -> OfMeans:
    return lambda e: np.asarray(sign * (e[..., a, axis] - e[..., b, axis]))


def _turned_distances(found: Campaign, turned: FloatArray, enough: list[int], axis: int) -> list[Figure]:
    """AD and RD of the turn about one axis of the tool, the first pose less the second."""
    out = []
    for name, a, b in _pairs(found, enough):
        count = min(len(found.stations[a].rows), len(found.stations[b].rows))
        between = found.turn_errors(a)[:count, axis] - found.turn_errors(b)[:count, axis]
        out.append(_of_means(f"AD_r{AXES[axis]}", name, "rad", turned, _difference(a, b, axis)))
        out.append(_of_spread(f"RD_r{AXES[axis]}", name, three_deviations, between, "rad"))
    return out


def _directions(found: Campaign, means: FloatArray) -> list[Figure]:
    """VAP of the poses that were approached from several sides."""
    out = []
    for pose, places in _sides(found).items():

        def of(e: FloatArray, places: Sequence[int] = tuple(places)) -> FloatArray:
            apart = e[..., places, np.newaxis, :] - e[..., np.newaxis, places, :]
            return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=(-1, -2)))

        out.append(_of_means("vAP", pose, "m", means, of))
    return out


def _sides(found: Campaign) -> dict[str, list[int]]:
    """The stations of each pose that was approached from several sides."""
    sides: dict[str, list[int]] = {}
    for k, station in enumerate(found.stations):
        if station.direction:
            sides.setdefault(station.pose, []).append(k)
    return {pose: places for pose, places in sides.items() if len(places) > 1}


def _turned_directions(found: Campaign, turned: FloatArray, axis: int) -> list[Figure]:
    """VAP of the turn about one axis of the tool."""
    out = []
    for pose, places in _sides(found).items():

        def of(e: FloatArray, places: Sequence[int] = tuple(places)) -> FloatArray:
            return np.asarray(np.ptp(e[..., places, axis], axis=-1))

        out.append(_of_means(f"vAP_r{AXES[axis]}", pose, "rad", turned, of))
    return out


def _drift(found: Campaign, k: int) -> list[Figure]:
    """DAP and dRP: the largest change of AP and RP from the first block of visits to a later one."""
    errors = found.points - found.stations[k].commanded[:3, 3]
    return _changes(found, k, errors, (("dAP", accuracy), ("dRP", spread)), "m")


def _turned_drift(found: Campaign, k: int, axis: int) -> list[Figure]:
    """The same of the turn about one axis of the tool."""
    turns = np.full(len(found.points), np.nan)
    turns[found.stations[k].rows] = found.turn_errors(k)[:, axis]
    of = ((f"dAP_r{AXES[axis]}", lambda t: float(t.mean())), (f"dRP_r{AXES[axis]}", three_deviations))
    return _changes(found, k, turns, of, "rad")


def _changes(
    found: Campaign,
    k: int,
    errors: FloatArray,
    of_block: Sequence[tuple[str, Callable[[FloatArray], float]]],
    unit: str,
) -> list[Figure]:
    """The largest change of statistics of the errors (N, ...) of all rows over the blocks of a station's visits."""
    blocks = [errors[rows] for rows in blocks_of_visits(found.data.time, found.stations[k].rows)]
    out = []
    for symbol, of in of_block:
        if len(blocks) > 1:
            changes = [abs(of(block) - of(blocks[0])) for block in blocks]
            last = int(np.argmax(changes))
            ends = [float(jackknife(of, blocks[0])), float(jackknife(of, blocks[last]))]
            freedom = min(len(blocks[0]), len(blocks[last])) - 1
            pose = found.stations[k].pose
            out.append(Figure(symbol, pose, unit, changes[last], None, math.hypot(*ends), freedom))
    return out


def _of_spread(
    symbol: str, where: str, of: Callable[[FloatArray], float], visits: FloatArray, unit: str = "m"
) -> Figure:
    return Figure(symbol, where, unit, of(visits), None, float(jackknife(of, visits)), len(visits) - 1)


def jackknife(of: Callable[[FloatArray], float | FloatArray], visits: FloatArray) -> FloatArray:
    """Standard uncertainty of a statistic of visits (n, ...), or (...) of several."""
    n = len(visits)
    left = np.array([of(np.delete(visits, j, axis=0)) for j in range(n)])
    return np.asarray(np.sqrt((n - 1) / n * np.sum((left - left.mean(axis=0)) ** 2, axis=0)))
