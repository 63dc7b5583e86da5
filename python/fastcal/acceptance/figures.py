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
from numpy.typing import NDArray

from fastcal.acceptance.visits import Campaign, cycle_of
from fastcal.calibration.repeatability import ENOUGH_VISITS, accuracy, blocks_of_visits, distance_figures, spread

FloatArray = NDArray[np.float64]
OfMeans = Callable[[FloatArray], FloatArray]  # (..., K, 3) -> (...,)

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Figure:
    """One figure.

    Attributes:
        symbol: AP, RP, vAP, AD, RD, dAP, dRP; with a subscript: AP_x, AP_rx ... about the tool's x.
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
                    f"RP_r{name}", found.stations[k].pose, lambda t: float(3 * t.std(ddof=1)),
                    found.turn_errors(k)[:, axis], "rad",
                )
                for k in enough
            ]  # fmt: skip
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


def _distances(found: Campaign, means: FloatArray, enough: list[int]) -> list[Figure]:
    """AD and RD between P2 and P4 where both are, as the standard has it, else between poses that follow each other."""
    at = {found.stations[k].pose: k for k in enough}
    pairs = [(at["P2"], at["P4"])] if {"P2", "P4"} <= at.keys() else list(pairwise(enough))
    out = []
    for a, b in pairs:
        name = f"{found.stations[a].pose}\N{EN DASH}{found.stations[b].pose}"
        apart = found.stations[a].commanded[:3, 3] - found.stations[b].commanded[:3, 3]

        def of(e: FloatArray, a: int = a, b: int = b, apart: FloatArray = apart) -> FloatArray:
            between = np.linalg.norm(apart + e[..., a, :] - e[..., b, :], axis=-1)
            return np.asarray(between - np.linalg.norm(apart))

        count = min(len(found.stations[a].rows), len(found.stations[b].rows))
        between = found.points[found.stations[a].rows[:count]] - found.points[found.stations[b].rows[:count]]
        mean_distance, _ = distance_figures(between, apart)
        out.append(Figure("AD", name, "m", mean_distance, of))
        out.append(_of_spread("RD", name, lambda x, apart=apart: distance_figures(x, apart)[1], between))  # type: ignore[misc]
    return out


def _directions(found: Campaign, means: FloatArray) -> list[Figure]:
    """VAP of the poses that were approached from several sides."""
    sides: dict[str, list[int]] = {}
    for k, station in enumerate(found.stations):
        if station.direction:
            sides.setdefault(station.pose, []).append(k)
    out = []
    for pose, places in sides.items():
        if len(places) > 1:

            def of(e: FloatArray, places: Sequence[int] = tuple(places)) -> FloatArray:
                apart = e[..., places, np.newaxis, :] - e[..., np.newaxis, places, :]
                return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=(-1, -2)))

            out.append(_of_means("vAP", pose, "m", means, of))
    return out


def _drift(found: Campaign, k: int) -> list[Figure]:
    """DAP and dRP: the largest change of AP and RP from the first block of visits to a later one."""
    blocks = [
        found.points[rows] - found.stations[k].commanded[:3, 3]
        for rows in blocks_of_visits(found.data.time, found.stations[k].rows)
    ]
    out = []
    for symbol, of in (("dAP", accuracy), ("dRP", spread)):
        if len(blocks) > 1:
            changes = [abs(of(block) - of(blocks[0])) for block in blocks]
            last = int(np.argmax(changes))
            ends = [jackknife(of, blocks[0]), jackknife(of, blocks[last])]
            freedom = min(len(blocks[0]), len(blocks[last])) - 1
            pose = found.stations[k].pose
            out.append(Figure(symbol, pose, "m", changes[last], None, math.hypot(*ends), freedom))
    return out


def _of_spread(
    symbol: str, where: str, of: Callable[[FloatArray], float], visits: FloatArray, unit: str = "m"
) -> Figure:
    return Figure(symbol, where, unit, of(visits), None, jackknife(of, visits), len(visits) - 1)


def jackknife(of: Callable[[FloatArray], float], visits: FloatArray) -> float:
    """Standard uncertainty of a statistic of visits (n, ...)."""
    n = len(visits)
    left = np.array([of(np.delete(visits, j, axis=0)) for j in range(n)])
    return float(np.sqrt((n - 1) / n * np.sum((left - left.mean()) ** 2)))
