# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New programs that visit joint targets again and again and wait at each for the instrument, in the four languages.

Joint targets need neither tool nor frame, so a controller goes exactly where its own zeros say. Every move ends in a
full stop; the numbers of a program are those that `read_program` reads back from it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.programs.languages import read_program
from fastcal.programs.makers import language_of_arm
from fastcal.programs.program import Document
from fastcal.units import from_si

AXES = 6
_FASTEST_RAD_S = 2.1  # URScript takes a speed and no share of the greatest one


@dataclass(frozen=True)
class Stop:
    """A move to a target (its place in the list of targets), with a wait for the instrument or on the way.

    Where `pause` says why, the program halts before it until somebody lets it go on.
    """

    target: int
    is_measured: bool
    pause: str = ""


@dataclass(frozen=True, eq=False)
class Cycles:
    """Targets, and the loops over them one after the other.

    Attributes:
        names: Of the targets, letters and digits.
        q: (K, 6) joint positions [rad], as the controller counts them.
        loops: How often, and the stops of each round.
        dwell_s: Wait at a measured stop [s].
        speed: Share of the greatest speed, above 0 to 1.
        comment: Lines for a reader of the program.
    """

    names: Sequence[str]
    q: FloatArray
    loops: Sequence[tuple[int, Sequence[Stop]]]
    dwell_s: float
    speed: float
    comment: Sequence[str] = ()


def check_axes(axis_types: Sequence[str]) -> None:
    """InvalidInput unless a program can be written for an arm of such axes, `revolute` or `prismatic`."""
    if len(axis_types) != AXES:
        raise InvalidInput(f"a program of {AXES} axes can be written, and this robot has {len(axis_types)} joints")
    if "prismatic" in axis_types:
        joint = list(axis_types).index("prismatic") + 1
        raise InvalidInput(f"a program of {AXES} axes that turn can be written, and this robot's joint {joint} slides")


def language_for(robot: str) -> str | None:
    """The language of LANGUAGES that an arm of this name is programmed in; None where none of them is known to be."""
    spoken = language_of_arm(robot)
    return next((language for language, name in _NAMES.items() if name == spoken), None)


def as_written(documents: Sequence[Document], stops: Sequence[Stop], q: FloatArray) -> FloatArray:
    """(K, n) the controller's joints q as the program's text gives them; its moves are the stops in their order."""
    program = read_program({document.name: document.text.encode("latin-1") for document in documents})
    out = q.copy()
    for move, stop in zip(program.moves, stops, strict=True):
        out[stop.target] = program.targets[move.target].values
    return out


def write_cycles(language: str, name: str, cycles: Cycles) -> tuple[Document, ...]:
    """The program's files, named after `name`, which may be a path with or without the language's ending.

    Raises:
        InvalidInput: Another number of joints than six, an unknown language, or a name that is no program's.
    """
    path = named(language, name)
    check_axes(["revolute"] * cycles.q.shape[1])
    _, write = LANGUAGES[language]
    return write(path, cycles)


def named(language: str, name: str) -> PurePath:
    """The file of a program of this name, which may be a path and ends as the language's files do.

    Raises:
        InvalidInput: An unknown language, or a name that is no program's.
    """
    if language not in LANGUAGES:
        raise InvalidInput(f"language must be one of {', '.join(LANGUAGES)}, got '{language}'")
    suffix, _ = LANGUAGES[language]
    path = PurePath(name)
    if path.suffix.lower() != suffix:
        raise InvalidInput(f"{name}: a program in {language} has a name that ends in {suffix}")
    if not re.fullmatch(r"[A-Za-z]\w{0,23}", path.stem):
        raise InvalidInput(
            f"{name}: the program takes its name from the file; expected a letter, then up to 23 letters, digits or "
            f"underscores, got '{path.stem}'"
        )
    return path


def degrees(q: FloatArray, digits: int) -> list[str]:
    """Joints [rad] as a program writes them [deg]."""
    return [f"{value + 0.0:.{digits}f}" for value in np.round(np.asarray(from_si(q, "deg")), digits)]


def _rapid(path: PurePath, cycles: Cycles) -> tuple[Document, ...]:
    lines = [f"MODULE {path.stem}", *(f"  ! {line}" for line in cycles.comment)]
    away = ",".join(["9E9"] * 6)
    for name, q in zip(cycles.names, cycles.q, strict=True):
        lines.append(f"  CONST jointtarget {name}:=[[{','.join(degrees(q, 5))}],[{away}]];")
    lines += ["  PROC main()", f"    VelSet {100 * cycles.speed:g},5000;", "    SingArea \\Off;"]
    for count, stops in cycles.loops:
        body = []
        for stop in stops:
            body += [f'    TPWrite "{stop.pause}";', "    Stop;"] if stop.pause else []
            body.append(f"    MoveAbsJ {cycles.names[stop.target]}\\NoEOffs,v1000,fine,tool0;")
            body += [f"    WaitTime \\InPos,{cycles.dwell_s:g};"] if stop.is_measured else []
        lines += looped(body, count, f"    FOR cycle FROM 1 TO {count} DO", "    ENDFOR")
    return (document(path, [*lines, "  ENDPROC", "ENDMODULE"]),)


