# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways in which a controller and a robot file may count joints differently: q' = C q + z, in numbers and in words.

A row of C holds +1 or -1 in the joint's own column where only its sign may differ, in another's where columns were
exchanged, in two where the controller gives sums of neighbours (FANUC's third joint, a parallelogram), and a ratio of
units where a column was read in the wrong one. z are zeros, multiples of a quarter turn or free.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations, permutations, product
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IntArray
from fastcal.place import joint_position
from fastcal.said import said
from fastcal.units import factor, from_si, to_si, unit_names

QUARTER = to_si(90.0, "deg")
NEAR_QUARTER = to_si(2.0, "deg")  # a zero this near to a multiple of 90 deg is meant to be it
SHIFT_COST = 1.25  # of a zero beside a sign: of two readings that fit alike the one with fewer changes is simpler
FREE_COST = 1.75  # of a zero that is no multiple of 90 deg
_CHOICES = 3  # joints of which sign and zero change at once beside another change of columns
_FINE = 12  # zeros in a turn, from where free ones are fitted
_WIDE = 7  # joints; of more, fewer change at once
_MOST_TURNED = 21_000  # ways to choose signs and zeros alone; with more, fewer joints change at once


class JointMap(NamedTuple):
    """One way to read the joints' columns.

    Attributes:
        matrix: (n, n) C.
        zero: (n,) z [rad or m].
    """

    matrix: FloatArray
    zero: FloatArray

    def read(self, q: FloatArray) -> FloatArray:
        """Joint positions (N, n) so read, of columns q (N, n) [rad or m]."""
        return np.asarray(q @ self.matrix.T + self.zero)


@dataclass(frozen=True, eq=False)
class JointMaps:
    """Many of them: matrices (S, n, n) and zeros (S, n)."""

    matrices: FloatArray
    zeros: FloatArray

    def __len__(self) -> int:
        return len(self.matrices)

    def __getitem__(self, index: int) -> JointMap:
        return JointMap(self.matrices[index], self.zeros[index])

    def and_(self, more: JointMaps | None) -> JointMaps:
        """These and more."""
        if more is None:
            return self
        return JointMaps(np.concatenate([self.matrices, more.matrices]), np.concatenate([self.zeros, more.zeros]))

    def parts(self, size: int) -> Iterator[JointMaps]:
        """So many after each other."""
        for first in range(0, len(self), size):
            yield JointMaps(self.matrices[first : first + size], self.zeros[first : first + size])

    def read(self, q: FloatArray) -> FloatArray:
        """Joint positions (S, N, n) so read, of columns q (N, n) [rad or m]."""
        return np.asarray(q @ self.matrices.swapaxes(1, 2) + self.zeros[:, np.newaxis])


class Joints:
    """The joints of an arm and the ways to read their columns."""

    def __init__(self, types: Sequence[str]) -> None:
        """`types`: revolute or prismatic, one a joint."""
        self.types = list(types)
        self.count = len(self.types)
        self.turning = [joint for joint, kind in enumerate(self.types) if kind == "revolute"]
        # Base and tool take up the zeros of the first and the last joint.
        self.shiftable = [joint for joint in self.turning if 0 < joint < self.count - 1]

    @cached_property
    def as_read(self) -> JointMap:
        """The columns as they are."""
        return JointMap(np.eye(self.count), np.zeros(self.count))

    @cached_property
    def single(self) -> JointMaps:
        """Every reading with one change, and all choices of signs."""
        own = np.eye(self.count)[np.newaxis]
        return _once(
            [
                self._turned(own, self._choices(1)),
                self._turned(self._structures(1), self._choices(0)),
                self._turned(own, self._choices(self.count, zeros=1)),
            ]
        )

    @cached_property
    def simple(self) -> JointMaps:
        """`single`, and all choices of the wrist's signs and zeros."""
        own = np.eye(self.count)[np.newaxis]
        wrist = set(range(max(self.count - _CHOICES, 0), self.count))
        single = (self.single.matrices, self.single.zeros)
        return _once([single, self._turned(own, self._choices(_CHOICES, among=wrist))])

    @cached_property
    def pairs(self) -> JointMaps:
        """Every reading with two changes at most."""
        own = np.eye(self.count)[np.newaxis]
        return _once([self._turned(own, self._choices(2)), self._turned(self._structures(1), self._choices(1))])

    @cached_property
    def near(self) -> JointMaps:
        """`simple` and `pairs`."""
        maps = self.simple.and_(self.pairs)
        return _once([(maps.matrices, maps.zeros)])

    @cached_property
    def several(self) -> JointMaps:
        """All choices of signs and zeros, and exchanges, sums and units of columns with some of them."""
        own = np.eye(self.count)[np.newaxis]
        few = self.count <= _WIDE
        return _once(
            [
                self._turned(own, self._choices(self.count)),
                self._turned(self._structures(1), self._choices(2 if few else 1)),
                self._turned(self._structures(2), self._choices(1 if few else 0)),
                *([self._turned(self._structures(3), self._choices(0))] if few else []),
                self._turned(own, self._choices(self.count, signs=False, zeros=_FINE)),
                self._turned(own, self._choices(2, zeros=_FINE)),
            ]
        )

    def _choices(
        self, most: int, *, signs: bool = True, zeros: int = 4, among: set[int] | None = None
    ) -> tuple[IntArray, FloatArray]:
        """(K, n) sign and zero of each joint, where at most `most` joints change; fewer, if too many.

        `zeros` are so many in a turn.
        """
        changed = []  # what each joint may be besides (1, 0)
        for joint in range(self.count):
            free = among is None or joint in among
            steps = range(zeros) if free and joint in self.shiftable else (0,)
            every = [(sign, step) for sign in ((1, -1) if free and signs else (1,)) for step in steps]
            changed.append(np.array([each for each in every if each != (1, 0)], dtype=np.int64).reshape(-1, 2))
        while sum(prod(map(len, some)) for k in range(most + 1) for some in combinations(changed, k)) > _MOST_TURNED:
            most -= 1
        parts = []
        for chosen in (some for k in range(most + 1) for some in combinations(range(self.count), k)):
            sizes = [len(changed[joint]) for joint in chosen]
            part = np.tile(np.array([1, 0]), (prod(sizes), self.count, 1))
            for joint, picked in zip(chosen, np.indices((1, *sizes))[1:], strict=True):
                part[:, joint] = changed[joint][picked.ravel()]
            parts.append(part)
        every_choice = np.concatenate(parts)
        return every_choice[..., 0], 4 * QUARTER / zeros * every_choice[..., 1]

    def _turned(self, structures: FloatArray, choices: tuple[IntArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Every structure (B, n, n) with every choice of signs and zeros (K, n), as matrices and zeros."""
        matrices = choices[0][np.newaxis, :, :, np.newaxis] * structures[:, np.newaxis]
        zeros = np.broadcast_to(choices[1], matrices.shape[:3])
        return matrices.reshape(-1, self.count, self.count), zeros.reshape(-1, self.count)

    def _structures(self, changes: int) -> FloatArray:
        """(B, n, n) matrices of exactly so many exchanges, sums and units of columns."""
        single = list(self._exchanges()) + list(self._sums())
        if changes == 1:
            return np.array([*single, *self._units(), *self._whole_orders()])
        found = {}
        pairs = [*permutations(single, 2), *product(self._units(only_all=True), single)]
        for chosen in pairs if changes == 2 else combinations(single, changes):
            matrix = np.linalg.multi_dot(chosen) if changes > 2 else chosen[0] @ chosen[1]
            if len(set(np.abs(matrix).ravel().tolist())) == 2:
                found[matrix.tobytes()] = matrix
        return np.array(list(found.values())).reshape(-1, self.count, self.count)

    def _exchanges(self) -> Iterator[FloatArray]:
        for first, second in combinations(range(self.count), 2):
            if self.types[first] == self.types[second]:
                order = list(range(self.count))
                order[first], order[second] = second, first
                yield np.eye(self.count)[order]

    def _sums(self) -> Iterator[FloatArray]:
        for joint in self.turning:
            if joint and self.types[joint - 1] == "revolute":
                for sign in (1.0, -1.0):
                    matrix = np.eye(self.count)
                    matrix[joint, joint - 1] = sign
                    yield matrix

    def _units(self, *, only_all: bool = False) -> Iterator[FloatArray]:
        for kind, quantity in (("revolute", "angle"), ("prismatic", "length")):
            joints = [joint for joint, found in enumerate(self.types) if found == kind]
            for _, ratio in unit_slips(quantity):
                for chosen in [joints] * (len(joints) > 1) + [[joint] for joint in joints] * (not only_all):
                    matrix = np.eye(self.count)
                    matrix[chosen, chosen] = ratio
                    yield matrix

    def _whole_orders(self) -> Iterator[FloatArray]:
        """All joints the other way round, or one place on."""
        if len(set(self.types)) == 1 and self.count > 2:
            for order in (np.arange(self.count)[::-1], *(np.roll(np.arange(self.count), step) for step in (1, -1))):
                yield np.eye(self.count)[order]

    def changes(self, of: JointMap) -> list[Change]:
        """What a map changes, in words, the kind and joints of each once."""
        out: list[Change] = []
        order, extra = self._order(of.matrix)
        moved = [joint for joint in range(self.count) if order[joint] != joint]
        if moved:
            out.append(Change(1.0, frozenset({("order", tuple(order))}), self._order_words(order, moved)))
        out += [self._sum(joint, order[joint], extra[joint]) for joint in np.flatnonzero(extra.any(axis=1)).tolist()]
        own = of.matrix[range(self.count), order]
        out += self._unit_changes(np.abs(own))
        turned = np.flatnonzero(own < 0).tolist()
        if turned:
            whole = len(turned) == self.count > 2
            words = said("the signs of all joints turned") if whole else _signs_turned(turned)
            parts = frozenset(("sign", joint) for joint in turned)
            out.append(Change(2.0 if whole else float(len(turned)), parts, words))
        return out + self._shift_changes(of.zero)

    def _order(self, matrix: FloatArray) -> tuple[list[int], FloatArray]:
        """The column that each joint mainly is, and what is added to it (n, n)."""
        order = []
        for joint, row in enumerate(matrix):
            used = [column for column in np.flatnonzero(row).tolist() if column not in order] or [joint]
            order.append(joint if joint in used else used[-1])
        extra = matrix.copy()
        extra[range(self.count), order] = 0.0
        return order, extra

    def _order_words(self, order: list[int], moved: list[int]) -> str:
        if len(moved) == 2:
            return said("the columns of joints {a} and {b} swapped", a=moved[0] + 1, b=moved[1] + 1)
        if order == list(range(self.count))[::-1]:
            return said("the joints in reverse order")
        taken = _numbers([order[joint] for joint in moved])
        return f"the columns of joints {_numbers(moved)} taken from those of joints {taken}"

    def _sum(self, joint: int, column: int, extra: FloatArray) -> Change:
        terms = "".join(f" {'+' if extra[k] > 0 else '-'} q{k + 1}" for k in np.flatnonzero(extra))
        words = f"{joint_position(column)}{terms} for joint {joint + 1}"
        return Change(1.0, frozenset({("sum", joint, terms)}), words)

    def _unit_changes(self, ratios: FloatArray) -> list[Change]:
        out = []
        for kind, quantity in (("revolute", "angle"), ("prismatic", "length")):
            joints = [joint for joint, found in enumerate(self.types) if found == kind]
            for words, ratio in unit_slips(quantity):
                slipped = [joint for joint in joints if np.isclose(ratios[joint], ratio)]
                if slipped:
                    every = said("all revolute joints") if kind == "revolute" else said("all prismatic joints")
                    who = every if len(slipped) == len(joints) > 1 else _joints(slipped)
                    text = said("{who} in {unit}", who=who, unit=words)
                    out.append(Change(1.0, frozenset({("unit", ratio, *slipped)}), text))
        return out

    def _shift_changes(self, zero: FloatArray) -> list[Change]:
        by_size: dict[str, list[int]] = {}
        for joint in np.flatnonzero(zero).tolist():
            by_size.setdefault(_degrees(float(zero[joint])), []).append(joint)
        return [
            Change(
                (SHIFT_COST if "." not in size else FREE_COST) * len(joints),
                frozenset(("shift", joint) for joint in joints),
                said("{joints} shifted by {size} deg", joints=_joints(joints), size=size),
            )
            for size, joints in by_size.items()
            if size != "0"
        ]

    def formulas(self, of: JointMap) -> list[str]:
        """What to write for each joint that is read otherwise, such as `q2: -q2 + 90 deg`."""
        out: list[str] = []
        if not set(np.abs(of.matrix).ravel().tolist()) <= {0.0, 1.0}:
            return out  # units are said in words
        for joint, (row, zero) in enumerate(zip(of.matrix, of.zero, strict=True)):
            order = sorted(np.flatnonzero(row).tolist(), key=lambda column: (column != joint, column))
            terms = "".join(_term(float(row[column]), column) for column in order)
            size = _degrees(float(zero)) if joint in self.turning else "0"
            if size != "0":
                terms += f" {'-' if size[0] == '-' else '+'} {size.lstrip('-')} deg"
            terms = terms[3:] if terms.startswith(" + ") else f"-{terms[3:]}"
            if terms not in (joint_position(order[0]),):
                out.append(f"{joint_position(joint)}: {terms}")
        return out


class Change(NamedTuple):
    """A part of what a reading changes.

    Attributes:
        cost: How far from simple it is.
        parts: What it changes; a reading of which the parts hold those of another is that one and something more.
        words: As it stands after "with".
    """

    cost: float
    parts: frozenset[tuple[object, ...]]
    words: str


def unit_slips(kind: str) -> Iterator[tuple[str, float]]:
    """Pairs of units of a kind: which was meant and which was read, and the ratio; one pair for each ratio."""
    seen: set[str] = set()
    for meant, read in permutations(unit_names(kind), 2):
        ratio = factor(meant) / factor(read)
        if f"{ratio:.6g}" not in seen:
            seen.add(f"{ratio:.6g}")
            yield said("{meant} where they were read in {read}", meant=meant, read=read), ratio


@cache
def joints_of(types: tuple[str, ...]) -> Joints:
    """The joints of an arm; lists of readings are made once for all arms of a kind."""
    return Joints(types)


def is_quarter(zero: FloatArray) -> NDArray[np.bool_]:
    """Which zeros [rad] are multiples of a quarter turn?"""
    return np.asarray(np.abs(zero / QUARTER - np.round(zero / QUARTER)) < 1e-9)


def _once(parts: list[tuple[FloatArray, FloatArray]]) -> JointMaps:
    """Each map once, but for the columns as they are."""
    matrices, zeros = (np.concatenate(each) for each in zip(*parts, strict=True))
    count = matrices.shape[1]
    keys = np.ascontiguousarray(np.hstack([matrices.reshape(len(matrices), -1), np.round(zeros, 9)]) + 0.0)
    first = np.unique(keys.view(np.dtype((np.void, keys.dtype.itemsize * keys.shape[1]))), return_index=True)[1]
    plain = (keys == np.concatenate([np.eye(count).ravel(), np.zeros(count)])).all(axis=1)
    chosen = [k for k in sorted(first.tolist()) if not plain[k]]
    return JointMaps(matrices[chosen], zeros[chosen])


def _degrees(zero: float) -> str:
    """A zero [rad] within half a turn, in degrees; whole quarters where it is near to one."""
    zero = float(np.remainder(zero + 2 * QUARTER, 4 * QUARTER) - 2 * QUARTER)
    quarters = round(zero / QUARTER)
    if abs(zero - quarters * QUARTER) < NEAR_QUARTER:
        return f"{from_si(2 * QUARTER if abs(quarters) == 2 else quarters * QUARTER, 'deg'):g}"
    return f"{from_si(zero, 'deg'):.1f}"


def _term(ratio: float, column: int) -> str:
    size = "" if abs(ratio) == 1.0 else f"{abs(ratio):.6g} "
    return f" {'-' if ratio < 0 else '+'} {size}q{column + 1}"


def _signs_turned(joints: list[int]) -> str:
    if len(joints) == 1:
        return said("the sign of joint {joint} turned", joint=joints[0] + 1)
    return said("the signs of joints {joints} turned", joints=_numbers(joints))


def _joints(joints: list[int]) -> str:
    if len(joints) == 1:
        return said("joint {number}", number=joints[0] + 1)
    return said("joints {numbers}", numbers=_numbers(joints))


def _numbers(joints: list[int]) -> str:
    """1, 4 and 6, of joints counted from 0."""
    *first, last = [f"{joint + 1}" for joint in joints]
    return said("{first} and {last}", first=", ".join(first), last=last) if first else last
