# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Generic blocks: "something at joint 4 that depends on q4". They localize an error that no effect explains.

A block is a motion of one frame (or of the measured point itself) times smooth functions of what varies from row to
row, orthonormal over the rows. In finite terms they are the orthogonal, embedded Gaussian process of Plumlee (2017).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, islice, product
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from fastcal.arrays import FloatArray, thin_svd
from fastcal.calibration.parallel import each
from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import BlockLabel
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_position

# Fourier orders of a curve over a turn, and degree of a curve over a load.
CURVE_ORDERS = 6
# Degrees of curves over temperature, and over any other condition (an own column, the payload).
TEMPERATURE_DEGREE = 3
CONDITION_DEGREE = 2
# Links that carry nearly all of an arm's weight, the longest: where they reach, a base that yields leans to.
LONG_LINKS = 2
# Degree of a smooth field over the workspace.
FIELD_DEGREE = 3
# Orders of an instrument's circles, and degree of its range.
CIRCLE_ORDERS = 2
RANGE_DEGREE = 2
# Distance from the instrument's own axis below which a point has no azimuth [of the farthest].
MIN_AXIS_DISTANCE = 1e-2
# Singular value below which a combination of curves is none of its own over these rows [of the largest].
MIN_CURVE_VALUE = 1e-2
_ROUNDING = 1e-9  # of the largest load of any joint: what is left where a load cancels, about an upright axis


@dataclass(frozen=True, eq=False)
class Curves:
    """Smooth functions over the rows.

    Attributes:
        depends_on: What they are functions of, as a person names it: "q4", "torque", "time_s".
        values: (N, k), columns of mean square 1.
    """

    depends_on: tuple[str, ...]
    values: FloatArray

    @property
    def count(self) -> int:
        """Of functions."""
        return int(self.values.shape[1])


@dataclass(frozen=True, eq=False)
class Generic:
    """One block: `owner` moves along `frame_columns` by `curves`.

    Attributes:
        owner: "joint4", "base", "tool", "workspace".
        curves: Over the rows.
    """

    owner: str
    curves: Curves

    @property
    def label(self) -> BlockLabel:
        """As it is written and spoken of."""
        return BlockLabel(self.owner, self.curves.depends_on)

    def __repr__(self) -> str:
        return str(self.label)


def orthonormal(values: FloatArray) -> FloatArray:
    """(N, k) an orthonormal basis, times root N, of the columns (N, p) and without their mean; column by column."""
    centred = values - values.mean(axis=0)
    length = np.linalg.norm(centred, axis=0)
    kept = length > 1e-9 * np.sqrt(len(values)) * np.maximum(np.abs(values).max(axis=0), 1e-300)
    if not kept.any():
        return np.zeros((len(values), 0))
    U, s, _ = thin_svd(centred[:, kept] / length[kept])
    return np.asfortranarray(U[:, s > MIN_CURVE_VALUE * s[0]] * np.sqrt(len(values)))


def _unit(x: FloatArray) -> FloatArray:
    """X scaled to -1 ... 1."""
    low, high = float(x.min()), float(x.max())
    return np.zeros_like(x) if high <= low else (2 * x - low - high) / (high - low)


def polynomials(x: FloatArray, degree: int) -> FloatArray:
    """Legendre polynomials 1 ... degree of x over its range."""
    return np.asarray(legendre.legvander(_unit(x), degree)[:, 1:])


def waves(q: FloatArray, orders: int) -> FloatArray:
    """The straight line and sin, cos of orders 1 ... of an angle."""
    n = np.arange(1, orders + 1)
    return np.column_stack([q, np.sin(np.outer(q, n)), np.cos(np.outer(q, n))])


Known = dict[tuple[str, ...], Curves]


class _Wanted(NamedTuple):
    """Curves before they are worked out: orthonormal ones of `values`."""

    depends_on: tuple[str, ...]
    values: Callable[[], FloatArray]
    of_load: bool = False  # those are of one joint at one fit

    def made(self) -> Curves:
        """Worked out."""
        return Curves(self.depends_on, orthonormal(self.values()))


def _made(wanted: Sequence[_Wanted], known: Known) -> list[Curves]:
    """The curves, side by side; those that no load enters are taken from `known` or put there."""
    missing = {one.depends_on: one for one in wanted if not one.of_load and one.depends_on not in known}
    new = iter(each(_Wanted.made, [*missing.values(), *(one for one in wanted if one.of_load)]))
    known.update(zip(missing, islice(new, len(missing)), strict=True))
    return [next(new) if one.of_load else known[one.depends_on] for one in wanted]