def _krl(path: PurePath, cycles: Cycles) -> tuple[Document, ...]:
    data = [f"DEFDAT {path.stem}"]
    for name, q in zip(cycles.names, cycles.q, strict=True):
        axes = ",".join(f"A{axis} {value}" for axis, value in enumerate(degrees(q, 5), start=1))
        data.append(f"DECL E6AXIS {name}={{{axes},E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}}")
    lines = [f"DEF {path.stem}()", "INT cycle", *(f"; {line}" for line in cycles.comment)]
    lines += ["BAS(#INITMOV,0)", f"BAS(#VEL_PTP,{100 * cycles.speed:g})"]
    for count, stops in cycles.loops:
        body = []
        for stop in stops:
            body += [f"; {stop.pause}", "HALT"] if stop.pause else []
            body.append(f"PTP {cycles.names[stop.target]}")
            body += [f"WAIT SEC {cycles.dwell_s:g}"] if stop.is_measured else []
        lines += looped(body, count, f"FOR cycle=1 TO {count}", "ENDFOR")
    return document(path, [*lines, "END"]), document(path.with_suffix(".dat"), [*data, "ENDDAT"])


def _fanuc(path: PurePath, cycles: Cycles) -> tuple[Document, ...]:
    steps = [f"!{line[:30]}" for line in cycles.comment]
    for label, (count, stops) in enumerate(cycles.loops, start=1):
        steps += ["R[1:cycle]=0", f"LBL[{label}]"] if count > 1 else []
        for stop in stops:
            steps += [f"!{stop.pause[:30]}", "PAUSE"] if stop.pause else []
            steps.append(f"J P[{stop.target + 1}] {100 * cycles.speed:g}% FINE")
            steps += [f"WAIT {cycles.dwell_s:7.2f}(sec)"] if stop.is_measured else []
        steps += ["R[1:cycle]=R[1:cycle]+1", f"IF R[1:cycle]<{count},JMP LBL[{label}]"] if count > 1 else []
    return fanuc_program(path, steps, cycles.names, cycles.q)


def fanuc_program(
    path: PurePath, steps: Sequence[str], names: Sequence[str], targets: FloatArray
) -> tuple[Document, ...]:
    """The file of a FANUC program: its steps, numbered, and its targets (K, 6) [rad], to a thousandth of a degree."""
    lines = [f"/PROG  {path.stem.upper()}", "/ATTR", "DEFAULT_GROUP = 1,*,*,*,*;", "/MN"]
    for at, step in enumerate(steps, start=1):
        lines.append(f"{at:4}:{'' if step.startswith(('J ', 'L ')) else '  '}{step} ;")
    lines.append("/POS")
    for at, (name, q) in enumerate(zip(names, targets, strict=True), start=1):
        joints = [f"J{axis}= {value:>9} deg" for axis, value in enumerate(degrees(q, 3), start=1)]
        lines += [f'P[{at}:"{name}"]{{', "   GP1:", "\tUF : 0, UT : 1,"]
        lines += [f"\t{', '.join(joints[:3])},", f"\t{', '.join(joints[3:])}", "};"]
    return (document(path, [*lines, "/END"]),)


def _urscript(path: PurePath, cycles: Cycles) -> tuple[Document, ...]:
    lines = [f"def {path.stem}():", *(f"  # {line}" for line in cycles.comment)]
    for name, q in zip(cycles.names, cycles.q, strict=True):
        lines.append(f"  {name} = [{', '.join(f'{value + 0.0:.7f}' for value in np.round(q, 7))}]")
    speed = f"a=1.4, v={_FASTEST_RAD_S * cycles.speed:.3f}"
    for count, stops in cycles.loops:
        body = []
        for stop in stops:
            body += [f'  popup("{stop.pause}", blocking=True)'] if stop.pause else []
            body.append(f"  movej({cycles.names[stop.target]}, {speed})")
            body += [f"  sleep({cycles.dwell_s:g})"] if stop.is_measured else []
        lines += ["  cycle = 0"] if count > 1 else []
        lines += looped(
            [*body, *(["  cycle = cycle + 1"] if count > 1 else [])], count, f"  while cycle < {count}:", "  end"
        )
    return (document(path, [*lines, "end"]),)


def looped(body: Sequence[str], count: int, head: str, tail: str) -> list[str]:
    """The lines in a loop, two spaces deeper; as they are where they run once."""
    return [head, *(f"  {line}" for line in body), tail] if count > 1 else list(body)


def document(path: PurePath, lines: Sequence[str]) -> Document:
    """The lines as a file of a program."""
    return Document(str(path), "\n".join(lines) + "\n")


# Name of a language: the ending of its files, and who writes it.
LANGUAGES: dict[str, tuple[str, Callable[[PurePath, Cycles], tuple[Document, ...]]]] = {
    "rapid": (".mod", _rapid),
    "krl": (".src", _krl),
    "fanuc": (".ls", _fanuc),
    "urscript": (".script", _urscript),
}
_NAMES = {"rapid": "RAPID", "krl": "KRL", "fanuc": "FANUC LS", "urscript": "URScript"}  # as `language_of_arm` has them
