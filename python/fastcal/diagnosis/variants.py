# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The variants of an effect that are tried: orders of waves, moments and places of steps, lags, corners, other laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.options_from_data import with_origins
from fastcal.diagnosis import rules
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.effects.entries import build_effects, label, position_option, traits_of
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import build_samples, condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.place import place_of, source_of
from fastcal.robot.robot import Robot, Spec
from fastcal.units import from_si

# Moments of a step that are tried before the best is searched for.
STEP_MOMENTS = 24
# Waves of an instrument's range over the distances that were measured, at most.
RANGE_CYCLES = 60.0
_SMALL = (0.005, 0.02, 0.06)  # of the largest load of a joint
_NO_LOAD = 1e-9  # [N m or N] rounding about an upright axis


def scanned(effect: str, owner: str, robot: Robot, data: Dataset) -> list[Hypothesis]:
    """The grid of an effect that a scan looks for; empty where the data lack what it reads."""
    bare: Spec = {"effect": effect, "owner": owner}
    try:
        return list(VARIANTS[traits_of(effect).searched](bare, robot, data))
    except InvalidInput:
        return []


def other_forms(entry: Spec, robot: Robot, data: Dataset) -> list[Hypothesis]:
    """The other laws that an effect states of itself, such as `side=load`, for the owner of an entry.

    Those that the robot can't have and whose columns the data lack are none.
    """
    out = []
    for form in traits_of(entry["effect"]).forms:
        law, _, load = form.partition(":")
        option, _, value = law.partition("=")
        bare = {"effect": entry["effect"], "owner": entry["owner"], option: value}
        try:
            effect = build_effects([bare], robot.core)[0]
            lacking = [c for c in effect.data_columns if getattr(data, c.rstrip("0123456789"), None) is None]
            if lacking or entry.get(option) == value:
                continue
            bare = with_origins(bare, robot, data)
        except InvalidInput:
            continue
        sizes = _loads_met(bare["owner"], robot, data) if load else []
        out += [with_number(bare, load, size, law) for size in sizes] or [Hypothesis(bare, law)]
    return out


def load_of_form(name: Hypothesis) -> tuple[str, str]:
    """(law, option) of a name whose form holds a load that is tried over those met; ("", "") where none does."""
    for form in name.traits.forms:
        law, _, load = form.partition(":")
        if load and load in name.entry:
            return law, load
    return "", ""


def _loads_met(owner: str, robot: Robot, data: Dataset) -> list[float]:
    """Small loads [N m or N] about a joint, by those met; empty where there is none.

    A gap whose flank changes over more of them is a compliance by another name: `grading.other_forms_that_do` asks.
    """
    core, joint = robot.core, place_of(owner).index
    model = _core.ErrorModel(core, [])
    samples = build_samples([], [], core, data.q, condition_columns(data))
    axis = 5 if robot.joint_types[joint] == "revolute" else 2
    size = np.abs(np.asarray(model.loads(samples, model.start))[:, 2 * joint + 1, axis])
    most = float(size.max(initial=0.0))
    return [share * most for share in _SMALL] if most > _NO_LOAD else []