def joint_curves(
    data: Dataset, loads: FloatArray, turns: Mapping[int, bool], known: Known | None = None
) -> list[list[Curves]]:
    """What the error of each joint may depend on: its position, its load, time, temperature, two positions at once.

    Args:
        data: The rows (N).
        loads: (N, n) about or along the joints' axes.
        turns: Of each joint, from 0, that moves the tool, whether it is revolute.
        known: Curves over the same rows that no load enters, by what they depend on: what is there is taken.
    """
    pairs = [((a, b), later - sooner <= 2) for (sooner, a), (later, b) in combinations(enumerate(turns), 2)]
    wanted = [list(_wanted_of_joint(joint, data, loads, turns[joint], pairs)) for joint in turns]
    made = iter(_made([one for of_joint in wanted for one in of_joint], {} if known is None else known))
    return [list(islice(made, len(of_joint))) for of_joint in wanted]


def _wanted_of_joint(
    joint: int, data: Dataset, loads: FloatArray, turns: bool, pairs: Sequence[tuple[tuple[int, int], bool]]
) -> Iterator[_Wanted]:
    """`pairs`: of joints, and whether these are near each other in the arm."""
    q = data.q
    yield _Wanted((joint_position(joint),), partial(_own_curve, q[:, joint], turns))
    load = loads[:, joint] if np.ptp(loads[:, joint]) > _ROUNDING * np.abs(loads).max() else np.zeros(len(loads))
    if load.any():
        yield _Wanted(("torque",), partial(_signed, load), of_load=True)
    yield from _of_conditions(data)
    yield from _of_friction(joint, data, load)
    yield from _of_history(joint, data)
    for (a, b), are_near in pairs:
        if joint in (a, b) or are_near:
            yield _Wanted((joint_position(a), joint_position(b)), partial(_pair, q[:, a], q[:, b]))


def _signed(load: FloatArray) -> FloatArray:
    return np.column_stack([polynomials(load, CURVE_ORDERS), np.sign(load)])


def _own_curve(q: FloatArray, turns: bool) -> FloatArray:
    return waves(q, CURVE_ORDERS) if turns else polynomials(q, 2 * CURVE_ORDERS)


def _column(values: FloatArray, k: int) -> FloatArray:
    """(N, 1) of (N, n)."""
    return values[:, [k]]


def _pair(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, 5) products of two positions, scaled and as they are."""
    return np.column_stack([_unit(a) * _unit(b), *(f(a) * g(b) for f in (np.sin, np.cos) for g in (np.sin, np.cos))])


def _of_conditions(data: Dataset) -> Iterator[_Wanted]:
    """Over what varies beside the pose."""
    for name, values, degree in _conditions(data):
        yield _Wanted((name,), partial(polynomials, values, degree))


def _of_friction(joint: int, data: Dataset, load: FloatArray) -> Iterator[_Wanted]:
    """What lost motion may depend on: the joint's own approach, that with its load, and its neighbours' approach."""
    approach = data.approach
    if approach is None:
        return
    own = partial(_column, approach, joint)
    yield _Wanted((f"approach{joint + 1}",), own)
    if load.any():
        loaded = _scaled_to_one(np.column_stack([np.abs(load), load]))
        yield _Wanted((f"approach{joint + 1}", "torque"), lambda: own() * loaded, of_load=True)
    for other in (joint - 1, joint + 1):
        if 0 <= other < data.q.shape[1]:
            yield _Wanted((f"approach{other + 1}",), partial(_column, approach, other))


def _of_history(joint: int, data: Dataset) -> Iterator[_Wanted]:
    """The joint's last move, its way and its length, where the rows have times and so an order."""
    if data.time is None:
        return
    order = np.argsort(data.time, kind="stable")
    moved = np.zeros(len(data))
    moved[order[1:]] = np.diff(data.q[order, joint])
    yield _Wanted((f"last move of joint {joint + 1}",), lambda: np.column_stack([np.sign(moved), moved]))


def _scaled_to_one(x: FloatArray) -> FloatArray:
    """Columns (N, k) over their largest number."""
    largest = np.abs(x).max(axis=0)
    return np.asarray(x / np.where(largest > 0, largest, 1.0))


