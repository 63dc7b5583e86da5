# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is found in a program while it is gone through: poses and joints written as numbers, their uses, what is left.

A reader of a language enters each pose or list of joints that is made of plain numbers (`target`), each use of it that
it understands (`go`), and each that it does not (`spoil`, `leave`). At the end a pose is a target if a move that was
understood goes to it; one that is used in another way as well is left as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.programs.program import (
    ACTIVE,
    Document,
    Frame,
    Kind,
    Language,
    Left,
    Load,
    Move,
    Number,
    Program,
    Target,
    Word,
)
from fastcal.programs.syntax import Node
from fastcal.said import said

LARGEST = 1e12  # mm or deg; 9E9 stands for an axis that is not there
SOMEWHERE = (math.nan, math.nan, math.nan)  # an offset that is not known


@dataclass(frozen=True, eq=False)
class Place:
    """Where an expression leads, as far as the text tells.

    Attributes:
        targets: Those that it may be, by their places in the book; more than one where the text leaves it open.
        chain: What stands before the target in a product of poses: names of frames, and poses (4, 4).
        first: Targets among those in `chain`.
        T: (4, 4) the pose itself where it is known, for tools and frames; without what is in `chain`.
        joints: Joints [rad] where they are known.
        number: A plain number where it is known.
        name: Of the tool or the frame that it is.
        near: Joints [rad] that its solution is to be nearest to.
        offset: What is added to the target at run time: metres along the frame's axes, NaN where it is not known.
        elements: Of a list.
        also: May it be something else as well, which only the run knows?
    """

    targets: tuple[int, ...] = ()
    chain: tuple[str | FloatArray, ...] = ()
    first: tuple[int, ...] = ()
    T: FloatArray | None = None
    joints: tuple[float, ...] | None = None
    number: float | None = None
    name: str | None = None
    near: tuple[float, ...] | None = None
    offset: tuple[float, float, float] | None = None
    elements: tuple[Place, ...] = ()
    also: bool = False

    @property
    def factors(self) -> tuple[str | FloatArray, ...]:
        """It as a product of names and poses; empty where it is not known."""
        if self.offset is not None:
            return ()
        last: tuple[str | FloatArray, ...] = () if self.T is None else (self.T,)
        if self.name is not None:
            last = (self.name,)
        return () if self.targets and not last else (*self.chain, *last)

    @property
    def is_plain(self) -> bool:
        """Is it what is written, without a product, an offset or joints to be near?"""
        return not self.chain and self.offset is None and self.near is None


NOWHERE = Place()


def load_changes(name: str, where: str) -> str:
    """Why a load whose mass the program changes is not relied upon."""
    return said("load {name} is changed at run time, in {where}", name=name, where=where)


def product(first: Place, second: Place) -> Place:
    """The place first times second: its target is the second, in the frame of the first; else the first, shifted.

    Where the first is a target of other moves too, the book shifts it: its numbers cannot stay those of a frame. Where
    it is not, it is a frame, and the second must be known.
    """
    before = first.factors
    if second.targets and second.is_plain and before:
        return Place(second.targets, before, first.targets or first.first, second.T, also=second.also)
    if first.targets and first.near is None:
        return replace(first, offset=SOMEWHERE, elements=(), first=(*first.first, *first.targets))
    after = second.factors
    return NOWHERE if second.targets or not before or not after else Place(chain=(*before, *after))


def any_of(places: Sequence[Place]) -> Place:
    """The one place that all are, or all targets that it may be."""
    if len(places) == 1:
        return places[0]
    if not places or not all(place.is_plain for place in places):
        return NOWHERE
    targets = tuple(dict.fromkeys(target for place in places for target in place.targets))
    return Place(targets, also=bool(targets) and any(place.also or not place.targets for place in places))