def _corners(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """Places where a compliance may bend; the critical load itself follows from the loads of a fit."""
    for corner in rules.CORNER_QUANTILES:
        yield Hypothesis({**bare, "corner": corner}, f"corner={corner}")


def with_lags(entry: Spec, time: FloatArray) -> Iterator[Hypothesis]:
    """The same with heat that reaches the metal late."""
    for share in rules.LAG_SHARES:
        lag = float(f"{share * np.ptp(time):.4g}")
        if lag > 0:
            yield Hypothesis({**entry, "lag_s": lag}, f"lag_s={lag:g}")


def effect_has_moment(effect: str) -> bool:
    """Is it there from a moment on?"""
    return traits_of(effect).searched == "at_s"


def moment_of(step: Hypothesis) -> float:
    """When a step is [s], or its row."""
    return float(step.entry["at_s" if "at_s" in step.entry else "at_row"])


def _steps(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """Moments over the rows of the data; the search goes on from the best of them to the best between two rows."""
    for at in _places_of_steps(order_of_rows(data), f"{label(bare)} needs more moments"):
        yield from_moment(bare, at, data)


def _places_of_steps(values: FloatArray, too_few: str) -> list[float]:
    """Values between which a step may lie, spread evenly over the rows, enough rows on either side of each."""
    inner = np.unique(values)[rules.MIN_ROWS_BESIDE_STEP : -rules.MIN_ROWS_BESIDE_STEP]
    if len(inner) == 0:
        raise InvalidInput(too_few)
    places = np.unique(np.linspace(0, len(inner) - 1, STEP_MOMENTS).round().astype(int))
    return [float(at) for at in inner[places]]


def order_of_rows(data: Dataset) -> FloatArray:
    """(N,) when each row was measured [s], or its place in the order where no row has a time."""
    if data.time is not None:
        return data.time
    return np.asarray(np.arange(len(data)) if data.row is None else data.row, dtype=np.float64)


def rows_between_steps(steps: Iterable[Hypothesis], data: Dataset) -> NDArray[np.intp]:
    """How many rows were measured between each of some steps and the next, in their order."""
    return np.diff(np.searchsorted(np.sort(order_of_rows(data)), sorted(moment_of(step) for step in steps)))


def from_moment(bare: Spec, at: float, data: Dataset) -> Hypothesis:
    """A step at a time [s], or at a row where no row has one."""
    if data.time is not None:
        return Hypothesis({**bare, "at_s": at}, f"at_s={at:.6g}")
    first, rows = math.ceil(at), int(order_of_rows(data).max()) + 1
    return Hypothesis({**bare, "at_row": float(first), "rows": float(rows)}, f"at_row={first}")


def from_the_beginning(bare: Spec, data: Dataset) -> Hypothesis:
    """A step before all rows: a shift of them."""
    return from_moment(bare, -math.inf if data.time is not None else 0.0, data)


def jumps_with_posture(effect: str) -> bool:
    """Does the position of another joint decide when it jumps?"""
    return traits_of(effect).searched == "at_deg"


def jumps_itself(name: Hypothesis) -> bool:
    """Is it a jump with the joint's own position, and not with another one's?"""
    return jumps_with_posture(name.effect) and source_of(name.owner) == place_of(name.owner)


def _positions(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """Positions of the joint that decides; the search goes on from the best of them to the best between two rows."""
    positions = data.q[:, source_of(bare["owner"]).index]
    for at in _places_of_steps(positions, f"{label(bare)} needs more positions"):
        yield from_position(bare, at, robot)


def from_position(bare: Spec, at: float, robot: Robot) -> Hypothesis:
    """A jump where the joint that decides stands at [rad or m]."""
    option, unit = position_option(robot.joint_types[source_of(bare["owner"]).index])
    number = from_si(at, unit)
    return Hypothesis({**bare, option: number}, f"{option}={number:.5g}")


def _periods(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """Waves over the distance from the instrument, half a resolution apart."""
    if data.position is None:
        raise InvalidInput(f"{label(bare)} needs points")
    distance = np.linalg.norm(data.position, axis=1)
    span = float(np.nanmax(distance) - np.nanmin(distance))
    for cycles in np.arange(1.0, RANGE_CYCLES, 0.5) if span > 0 else ():
        yield with_number(bare, "period_mm", from_si(span / cycles, "mm"))


def _time_constants(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    entry = with_origins(bare, robot, data)
    if data.time is None or not np.ptp(data.time) > 0:
        raise InvalidInput(f"{label(bare)} needs the column time_s")
    for share in rules.SETTLING_SHARES:
        yield with_number(entry, "tau_s", share * float(np.ptp(data.time)))


def _lags(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    """Heat that comes at once, and late."""
    if data.temperature is None or not np.ptp(data.temperature) > 0:
        raise InvalidInput(f"{label(bare)} needs the column temperature_c")
    entry = with_origins(bare, robot, data)
    yield Hypothesis(entry)
    if data.time is not None:
        yield from with_lags(entry, data.time)


def with_number(entry: Spec, option: str, value: float, law: str = "") -> Hypothesis:
    """An entry with what a search finds, four digits of it; `law` is the form that it is a number of."""
    number = float(f"{value:.4g}")
    return Hypothesis({**entry, option: number}, f"{law}{':' * bool(law)}{option}={number:g}")


def _waves(bare: Spec, robot: Robot, data: Dataset) -> Iterator[Hypothesis]:
    return harmonics(bare, robot, data, rules.WAVE_ORDERS)


def harmonics(bare: Spec, robot: Robot, data: Dataset, orders: Collection[float]) -> Iterator[Hypothesis]:
    """A wave of each order of which at least half a period fits into both the joint's limits and the data's range."""
    joint = place_of(bare["owner"]).index
    span = float(np.ptp(data.q[:, joint]))
    for order in orders:
        if order >= 1 and order * span > math.pi:
            entry = {**bare, "order": float(order)}
            try:
                yield Hypothesis(with_origins(entry, robot, data), f"order={order:g}")
            except InvalidInput:
                continue


VARIANTS: dict[str, Callable[[Spec, Robot, Dataset], Iterator[Hypothesis]]] = {
    "order": _waves,
    "at_s": _steps,
    "at_deg": _positions,
    "critical": _corners,
    "lag_s": _lags,
    "period_mm": _periods,
    "tau_s": _time_constants,
}
