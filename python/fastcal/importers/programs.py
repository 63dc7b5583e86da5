# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot programs as lists of joint positions: RAPID jointtargets, KRL axes (A1 ...), FANUC's joint form, URScript.

Targets come in the order in which the program visits them, where it visits all of them; else as they are declared.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

from fastcal.importers.dialect import made
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.io.programs import load_program
from fastcal.programs import Program, Target, language_of

_LOOKED_AT = 100_000  # bytes
_SIGNS = re.compile(
    r"^[ \t]*(MODULE|DEFDAT|DEF|DECL|PROC|/PROG|/POS|def \w+\()\b|jointtarget|robtarget|E6AXIS|E6POS|movej\(|movel\(",
    re.I | re.M,
)


def is_program(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a robot program, by its ending and its words: a table may end in .dat too."""
    file = Path(path)
    if language_of(file.name) is None or not file.is_file():
        return False
    with file.open("rb") as stream:
        return _SIGNS.search(stream.read(_LOOKED_AT).decode("latin-1")) is not None


def read_joints(path: str) -> Export:
    """The joint positions of a program, with the names of its targets.

    Raises:
        ParseError: It can't be read, or holds no joint positions.
    """
    program = load_program(path)
    grid = Grid(path, ())
    joints = [k for k, target in enumerate(program.targets) if target.kind == "joints"]
    if not joints:
        held = (
            f"{len(program.targets)} poses, which a controller computes from its joints"
            if program.targets
            else "no targets"
        )
        raise grid.error(f"holds {held}; expected joint positions, such as jointtargets")
    visited = [move.target for move in program.moves if move.target in set(joints)]
    order = visited if set(visited) == set(joints) else joints
    targets = [program.targets[k] for k in order]
    width = min(len(target.numbers) for target in targets)
    comments = _comments(program)
    rows = [[_name(target, comments), *(number.text for number in target.numbers[:width])] for target in targets]
    units = ["", *(number.unit for number in targets[0].numbers[:width])]
    titles = ["Name", *(f"J{joint}" for joint in range(1, width + 1))]
    export = made(grid, titles, rows, [target.line for target in targets], units)
    return replace(export, dialect=program.language.name, controller=True)


def _comments(program: Program) -> dict[str, str]:
    """FANUC's comments on positions, P[1:"P001"], which are their names on the pendant."""
    found = (m for d in program.documents for m in re.finditer(r'\bP\[\s*(\d+)\s*:\s*"([^"]+)"', d.text))
    return {f"P[{match[1]}]": match[2] for match in found}


def _name(target: Target, comments: dict[str, str]) -> str:
    return comments.get(target.name, target.name)