@dataclass
class Book:
    """Collects what a program's documents hold; places of targets are those in `targets`.

    Attributes:
        documents: Of the program.
        targets, moves, left, notes, tools, frames, doubts, loads: As in `Program`.
        kept: Targets that are declared as such, whether a move goes to them or not.
        origins: Names of frames that lie in the robot's base.
        unread: Why a pose or joints, by document and place, are no target.
    """

    documents: tuple[Document, ...]
    targets: list[Target] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    left: list[Left] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    tools: dict[str, Frame] = field(default_factory=dict)
    frames: dict[str, Frame] = field(default_factory=dict)
    doubts: dict[tuple[str, str], str] = field(default_factory=dict)
    loads: dict[str, Load] = field(default_factory=dict)
    kept: set[int] = field(default_factory=set)
    origins: frozenset[str] = frozenset()
    unread: dict[tuple[int, int], str] = field(default_factory=dict)
    _spoiled: dict[int, str] = field(default_factory=dict)
    _products: dict[int, tuple[int, ...]] = field(default_factory=dict)
    _at: dict[tuple[int, int], int] = field(default_factory=dict)

    def line(self, document: int, at: int) -> int:
        """The line, from 1, of a place in a document."""
        return self.documents[document].line(at)

    def shown(self, document: int, start: int, end: int) -> str:
        """A piece of the text in one line, cut short."""
        text = " ".join(self.documents[document].text[start:end].split())
        return text if len(text) <= 60 else text[:57] + "..."

    def number(self, document: int, node: Node, unit: str) -> Number | None:
        """A plain number with or without a sign; None where it is computed, or beyond all sizes."""
        digits = node.parts[0] if node.kind == "prefix" and node.text in ("-", "+") else node
        text = self.documents[document].text[node.start : node.end]
        try:
            value = float("".join(text.split())) if digits.kind == "number" else math.nan
        except ValueError:
            return None
        return Number(document, node.start, node.end, text, value, unit) if abs(value) <= LARGEST else None

    def target(
        self,
        document: int,
        node: Node,
        kind: Kind,
        numbers: Sequence[tuple[Node, str]],
        name: str = "",
        words: Mapping[str, Node] | None = None,
    ) -> int | None:
        """Enters a pose or joints made of numbers (each with its unit); None where one of them is computed."""
        key = (document, node.start)
        if key in self._at:
            return self._at[key]
        found = [self.number(document, piece, unit) for piece, unit in numbers]
        if None in found:
            first = numbers[found.index(None)][0]
            self.unread[key] = f"{self.shown(document, first.start, first.end)} is no plain number"
            return None
        line = self.line(document, node.start)
        texts = {
            key: Word(document, word.start, word.end, self.documents[document].text[word.start : word.end])
            for key, word in (words or {}).items()
        }
        plain = tuple(number for number in found if number is not None)
        self._at[key] = len(self.targets)
        name = name or said("the target of line {line}", line=line)
        self.targets.append(Target(name, line, kind, plain, texts))
        return self._at[key]

    def go(self, place: Place, document: int, at: int, frame: str | None, **move: Any) -> None:
        """A move to each target that a place may be."""
        line = self.line(document, at)
        if place.chain:
            frame = self.chain(f"the product of line {line}", (ACTIVE if frame is None else frame, *place.chain))
        if place.also:
            named = " or ".join(self.targets[target].name for target in place.targets)
            self.leave(document, at, f"what {named} is given at run time", "only the values in the text are changed")
        for target in place.targets:
            if place.first:
                self._products[len(self.moves)] = place.first
            self.moves.append(Move(target, document, line, frame=frame, near=place.near, offset=place.offset, **move))

    def chain(self, label: str, parts: tuple[str | FloatArray, ...], *, tool: bool = False) -> str:
        """Enters a tool or a frame that is a product, and gives the name under which it stands."""
        known = self.tools if tool else self.frames
        named = [part for part in parts if not isinstance(part, str) or part not in self.origins] or [np.eye(4)]
        whole: Frame = named[0] if len(named) == 1 and not isinstance(named[0], str) else tuple(named)
        while label in known and not _same(known[label], whole):
            label += "'"
        known[label] = whole
        return label

    def leave(self, document: int, at: int, what: str, why: str) -> None:
        """Something that is left as it is, and why."""
        left = Left(document, self.line(document, at), what, why)
        if left not in self.left:
            self.left.append(left)

    def reason(self, document: int, node: Node) -> str:
        """Why an expression leads to no target."""
        shown = self.shown(document, node.start, node.end)
        return self.unread.get((document, node.start), f"{shown} is no target of plain numbers here")

    def spoil(self, targets: Sequence[int], why: str) -> None:
        """Targets that are used in a way that is not understood."""
        for target in targets:
            self._spoiled.setdefault(target, why)

    def doubt(self, what: str, name: str, why: str) -> None:
        """A tool, a frame or a load that cannot be relied upon."""
        self.doubts.setdefault((what, name.lower()), why)

    def weigh(self, name: str, mass: float | None, line: int) -> None:
        """Enters a load's mass [kg], said in a line: doubtful where it is computed, or less than nothing."""
        where = said("line {line}", line=line)
        known = self.loads.setdefault(name.lower(), math.nan if mass is None else mass)
        if mass is None:
            why = said("the mass of load {name} is computed at run time, in {where}", name=name, where=where)
            self.doubt("load", name, why)
        elif mass < 0:
            why = said(
                "the mass of load {name} is {mass:g} in {where}, which stands for none given",
                name=name,
                mass=float(mass),
                where=where,
            )
            self.doubt("load", name, why)
        elif mass != known:
            self.doubt("load", name, load_changes(name, where))

    def program(self, language: Language) -> Program:
        """The program: targets that moves go to, and those that are kept anyway; others are no targets."""
        moves = list(self.moves)
        direct = {move.target for place, move in enumerate(moves) if place not in self._products}
        for place, first in self._products.items():
            line = moves[place].line
            # The first factor changes with its own moves, so that this one goes along; a mere frame has to stay.
            if not direct.intersection(first):
                self.spoil(first, f"line {line} takes it as a frame")
            elif moves[place].target not in first:
                frame = self.frames[str(moves[place].frame)]
                around = frame[0] if isinstance(frame, tuple) and isinstance(frame[0], str) else min(self.origins)
                moves[place] = replace(moves[place], frame=around, offset=SOMEWHERE, target=first[0])
            if direct.intersection(first) and len(first) > 1:
                self.spoil(first, f"line {line} adds something to it that is not known")
        used = {move.target for move in moves} | self.kept
        program = Program(
            *(language, self.documents, tuple(self.targets), tuple(moves), self.tools, self.frames, self.doubts),
            left=tuple(self.left),
            notes=tuple(dict.fromkeys(self.notes)),
            loads=self.loads,
        )
        spoiled = {target: why for target, why in self._spoiled.items() if target in used}
        return program.leaving(spoiled, dropped=set(range(len(self.targets))) - used)


def _same(a: Frame, b: Frame) -> bool:
    """Are two frames one?"""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(x is y or (isinstance(x, str) and x == y) for x, y in zip(a, b, strict=True))
    return a is b