def tool_curves(turned: FloatArray, name: str) -> Curves:
    """A direction as the tool sees it (N, 3): a target or its holder that gives by how it is held or looked at."""
    return Curves((name,), orthonormal(turned))


def sight_curves(point: FloatArray) -> Iterator[tuple[Curves, FloatArray]]:
    """What an instrument at the origin may show wrong, and the way (N, 3) in which each moves the point (N, 3).

    Eccentric circles of azimuth and elevation, and a range with a scale and an offset: curves of each over the place,
    along the directions in which azimuth, elevation and range grow. Rigid motions of the whole field are geometry's.
    """
    x, y, z = point.T
    flat, distance = np.hypot(x, y), np.linalg.norm(point, axis=1)
    if flat.min() < MIN_AXIS_DISTANCE * flat.max():
        return
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, flat)
    around = np.column_stack([-y, x, np.zeros_like(x)])
    up = np.column_stack([-x * z / flat, -y * z / flat, flat])
    yield Curves(("azimuth",), _circles(azimuth)), around
    yield Curves(("elevation",), _circles(elevation)), up
    yield Curves(("range",), orthonormal(polynomials(distance, RANGE_DEGREE))), point / distance[:, np.newaxis]


def _circles(angle: FloatArray) -> FloatArray:
    n = np.arange(1, CIRCLE_ORDERS + 1)
    return orthonormal(np.column_stack([np.sin(np.outer(angle, n)), np.cos(np.outer(angle, n))]))


def frame_curves(data: Dataset, known: Known | None = None) -> Iterator[Curves]:
    """What a motion of base or tool may depend on; `known` as in `joint_curves`."""
    yield from _made(list(_of_conditions(data)), {} if known is None else known)
    for name, labels in (("station", data.station), ("mount", data.mount)):
        if labels is not None:
            yield Curves((name,), orthonormal((labels[:, np.newaxis] == np.unique(labels)).astype(float)))
    if np.ptp(data.payload) > 0:
        yield Curves(("payload_kg",), orthonormal(polynomials(data.payload, CONDITION_DEGREE)))


def lean_curves(
    across: FloatArray, q: FloatArray, places: Callable[[], FloatArray], known: Known | None = None
) -> Iterator[Curves]:
    """What a lean of base or pedestal may depend on: where the arm's weight hangs, whatever its links weigh.

    The moment of a link on the base is linear in the place of its centre across gravity, and nearly all of an arm's
    weight hangs on its long links. How the first two joints stand says less of it and more of all else.

    Args:
        across: (2, 3) directions across gravity.
        q: (N, n).
        places: Gives (N, frames, 3) origins of the chain's frames [m], in the frame of `across`.
        known: As in `joint_curves`.
    """
    known = {} if known is None else known

    def reach() -> FloatArray:
        links = np.diff(places(), axis=1) @ across.T
        span = np.linalg.norm(np.ptp(links, axis=0), axis=1)
        longest = np.argsort(-span, kind="stable")[:LONG_LINKS]
        return links[:, longest].reshape(len(links), -1)

    [kept] = _made([_Wanted((" reach",), reach)], known)  # a column of the data may be called "reach"
    yield replace(kept, depends_on=("reach",))
    if q.shape[1] > 1:
        yield from _made([_Wanted(("q1", "q2"), partial(_pair, q[:, 0], q[:, 1]))], known)


def field_curves(point: FloatArray) -> Curves:
    """Polynomials of degree 2 ... FIELD_DEGREE in the place (N, 3): a smooth field, less its rigid part."""
    x, y, z = (_unit(point[:, k]) for k in range(3))
    powers = [(i, j, k) for i, j, k in product(range(FIELD_DEGREE + 1), repeat=3) if 2 <= i + j + k <= FIELD_DEGREE]
    return Curves(("x", "y", "z"), orthonormal(np.column_stack([x**i * y**j * z**k for i, j, k in powers])))


def _conditions(data: Dataset) -> Iterator[tuple[str, FloatArray, int]]:
    """Name, values and degree of what varies beside the pose."""
    for name, values, degree in (
        ("time_s", data.time, rules.TIME_DEGREE),
        ("temperature_c", data.temperature, TEMPERATURE_DEGREE),
    ):
        if values is not None and np.ptp(values) > 0:
            yield name, np.asarray(values), degree
    for name, values in data.sensors.items():
        if np.isfinite(values).all() and np.ptp(values) > 0:
            yield name, values, CONDITION_DEGREE
