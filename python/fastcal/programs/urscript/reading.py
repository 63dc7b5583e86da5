# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The targets of scripts and what moves go to them; the tool is the one that set_tcp gave last."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.programs.book import NOWHERE, SOMEWHERE, Book, Place, any_of, product
from fastcal.programs.flow import State, Walker
from fastcal.programs.program import Document, Program
from fastcal.programs.syntax import Node, Statement
from fastcal.programs.urscript.language import UrScript
from fastcal.programs.urscript.statements import routines
from fastcal.robot import se3
from fastcal.units import from_si, to_si

# How many places a move has, and does it keep the configuration on its way?
_MOVES = {
    **dict.fromkeys(("movej", "optimovej", "servoj"), (1, False)),
    **dict.fromkeys(("movel", "movep", "optimovel", "servoc", "servol"), (1, True)),
    "movec": (2, True),
}
_PLACES = {"q", "pose", "pose_via", "pose_to"}  # as arguments with a name
_OPTIONS = {"a", "v", "t", "r", "mode", "lookahead_time", "gain"}
_TRACKS = {"track_conveyor_linear", "track_conveyor_circular"}
_BY_HAND = {"speedj", "freedrive_mode", "teach_mode"}
# Functions that read what they are given, and whose results are no places.
_ONLY_READ = {
    *("textmsg", "popup", "point_dist", "pose_dist", "norm", "length", "to_str", "str_cat", "varmsg", "sleep"),
    *("set_payload_cog", "set_gravity", "is_within_safety_limits", "force_mode"),
}
_LOADS = {"set_payload", "set_payload_mass", "set_target_payload"}  # whose first argument is a mass at the flange
_HERE = {"get_actual_joint_positions", "get_target_joint_positions", "get_joint_positions"}


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of scripts."""
    book = Book(documents, origins=frozenset({"base"}))
    book.frames["base"] = np.eye(4)
    found = [routine for place, document in enumerate(documents) for routine in routines(document.text, place)]
    _Reader(book, found, State(frame="base")).run()
    return book.program(UrScript())


class _Reader(Walker):
    """Goes through scripts."""

    by_reference = False
    loops = frozenset({"while"})
    first_index = 0

    def statement(self, statement: Statement) -> None:
        if statement.kind == "assign":
            self.assign(statement)
        elif statement.kind == "call":
            self._call(statement)
        elif statement.kind == "unknown":
            self.not_followed(statement)
        else:
            self.read(statement)

    # What expressions mean.

    def number(self, node: Node) -> float | None:
        if node.kind == "call" and node.text in ("d2r", "r2d") and len(node.parts) == 1:
            inner = self.number(node.parts[0])
            turn = to_si if node.text == "d2r" else from_si
            return None if inner is None else float(turn(inner, "deg"))
        return super().number(node)

    def literal(self, node: Node, name: str) -> Place | None:
        if node.kind not in ("pose", "list"):
            return None
        if node.kind == "list" and any(part.kind in ("pose", "list", "name") for part in node.parts):
            elements = tuple(self.place(part) for part in node.parts)
            return Place(any_of(elements).targets, elements=elements)
        if len(node.parts) != 6:
            self.book.unread[self.document, node.start] = f"expected 6 numbers, got {len(node.parts)}"
            return NOWHERE
        values = [self.number(part) for part in node.parts]
        known = None if None in values else np.array(values, dtype=float)
        posed = node.kind == "pose"
        numbers = [_degrees(part) or (part, "m" if posed and k < 3 else "rad") for k, part in enumerate(node.parts)]
        target = self.book.target(self.document, node, "pose" if posed else "joints", numbers, name)
        found = () if target is None else (target,)
        if posed:
            return Place(found, T=None if known is None else se3.pose_of_six(known))
        return Place(found, joints=None if known is None else tuple(known.tolist()))

    def function(self, node: Node) -> Place:
        plain = [part for part in node.parts if part.kind != "named"]
        named = {part.text: part.parts[0] for part in node.parts if part.kind == "named" and part.parts}
        if node.text == "pose_trans" and len(plain) == 2:
            return product(self.place(plain[0]), self.place(plain[1]))
        if node.text == "pose_add" and len(plain) == 2:
            return self._added(self.place(plain[0]), self.place(plain[1]))
        if node.text == "pose_inv" and len(plain) == 1:
            T = self.place(plain[0]).T
            self.takes_as_frame(node.start, plain[0])
            return NOWHERE if T is None else Place(T=se3.inverse(T))
        if node.text == "get_inverse_kin" and plain and len(plain) < 5 and "tcp" not in named:
            return self._solved(plain, named)
        if node.text == "get_forward_kin" and len(plain) == 1 and not named:
            return self.place(plain[0])
        self.call(node.text, [self.place(part) for part in plain])
        return NOWHERE

    def _added(self, place: Place, by: Place) -> Place:
        """pose_add: a shift along the axes of the base, and a turn."""
        if not place.targets or place.near is not None:
            return NOWHERE
        offset = SOMEWHERE
        if by.T is not None and place.is_plain and np.allclose(by.T[:3, :3], np.eye(3)):
            x, y, z = by.T[:3, 3].tolist()
            offset = (x, y, z)
        return replace(place, offset=offset, T=None, elements=())

    def _solved(self, plain: list[Node], named: dict[str, Node]) -> Place:
        """get_inverse_kin: the place, near the joints that are given."""
        place = self.place(named.get("x", plain[0]))
        near = named.get("qnear", plain[1] if len(plain) > 1 else None)
        if near is None or (near.kind == "call" and near.text in _HERE):
            return place
        joints = self.place(near).joints
        return NOWHERE if joints is None else replace(place, near=joints)

    # What statements do.

    def assign(self, statement: Statement) -> None:
        value = statement.parts[1]
        if value.kind == "call" and value.text in _ONLY_READ:
            self.read(statement)
        else:
            super().assign(statement)

    def _call(self, statement: Statement) -> None:
        name = statement.name
        plain = [part for part in statement.parts if part.kind != "named"]
        if name in _MOVES and name not in self.routines:
            self._move(statement)
        elif name == "set_tcp" and statement.parts:
            self._set_tool(statement)
        elif name in _TRACKS:
            label = f"{name} of line {self.book.line(self.document, statement.start)}"
            self.book.doubt("frame", label, "the arm follows a conveyor there")
            self.state = replace(self.state, frame=label)
            self.spoil(statement)
        elif name == "stop_conveyor_tracking":
            self.state = replace(self.state, frame="base")
        elif name in _LOADS and name not in self.routines and statement.parts:
            self._set_load(statement)
        elif name in _BY_HAND:
            self.state = replace(self.state, afresh=True)
        elif name in _ONLY_READ:
            self.read(statement)
        elif not self.call(name, [self.place(part) for part in plain]):
            self.spoil(statement)

    def _set_tool(self, statement: Statement) -> None:
        first = statement.parts[0]
        self.takes_as_frame(statement.start, first)
        label = f"set_tcp of line {self.book.line(self.document, statement.start)}"
        place = self.place(first.parts[0] if first.kind == "named" else first)
        if place.T is not None and place.is_plain:
            self.book.tools[label] = place.T
        elif place.factors:
            label = self.book.chain(label, place.factors, tool=True)
        else:
            shown = self.book.shown(self.document, first.start, first.end)
            self.book.doubt("tool", label, f"its tool, {shown} in set_tcp of that line, is computed at run time")
        self.state = replace(self.state, tool=label)

    def _set_load(self, statement: Statement) -> None:
        """set_payload(2.35, [0, 0, 0.06]): all that hangs on the flange, from there on."""
        self.read(statement)
        first = next((part.parts[0] for part in statement.parts if part.kind == "named" and part.text == "m"), None)
        line = self.book.line(self.document, statement.start)
        label = f"{statement.name} of line {line}"
        self.book.weigh(label, self.number(first or statement.parts[0]), line)
        self.state = replace(self.state, loads=(label,))

    def _move(self, statement: Statement) -> None:
        count, is_linear = _MOVES[statement.name]
        if any(part.kind == "named" and part.text not in _PLACES | _OPTIONS for part in statement.parts):
            self.spoil(statement)
            why = "its arguments are not those that this instruction has"
            self.book.leave(self.document, statement.start, statement.name, why)
            self.state = replace(self.state, afresh=self.state.afresh or not is_linear)
            return
        places = [
            part.parts[0] if part.kind == "named" else part
            for part in statement.parts
            if part.kind != "named" or part.text in _PLACES
        ]
        for node in places[:count]:
            place = self.place(node)
            if place.targets:
                where = (self.document, statement.start, self.state.frame)
                state = self.state
                self.book.go(place, *where, tool=state.tool, afresh=state.afresh, loads=state.loads)
                self.state = replace(self.state, afresh=False)
                continue
            self.spoil(statement, node)
            self.book.leave(self.document, statement.start, statement.name, self.book.reason(self.document, node))
            self.state = replace(self.state, afresh=self.state.afresh or not is_linear)


def _degrees(node: Node) -> tuple[Node, str] | None:
    """d2r(90) as a number in degrees."""
    return (node.parts[0], "deg") if node.kind == "call" and node.text == "d2r" and len(node.parts) == 1 else None
